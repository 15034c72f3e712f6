// SAP: compliant contact with friction as an unconstrained convex program in the velocity of each step.
//
//   q_m = q_k + h/2 v_k,   Mhat = M(q_m) - h theta f_v - h^2 theta^2 f_q                     (1)
//   v* = v_k + Mhat^-1 (h f(q_k, v_k) + h^2 theta f_q v_k)                                   (2)
//   v_{k+1} = arg min  1/2 (v - v*)' A (v - v*) + 1/w sum_i 1/2 gamma_i' R_i gamma_i,   A = sym(Mhat)   (3)
//   gamma_i = P_i(y_i),   y_i = -R_i^-1 (c_i - (v^_i, 0)),   c_i = J_i' (w v + (1 - w) v_k)        (4)
//   v^_i = -f_c^i(q_k) / (H + tau),   R_i = diag(R_n, R_t, R_t),   R_t = sigma w_i                 (5)
//   R_n = max(beta^2 / (4 pi^2) w_i, 1 / (h k (H + tau)))                                    (6)
//   q_{k+1} = q_k + h (theta v_{k+1} + (1 - theta) v_k)                                      (7)
//
// P is the projection on the friction cone in the norm of R, w_i = trace(J_i' M^-1 J_i) per direction, J at q_m. So
// gamma_n = -h k (f_c + (H + tau) c_n) where the second part of (6) is the larger: a spring k = stiffness= with
// dissipation time tau = dissipation=, implicit. stiffness=0 is the stiffest contact that beta allows. H and w are those of
//   contact=end      H = h, w = 1: gap and slip at the end of the step, as published, whatever theta is;
//   contact=middle   H = theta h, w = theta: where (7) has them, so that theta = 1/2 is the implicit midpoint rule. For
//                    springs that a step resolves, h sqrt(k / m) < 1/2: a stiffer contact that closes gains energy.
// With r = R_t / R_n, s = 1 / (1 + mu^2 r), t = y_t / ||y_t|| the projection and -R^-1 dP/dy = -G, the slope of gamma(c), are
//
//   ||y_t|| <= mu y_n        stick: gamma = y,   G = R^-1                                    (8)
//   y_n + mu r ||y_t|| > 0   slip: gamma_n = s (y_n + mu r ||y_t||),   gamma_t = mu gamma_n t          (9)
//                            G_nn = s / R_n,   G_nt = mu s t' / R_n,
//                            G_tt = mu^2 s t t' / R_n + mu gamma_n / (||y_t|| R_t) (I - t t')
//   else                     open: gamma = 0
//
// Newton's method on (3), whose Hessian is A + w J G J', with exact line search: the zero of the slope of (3) along the
// direction. A bilateral constraint has gamma_n = y_n and the first R_n of (6). Restitution is not modelled: what a
// spring with dissipation returns depends on k, tau and the mass, and near rigidity is nothing.
//
// Order: theta = 1/2 is 2 on smooth motion and where contacts stay in equilibrium; a spring that moves is implicit Euler
// whatever theta is, order 1 (contact=middle: 2). Slip has a law of the associated kind, (9): a sliding block hovers
// mu (H + tau) ||c_t|| above where its spring would have it, order 1; and where slip meets the surface, or starts on it, the
// block lifts with mu ||c_t|| / (1 + mu^2) (equal masses), a hop that smaller steps do not change. A block that sticks creeps with R_t gamma_t.
// Source: A. Castro, F. Permenter, X. Han, An unconstrained convex formulation of compliant contact, T-RO 39 (2023),
// arXiv 2110.10107.
// Differs from the source: 1. v* by one linearly implicit step; J, M at the midpoint; 2. where sym(Mhat) is not positive
// definite, A = M; 3. contact=middle; 4. H is dense, the source's block-sparse; 5. w_i is a mean, the source's a norm.

#include <fmt/format.h>

#include <Eigen/Cholesky>
#include <limits>
#include <numbers>

#include "methods/registry.h"
#include "methods/time_stepping/common/sequential_contacts.h"

