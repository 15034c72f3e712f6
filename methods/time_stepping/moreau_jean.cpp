// Moreau-Jean time stepping with the theta method.
//
//   q_m = q_k + h/2 v_k                                                                       (1)
//   Mhat = M(q_m) - h theta f_v - h^2 theta^2 f_q,   f_q, f_v: derivatives of f at (q_k, v_k)        (2)
//   v_free = v_k + Mhat^-1 (h f(q_k, v_k) + h^2 theta f_q v_k)                                    (3)
//   v_{k+1} = v_free + Mhat^-1 sum_i (J_n^i Lambda_n^i + J_t^i Lambda_t^i),   i with f_c^i(q_m) <= 0    (4)
//   0 <= Lambda_n^i  _|_  J_n^i' (v_{k+1} + eps_r^i v_k) >= 0,   Coulomb's law for Lambda_t^i and J_t^i' v_{k+1}   (5)
//   G' (theta v_{k+1} + (1 - theta) v_k) = 0,   G: J_n of the bilateral constraints, whose impulses are in (4) too (5b)
//   q_{k+1} = q_k + h (theta v_{k+1} + (1 - theta) v_k)                                         (6)
//
// (2), (3) are one Newton step on M (v_{k+1} - v_k) = h (theta f_{k+1} + (1 - theta) f_k); J_n, J_t at q_m. (4), (5)
// are solved as in contact_step.h; J_n^i' v_k is zero in (5) for a contact at rest (FixedStepRun::impact_velocity).
// (5b) holds for the velocity that moves q in (6): with theta = 1/2 the constraints do no work, and keep their gaps to
// O(h^2). Order 1 through impacts, since (5) acts where a step happens to end; on smooth motion order 2 for theta =
// 1/2, else 1.
//
// implicit=full: Newton's method goes on until v_{k+1} stands still, with f_q, f_v at the last (q_{k+1}, v_{k+1}) and
//   v_free = v_{k+1} - Mhat^-1 (M (v_{k+1} - v_k) - h theta f_{k+1} - h (1 - theta) f_k)           (7)
// in place of (3): the part of v_{k+1} that no impulse of the last iteration made. Impulses are solved for afresh.
//
// projection=on: then q_{k+1} moves to the nearest position, in the norm of M, without penetration and without drift of
// the bilateral constraints, in a few linearised steps (position_projection.h):
//   q <- q + M^-1 J_n tau,   0 <= tau  _|_  f_c + J_n' M^-1 J_n tau >= 0,   equality where bilateral   (8)
//
// Source: Jean, CMAME 177 (1999); Acary, Brogliato, Numerical Methods for Nonsmooth Dynamical Systems (2008),
// section 10.1, eq. (10.7)-(10.12); (8): Acary, Projected event-capturing time-stepping schemes, CMAME 256 (2013).
// Differs from the source: 1. M and the contact kinematics are taken at the midpoint (1), which keeps order 2 for
// configuration-dependent M, also with implicit=full; 2. with solver=lemke the friction disc is a polygon in space;
// 3. (8) follows the step instead of being part of its equations, for every contact that penetrates.

#include <fmt/format.h>

#include <optional>

#include "methods/registry.h"
#include "methods/time_stepping/common/fixed_step_run.h"
#include "methods/time_stepping/common/position_projection.h"
#include "methods/time_stepping/common/time_stepping_method.h"

namespace ricochet {
namespace {

constexpr int kMaxNewton = 30;

class MoreauJean final : public TimeSteppingMethod {
 public:
  explicit MoreauJean(const MethodSpec& spec)
      : TimeSteppingMethod(spec),
        theta_(spec.number("theta", 0.5, 0.5, 1)),
        is_full_(spec.choice("implicit", {"linear", "full"}) == "full"),
        projects_(spec.choice("projection", {"off", "on"}) == "on") {}

  MethodInfo info() const override {
    return {.id = id_,
            .title = fmt::format("Moreau-Jean, theta = {}{}{}", theta_, is_full_ ? ", fully implicit" : "",
                                 projects_ ? ", projected" : ""),
            .source = "Jean, CMAME 177 (1999); Acary, Brogliato (2008), section 10.1",
            .order_smooth = theta_ == 0.5 ? 2.0 : 1.0,
            .order_impacts = 1,
            .is_adaptive = false,
            .is_audited = true,
            .has_restitution_of_speed = true,
            .is_allocation_free = !projects_};  // a projection makes a contact problem of its own
  }

  Support supports(const ProblemInfo&) const override { return Support::yes(); }

 protected:
  Solution do_solve(const Problem& problem, const Settings& settings) const override;

