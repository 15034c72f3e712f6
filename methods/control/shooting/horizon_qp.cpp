#include "methods/control/shooting/horizon_qp.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <limits>
#include <string>

#include "problems/input_error.h"

namespace ricochet {

namespace {

constexpr double kUnbounded = std::numeric_limits<double>::infinity();
/// Proximal term of the controls, relative to the largest entry of all H: a direction without curvature has a pivot.
constexpr double kProximal = 1e-12;
/// A matrix of (11) that is not positive definite with this, relative to its largest entry, is so by more than rounding.
constexpr double kIndefinite = 1e-6;
/// 1/W of (9) is at least this, relative to |C_i|^2 / the largest entry of all H. A row that holds a combination of controls
/// adds W to their matrix of (11), which must not lose the digits of the others. The next step corrects the error of the
/// row, this times dy.
constexpr double kCompliance = 1e-10;
/// Rounding of a sum relative to the largest of its terms.
constexpr double kRounding = 1e-14;
/// A multiplier this large, relative to 1 + the largest |g|, of a hard row that is violated: it has no bound.
constexpr double kDivergence = 1e9;
/// Steps end short of the boundary by this part of the way.
constexpr double kBoundary = 0.005;

double largest(const auto& v) {
  return v.size() == 0 ? 0 : v.template lpNorm<Eigen::Infinity>();
}

void require_size(const char* name, std::size_t stage, const auto& matrix, Eigen::Index rows, Eigen::Index columns) {
  if (matrix.rows() == rows && matrix.cols() == columns) return;
  throw InputError(fmt::format("{} of stage {}", name, stage), fmt::format("{} x {}", matrix.rows(), matrix.cols()),
                   fmt::format("{} x {} is required", rows, columns));
}

void require_weights(const char* name, std::size_t stage, const Vector& weights, bool may_be_infinite) {
  for (const double weight : weights)
    if (weight <= 0 || (weight == kUnbounded && !may_be_infinite))
      throw InputError(fmt::format("{} of stage {}", name, stage), weight,
                       may_be_infinite ? "a number > 0, or infinity, is required" : "a finite number > 0 is required");
}

void require_bounds(const char* name, std::size_t stage, double lower, double upper) {
  if (lower > upper || lower == kUnbounded || upper == -kUnbounded)
    throw InputError(fmt::format("{} of stage {}", name, stage), fmt::format("[{}, {}]", lower, upper),
                     "a lower bound <= the upper one is required");
}

void check(const HorizonQp& qp, const HorizonQpOptions& options) {
  const Eigen::Index n = qp.dx_0.size();
  const std::size_t N = qp.stages.size();
  if (N == 0) throw InputError("stages", N, "at least one is required");
  for (std::size_t k = 0; k < N; ++k) {
    const HorizonStage& stage = qp.stages[k];
    const Eigen::Index n_u = stage.B.cols(), m = stage.d.size();
    require_size("A", k, stage.A, n, n);
    require_size("B", k, stage.B, n, n_u);
    require_size("c", k, stage.c, n, 1);
    require_size("H", k, stage.H, n + n_u, n + n_u);
    require_size("g", k, stage.g, n + n_u, 1);
    require_size("C", k, stage.C, m, n + n_u);
    require_size("weight", k, stage.weight, m, 1);
    require_size("lower", k, stage.lower, n_u, 1);
    require_size("upper", k, stage.upper, n_u, 1);
    require_weights("weight", k, stage.weight, true);
    for (Eigen::Index i = 0; i < n_u; ++i) require_bounds("bounds of du", k, stage.lower[i], stage.upper[i]);
  }
  const Eigen::Index m = qp.end.d.size(), p = qp.end.r.size();
  require_size("H", N, qp.end.H, n, n);
  require_size("g", N, qp.end.g, n, 1);
  require_size("C", N, qp.end.C, m, n);
  require_size("weight", N, qp.end.weight, m, 1);
  require_size("E", N, qp.end.E, p, n);
  require_size("E_weight", N, qp.end.E_weight, p, 1);
  require_weights("weight", N, qp.end.weight, true);
  require_weights("E_weight", N, qp.end.E_weight, false);
  for (std::size_t j = 0; j < qp.free.size(); ++j) {
    const FreeInitialComponent& component = qp.free[j];
    if (component.index < 0 || component.index >= n)
      throw InputError("free component of dx_0", component.index, fmt::format("0 to {} is required", n - 1));
    require_bounds("bounds of dx_0", 0, component.lower, component.upper);
    for (std::size_t i = 0; i < j; ++i)
      if (qp.free[i].index == component.index)
        throw InputError("free component of dx_0", component.index, "it is listed twice");
  }
  if (!(options.tolerance > 0 && options.tolerance < 1))
    throw InputError("tolerance", options.tolerance, "a number between 0 and 1 is required");
  if (options.max_iterations < 1)
    throw InputError("max_iterations", options.max_iterations, "a number >= 1 is required");
}

bool is_finite(const HorizonQp& qp) {
  const auto no_nan = [](const Vector& v) { return !v.hasNaN(); };
  for (const HorizonStage& stage : qp.stages)
    if (!stage.A.allFinite() || !stage.B.allFinite() || !stage.c.allFinite() || !stage.H.allFinite() ||
        !stage.g.allFinite() || !stage.C.allFinite() || !stage.d.allFinite() || !no_nan(stage.weight) ||
        !no_nan(stage.lower) || !no_nan(stage.upper))
      return false;
  const HorizonEnd& end = qp.end;
  if (!end.H.allFinite() || !end.g.allFinite() || !end.C.allFinite() || !end.d.allFinite() || !no_nan(end.weight) ||
      !end.E.allFinite() || !end.r.allFinite() || !no_nan(end.E_weight))
    return false;
  for (const FreeInitialComponent& component : qp.free)
    if (std::isnan(component.lower) || std::isnan(component.upper)) return false;
  for (int i = 0; i < qp.n_x(); ++i)
    if (!std::isfinite(qp.dx_0[i]) && std::ranges::find(qp.free, i, &FreeInitialComponent::index) == qp.free.end())
      return false;
  return true;
}

/// Equal up to rounding: no number is well inside of them.
bool is_fixed(double lower, double upper) {
  const double width = upper - lower;
  return width < kUnbounded && width <= 1e-14 * std::max(std::abs(lower), std::abs(upper));
}

/// The nearest to `value` that is inside of both bounds by a tenth of their distance, or by 1.
double inner_value(double value, double lower, double upper) {
  if (is_fixed(lower, upper)) return lower;
  const double margin = std::min(1.0, 0.1 * (upper - lower));
  return std::clamp(value, lower + margin, upper - margin);
}

}  // namespace

/// Each row of (3), of E, and each bound has a value v(z) and costs w s + u t, where
///
///   v = t - s,   t, s >= 0.                                                                                  (7)
///
/// Inequalities have u = 0 and w = weight; hard ones and bounds have s = 0; rows of E have u = w = E_weight. With the
/// multiplier y in [-u, w], a = y + u and b = w - y, the central path is
///
///   t a = mu,   s b = mu.                                                                                    (8)
///
/// A Newton step towards t a = t a + c_t, s b = s b + c_s gives with (7)
///
///   dy = W (e - dv),   W = 1 / (t/a + s/b),   e = c_t/a - c_s/b - (v - t + s).                               (9)
///
/// With (9), the step of z minimises over the dynamics with the residuals rho_k = A dx_k + B du_k + c - dx_k+1
///
///   sum 1/2 dz' (H + C' W C) dz + (H z + g - C' (y + W e))' dz.                                             (10)
///
/// Backwards from P_N, p_N of the end, with Q = H + C' W C and the gradient h of (10), each stage has
///
///   K = -(Q_uu + B' P B)^-1 (Q_ux + B' P A),   k = -(Q_uu + B' P B)^-1 (h_u + B' (p + P rho)),              (11)
///   P_k = (1 K)' Q (1 K) + (A + B K)' P (A + B K),   p_k = h_x + K' h_u + (A + B K)' (p + P rho).           (12)
///
/// This form of P keeps its digits where W is large: the error of K enters squared.
class HorizonQpSolver::Workspace {
 public:
  const HorizonQpSolution& solve(const HorizonQp& qp, const HorizonQpOptions& options);