namespace ricochet {
namespace {

constexpr int kMaxNewton = 100, kMaxSearch = 60;

struct SapOptions {
  double theta, stiffness, dissipation, beta, sigma;
  bool at_middle;
};

/// One contact in (3): direction 0 is the normal.
struct SapContact {
  bool is_bilateral = false;
  int n_t = 0;
  double mu = 0, R_n = 1, R_t = 1, v_hat = 0;
  std::array<double, 3> c{}, dc{}, gamma{};  // at a = 0, for a = 1, at the last a
  std::array<std::array<double, 3>, 3> G{};  // at the last a

  enum class Mode { open, stick, slip, slip_back } mode = Mode::open, before = Mode::open;

  /// (4), (8), (9) at c + a dc.
  void project(double a) {
    const auto at = [&](int d) { return c[d] + a * dc[d]; };
    const double y_n = (v_hat - at(0)) / R_n;
    mode = Mode::open;
    gamma = {};
    G = {};
    if (is_bilateral || (n_t == 0 && y_n > 0)) {
      mode = Mode::stick;
      gamma[0] = y_n;
      G[0][0] = 1 / R_n;
    } else if (n_t > 0) {
      rub(y_n, {-at(1) / R_t, n_t == 2 ? -at(2) / R_t : 0});
    }
  }
  bool is_active() const { return mode != Mode::open; }
  /// gamma(c) is affine in this mode.
  bool is_affine() const { return mode == Mode::open || mode == Mode::stick || n_t == 1; }
  /// -gamma' dc: a part of the slope of (3) along the direction, but for 1 / w.
  double slope() const { return -(gamma[0] * dc[0] + gamma[1] * dc[1] + gamma[2] * dc[2]); }
  /// dc' G dc
  double curvature() const {
    double sum = 0;
    for (int a = 0; a <= n_t; ++a) {
      for (int b = 0; b <= n_t; ++b) sum += dc[a] * G[a][b] * dc[b];
    }
    return sum;
  }

 private:
  /// (8), (9)
  void rub(double y_n, const std::array<double, 2>& y_t) {
    const double y_r = std::hypot(y_t[0], y_t[1]), ratio = R_t / R_n;
    if (y_r <= mu * y_n) {
      mode = Mode::stick;
      gamma = {y_n, y_t[0], y_t[1]};
      G[0][0] = 1 / R_n;
      for (int d = 1; d <= n_t; ++d) G[d][d] = 1 / R_t;
    } else if (y_n + mu * ratio * y_r > 0) {
      mode = n_t == 1 && y_t[0] < 0 ? Mode::slip_back : Mode::slip;
      const double s = 1 / (1 + mu * mu * ratio), t[2]{y_t[0] / y_r, y_t[1] / y_r};
      gamma[0] = s * (y_n + mu * ratio * y_r);
      G[0][0] = s / R_n;
      const double along = mu * mu * s / R_n, across = mu * gamma[0] / (y_r * R_t);
      for (int a = 0; a < n_t; ++a) {
        gamma[1 + a] = mu * gamma[0] * t[a];
        G[0][1 + a] = G[1 + a][0] = mu * s * t[a] / R_n;
        for (int b = 0; b < n_t; ++b) G[1 + a][1 + b] = along * t[a] * t[b] + across * ((a == b ? 1 : 0) - t[a] * t[b]);
      }
    }
  }
};

/// The steps (1)-(7) of one run.
class SapRun {
 public:
  SapRun(const Problem& problem, const Settings& settings, const SapOptions& options);

  Solution take_steps();

 private:
  void linearize();
  void set_free_velocity();
  void set_contacts();
  bool minimize(Vector& v);
  void set_hessian();
  double search();

