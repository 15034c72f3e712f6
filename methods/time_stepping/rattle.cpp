// Nonsmooth RATTLE: contact at position and at velocity level, order 2 in persistent contact.
//
//   M(q_k) (v' - v_k) = h/2 f(q_k, v') + J_n(q_k) P_n + J_t(q_k) P_t                         (1)
//   q_{k+1} = q_k + h v'                                                                     (2)
//   0 <= P_n  _|_  f_c(q_{k+1}) >= 0,   Coulomb's law for P_t and J_t(q_m)' v',   q_m = q_k + h/2 v'   (3)
//   M(q_{k+1}) (v_{k+1} - v') = h/2 f(q_{k+1}, v') + J_n(q_{k+1}) Q_n + J_t(q_{k+1}) Q_t     (4)
//   0 <= P_n + Q_n  _|_  J_n' (v_{k+1} + eps_r v_k) >= 0  for i with P_n > 0 or f_c(q_{k+1}) <= 0     (5)
//   Coulomb's law for P_t + Q_t and J_t' v_{k+1}                                             (6)
//   f_c(q_{k+1}) = 0 and J_n' v_{k+1} = 0 where bilateral, P_n and Q_n of either sign        (7)
//
// J_n, J_t of (5)-(7) at q_{k+1}. The first half step keeps gaps, the second their rates: neither penetration nor drift.
// Contacts that stay closed have forces P_n, Q_n at both ends of the step, and (1)-(4) are symmetric: order 2 for
// smooth motion, joints and persistent contact; without friction and impacts the method is symplectic. Order 1 through
// impacts, which (5) takes to the end of their step.
//
// (1)-(3) are solved by Newton's method with the matrices of the beginning of the step,
//
//   v_free = v_k + h/2 Mhat^-1 (f(q_k, v') + f_v (v_k - v')),   Mhat = M(q_k) - h/2 f_v(q_k, v_k)     (8)
//   J_n(q_k)' v' + s_n >= 0,   s_n = f_c(q_k + h v'_last) / h - J_n(q_k)' v'_last            (9)
//   s_t = (J_t(q_m) - J_t(q_k))' v'_last                                                     (10)
//
// a contact problem each (gap_contacts.h), one where (3) and f are affine. In space, slip that turns would have its
// friction of (6) in the direction of the end of the step, order 1: where a contact slides at both ends, s_t moves the
// slip of (6) to v', the middle,
//
//   s_t = J_t(q_{k+1})' (v' - v_last),   v_last: (4), (6) without s_t                        (11)
//
// Source: Breuling, Capobianco, Eugster, Leine, Nonlinear Anal. Hybrid Syst. 52 (2024) 101469, eq. (26)-(31).
// Differs from the source: 1. slip of (3) is that of the middle of the step, in the source of q_{k+1}, which has order 1
// where tangents turn; 2. (11); 3. q' = v, no matrix between positions and velocities.

#include <algorithm>

#include "methods/registry.h"
#include "methods/time_stepping/common/fixed_step_run.h"
#include "methods/time_stepping/common/gap_contacts.h"
#include "methods/time_stepping/common/time_stepping_method.h"
#include "methods/time_stepping/common/turning_slip.h"
#include "problems/packed_column.h"

namespace ricochet {
namespace {

constexpr int kMaxNewton = 30;

class Rattle final : public TimeSteppingMethod {
 public:
  explicit Rattle(const MethodSpec& spec) : TimeSteppingMethod(spec, kTightContactTolerance) {}