 private:
  double theta_;
  bool is_full_, projects_;
};

Solution MoreauJean::do_solve(const Problem& problem, const Settings& settings) const {
  const ProblemInfo& info = problem.info();
  const auto& structure = info.structure;
  const int n_q = info.n_q;
  FixedStepRun run(problem, settings, solver_, observer_);
  const double h = run.h;
  const Vector &q = run.q, &v = run.v;
  Counters& counters = run.solution.counters;

  const int n_implicit = structure.force_uses_position || structure.force_uses_velocity ? n_q : 0;
  Matrix M(n_q, n_q), f_q(n_implicit, n_implicit), f_v(n_implicit, n_implicit), Mhat(n_implicit, n_implicit);
  BlockInverse W;  // Mhat^-1
  Vector q_m(n_q), f(n_q), Wf(n_q), q_next(n_q), v_last(n_q), g(n_q), shift = Vector::Zero(info.n_c());
  std::optional<PositionProjection> projection;
  if (projects_) projection.emplace(problem, h, counters);
  const auto factorize = [&](const Vector& position, const Vector& velocity) {  // (2)
    problem.mass_matrix(q_m.data(), M.data());
    ++counters.matrix_factorizations;
    if (n_implicit == 0) return W.compute(M, info.has_bilateral());
    problem.force_jacobians(position.data(), velocity.data(), info.u.data(), f_q.data(), f_v.data());
    Mhat = M - (h * theta_) * f_v - (h * h * theta_ * theta_) * f_q;
    W.compute(Mhat, info.has_bilateral());
    ++counters.jacobian_evaluations;
  };
  const bool constant_matrix = structure.constant_mass && structure.constant_force_jacobian;
  q_m = q;
  if (constant_matrix) factorize(q, v);

  /// (4), (5) of the contacts that are active; replaces the free velocity.
  const auto solve_contacts = [&](Vector& v_plus) {
    if (!run.has_contact_problem()) return true;
    if (!run.prepare_contacts(q_m, W)) return false;
    for (const int i : run.active) shift[i] = run.rebound(i);
    run.contacts.bilateral_velocities(v, shift);
    for (const int i : info.bilateral) shift[i] *= (1 - theta_) / theta_;  // (5b)
    return run.solve_contacts(v_plus, shift, {});
  };

  /// (7)
  const auto correct = [&](Vector& v_plus) {
    NewtonEnd is_end(settings.inner_tolerance, run.largest_velocity() + Wf.cwiseAbs().maxCoeff());
    for (int iteration = 0; iteration < kMaxNewton; ++iteration) {
      q_next = q + (h * theta_) * v_plus + (h * (1 - theta_)) * v;
      if (!constant_matrix) factorize(q_next, v_plus);
      problem.force(q_next.data(), v_plus.data(), info.u.data(), g.data());
      v_last = v_plus - v;
      g = (h * theta_) * g + (h * (1 - theta_)) * f;
      g.noalias() -= M.lazyProduct(v_last);
      v_last = v_plus;
      W.apply(g, Wf);
      v_plus += Wf;
      ++counters.force_evaluations;
      ++counters.linear_solves;
      ++counters.inner_iterations;
      run.clear_impulses();
      if (!solve_contacts(v_plus)) return false;
      if (is_end((v_plus - v_last).cwiseAbs().maxCoeff())) return true;
    }
    return run.fail("Newton's method for the implicit forces did not converge");
  };

  run.impact_place = 1 - theta_;  // (6)
  return run.take_steps([&](Vector& v_plus) {
    q_m = q + (0.5 * h) * v;  // (1)
    if (!constant_matrix) factorize(q, v);
    problem.force(q.data(), v.data(), info.u.data(), f.data());
    g = h * f;
    if (structure.force_uses_position) g.noalias() += (h * h * theta_) * f_q.lazyProduct(v);
    W.apply(g, Wf);
    v_plus = v + Wf;  // (3)
    ++counters.force_evaluations;
    ++counters.linear_solves;
    run.find_active(q_m);
    if (!solve_contacts(v_plus)) return false;
    if (is_full_ && !correct(v_plus)) return false;
    run.q += (h * theta_) * v_plus + (h * (1 - theta_)) * v;  // (6)
    return !projection || projection->apply(run.q) || run.fail(projection->reason());
  });
}

const bool registered = register_method<MoreauJean>({
    .name = "moreau_jean",
    .usage = std::string("moreau_jean[,theta=0.5][,implicit=linear|full][,projection=off|on]") + kContactSolverUsage,
    .summary = "Moreau-Jean time stepping, theta method",
    .examples = {"moreau_jean", "moreau_jean,theta=1", "moreau_jean,implicit=full", "moreau_jean,projection=on",
                 "moreau_jean,solver=pgs,contact_tolerance=1e-13", "moreau_jean,solver=newton,contact_tolerance=1e-13",
                 "moreau_jean,solver=interior_point,contact_tolerance=1e-13"},
});

}  // namespace
}  // namespace ricochet
