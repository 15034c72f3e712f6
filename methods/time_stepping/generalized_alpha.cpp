// Nonsmooth generalised-alpha method: second order for the smooth part of the motion, impulses by implicit Euler.
//
//   M(q_{k+1}) d_{k+1} = f(q_{k+1}, v_{k+1})                                                (1)
//   (1 - alpha_m) a_{k+1} + alpha_m a_k = (1 - alpha_f) d_{k+1} + alpha_f d_k              (2)
//   v_{k+1} = v_k + h (1 - gamma) a_k + h gamma a_{k+1} + w                                (3)
//   q_{k+1} = q_k + h v_k + h^2 (1/2 - beta) a_k + h^2 beta a_{k+1} + h/2 w                 (4)
//   M w = J_n Lambda_n + J_t Lambda_t                                                      (5)
//   0 <= Lambda_n^i  _|_  J_n^i' (v_{k+1} + eps_r^i v_k) >= 0,   Coulomb's law for Lambda_t^i and J_t^i' v_{k+1}   (6)
//
//   alpha_m = (2 rho - 1) / (rho + 1),  alpha_f = rho / (rho + 1),  gamma = 1/2 + alpha_f - alpha_m,
//   beta = (gamma + 1/2)^2 / 4,  rho = rho_inf the spectral radius at infinite frequency, 1 is without dissipation (7)
//
// a_0 = d_0 = M^-1 f(q_0, v_0). Contacts are those with f_c <= 0 at q* = q_k + h v_k + h^2/2 a_k, where M of (5), J_n
// and J_t are taken. Newton's method on (1), with c = (1 - alpha_f) / (1 - alpha_m), R = M d - f, F_q = f_q - (M d)_q:
//
//   S = M - h gamma c f_v - h^2 beta c F_q,   X = f_v + h/2 F_q                               (8)
//   v_free = v_{k+1} - w - h gamma c S^-1 (R + X w),   v_{k+1} = v_free + What (J_n Lambda_n + J_t Lambda_t)   (9)
//   What = (I + h gamma c S^-1 X) M^-1 = S^-1 N M^-1,   N = S + h gamma c X                  (10)
//
// so that stiff forces know of the impulses while these are solved for. Order 2 on smooth motion, 1 through impacts and
// in persistent contact, whose forces are in w.
//
// Source: Chen, Acary, Virlez, Bruls, IJNME 96 (2013) 487-511, eq. (18)-(31); (7): Chung, Hulbert, J. Appl. Mech. 60
// (1993).
// Differs from the source: 1. Newton's law and Coulomb's law (6) together, in the solver of (9); the source has no
// friction; 2. no bilateral constraints.

#include <fmt/format.h>

#include "methods/registry.h"
#include "methods/time_stepping/common/fixed_step_run.h"
#include "methods/time_stepping/common/time_stepping_method.h"

namespace ricochet {
namespace {

constexpr int kMaxNewton = 30;

struct Coefficients {  // (7)
  double alpha_m, alpha_f, gamma, beta, c;
  explicit Coefficients(double rho)
      : alpha_m((2 * rho - 1) / (rho + 1)),
        alpha_f(rho / (rho + 1)),
        gamma(0.5 + alpha_f - alpha_m),
        beta(0.25 * (gamma + 0.5) * (gamma + 0.5)),
        c((1 - alpha_f) / (1 - alpha_m)) {}
};

class GeneralizedAlpha final : public TimeSteppingMethod {
 public:
  explicit GeneralizedAlpha(const MethodSpec& spec)
      : TimeSteppingMethod(spec), rho_inf_(spec.number("rho_inf", 0.8, 0, 1)) {}

  MethodInfo info() const override {
    return {.id = id_,
            .title = fmt::format("generalised alpha, rho_inf = {}", rho_inf_),
            .source = "Chen, Acary, Virlez, Bruls, IJNME 96 (2013) 487-511",
            .order_smooth = 2,
            .order_impacts = 1,
            .is_adaptive = false,
            .is_audited = true,
            .has_restitution_of_speed = true,
            .is_allocation_free = true};
  }

  Support supports(const ProblemInfo& problem) const override {
    return problem.has_bilateral() ? Support::no("bilateral constraints are not part of this implementation")
                                   : Support::yes();
  }

 protected:
  Solution do_solve(const Problem& problem, const Settings& settings) const override;

 private:
  double rho_inf_;
};

/// The matrices of a Newton step.
struct Linearization {
  explicit Linearization(int n) : M(n, n), f_q(n, n), f_v(n, n), Md_q(n, n), S(n, n), X(n, n), N(n, n), NM(n, n) {}

  /// (8) at (q, v, d). @param M_contact  M of (5)
  void compute(const Problem& problem, const Coefficients& alpha, double h, const Vector& q, const Vector& v,
               const Vector& d) {
    problem.mass_matrix(q.data(), M.data());
    problem.force_jacobians(q.data(), v.data(), problem.info().u.data(), f_q.data(), f_v.data());
    if (!problem.info().structure.constant_mass) {
      problem.mass_derivative(q.data(), d.data(), Md_q.data());
      f_q -= Md_q;
    }
    S = M - (h * alpha.gamma * alpha.c) * f_v - (h * h * alpha.beta * alpha.c) * f_q;
    X = f_v + (0.5 * h) * f_q;
    S_inverse.compute(S);
  }
  /// (10). @param M_contact  M of (5)
  void compute_response(const Coefficients& alpha, double h, const Matrix& M_contact) {
    N = S + (h * alpha.gamma * alpha.c) * X;
    N_lu.factorize(N);
    NM = S;
    N_lu.solve_in_place(NM.data(), static_cast<int>(NM.cols()));
    N = M_contact.lazyProduct(NM);
    What.compute(N);
  }

