// D1-minus: half-explicit time-discontinuous Galerkin method, forces of closed contacts at both ends of the step.
//
//   M_k (v~ - v_k) = h f(q_k, v_k) + J_n p_n + J_t p_t,   M, J_n, J_t at q_k                 (1)
//   0 <= p_n  _|_  J_n' v~ + h b_k >= 0,   b = v_k' (grad^2 f_c) v_k                         (2)
//   Coulomb's law for p_t: opposite to J_t' v_k where the contact slides on, else for J_t' v~ + h T_k v_k   (3)
//   q_{k+1} = q_k + h/2 (v_k + v~)                                                           (4)
//   v_{k+1} = 1/2 (v_k + v~) + h/2 M_{k+1}^-1 f(q_{k+1}, v~) + M_{k+1}^-1 (J_n P_n + J_t P_t)     (5)
//   0 <= P_n  _|_  J_n' (v_{k+1} + eps_r v_k) >= 0,   Coulomb's law for P_t and J_t' v_{k+1},   J_n, J_t at q_{k+1}   (6)
//   J_n' v~ + h b_k = 0 and J_n' v_{k+1} = 0 where bilateral                                 (7)
//
// (2), (3) for contacts with f_c(q_k) <= 0, or an impulse in the step before, that do not bounce, J_n' v_k <= 0: with
// p = h lambda+ they are the laws of the acceleration (v~ - v_k) / h, written with velocities. (6) for contacts
// with f_c(q_{k+1}) <= 0, or p_n > 0: P is h/2 lambda- of closed contacts, the trapezoidal rule with p / 2 in (5), and
// the impulse of those that close. T v is the part of the slip acceleration that does not contain v'. Forces are explicit.
// Order 2 for smooth motion, joints and persistent contact, whose gaps drift by O(h^2); 1 through impacts.
//
// Source: Schindler, Acary, Math. Comput. Simul. 95 (2014) 180-199; with friction: Schindler, Rezaei, Kursawe, Acary,
// CMAME 290 (2015) 250-276.
// Differs from the source: 1. lambda- and the impulse are one unknown P of (6); in the source lambda- solves a law of
// accelerations at q_{k+1} and the impulse what is left, so that a velocity that opens a closed contact is kept;
// 2. friction in space has the disc, its direction in (3) by turning_slip.h.

#include <algorithm>

#include "methods/registry.h"
#include "methods/time_stepping/common/explicit_step.h"
#include "methods/time_stepping/common/fixed_step_run.h"
#include "methods/time_stepping/common/time_stepping_method.h"
#include "methods/time_stepping/common/turning_slip.h"

namespace ricochet {
namespace {

class D1Minus final : public TimeSteppingMethod {
 public:
  explicit D1Minus(const MethodSpec& spec) : TimeSteppingMethod(spec, kTightContactTolerance) {}

  MethodInfo info() const override {
    return {.id = id_,
            .title = "D1-minus, half-explicit",
            .source = "Schindler, Acary, Math. Comput. Simul. 95 (2014) 180-199",
            .order_smooth = 2,
            .order_impacts = 1,
            .is_adaptive = false,
            .is_audited = true,
            .has_restitution_of_speed = true,
            .is_allocation_free = true};
  }

  Support supports(const ProblemInfo&) const override { return Support::yes(); }

 protected:
  Solution do_solve(const Problem& problem, const Settings& settings) const override;
};

Solution D1Minus::do_solve(const Problem& problem, const Settings& settings) const {
  const ProblemInfo& info = problem.info();
  FixedStepRun run(problem, settings, solver_, observer_);
  ExplicitStep free(run);
  TurningSlip turning(info);
  const double h = run.h;
  const Vector &q = run.q, &v = run.v;
  const bool is_affine = std::ranges::all_of(info.contacts, &ContactInfo::is_affine);
  const bool keeps_force = !info.structure.force_uses_velocity;  // f of (5) serves the next step as well

  Vector change = free.change(q, v), v_tilde(info.n_q), v_free(info.n_q);
  Vector shift = Vector::Zero(info.n_c()), slip_shift = Vector::Zero(info.n_lambda_t);
  Matrix T(info.n_lambda_t, info.n_q);

  /// (1)-(3), (7): replaces v_k + h M^-1 f by v~.
  const auto solve_forces = [&] {
    if (!run.has_contact_problem()) return true;
    if (!run.prepare_contacts(free.W)) return false;
    if (!is_affine) {
      problem.gap_acceleration_bias(q.data(), v.data(), shift.data());
      shift *= h;
      if (info.has_friction()) {
        problem.slip_velocity_derivative(q.data(), v.data(), T.data());
        slip_shift.noalias() = h * T.lazyProduct(v);
      }
    } else {
      shift.setZero();
      slip_shift.setZero();
    }
    v_free = v_tilde;
    if (!run.solve_contacts(v_tilde, shift, {}, slip_shift)) return false;
    if (!turning.is_any() || !turning.add(run.contacts, v, v_tilde, slip_shift)) return true;
    v_tilde = v_free;
    run.clear_impulses();
    return run.solve_contacts(v_tilde, shift, {}, slip_shift);
  };

  run.impact_place = 1;  // (6)
  return run.take_steps([&](Vector& v_plus) {
    if (!keeps_force) change = free.change_without_mass(q, v);
    v_tilde = v + change;  // (1)
    run.contacts.set_position(q);
    run.find_active(q, [&](int i) { return run.was_pressed(i); });
    std::erase_if(run.active, [&](int i) { return run.impact_velocity(i) > 0; });
    if (!solve_forces()) return false;
    run.q += (0.5 * h) * (v + v_tilde);  // (4)
    change = free.change(q, v_tilde);
    v_plus = 0.5 * (v + v_tilde + change);  // (5)
    run.find_active(q, [&](int i) { return run.Lambda_n[i] > 0; });
    run.Lambda_n *= 0.5;
    run.Lambda_t *= 0.5;
    if (!run.has_contact_problem()) return true;
    if (!run.prepare_contacts(q, free.W)) return false;
    shift.setZero();
    for (const int i : run.active) shift[i] = run.rebound(i);
    return run.solve_contacts(v_plus, shift, {});  // (6), (7)
  });
}

const bool registered = register_method<D1Minus>({
    .name = "d1_minus",
    .usage = std::string("d1_minus") + kTightContactSolverUsage,
    .summary = "half-explicit time-discontinuous Galerkin method, forces at both ends of the step",
    .examples = {"d1_minus", "d1_minus,solver=newton,contact_tolerance=1e-13"},
});

}  // namespace
}  // namespace ricochet
