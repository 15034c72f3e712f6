#include <fmt/format.h>

#include "methods/peers/siconos/integrate.h"
#include "methods/registry.h"
#include "problems/levers.h"

namespace ricochet {
namespace {

// A library that is optional: without it its methods are listed, with the reason why they cannot run.
#ifdef RICOCHET_HAS_SICONOS

const char* const kSource = "Acary et al., An introduction to Siconos, INRIA RT-0340";

Support supports_contacts(const ProblemInfo& problem) {
  if (problem.has_bilateral()) return Support::no("bilateral constraints are not passed on to Siconos");
  if (problem.clock >= 0)
    return Support::no(
        "the scene depends on time, and the clock that it has here would be a body to Siconos, which contacts push");
  if (has_levers(problem))
    return Support::no("friction elements that are bounded by the force of a contact are not passed on to Siconos");
  for (const ContactInfo& contact : problem.contacts) {
    if (contact.n_t != problem.contacts.front().n_t)
      return Support::no("a contact problem of Siconos takes contacts of one kind, not with and without friction");
  }
  return Support::yes();
}

/// siconos/moreau_jean.cpp
template <siconos::Projection projection>
class MoreauJean final : public Method {
 public:
  explicit MoreauJean(const MethodSpec& spec) : id_(spec.text()), theta_(spec.number("theta", 0.5, 0.5, 1)) {}
  MethodInfo info() const override {
    return {.id = id_,
            .title = fmt::format("Siconos Moreau-Jean{}, theta = {}", kProjection, theta_),
            .source = projects ? "Acary, CMAME 256 (2013) 224-250" : kSource,
            .order_smooth = 1,  // 2 for theta = 1/2 and a constant M: Siconos takes M(q) at the end of a step
            .order_impacts = 1};
  }
  Support supports(const ProblemInfo& problem) const override {
    if (constexpr int most = siconos::max_contacts(projection); problem.n_c() > most)
      return Support::no(fmt::format("Siconos' projection takes {} contacts at most", most));
    return supports_contacts(problem);
  }

 protected:
  Solution do_solve(const Problem& problem, const Settings& settings) const override {
    return siconos::integrate_moreau_jean(problem, settings, theta_, projection);
  }

 private:
  static constexpr bool projects = projection != siconos::Projection::none;
  static constexpr const char* kProjection = projection == siconos::Projection::direct     ? " with direct projection"
                                             : projection == siconos::Projection::combined ? " with combined projection"
                                                                                           : "";
  std::string id_;
  double theta_;
};

using SiconosMoreauJean = MoreauJean<siconos::Projection::none>;
using SiconosProjection = MoreauJean<siconos::Projection::combined>;
using SiconosDirectProjection = MoreauJean<siconos::Projection::direct>;

/// siconos/schatzman_paoli.cpp
class SiconosSchatzmanPaoli final : public Method {
 public:
  explicit SiconosSchatzmanPaoli(const MethodSpec& spec) : id_(spec.text()), theta_(spec.number("theta", 0.5, 0, 1)) {}
  MethodInfo info() const override {
    return {.id = id_,
            .title = fmt::format("Siconos Schatzman-Paoli, theta = {}", theta_),
            .source = "Paoli, Schatzman, SIAM J. Numer. Anal. 40 (2002) 702-733",
            .order_smooth = 1,
            .order_impacts = 1};
  }
  Support supports(const ProblemInfo& problem) const override {
    if (problem.has_friction())
      return Support::no("Siconos' Schatzman-Paoli scheme would apply Coulomb's law to positions, not to velocities");
    if (!problem.structure.constant_mass || !problem.structure.constant_force_jacobian)
      return Support::no("Siconos' Schatzman-Paoli scheme takes constant matrices M, C, K only");
    for (const ContactInfo& contact : problem.contacts) {
      if (!contact.is_affine) return Support::no("Siconos' Schatzman-Paoli scheme takes affine gaps only");
    }
    return supports_contacts(problem);
  }

 protected:
  Solution do_solve(const Problem& problem, const Settings& settings) const override {
    return siconos::integrate_schatzman_paoli(problem, settings, theta_);
  }