 private:
  struct Stage {
    int rows = 0;                // the first of its rows: those of C, then lower bounds, then upper bounds
    int m = 0, n_u = 0;          // rows of C
    std::vector<char> is_fixed;  // du: equal bounds
    Vector z, rho, Hz_g;         // of the iterate
    Vector h, q, k, dx, du, dz;  // of the step; q = p + P rho
    Vector diagonal;             // of Q_uu: bounds and the proximal term
    Matrix WC, PA, PB, M_uu, M_ux;
    Matrix HK, CK, WCK, AK, PAK;  // H (1 K), C (1 K), W C (1 K), A + B K, P (A + B K)
    Eigen::LLT<Matrix> factors;   // of Q_uu + B' P B
  };

  void resize();
  void set_row(int i, double w, double u, double squared_norm);
  double set_rows();
  double largest_slope();
  void start();
  void evaluate();
  void find_scales();
  bool is_converged() const;
  bool is_diverging() const;
  void find_weights();
  void factorise(bool with_bounds);
  void factorise_stage(std::size_t k, bool with_bounds);
  double factorise_positive(Matrix& M, Eigen::LLT<Matrix>& factors);
  void aim(double mu, double second_order);
  void sweep();
  bool is_step_finite() const;
  double mu(double length) const;
  double longest_step() const;
  void take_step(double length);
  const HorizonQpSolution& finish(QpStatus status, const char* message);

  bool is_row(int i) const { return w_[i] > 0; }
  bool is_soft(int i) const { return w_[i] < kUnbounded; }
  auto C_rows(const Stage& stage, const Vector& of) const { return of.segment(stage.rows, stage.m); }
  auto lower_rows(const Stage& stage, const Vector& of) const { return of.segment(stage.rows + stage.m, stage.n_u); }
  auto upper_rows(const Stage& stage, const Vector& of) const {
    return of.segment(stage.rows + stage.m + stage.n_u, stage.n_u);
  }