  Matrix M, f_q, f_v, Md_q, S, X, N, NM;  // NM = N^-1 S
  BlockInverse S_inverse, What;
  SmallLu N_lu;
};

Solution GeneralizedAlpha::do_solve(const Problem& problem, const Settings& settings) const {
  const ProblemInfo& info = problem.info();
  const int n_q = info.n_q;
  FixedStepRun run(problem, settings, solver_, observer_);
  const Coefficients alpha(rho_inf_);
  const double h = run.h, h_d = h * alpha.gamma * alpha.c;
  const Vector &q = run.q, &v = run.v;
  Counters& counters = run.solution.counters;
  const bool constant_matrix = info.structure.constant_mass && info.structure.constant_force_jacobian;

  Linearization at(n_q);
  Matrix M_contact(n_q, n_q);
  Vector a(n_q), d(n_q), a_last(n_q), d_last(n_q), w(n_q), w_last(n_q), f(n_q), R(n_q), change(n_q), v_free(n_q);
  Vector q_star(n_q), q_next(n_q), shift = Vector::Zero(info.n_c());
  const auto linearize = [&](const Vector& position, const Vector& velocity) {
    at.compute(problem, alpha, h, position, velocity, d);
    ++counters.jacobian_evaluations;
    ++counters.matrix_factorizations;
  };
  {
    BlockInverse W;
    problem.mass_matrix(q.data(), M_contact.data());
    W.compute(M_contact);
    problem.force(q.data(), v.data(), info.u.data(), f.data());
    W.apply(f, d);
    a = d;
    ++counters.mass_factorizations;
    ++counters.force_evaluations;
  }
  if (constant_matrix) {
    linearize(q, v);
    at.compute_response(alpha, h, M_contact);
  }

  const auto step = [&](Vector& v_plus) {
    q_star = q + h * v + (0.5 * h * h) * a;
    run.find_active(q_star);
    const bool has_contacts = !run.active.empty();
    if (has_contacts) {
      run.contacts.set_position(q_star);
      if (!info.structure.constant_mass) problem.mass_matrix(q_star.data(), M_contact.data());
      for (const int i : run.active) shift[i] = run.rebound(i);
    }
    a_last = a;
    d_last = d;
    w.setZero();
    NewtonEnd is_end(settings.inner_tolerance, run.largest_velocity() + h * a.cwiseAbs().maxCoeff());
    for (int iteration = 0; iteration < kMaxNewton; ++iteration) {
      a = (1 / (1 - alpha.alpha_m)) *
          ((1 - alpha.alpha_f) * d + alpha.alpha_f * d_last - alpha.alpha_m * a_last);                        // (2)
      v_plus = v + (h * (1 - alpha.gamma)) * a_last + (h * alpha.gamma) * a + w;                              // (3)
      q_next = q + h * v + (h * h * (0.5 - alpha.beta)) * a_last + (h * h * alpha.beta) * a + (0.5 * h) * w;  // (4)
      if (!constant_matrix) linearize(q_next, v_plus);
      problem.force(q_next.data(), v_plus.data(), info.u.data(), f.data());
      R = -f;
      R.noalias() += at.M.lazyProduct(d);  // (1)
      ++counters.force_evaluations;
      ++counters.linear_solves;
      ++counters.inner_iterations;
      if (has_contacts) {
        if (!constant_matrix) at.compute_response(alpha, h, M_contact);
        w_last = w;
        f = R;
        f.noalias() += at.X.lazyProduct(w);
        at.S_inverse.apply(f, change);
        v_free = v_plus - w - h_d * change;  // (9)
        f = v_free;
        run.clear_impulses();
        if (!run.prepare_contacts(at.What) || !run.solve_contacts(f, shift, {})) return false;
        f -= v_free;
        w.noalias() = at.NM.lazyProduct(f);  // (5), What^-1 M^-1 = N^-1 S
        f = w - w_last;
        R.noalias() -= at.X.lazyProduct(f);
      }
      at.S_inverse.apply(R, change);
      d -= change;
      const double w_change = has_contacts ? (w - w_last).cwiseAbs().maxCoeff() : 0;
      if (is_end(h * change.cwiseAbs().maxCoeff() + w_change)) break;
      if (iteration + 1 == kMaxNewton) return run.fail("Newton's method for the accelerations did not converge");
    }
    a = (1 / (1 - alpha.alpha_m)) * ((1 - alpha.alpha_f) * d + alpha.alpha_f * d_last - alpha.alpha_m * a_last);
    v_plus = v + (h * (1 - alpha.gamma)) * a_last + (h * alpha.gamma) * a + w;
    run.q += h * v + (h * h * (0.5 - alpha.beta)) * a_last + (h * h * alpha.beta) * a + (0.5 * h) * w;
    return true;
  };
  run.impact_place = 0.5;  // (4)
  return run.take_steps(step);
}

const bool registered = register_method<GeneralizedAlpha>({
    .name = "generalized_alpha",
    .usage = std::string("generalized_alpha[,rho_inf=0.8]") + kContactSolverUsage,
    .summary = "nonsmooth generalised-alpha method, impulses by implicit Euler",
    .examples = {"generalized_alpha", "generalized_alpha,rho_inf=0.5,solver=newton,contact_tolerance=1e-13"},
});

}  // namespace
}  // namespace ricochet
