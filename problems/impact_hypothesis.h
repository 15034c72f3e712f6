#pragma once

#include <array>
#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

/// @file
/// The law of impacts that a scene states; how a method computes it is not defined here.

namespace ricochet {

/// Hypothesis that closes the equations of an impact; methods/contact_laws/impact_laws/ has the equations.
enum class ImpactHypothesis {
  newton,   ///< w_n+ = -e w_n- and Coulomb's law for the whole impact; Moreau's law for several at once
  poisson,  ///< the impulse of expansion is e times that of compression, Coulomb's law in each of the two phases
  routh,    ///< Poisson's impulses, Coulomb's law at each instant of the impact
  stronge,  ///< expansion returns e^2 of the work of compression, Coulomb's law at each instant
  lzb       ///< several impacts at once as the rigid limit of springs, which return e^2 of each contact's energy
};

/// All hypotheses, in the order of the enumeration.
inline constexpr std::array kImpactHypotheses{ImpactHypothesis::newton, ImpactHypothesis::poisson,
                                              ImpactHypothesis::routh, ImpactHypothesis::stronge,
                                              ImpactHypothesis::lzb};

/// All hypotheses as a list, for methods that support every law.
inline std::vector<ImpactHypothesis> all_impact_hypotheses() {
  return {kImpactHypotheses.begin(), kImpactHypotheses.end()};
}

/// The name of `law` in scene files and tables.
constexpr std::string_view name_of(ImpactHypothesis law) {
  constexpr std::array<std::string_view, kImpactHypotheses.size()> names{"newton", "poisson", "routh", "stronge",
                                                                         "lzb"};
  return names[static_cast<std::size_t>(law)];
}

/// The law of this `name`. @throws InputError with all names
ImpactHypothesis impact_hypothesis(const std::string& name);

/// The law of a scene's impacts.
struct ImpactLaw {
  ImpactHypothesis hypothesis = ImpactHypothesis::newton;  ///< which law
  double eta = 1.5;                                        ///< lzb: exponent of the contacts as springs, >= 1
  std::vector<double> stiffness;  ///< lzb: ratios of the contacts' stiffnesses, n_c, > 0; empty if all are equal
};

}  // namespace ricochet