 private:
  std::string id_;
  double theta_;
};

/// siconos/event_driven.cpp
class SiconosEventDriven final : public Method {
 public:
  explicit SiconosEventDriven(const MethodSpec& spec) : id_(spec.text()) {}
  MethodInfo info() const override {
    return {.id = id_,
            .title = "Siconos event-driven, LSODAR",
            .source = kSource,
            .order_smooth = 12,
            .order_impacts = 12,
            .is_adaptive = true,
            .keeps_samples = false};
  }
  Support supports(const ProblemInfo& problem) const override {
    if (problem.has_friction()) return Support::no("Siconos' event-driven scheme with LSODAR has no friction");
    return supports_contacts(problem);
  }

 protected:
  Solution do_solve(const Problem& problem, const Settings& settings) const override {
    return siconos::integrate_event_driven(problem, settings);
  }

 private:
  std::string id_;
};

/// siconos/d1_minus.cpp
class SiconosD1Minus final : public Method {
 public:
  explicit SiconosD1Minus(const MethodSpec& spec) : id_(spec.text()) {}
  MethodInfo info() const override {
    return {.id = id_,
            .title = "Siconos D1-minus, half-explicit",
            .source = "Schindler, Acary, Math. Comput. Simul. 95 (2014) 180-199",
            .order_smooth = 2,
            .order_impacts = 1};
  }
  Support supports(const ProblemInfo& problem) const override {
    if (problem.has_friction()) return Support::no("Siconos' D1-minus scheme has no friction");
    return supports_contacts(problem);
  }

 protected:
  Solution do_solve(const Problem& problem, const Settings& settings) const override {
    return siconos::integrate_d1_minus(problem, settings);
  }

 private:
  std::string id_;
};

#else
using SiconosMoreauJean = NotBuilt;
using SiconosProjection = NotBuilt;
using SiconosDirectProjection = NotBuilt;
using SiconosSchatzmanPaoli = NotBuilt;
using SiconosD1Minus = NotBuilt;
using SiconosEventDriven = NotBuilt;
#endif

const char* const kNotBuilt = "libsiconos-kernel-dev not found";

const bool registered =
    register_method<SiconosMoreauJean>({
        .name = "siconos_moreau_jean",
        .usage = "siconos_moreau_jean[,theta=0.5]",
        .summary = "Siconos: its Moreau-Jean time stepping",
        .examples = {"siconos_moreau_jean", "siconos_moreau_jean,theta=1"},
        .not_built = kNotBuilt,
        .scheme = "siconos/moreau_jean.cpp",
    }) &&
    register_method<SiconosProjection>({
        .name = "siconos_projection",
        .usage = "siconos_projection[,theta=0.5]",
        .summary = "Siconos: Moreau-Jean, positions projected onto the surfaces of all contacts that close",
        .examples = {"siconos_projection"},
        .not_built = kNotBuilt,
        .scheme = "siconos/moreau_jean.cpp",
    }) &&
    register_method<SiconosDirectProjection>({
        .name = "siconos_direct_projection",
        .usage = "siconos_direct_projection[,theta=0.5]",
        .summary = "Siconos: Moreau-Jean, active contacts that penetrate are projected out after the step",
        .examples = {"siconos_direct_projection"},
        .not_built = kNotBuilt,
        .scheme = "siconos/moreau_jean.cpp",
    }) &&
    register_method<SiconosSchatzmanPaoli>({
        .name = "siconos_schatzman_paoli",
        .usage = "siconos_schatzman_paoli[,theta=0.5]",
        .summary = "Siconos: its Schatzman-Paoli scheme for positions, linear motion without friction",
        .examples = {"siconos_schatzman_paoli", "siconos_schatzman_paoli,theta=0"},
        .not_built = kNotBuilt,
        .scheme = "siconos/schatzman_paoli.cpp",
    }) &&
    register_method<SiconosD1Minus>({
        .name = "siconos_d1_minus",
        .usage = "siconos_d1_minus",
        .summary = "Siconos: its half-explicit time-discontinuous Galerkin method, without friction",
        .examples = {"siconos_d1_minus"},
        .not_built = kNotBuilt,
        .scheme = "siconos/d1_minus.cpp",
    }) &&
    register_method<SiconosEventDriven>({
        .name = "siconos_event_driven",
        .usage = "siconos_event_driven, with --tolerance",
        .summary = "Siconos: LSODAR with located events, without friction",
        .examples = {"siconos_event_driven"},
        .not_built = kNotBuilt,
        .scheme = "siconos/event_driven.cpp",
    });

}  // namespace
}  // namespace ricochet
