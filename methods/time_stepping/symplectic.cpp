// Stoermer-Verlet time stepping with elastic impacts: e = 1, no friction, separable energy.
//
//   v_{k+1/2} = v_k + h/2 M^-1 f(q_k)                                                      (1)
//   q_{k+1} = q_k + h v_{k+1/2}                                                           (2)
//   v' = v_{k+1/2} + h/2 M^-1 f(q_{k+1})                                                  (3)
//   v_{k+1} = v' + M^-1 J_n Lambda_n,   0 <= Lambda_n  _|_  J_n' (v_{k+1} + v') >= 0      (4)
//
// (4) for the contacts with f_c(q_{k+1}) <= 0, J_n there: several at once are solved for together. (1)-(3) are
// symplectic. (4) keeps the kinetic energy exactly,
//
//   1/2 v_{k+1}' M v_{k+1} - 1/2 v'' M v' = 1/2 Lambda_n' J_n' (v_{k+1} + v') = 0,
//
// and the position, so that the energy error stays bounded over long times, also through many impacts. Order 2 on
// smooth motion; 1 through impacts, which happen where a step ends.
//
// Source: Cirak, West, Decomposition contact response, IJNME 64 (2005) 1078-1110, section 4; Hairer, Lubich, Wanner,
// Geometric Numerical Integration, I.3.1 for (1)-(3).
// Differs from the source: no projection of penetrating positions, which would change the energy.

#include <algorithm>

#include "methods/registry.h"
#include "methods/time_stepping/common/explicit_step.h"
#include "methods/time_stepping/common/time_stepping_method.h"

namespace ricochet {
namespace {

class Symplectic final : public TimeSteppingMethod {
 public:
  explicit Symplectic(const MethodSpec& spec) : TimeSteppingMethod(spec) {}

  MethodInfo info() const override {
    return {.id = id_,
            .title = "Stoermer-Verlet with elastic impacts",
            .source = "Cirak, West, IJNME 64 (2005) 1078-1110",
            .order_smooth = 2,
            .order_impacts = 1,
            .is_adaptive = false,
            .is_audited = true,
            .is_allocation_free = true};
  }

  Support supports(const ProblemInfo& problem) const override {
    if (problem.has_bilateral()) return Support::no("bilateral constraints are not part of the scheme");
    if (problem.has_friction()) return Support::no("it conserves energy, friction does not");
    if (problem.clock >= 0)
      return Support::no("it conserves energy, forces and surfaces that move by themselves do not");
    const auto is_elastic = [](const auto& contact) { return contact.eps_r == 1; };
    if (!std::ranges::all_of(problem.contacts, is_elastic))
      return Support::no("it conserves energy, eps_r = 1 is required in every contact");
    if (!problem.structure.constant_mass || problem.structure.force_uses_velocity)
      return Support::no("the energy is not separable: M depends on q, or f on v");
    return Support::yes();
  }

 protected:
  Solution do_solve(const Problem& problem, const Settings& settings) const override {
    FixedStepRun run(problem, settings, solver_, observer_);
    ExplicitStep free(run);
    Vector kick = free.change(run.q, run.v), shift = Vector::Zero(problem.n_c());
    run.impact_place = 1;  // (4)
    return run.take_steps([&](Vector& v_plus) {
      v_plus = run.v + 0.5 * kick;        // (1)
      run.q += run.h * v_plus;            // (2)
      kick = free.change(run.q, v_plus);  // h M^-1 f, which (1) of the next step uses again
      v_plus += 0.5 * kick;               // (3)
      run.find_active(run.q);
      if (run.active.empty()) return true;
      if (!run.prepare_contacts(run.q, free.W)) return false;
      for (const int i : run.active) shift[i] = run.contacts.normal_velocity(i, v_plus);
      return run.solve_contacts(v_plus, shift, {});  // (4)
    });
  }
};

const bool registered = register_method<Symplectic>({
    .name = "symplectic",
    .usage = std::string("symplectic") + kContactSolverUsage,
    .summary = "Stoermer-Verlet with impacts that conserve energy, for eps_r = 1",
    .examples = {"symplectic"},
});

}  // namespace
}  // namespace ricochet