  const Problem& problem_;
  const ProblemInfo& info_;
  const SapOptions options_;
  const bool constant_matrix_;
  FixedStepRun run_;
  SequentialContacts contacts_;
  const double h_, reach_, weight_;  // H, w
  Matrix M_, f_q_, f_v_, A_, hessian_;
  BlockInverse W_;  // Mhat^-1
  Eigen::LLT<Matrix> llt_;
  Vector q_m_, f_, v_star_, change_, gradient_, dv_, A_dv_, gap_;
  std::vector<SapContact> laws_;
  double slope_ = 0, curvature_ = 0;  // of the first part of (3) along dv, at a = 0
};

SapRun::SapRun(const Problem& problem, const Settings& settings, const SapOptions& options)
    : problem_(problem),
      info_(problem.info()),
      options_(options),
      constant_matrix_(info_.structure.constant_mass && info_.structure.constant_force_jacobian),
      run_(problem, settings),
      contacts_(run_),
      h_(run_.h),
      reach_(options.at_middle ? options.theta * h_ : h_),
      weight_(options.at_middle ? options.theta : 1),
      llt_(info_.n_q),
      laws_(info_.n_c()) {
  run_.solution.residuals.clear();  // regularised, it has no law of complementarity to audit
  for (auto* matrix : {&M_, &f_q_, &f_v_, &A_, &hessian_}) matrix->setZero(info_.n_q, info_.n_q);
  for (auto* x : {&f_, &v_star_, &change_, &gradient_, &dv_, &A_dv_}) x->setZero(info_.n_q);
  gap_.setZero(info_.n_c());
  for (int i = 0; i < info_.n_c(); ++i) {
    const ContactInfo& contact = info_.contacts[i];
    laws_[i].is_bilateral = contact.is_bilateral;
    laws_[i].n_t = contact.n_t;
    laws_[i].mu = contact.mu;
  }
  q_m_ = run_.q;
  if (constant_matrix_) linearize();
}

/// (1), A of (3).
void SapRun::linearize() {
  problem_.mass_matrix(q_m_.data(), M_.data());
  problem_.force_jacobians(run_.q.data(), run_.v.data(), info_.u.data(), f_q_.data(), f_v_.data());
  hessian_ = M_ - (h_ * options_.theta) * f_v_ - (h_ * h_ * options_.theta * options_.theta) * f_q_;
  W_.compute(hessian_);
  A_ = 0.5 * (hessian_ + hessian_.transpose());
  if (info_.clock >= 0) {  // nothing pushes it
    A_.row(info_.clock).setZero();
    A_.col(info_.clock).setZero();
    A_(info_.clock, info_.clock) = 1;
  }
  llt_.compute(A_);
  if (llt_.info() != Eigen::Success) A_ = M_;
  ++run_.solution.counters.jacobian_evaluations;
  ++run_.solution.counters.matrix_factorizations;
}

/// (2)
void SapRun::set_free_velocity() {
  problem_.force(run_.q.data(), run_.v.data(), info_.u.data(), f_.data());
  gradient_ = h_ * f_;
  if (info_.structure.force_uses_position) gradient_.noalias() += (h_ * h_ * options_.theta) * f_q_.lazyProduct(run_.v);
  W_.apply(gradient_, change_);
  v_star_ = run_.v + change_;
  ++run_.solution.counters.force_evaluations;
  ++run_.solution.counters.linear_solves;
}

/// (5), (6)
void SapRun::set_contacts() {
  problem_.gap(run_.q.data(), gap_.data());
  const double rigid = options_.beta * options_.beta / (4 * std::numbers::pi * std::numbers::pi),
               lead = reach_ + options_.dissipation;
  for (const int i : contacts_.list()) {
    SapContact& law = laws_[i];
    const double mean_delassus = contacts_.mean_delassus(i);
    law.R_n = std::max(rigid * mean_delassus, std::numeric_limits<double>::min());
    if (options_.stiffness > 0 && !law.is_bilateral) law.R_n = std::max(law.R_n, 1 / (h_ * options_.stiffness * lead));
    law.R_t = std::max(options_.sigma * mean_delassus, std::numeric_limits<double>::min());
    law.v_hat = -gap_[i] / (law.is_bilateral ? reach_ : lead);
  }
}

/// A + w J G J'
void SapRun::set_hessian() {
  hessian_ = A_;
  for (const int i : contacts_.list()) {
    const SapContact& law = laws_[i];
    if (!law.is_active()) continue;
    const auto pushed = info_.contacts[i].pushed();
    for (int a = 0; a <= law.n_t; ++a) {
      const double* column_a = contacts_.directions().column(i, a);
      for (int b = 0; b <= law.n_t; ++b) {
        const double* column_b = contacts_.directions().column(i, b);
        const double factor = weight_ * law.G[a][b];
        for (std::size_t l = 0; l < pushed.size(); ++l) {
          for (std::size_t k = 0; k < pushed.size(); ++k)
            hessian_(pushed[k], pushed[l]) += factor * column_a[k] * column_b[l];
        }
      }
    }
  }
}

/// The zero of the slope of (3) along dv, to a part of what it is at 0: Newton's method between two bounds.
double SapRun::search() {
  constexpr double kTolerance = 1e-6;  // Newton's next direction takes what is left
  const auto slope_at = [&](double a, double& curvature) {
    double slope = slope_ + a * curvature_;
    curvature = curvature_;
    for (const int i : contacts_.list()) {
      laws_[i].project(a);
      slope += laws_[i].slope() / weight_;
      curvature += laws_[i].curvature() / weight_;
    }
    return slope;
  };
  const double first = gradient_.dot(dv_);
  double curvature = 0, low = 0, high = std::numeric_limits<double>::infinity(), a = 1;
  for (int k = 0; k < kMaxSearch; ++k) {
    const double slope = slope_at(a, curvature);
    if (!(std::abs(slope) > kTolerance * std::abs(first))) break;
    (slope < 0 ? low : high) = a;
    a -= slope / curvature;
    if (!(a > low && a < high)) a = std::isinf(high) ? 2 * low : 0.5 * (low + high);
  }
  return a;
}

/// Newton's method on (3), from v*. @param v  overwritten
bool SapRun::minimize(Vector& v) {
  v = v_star_;
  for (const int i : contacts_.list()) {
    SapContact& law = laws_[i];
    for (int d = 0; d <= law.n_t; ++d) {
      law.c[d] =
          weight_ * contacts_.directions().dot(i, d, v) + (1 - weight_) * contacts_.directions().dot(i, d, run_.v);
      law.dc[d] = 0;
    }
    law.project(0);
  }
  NewtonEnd is_end(run_.settings.inner_tolerance,
                   run_.largest_velocity() + v.head(info_.n_mechanical()).cwiseAbs().maxCoeff());
  for (int iteration = 0; iteration < kMaxNewton; ++iteration) {
    dv_ = v - v_star_;
    gradient_.noalias() = A_.lazyProduct(dv_);
    bool is_free = true;
    for (const int i : contacts_.list()) {
      const SapContact& law = laws_[i];
      const auto pushed = info_.contacts[i].pushed();
      is_free = is_free && !law.is_active();
      for (int d = 0; d <= law.n_t; ++d) {
        const double* column = contacts_.directions().column(i, d);
        for (const int at : pushed) gradient_[at] -= *column++ * law.gamma[d];
      }
    }
    if (is_free && iteration == 0) return true;
    set_hessian();
    llt_.compute(hessian_);
    ++run_.solution.counters.matrix_factorizations;
    ++run_.solution.counters.inner_iterations;
    if (llt_.info() != Eigen::Success) return run_.fail("the Hessian of SAP is not positive definite");
    dv_ = -gradient_;
    llt_.solveInPlace(dv_);
    A_dv_.noalias() = A_.lazyProduct(dv_);
    curvature_ = dv_.dot(A_dv_);
    slope_ = A_dv_.dot(v - v_star_);
    for (const int i : contacts_.list()) {
      SapContact& law = laws_[i];
      law.before = law.mode;
      for (int d = 0; d <= law.n_t; ++d) law.dc[d] = weight_ * contacts_.directions().dot(i, d, dv_);
    }
    const bool ends = is_end(dv_.cwiseAbs().maxCoeff());
    const double a = ends ? 1 : search();  // rounding has no slope to search along
    v += a * dv_;
    bool is_solved = a == 1;  // (3) is quadratic between v and v + dv
    for (const int i : contacts_.list()) {
      SapContact& law = laws_[i];
      for (int d = 0; d <= law.n_t; ++d) law.c[d] += a * law.dc[d];
      if (ends) law.project(0);
      is_solved = is_solved && law.mode == law.before && law.is_affine();
    }
    if (is_solved || ends) return true;
  }
  return run_.fail("Newton's method of SAP did not converge");
}

Solution SapRun::take_steps() {
  run_.impact_place = 1 - options_.theta;  // (7)
  return run_.take_steps([&](Vector& v) {
    q_m_ = run_.q + (0.5 * h_) * run_.v;
    if (!constant_matrix_) linearize();
    set_free_velocity();
    contacts_.choose(run_.q, run_.v, change_, h_ + options_.dissipation, FrictionLaw::associated);
    if (contacts_.list().empty()) {
      v = v_star_;
    } else {
      if (!contacts_.set_position(q_m_)) return false;
      set_contacts();
      if (!minimize(v)) return false;
    }
    for (const int i : contacts_.list()) {
      run_.Lambda_n[i] = laws_[i].gamma[0];
      for (int d = 0; d < laws_[i].n_t; ++d) run_.Lambda_t[info_.contacts[i].tangent_index + d] = laws_[i].gamma[1 + d];
    }
    run_.q += (h_ * options_.theta) * v + (h_ * (1 - options_.theta)) * run_.v;  // (7)
    return v.allFinite() || run_.fail("the velocity is not finite");
  });
}

class Sap final : public Method {
 public:
  explicit Sap(const MethodSpec& spec)
      : id_(spec.text()),
        options_{.theta = spec.number("theta", 1, 0.5, 1),
                 .stiffness = spec.number("stiffness", 0, 0, 1e300),
                 .dissipation = spec.number("dissipation", 0, 0, 1e300),
                 .beta = spec.number("beta", 1, 0, 1e6),
                 .sigma = spec.number("sigma", 1e-3, 1e-12, 1e6),
                 .at_middle = spec.choice("contact", {"end", "middle"}) == "middle"} {}