  const HorizonQp* qp_ = nullptr;
  HorizonQpOptions options_;
  HorizonQpSolution solution_;
  std::size_t N_ = 0;
  int n_ = 0;
  std::vector<Stage> stages_;
  bool is_convex_ = true;                                        // so far
  int end_rows_ = 0, free_rows_ = 0, n_rows_ = 0, n_pairs_ = 0;  // first rows of the end and of the free components
  Vector w_, u_, compliance_;                                    // w = 0: no row, an infinite or an equal bound
  Vector v_, t_, s_, a_, b_, y_;                                 // iterate
  Vector W_, c_t_, c_s_, e_, dv_, dy_, dt_, ds_;                 // step
  std::vector<Matrix> P_;
  std::vector<Vector> p_, dlambda_;
  Vector end_gradient_, end_dx_, work_;
  Matrix WC_end_, WE_end_, P_free_;
  Vector p_free_;
  Eigen::LLT<Matrix> free_factors_;
  double row_scale_ = 1, gradient_scale_ = 1, curvature_scale_ = 1;
  double largest_product_ = 0;     // of (8), beyond the rounding of the rows
  double largest_multiplier_ = 0;  // of rows and dynamics
};

const HorizonQpSolution& HorizonQpSolver::Workspace::solve(const HorizonQp& qp, const HorizonQpOptions& options) {
  qp_ = &qp;
  options_ = options;
  resize();
  if (!is_finite(qp)) return finish(QpStatus::non_finite, "a term of the program is not a finite number");
  start();
  for (;;) {
    evaluate();
    if (is_converged()) return finish(QpStatus::solved, "");
    if (solution_.iterations == options.max_iterations)
      return finish(QpStatus::iteration_limit, "the iteration limit is reached");
    if (options.is_interrupted && options.is_interrupted()) return finish(QpStatus::interrupted, "interrupted");
    if (is_diverging())
      return finish(QpStatus::infeasible, "hard inequalities contradict each other: their multipliers have no bound");
    ++solution_.iterations;
    find_weights();
    factorise(true);
    if (!is_convex_) return finish(QpStatus::not_convex, "a matrix H is not positive semidefinite");
    const double now = mu(0);
    aim(0, 0);
    sweep();
    if (n_pairs_ > 0) {
      const double length = std::min(1.0, longest_step());
      aim(now * std::pow(mu(length) / now, 3), length * length);
      sweep();
    }
    if (!is_step_finite()) return finish(QpStatus::non_finite, "a step is not a finite number");
    take_step(std::min(1.0, (1 - kBoundary) * longest_step()));
  }
}

void HorizonQpSolver::Workspace::resize() {
  const HorizonQp& qp = *qp_;
  n_ = qp.n_x();
  N_ = qp.stages.size();
  stages_.resize(N_);
  HorizonQpSolution& out = solution_;
  for (auto* list : {&out.dx, &out.lambda, &p_, &dlambda_}) {
    list->resize(N_ + 1);
    for (Vector& v : *list) v.setZero(n_);
  }
  P_.resize(N_ + 1);
  for (auto* list : {&out.du, &out.y_lower, &out.y_upper}) list->resize(N_);
  for (auto* list : {&out.y, &out.slack}) list->resize(N_ + 1);
  out.K.resize(N_);

  n_rows_ = 0;
  for (std::size_t k = 0; k < N_; ++k) {
    Stage& stage = stages_[k];
    const HorizonStage& terms = qp.stages[k];
    stage.rows = n_rows_;
    stage.m = static_cast<int>(terms.d.size());
    stage.n_u = static_cast<int>(terms.B.cols());
    n_rows_ += stage.m + 2 * stage.n_u;
    stage.is_fixed.resize(stage.n_u);
    for (auto* list : {&out.y, &out.slack}) (*list)[k].setZero(stage.m);
    for (auto* list : {&out.du, &out.y_lower, &out.y_upper}) (*list)[k].setZero(stage.n_u);
    out.K[k].setZero(stage.n_u, n_);
  }
  end_rows_ = n_rows_;
  n_rows_ += static_cast<int>(qp.end.d.size() + qp.end.r.size());
  free_rows_ = n_rows_;
  n_rows_ += 2 * static_cast<int>(qp.free.size());
  for (auto* list : {&out.y, &out.slack}) (*list)[N_].setZero(qp.end.d.size());
  out.y_E.setZero(qp.end.r.size());
  for (Vector* v : {&out.y_free_lower, &out.y_free_upper}) v->setZero(qp.free.size());
  p_free_.resize(qp.free.size());
  for (Vector* v :
       {&w_, &u_, &compliance_, &v_, &t_, &s_, &a_, &b_, &y_, &W_, &c_t_, &c_s_, &e_, &dv_, &dy_, &dt_, &ds_})
    v->setZero(n_rows_);
  out.iterations = out.factorisations = 0;
  out.cost = out.penalty = 0;
  out.residuals = {};
  is_convex_ = true;
}

void HorizonQpSolver::Workspace::set_row(int i, double w, double u, double squared_norm) {
  w_[i] = w;
  u_[i] = u;
  compliance_[i] = kCompliance * squared_norm / curvature_scale_;
  n_pairs_ += w < kUnbounded ? 2 : 1;
}

/// Rows of all inequalities, equalities and bounds. @return mean width of the bounds, each at most 1
double HorizonQpSolver::Workspace::set_rows() {
  const HorizonQp& qp = *qp_;
  n_pairs_ = 0;
  double width = 0;
  int n_widths = 0;
  const auto add_bounds = [&](int lower_row, int upper_row, double lower, double upper) {
    if (is_fixed(lower, upper)) return;
    if (lower > -kUnbounded) set_row(lower_row, kUnbounded, 0, 0);
    if (upper < kUnbounded) set_row(upper_row, kUnbounded, 0, 0);
    width += std::min(1.0, upper - lower);
    ++n_widths;
  };
  for (std::size_t k = 0; k < N_; ++k) {
    Stage& stage = stages_[k];
    const HorizonStage& terms = qp.stages[k];
    for (int i = 0; i < stage.m; ++i) set_row(stage.rows + i, terms.weight[i], 0, terms.C.row(i).squaredNorm());
    for (int i = 0, row = stage.rows + stage.m; i < stage.n_u; ++i, ++row) {
      stage.is_fixed[i] = is_fixed(terms.lower[i], terms.upper[i]);
      add_bounds(row, row + stage.n_u, terms.lower[i], terms.upper[i]);
    }
  }
  const int m = static_cast<int>(qp.end.d.size()), p = static_cast<int>(qp.end.r.size());
  for (int i = 0; i < m; ++i) set_row(end_rows_ + i, qp.end.weight[i], 0, qp.end.C.row(i).squaredNorm());
  for (int i = 0; i < p; ++i)
    set_row(end_rows_ + m + i, qp.end.E_weight[i], qp.end.E_weight[i], qp.end.E.row(i).squaredNorm());
  const int n_free = static_cast<int>(qp.free.size());
  for (int j = 0; j < n_free; ++j)
    add_bounds(free_rows_ + j, free_rows_ + n_free + j, qp.free[j].lower, qp.free[j].upper);
  return n_widths > 0 ? width / n_widths : 1;
}

/// The first iterate fulfils (2), (4) and (5): the optimal feedback of the cost alone, with controls and free components
/// held inside of their bounds. Every row then starts at (8) with the same mu.
void HorizonQpSolver::Workspace::start() {
  const HorizonQp& qp = *qp_;
  solution_.dx[0] = qp.dx_0;
  for (const FreeInitialComponent& component : qp.free)
    solution_.dx[0][component.index] = inner_value(0, component.lower, component.upper);
  for (std::size_t k = 0; k < N_; ++k)
    for (int i = 0; i < stages_[k].n_u; ++i)
      solution_.du[k][i] = inner_value(0, qp.stages[k].lower[i], qp.stages[k].upper[i]);
  find_scales();
  const double width = set_rows();
  evaluate();
  a_.setOnes();
  b_.setOnes();
  factorise(true);  // W = 0
  sweep();
  for (std::size_t k = 0; k <= N_; ++k) solution_.lambda[k] += dlambda_[k];
  for (const FreeInitialComponent& component : qp.free) {
    double& value = solution_.dx[0][component.index];
    value = inner_value(value + stages_[0].dz[component.index], component.lower, component.upper);
  }
  for (std::size_t k = 0; k < N_; ++k) {
    Stage& stage = stages_[k];
    const HorizonStage& terms = qp.stages[k];
    Vector &u = solution_.du[k], &x = solution_.dx[k], &next = solution_.dx[k + 1];
    u += stage.k;
    work_ = x - stage.z.head(n_);
    u.noalias() += solution_.K[k] * work_;
    for (int i = 0; i < stage.n_u; ++i) u[i] = inner_value(u[i], terms.lower[i], terms.upper[i]);
    next = terms.c;
    next.noalias() += terms.A * x;
    next.noalias() += terms.B * u;
  }
  evaluate();

  const double mu = std::max(1.0, largest_slope()) * width;
  for (int i = 0; i < n_rows_; ++i) {
    if (!is_row(i)) continue;
    if (is_soft(i)) {  // t a = s b = mu with t - s = v and a + b = q
      const double q = w_[i] + u_[i], v = v_[i], root = std::hypot(v * q, 2 * mu);
      a_[i] = 2 * mu * q / (v * q + 2 * mu + root);
      b_[i] = 2 * mu * q / (-v * q + 2 * mu + root);
      s_[i] = mu / b_[i];
    } else {
      a_[i] = mu / (v_[i] > 0 ? v_[i] : 1);
    }
    t_[i] = mu / a_[i];
    y_[i] = a_[i] - u_[i];
  }
}

/// Largest derivative of (1) by a control, at the iterate.
double HorizonQpSolver::Workspace::largest_slope() {
  const HorizonQp& qp = *qp_;
  for (int i = 0; i < n_rows_; ++i) y_[i] = is_row(i) && is_soft(i) ? (v_[i] < 0 ? w_[i] : -u_[i]) : 0;
  p_[N_] = end_gradient_;
  p_[N_].noalias() -= qp.end.C.transpose() * y_.segment(end_rows_, qp.end.d.size());
  p_[N_].noalias() -= qp.end.E.transpose() * y_.segment(end_rows_ + qp.end.d.size(), qp.end.r.size());
  double slope = 0;
  for (std::size_t k = N_; k-- > 0;) {
    Stage& stage = stages_[k];
    const HorizonStage& terms = qp.stages[k];
    stage.h = stage.Hz_g;
    stage.h.noalias() -= terms.C.transpose() * C_rows(stage, y_);
    stage.h.tail(stage.n_u).noalias() += terms.B.transpose() * p_[k + 1];
    p_[k] = stage.h.head(n_);
    p_[k].noalias() += terms.A.transpose() * p_[k + 1];
    slope = std::max(slope, largest(stage.h.tail(stage.n_u)));
  }
  return slope;
}

void HorizonQpSolver::Workspace::find_scales() {
  const HorizonQp& qp = *qp_;
  double rows = std::max(largest(qp.end.d), largest(qp.end.r)), slope = largest(qp.end.g);
  double curvature = largest(qp.end.H.diagonal());
  for (int i = 0; i < n_; ++i) rows = std::max(rows, std::abs(solution_.dx[0][i]));
  for (const HorizonStage& stage : qp.stages) {
    rows = std::max({rows, largest(stage.c), largest(stage.d)});
    slope = std::max(slope, largest(stage.g));
    curvature = std::max(curvature, largest(stage.H.diagonal()));
  }
  row_scale_ = 1 + rows;
  gradient_scale_ = 1 + slope;
  curvature_scale_ = curvature > 0 ? curvature : 1;
}

/// Values of the rows, cost and residuals at the iterate.
void HorizonQpSolver::Workspace::evaluate() {
  const HorizonQp& qp = *qp_;
  HorizonQpSolution& out = solution_;
  out.residuals = {};
  out.cost = out.penalty = largest_product_ = 0;
  largest_multiplier_ = largest(y_);
  for (const Vector& lambda : out.lambda) largest_multiplier_ = std::max(largest_multiplier_, largest(lambda));
  QpResiduals& residuals = out.residuals;
  for (std::size_t k = 0; k < N_; ++k) {
    Stage& stage = stages_[k];
    const HorizonStage& terms = qp.stages[k];
    stage.z.resize(n_ + stage.n_u);
    stage.z << out.dx[k], out.du[k];
    stage.rho = terms.c - out.dx[k + 1];
    stage.rho.noalias() += terms.A * out.dx[k];
    stage.rho.noalias() += terms.B * out.du[k];
    residuals.dynamics = std::max(residuals.dynamics, largest(stage.rho));
    stage.Hz_g.noalias() = terms.H * stage.z;
    out.cost += 0.5 * stage.z.dot(stage.Hz_g) + terms.g.dot(stage.z);
    stage.Hz_g += terms.g;
    auto C_values = v_.segment(stage.rows, stage.m);
    C_values = terms.d;
    C_values.noalias() += terms.C * stage.z;
    for (int i = 0, row = stage.rows + stage.m; i < stage.n_u; ++i, ++row) {
      if (is_row(row)) v_[row] = out.du[k][i] - terms.lower[i];
      if (is_row(row + stage.n_u)) v_[row + stage.n_u] = terms.upper[i] - out.du[k][i];
    }
    // Derivatives of (6) by z_k.
    stage.h = stage.Hz_g;
    stage.h.head(n_).noalias() += terms.A.transpose() * out.lambda[k + 1];
    stage.h.tail(stage.n_u).noalias() += terms.B.transpose() * out.lambda[k + 1];
    stage.h.head(n_) -= out.lambda[k];
    stage.h.noalias() -= terms.C.transpose() * C_rows(stage, y_);
    stage.h.tail(stage.n_u) += upper_rows(stage, y_) - lower_rows(stage, y_);
    for (int i = 0; i < stage.n_u; ++i)
      if (stage.is_fixed[i]) stage.h[n_ + i] = 0;  // the multipliers of these bounds are what makes it zero
    residuals.stationarity = std::max(residuals.stationarity, largest(stage.h));
  }
  const Vector& x = out.dx[N_];
  const Eigen::Index m = qp.end.d.size(), p = qp.end.r.size();
  end_gradient_.noalias() = qp.end.H * x;
  out.cost += 0.5 * x.dot(end_gradient_) + qp.end.g.dot(x);
  end_gradient_ += qp.end.g;
  v_.segment(end_rows_, m) = qp.end.d;
  v_.segment(end_rows_, m).noalias() += qp.end.C * x;
  v_.segment(end_rows_ + m, p) = qp.end.r;
  v_.segment(end_rows_ + m, p).noalias() += qp.end.E * x;
  work_ = end_gradient_ - out.lambda[N_];
  work_.noalias() -= qp.end.C.transpose() * y_.segment(end_rows_, m);
  work_.noalias() -= qp.end.E.transpose() * y_.segment(end_rows_ + m, p);
  residuals.stationarity = std::max(residuals.stationarity, largest(work_));
  for (int j = 0, row = free_rows_, n_free = static_cast<int>(qp.free.size()); j < n_free; ++j, ++row) {
    const FreeInitialComponent& component = qp.free[j];
    const double value = out.dx[0][component.index];
    if (is_row(row)) v_[row] = value - component.lower;
    if (is_row(row + n_free)) v_[row + n_free] = component.upper - value;
    if (is_fixed(component.lower, component.upper)) continue;
    const double slope = out.lambda[0][component.index] - y_[row] + y_[row + n_free];
    residuals.stationarity = std::max(residuals.stationarity, std::abs(slope));
  }
  // Each row with the best t and s for its value.
  for (int i = 0; i < n_rows_; ++i) {
    if (!is_row(i)) continue;
    const double t = std::max(0.0, v_[i]), s = std::max(0.0, -v_[i]);
    double product = t * a_[i], excess = (t - kRounding * row_scale_) * a_[i];
    if (is_soft(i)) {
      product = std::max(product, s * b_[i]);
      excess = std::max(excess, (s - kRounding * row_scale_) * b_[i]);
      out.penalty += w_[i] * s + u_[i] * t;
    } else {
      residuals.inequalities = std::max(residuals.inequalities, s);
    }
    residuals.complementarity = std::max(residuals.complementarity, product);
    largest_product_ = std::max(largest_product_, excess);
  }
}

bool HorizonQpSolver::Workspace::is_converged() const {
  const QpResiduals& residuals = solution_.residuals;
  const double tolerance = options_.tolerance;
  return residuals.dynamics <= tolerance * row_scale_ && residuals.inequalities <= tolerance * row_scale_ &&
         residuals.stationarity <= tolerance * gradient_scale_ + kRounding * largest_multiplier_ &&
         largest_product_ <= tolerance * (1 + std::abs(solution_.cost));
}

bool HorizonQpSolver::Workspace::is_diverging() const {
  for (int i = 0; i < n_rows_; ++i)
    if (is_row(i) && !is_soft(i) && v_[i] < -options_.tolerance * row_scale_ && y_[i] > kDivergence * gradient_scale_)
      return true;
  return false;
}

/// W of (9).
void HorizonQpSolver::Workspace::find_weights() {
  for (int i = 0; i < n_rows_; ++i)
    if (is_row(i)) W_[i] = 1 / (t_[i] / a_[i] + (is_soft(i) ? s_[i] / b_[i] : 0) + compliance_[i]);
}

/// P and K of all stages, from the end.
/// @param with_bounds  false: gains as if there were none
void HorizonQpSolver::Workspace::factorise(bool with_bounds) {
  const HorizonQp& qp = *qp_;
  const Eigen::Index m = qp.end.d.size(), p = qp.end.r.size();
  P_[N_] = qp.end.H;
  WC_end_ = W_.segment(end_rows_, m).asDiagonal() * qp.end.C;
  WE_end_ = W_.segment(end_rows_ + m, p).asDiagonal() * qp.end.E;
  P_[N_].noalias() += qp.end.C.transpose() * WC_end_;
  P_[N_].noalias() += qp.end.E.transpose() * WE_end_;
  for (std::size_t k = N_; k-- > 0;) factorise_stage(k, with_bounds);

  const int n_free = static_cast<int>(qp.free.size());
  P_free_.resize(n_free, n_free);
  for (int i = 0; i < n_free; ++i) {
    for (int j = 0; j < n_free; ++j) P_free_(i, j) = P_[0](qp.free[i].index, qp.free[j].index);
    P_free_(i, i) += W_[free_rows_ + i] + W_[free_rows_ + n_free + i];
  }
  for (int i = 0; i < n_free; ++i) {
    if (!is_fixed(qp.free[i].lower, qp.free[i].upper)) continue;
    P_free_.row(i).setZero();
    P_free_.col(i).setZero();
    P_free_(i, i) = 1;
  }
  factorise_positive(P_free_, free_factors_);
}

/// Factors of M with the proximal term, which grows where rounding requires it. @return the term
double HorizonQpSolver::Workspace::factorise_positive(Matrix& M, Eigen::LLT<Matrix>& factors) {
  const double limit = std::max(kProximal * curvature_scale_, kIndefinite * largest(M.diagonal()));
  for (double added = 0, total = kProximal * curvature_scale_;; total *= 100) {
    M.diagonal().array() += total - added;
    added = total;
    factors.compute(M);
    if (M.size() > 0) ++solution_.factorisations;
    if (factors.info() == Eigen::Success || !M.allFinite()) return total;
    if (total < limit) continue;
    is_convex_ = false;
    return total;
  }
}

/// (11) and (12).
void HorizonQpSolver::Workspace::factorise_stage(std::size_t k, bool with_bounds) {
  Stage& stage = stages_[k];
  const HorizonStage& terms = qp_->stages[k];
  const int n_u = stage.n_u;
  const Matrix& P = P_[k + 1];
  stage.WC = C_rows(stage, W_).asDiagonal() * terms.C;
  stage.PA.noalias() = P * terms.A;
  stage.PB.noalias() = P * terms.B;
  stage.M_uu = terms.H.bottomRightCorner(n_u, n_u);
  stage.M_uu.noalias() += terms.C.rightCols(n_u).transpose() * stage.WC.rightCols(n_u);
  stage.M_uu.noalias() += terms.B.transpose() * stage.PB;
  stage.M_ux = terms.H.bottomLeftCorner(n_u, n_);
  stage.M_ux.noalias() += terms.C.rightCols(n_u).transpose() * stage.WC.leftCols(n_);
  stage.M_ux.noalias() += terms.B.transpose() * stage.PA;
  stage.diagonal.setZero(n_u);
  if (with_bounds) {
    stage.diagonal = lower_rows(stage, W_) + upper_rows(stage, W_);
    stage.M_uu.diagonal() += stage.diagonal;
    for (int i = 0; i < n_u; ++i) {
      if (!stage.is_fixed[i]) continue;
      stage.M_uu.row(i).setZero();
      stage.M_uu.col(i).setZero();
      stage.M_uu(i, i) = 1;
      stage.M_ux.row(i).setZero();
    }
  }
  stage.diagonal.array() += factorise_positive(stage.M_uu, stage.factors);

  Matrix& K = solution_.K[k];
  K = -stage.M_ux;
  stage.factors.solveInPlace(K);

  stage.HK = terms.H.leftCols(n_);
  stage.HK.noalias() += terms.H.rightCols(n_u) * K;
  stage.CK = terms.C.leftCols(n_);
  stage.CK.noalias() += terms.C.rightCols(n_u) * K;
  stage.WCK = C_rows(stage, W_).asDiagonal() * stage.CK;
  stage.AK = terms.A;
  stage.AK.noalias() += terms.B * K;
  stage.PAK.noalias() = P * stage.AK;
  Matrix& result = P_[k];
  result = stage.HK.topRows(n_);
  result.noalias() += K.transpose() * stage.HK.bottomRows(n_u);
  result.noalias() += stage.CK.transpose() * stage.WCK;
  result.noalias() += stage.AK.transpose() * stage.PAK;
  stage.M_ux = stage.diagonal.asDiagonal() * K;
  result.noalias() += K.transpose() * stage.M_ux;
  for (int j = 0; j < n_; ++j)
    for (int i = 0; i < j; ++i) result(i, j) = result(j, i) = 0.5 * (result(i, j) + result(j, i));
}

/// Right-hand sides of (8) with mu, and e of (9). @param second_order  part of the products of the last step's changes
void HorizonQpSolver::Workspace::aim(double mu, double second_order) {
  for (int i = 0; i < n_rows_; ++i) {
    if (!is_row(i)) continue;
    c_t_[i] = mu - t_[i] * a_[i] - second_order * dt_[i] * dy_[i];
    e_[i] = c_t_[i] / a_[i] - (v_[i] - t_[i]);
    if (!is_soft(i)) continue;
    c_s_[i] = mu - s_[i] * b_[i] + second_order * ds_[i] * dy_[i];
    e_[i] -= c_s_[i] / b_[i] + s_[i];
  }
}

/// The step of all unknowns by (10) to (12) and (9).
void HorizonQpSolver::Workspace::sweep() {
  const HorizonQp& qp = *qp_;
  const Eigen::Index m = qp.end.d.size(), p = qp.end.r.size();
  for (int i = 0; i < n_rows_; ++i) dy_[i] = is_row(i) ? y_[i] + W_[i] * e_[i] : 0;  // at dv = 0
  p_[N_] = end_gradient_;
  p_[N_].noalias() -= qp.end.C.transpose() * dy_.segment(end_rows_, m);
  p_[N_].noalias() -= qp.end.E.transpose() * dy_.segment(end_rows_ + m, p);
  for (std::size_t k = N_; k-- > 0;) {
    Stage& stage = stages_[k];
    const HorizonStage& terms = qp.stages[k];
    stage.h = stage.Hz_g;
    stage.h.noalias() -= terms.C.transpose() * C_rows(stage, dy_);
    stage.h.tail(stage.n_u) += upper_rows(stage, dy_) - lower_rows(stage, dy_);
    stage.q = p_[k + 1];
    stage.q.noalias() += P_[k + 1] * stage.rho;
    stage.k = -stage.h.tail(stage.n_u);
    stage.k.noalias() -= terms.B.transpose() * stage.q;
    for (int i = 0; i < stage.n_u; ++i)
      if (stage.is_fixed[i]) stage.k[i] = 0;
    stage.factors.solveInPlace(stage.k);
    p_[k] = stage.h.head(n_);
    p_[k].noalias() += solution_.K[k].transpose() * stage.h.tail(stage.n_u);
    p_[k].noalias() += stage.AK.transpose() * stage.q;
  }

  const int n_free = static_cast<int>(qp.free.size());
  work_.setZero(n_);  // the step of dx_0
  for (int j = 0; j < n_free; ++j) {
    const int row = free_rows_ + j;
    p_free_[j] =
        is_fixed(qp.free[j].lower, qp.free[j].upper) ? 0 : dy_[row] - dy_[row + n_free] - p_[0][qp.free[j].index];
  }
  free_factors_.solveInPlace(p_free_);
  for (int j = 0; j < n_free; ++j) work_[qp.free[j].index] = p_free_[j];

  for (std::size_t k = 0; k < N_; ++k) {
    Stage& stage = stages_[k];
    const HorizonStage& terms = qp.stages[k];
    stage.dz.resize(n_ + stage.n_u);
    stage.dz.head(n_) = work_;
    stage.dz.tail(stage.n_u) = stage.k;
    stage.dz.tail(stage.n_u).noalias() += solution_.K[k] * work_;
    dlambda_[k] = p_[k] - solution_.lambda[k];
    dlambda_[k].noalias() += P_[k] * work_;
    dv_.segment(stage.rows, stage.m).noalias() = terms.C * stage.dz;
    dv_.segment(stage.rows + stage.m, stage.n_u) = stage.dz.tail(stage.n_u);
    dv_.segment(stage.rows + stage.m + stage.n_u, stage.n_u) = -stage.dz.tail(stage.n_u);
    work_ = stage.rho;
    work_.noalias() += terms.A * stage.dz.head(n_);
    work_.noalias() += terms.B * stage.dz.tail(stage.n_u);
  }
  end_dx_ = work_;
  dlambda_[N_] = p_[N_] - solution_.lambda[N_];
  dlambda_[N_].noalias() += P_[N_] * end_dx_;
  dv_.segment(end_rows_, m).noalias() = qp.end.C * end_dx_;
  dv_.segment(end_rows_ + m, p).noalias() = qp.end.E * end_dx_;
  for (int j = 0; j < n_free; ++j) {
    dv_[free_rows_ + j] = p_free_[j];
    dv_[free_rows_ + n_free + j] = -p_free_[j];
  }
  for (int i = 0; i < n_rows_; ++i) {
    if (!is_row(i)) continue;
    dy_[i] = W_[i] * (e_[i] - dv_[i]);
    dt_[i] = (c_t_[i] - t_[i] * dy_[i]) / a_[i];
    if (is_soft(i)) ds_[i] = (c_s_[i] + s_[i] * dy_[i]) / b_[i];
  }
}

bool HorizonQpSolver::Workspace::is_step_finite() const {
  const auto is_finite = [](const Vector& v) { return v.allFinite(); };
  return std::ranges::all_of(dlambda_, is_finite) && end_dx_.allFinite() && dy_.allFinite() && dt_.allFinite() &&
         ds_.allFinite() && std::ranges::all_of(stages_, [](const Stage& stage) { return stage.dz.allFinite(); });
}

/// Mean of the products of (8) after a step of this length.
double HorizonQpSolver::Workspace::mu(double length) const {
  double sum = 0;
  for (int i = 0; i < n_rows_; ++i) {
    if (!is_row(i)) continue;
    sum += (t_[i] + length * dt_[i]) * (a_[i] + length * dy_[i]);
    if (is_soft(i)) sum += (s_[i] + length * ds_[i]) * (b_[i] - length * dy_[i]);
  }
  return n_pairs_ > 0 ? sum / n_pairs_ : 0;
}

/// Length of the step to the first boundary, at most 1 / (1 - kBoundary).
double HorizonQpSolver::Workspace::longest_step() const {
  double length = 1 / (1 - kBoundary);
  const auto limit = [&](double value, double slope) {
    if (value + length * slope < 0) length = -value / slope;
  };
  for (int i = 0; i < n_rows_; ++i) {
    if (!is_row(i)) continue;
    limit(t_[i], dt_[i]);
    limit(a_[i], dy_[i]);
    if (!is_soft(i)) continue;
    limit(s_[i], ds_[i]);
    limit(b_[i], -dy_[i]);
  }
  return length;
}

void HorizonQpSolver::Workspace::take_step(double length) {
  for (std::size_t k = 0; k < N_; ++k) {
    solution_.dx[k] += length * stages_[k].dz.head(n_);
    solution_.du[k] += length * stages_[k].dz.tail(stages_[k].n_u);
  }
  solution_.dx[N_] += length * end_dx_;
  for (std::size_t k = 0; k <= N_; ++k) solution_.lambda[k] += length * dlambda_[k];
  t_ += length * dt_;
  s_ += length * ds_;
  a_ += length * dy_;
  b_ -= length * dy_;
  y_ += length * dy_;
}

/// Copies the multipliers, and states the residuals of what is returned.
const HorizonQpSolution& HorizonQpSolver::Workspace::finish(QpStatus status, const char* message) {
  const HorizonQp& qp = *qp_;
  HorizonQpSolution& out = solution_;
  out.status = status;
  out.message = message;
  if (status == QpStatus::non_finite) return out;
  if (options_.gains_without_bounds) {
    find_weights();
    factorise(false);
  }
  for (std::size_t k = 0; k < N_; ++k) {
    const Stage& stage = stages_[k];
    const HorizonStage& terms = qp.stages[k];
    out.du[k] = out.du[k].cwiseMax(terms.lower).cwiseMin(terms.upper);  // rounding
    out.y[k] = C_rows(stage, y_);
    out.y_lower[k] = lower_rows(stage, y_);
    out.y_upper[k] = upper_rows(stage, y_);
    for (int i = 0; i < stage.n_u; ++i) {
      if (!stage.is_fixed[i]) continue;
      const double slope =
          stage.Hz_g[n_ + i] + terms.B.col(i).dot(out.lambda[k + 1]) - terms.C.col(n_ + i).dot(C_rows(stage, y_));
      out.y_lower[k][i] = std::max(0.0, slope);
      out.y_upper[k][i] = std::max(0.0, -slope);
    }
  }
  const Eigen::Index m = qp.end.d.size(), p = qp.end.r.size(), n_free = qp.free.size();
  out.y[N_] = y_.segment(end_rows_, m);
  out.y_E = y_.segment(end_rows_ + m, p);
  out.y_free_lower = y_.segment(free_rows_, n_free);
  out.y_free_upper = y_.segment(free_rows_ + n_free, n_free);
  for (int j = 0; j < n_free; ++j) {
    const FreeInitialComponent& component = qp.free[j];
    double& value = out.dx[0][component.index];
    value = std::clamp(value, component.lower, component.upper);
    if (!is_fixed(component.lower, component.upper)) continue;
    out.y_free_lower[j] = std::max(0.0, out.lambda[0][component.index]);
    out.y_free_upper[j] = std::max(0.0, -out.lambda[0][component.index]);
  }
  evaluate();
  for (std::size_t k = 0; k <= N_; ++k) {
    const int first = k < N_ ? stages_[k].rows : end_rows_;
    for (int i = 0; i < out.slack[k].size(); ++i)
      out.slack[k][i] = is_soft(first + i) ? std::max(0.0, -v_[first + i]) : 0;
  }
  return out;
}

HorizonQpSolver::HorizonQpSolver() : workspace_(std::make_unique<Workspace>()) {}
HorizonQpSolver::~HorizonQpSolver() = default;
HorizonQpSolver::HorizonQpSolver(HorizonQpSolver&&) noexcept = default;
HorizonQpSolver& HorizonQpSolver::operator=(HorizonQpSolver&&) noexcept = default;

const HorizonQpSolution& HorizonQpSolver::solve(const HorizonQp& qp, const HorizonQpOptions& options) {
  check(qp, options);
  return workspace_->solve(qp, options);
}

}  // namespace ricochet
