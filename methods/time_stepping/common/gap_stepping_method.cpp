#include "methods/time_stepping/common/gap_stepping_method.h"

#include <algorithm>

#include "methods/time_stepping/common/gap_contacts.h"

namespace ricochet {

GapSteppingMethod::GapSteppingMethod(const MethodSpec& spec, std::string title, std::string source, FrictionLaw law)
    : TimeSteppingMethod(spec), title_(std::move(title)), source_(std::move(source)), law_(law) {}

MethodInfo GapSteppingMethod::info() const {
  return {.id = id_,
          .title = title_,
          .source = source_,
          .order_smooth = 1,
          .order_impacts = 1,
          .is_adaptive = false,
          .is_audited = true,
          .is_allocation_free = true};
}

Support GapSteppingMethod::supports(const ProblemInfo& problem) const {
  const bool bounces = std::ranges::any_of(problem.contacts, [](const auto& contact) { return contact.eps_r > 0; });
  if (bounces) return Support::no("it has no restitution, eps_r = 0 is required in every contact");
  if (law_ == FrictionLaw::associated && problem.n_friction_elements > 0)
    return Support::no("a contact that slips is lifted, and a friction element would lose its normal force");
  return Support::yes();
}

void GapSteppingMethod::set_shift(const FixedStepRun& run, Vector& shift) const {
  shift /= run.h;
}

Solution GapSteppingMethod::do_solve(const Problem& problem, const Settings& settings) const {
  FixedStepRun run(problem, settings, solver_, observer_, {.friction = law_});
  ExplicitStep free(run);
  GapContacts contacts(run, law_);
  Vector shift(problem.n_c());
  return run.take_steps([&](Vector& v_plus) {
    v_plus = run.v + free.change(run.q, run.v);
    problem.gap(run.q.data(), shift.data());
    run.contacts.set_position(run.q);
    set_shift(run, shift);
    if (!contacts.solve(free.W, shift, v_plus)) return false;  // (1), (2)
    run.q += run.h * v_plus;                                   // (3)
    return true;
  });
}

}  // namespace ricochet
