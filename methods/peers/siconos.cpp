#include <fmt/format.h>

#include "methods/peers/siconos/integrate.h"
#include "methods/registry.h"

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
  for (const ContactInfo& contact : problem.contacts) {
    if (contact.n_t != problem.contacts.front().n_t)
      return Support::no("a contact problem of Siconos takes contacts of one kind, not with and without friction");
  }
  return Support::yes();
}

/// siconos/moreau_jean.cpp
class SiconosMoreauJean final : public Method {
 public:
  explicit SiconosMoreauJean(const MethodSpec& spec) : id_(spec.text()), theta_(spec.number("theta", 0.5, 0.5, 1)) {}
  MethodInfo info() const override {
    return {.id = id_,
            .title = fmt::format("Siconos Moreau-Jean, theta = {}", theta_),
            .source = kSource,
            .order_smooth = theta_ == 0.5 ? 2.0 : 1.0,
            .order_impacts = 1};
  }
  Support supports(const ProblemInfo& problem) const override { return supports_contacts(problem); }

 protected:
  Solution do_solve(const Problem& problem, const Settings& settings) const override {
    return siconos::integrate_moreau_jean(problem, settings, theta_);
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
            .is_adaptive = true};
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
using SiconosD1Minus = NotBuilt;
using SiconosMoreauJean = NotBuilt;
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
    }) &&
    register_method<SiconosD1Minus>({
        .name = "siconos_d1_minus",
        .usage = "siconos_d1_minus",
        .summary = "Siconos: its half-explicit time-discontinuous Galerkin method, without friction",
        .examples = {"siconos_d1_minus"},
        .not_built = kNotBuilt,
    }) &&
    register_method<SiconosEventDriven>({
        .name = "siconos_event_driven",
        .usage = "siconos_event_driven, with --tolerance",
        .summary = "Siconos: LSODAR with located events, without friction",
        .examples = {"siconos_event_driven"},
        .not_built = kNotBuilt,
    });

}  // namespace
}  // namespace ricochet