  MethodInfo info() const override {
    return {.id = id_,
            .title = "Nonsmooth RATTLE",
            .source = "Breuling, Capobianco, Eugster, Leine, NAHS 52 (2024) 101469",
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

class RattleStep {
 public:
  explicit RattleStep(FixedStepRun& run)
      : run_(run),
        problem_(run.problem),
        info_(run.problem.info()),
        gaps_(run, FrictionLaw::coulomb),
        turning_(info_),
        has_f_v_(info_.structure.force_uses_velocity),
        is_affine_(std::ranges::all_of(info_.contacts, &ContactInfo::is_affine)),
        is_one_pass_(is_affine_ && (!has_f_v_ || info_.structure.constant_force_jacobian)) {
    const int n_q = info_.n_q, n_f = has_f_v_ ? n_q : 0;
    M_.resize(n_q, n_q);
    for (auto* matrix : {&Mhat_, &f_q_, &f_v_}) matrix->resize(n_f, n_f);
    for (auto* x : {&f_, &g_, &Wf_, &v_mid_, &v_last_, &q_next_, &q_m_}) x->setZero(n_q);
    for (auto* x : {&gap_, &shift_, &P_n_}) x->setZero(info_.n_c());
    for (auto* x : {&P_t_, &slip_shift_, &slip_}) x->setZero(info_.n_lambda_t);
    tangents_.setZero(info_.n_tangent_entries);
    invert_mass(run.q);
    evaluate_force(run.q, run.v);
    if (has_f_v_ && has_constant_matrix()) factorize();
  }

  bool operator()(Vector& v_plus) { return first_half() && second_half(v_plus); }

 private:
  bool has_constant_matrix() const { return info_.structure.constant_mass && info_.structure.constant_force_jacobian; }

  void invert_mass(const Vector& q) {
    problem_.mass_matrix(q.data(), M_.data());
    W_.compute(M_, info_.has_bilateral());
    ++run_.solution.counters.mass_factorizations;
  }

  void evaluate_force(const Vector& q, const Vector& v) {
    problem_.force(q.data(), v.data(), info_.u.data(), f_.data());
    ++run_.solution.counters.force_evaluations;
  }

  void factorize() {  // (8)
    problem_.force_jacobians(run_.q.data(), run_.v.data(), info_.u.data(), f_q_.data(), f_v_.data());
    Mhat_ = M_ - (0.5 * run_.h) * f_v_;
    What_.compute(Mhat_, info_.has_bilateral());
    ++run_.solution.counters.jacobian_evaluations;
    ++run_.solution.counters.matrix_factorizations;
  }

  /// (1)-(3): v_mid_, q_next_, and P_n, P_t in the impulses of the run.
  bool first_half() {
    const double h = run_.h;
    if (has_f_v_) {
      if (!has_constant_matrix()) factorize();
      evaluate_force(run_.q, run_.v);
    }
    const BlockInverse& W = has_f_v_ ? What_ : W_;
    run_.contacts.set_position(run_.q);
    W.apply(f_, Wf_);
    ++run_.solution.counters.linear_solves;
    NewtonEnd is_end(run_.settings.inner_tolerance, run_.largest_velocity() + 0.5 * h * Wf_.cwiseAbs().maxCoeff(),
                     run_.largest_touching() / h);
    for (int iteration = 0; iteration < kMaxNewton; ++iteration) {
      if (has_f_v_ && iteration > 0) {
        evaluate_force(run_.q, v_last_);
        g_ = run_.v - v_last_;
        f_.noalias() += f_v_.lazyProduct(g_);
        W.apply(f_, Wf_);
        ++run_.solution.counters.linear_solves;
      }
      v_mid_ = run_.v + (0.5 * h) * Wf_;  // (8)
      if (iteration == 0) v_last_ = v_mid_;
      set_shifts();
      if (!gaps_.solve(W, shift_, v_mid_, slip_shift_)) return false;
      ++run_.solution.counters.inner_iterations;
      const double change = (v_mid_ - v_last_).cwiseAbs().maxCoeff();
      v_last_ = v_mid_;
      if (is_one_pass_ || is_end(change)) {
        q_next_ = run_.q + h * v_mid_;  // (2)
        return true;
      }
    }
    return run_.fail("Newton's method for the first half of the step did not converge");
  }

  /// (9), (10)
  void set_shifts() {
    const double h = run_.h;
    q_next_ = run_.q + h * v_last_;
    problem_.gap(q_next_.data(), gap_.data());
    for (int i = 0; i < info_.n_c(); ++i) shift_[i] = gap_[i] / h - run_.contacts.normal_velocity(i, v_last_);
    if (is_affine_ || !info_.has_friction()) return;
    q_m_ = run_.q + (0.5 * h) * v_last_;
    problem_.tangent_jacobian(q_m_.data(), tangents_.data());
    run_.contacts.slip_velocities(v_last_, slip_);
    for (const auto& contact : info_.contacts) {
      for (int d = 0; d < contact.n_t; ++d) {
        const double* column = tangents_.data() + contact.tangent_begin + d * contact.support.size();
        const int at = contact.tangent_index + d;
        slip_shift_[at] = packed_dot(contact, column, v_last_) - slip_[at];
      }
    }
  }

  /// (4)-(7)
  bool second_half(Vector& v_plus) {
    if (!info_.structure.constant_mass) invert_mass(q_next_);
    evaluate_force(q_next_, v_mid_);
    W_.apply(f_, Wf_);
    ++run_.solution.counters.linear_solves;
    v_plus = v_mid_ + (0.5 * run_.h) * Wf_;  // (4)
    run_.find_active(q_next_, [&](int i) { return run_.Lambda_n[i] > 0; });
    if (run_.has_contact_problem() && !solve_velocities(v_plus)) return false;
    run_.q = q_next_;
    return true;
  }

  /// (5)-(7) with the unknowns P + Q.
  bool solve_velocities(Vector& v_plus) {
    P_n_ = run_.Lambda_n;
    P_t_ = run_.Lambda_t;
    for (const int i : info_.unilateral) run_.Lambda_n[i] = 0;  // those of joints are P_n and Q_n, one after the other
    run_.Lambda_t.setZero();
    if (!run_.prepare_contacts(q_next_, W_)) return false;
    run_.contacts.add_impulses(-1, P_n_, P_t_, v_plus, run_.Lambda_n);
    shift_.setZero();
    for (const int i : run_.active) shift_[i] = run_.rebound(i);
    v_last_ = v_plus;
    P_n_ = run_.Lambda_n;
    if (!run_.solve_contacts(v_plus, shift_, {})) return false;
    if (!turning_.is_any()) return true;
    slip_shift_.setZero();
    if (!turning_.add(run_.contacts, v_mid_, v_plus, slip_shift_)) return true;  // (11)
    v_plus = v_last_;
    run_.Lambda_n = P_n_;
    run_.Lambda_t.setZero();
    return run_.solve_contacts(v_plus, shift_, {}, slip_shift_);
  }

  FixedStepRun& run_;
  const Problem& problem_;
  const ProblemInfo& info_;
  GapContacts gaps_;
  TurningSlip turning_;
  const bool has_f_v_, is_affine_, is_one_pass_;
  Matrix M_, Mhat_, f_q_, f_v_;
  BlockInverse W_, What_;  // M^-1 of (4), and of (1) where f does not depend on v; Mhat^-1
  Vector f_, g_, Wf_, v_mid_, v_last_, q_next_, q_m_, gap_, shift_, P_n_;
  Vector slip_shift_, slip_, P_t_, tangents_;
};

Solution Rattle::do_solve(const Problem& problem, const Settings& settings) const {
  FixedStepRun run(problem, settings, solver_, observer_);
  RattleStep step(run);
  run.impact_place = 1;  // (5)
  return run.take_steps([&](Vector& v_plus) { return step(v_plus); });
}

const bool registered = register_method<Rattle>({
    .name = "rattle",
    .usage = std::string("rattle") + kTightContactSolverUsage,
    .summary = "nonsmooth RATTLE: gaps and their rates at the end of the step",
    .examples = {"rattle", "rattle,solver=newton,contact_tolerance=1e-13"},
});

}  // namespace
}  // namespace ricochet