  MethodInfo info() const override {
    return {.id = id_,
            .title = fmt::format("SAP, theta = {}{}", options_.theta,
                                 options_.stiffness > 0 ? fmt::format(", k = {:g} N/m", options_.stiffness) : ""),
            .source = "Castro, Permenter, Han, T-RO 39 (2023), arXiv 2110.10107",
            .order_smooth = options_.theta == 0.5 ? 2.0 : 1.0,
            .order_impacts = options_.stiffness > 0 ? 0.0 : 1.0,
            .is_adaptive = false,
            .is_allocation_free = true};
  }

  Support supports(const ProblemInfo& problem) const override {
    for (const auto& contact : problem.contacts) {
      if (contact.eps_r > 0) return Support::no("restitution is not modelled, eps_r = 0 is required in every contact");
    }
    if (problem.n_friction_elements > 0)
      return Support::no("a contact that slips is lifted, and a friction element would lose its normal force");
    return Support::yes();
  }

 protected:
  Solution do_solve(const Problem& problem, const Settings& settings) const override {
    return SapRun(problem, settings, options_).take_steps();
  }

 private:
  const std::string id_;
  const SapOptions options_;
};

const bool registered = register_method<Sap>({
    .name = "sap",
    .usage = "sap[,theta=1][,stiffness=0][,dissipation=0][,contact=end|middle][,beta=1][,sigma=1e-3]",
    .summary = "SAP: compliant contact as a convex program in each step, inelastic",
    .examples = {"sap", "sap,theta=0.5", "sap,theta=0.5,stiffness=1e5,dissipation=0.01"},
});

}  // namespace
}  // namespace ricochet
