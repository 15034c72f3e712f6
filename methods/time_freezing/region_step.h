#pragma once

#include <string>

#include "methods/time_freezing/instant_law.h"
#include "methods/time_freezing/switching_functions.h"

namespace ricochet {

/// One element from a state on, which ends at its length or at the first zero of a switching function: then its length is
/// the unknown, found by bracketing.
class RegionStep {
 public:
  /// Why there is no element.
  struct Failure {
    Status status = Status::success;
    std::string message{};
    explicit operator bool() const { return status != Status::success; }
  };

  static constexpr const char* kNoMass = "M is not positive definite, or bilateral constraints depend on each other";
  static constexpr const char* kNoForces = "no forces hold the contacts in their modes";
  static constexpr double kShortest = 1e-15;  ///< of the end time: rounding of the time

  /// All references must outlive this object. @param system, forces  of the state at hand
  RegionStep(const Problem& problem, const ButcherTableau& tableau, AuxiliaryDynamics& auxiliary,
             const ContactScales& scales, InstantSystem& system, RegionForces& forces, double inner_tolerance,
             Counters& counters);

  /// The element of at most this length. Sets the length, and the switch that ends it.
  Failure take(RegionState& state, double& length, RegionSwitch& cause);
  const RegionElement& element() const { return element_; }

  /// First guess at a state whose forces are known.
  void guess(const RegionState& state, double length) { element_.guess(state, forces_, length); }
  /// First guess where forces are unknown, or after Newton's method has failed. @return false if there are no forces
  bool renew_guess(const RegionState& state, double length);
  /// The state is the right end of the last element; its regions change or not.
  void leave(bool changes) { has_system_ = !changes && problem_.info().clock < 0; }

 private:
  bool begin(RegionState& state);
  bool reach(const RegionState& state, double length);
  /// Lengths at which a function is positive and negative, and its values there.
  struct Bracket {
    double a, f_a, b, f_b;
  };
  bool find_positive(const RegionState& state, const SwitchingFunctions::Function& function, Bracket& bracket);
  bool locate(const RegionState& state, const SwitchingFunctions::Function& function, double& length);

  const Problem& problem_;
  const AuxiliaryDynamics& auxiliary_;
  const ContactScales& scales_;
  InstantSystem& system_;
  RegionForces& forces_;
  RegionElement element_;
  SwitchingFunctions functions_;
  bool has_system_ = false;  // system_ and forces_ are those of the state
};

}  // namespace ricochet
