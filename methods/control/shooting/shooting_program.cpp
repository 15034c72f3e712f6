#include "methods/control/shooting/shooting_program.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "problems/dense_solve.h"

namespace ricochet {
namespace {

/// Cost of a guard's slack, relative to the largest slope of the cost and to nu.
constexpr double kGuardWeight = 1e3;
/// Rows are in the first program if they are this near to zero, and later if a solution violates them by more than this.
constexpr double kNear = 1e-6, kMayMiss = 1e-10;
/// A row with slopes below this is constant.
constexpr double kConstant = 1e-12;
/// An update (4) whose denominator is a smaller part of its factors is left out.
constexpr double kSmallUpdate = 1e-8;
/// Range of an H that is free, but held by equal bounds, relative to itself.
constexpr double kSmallestRange = 1e-12;

}  // namespace

ShootingProgram::ShootingProgram(PlantRunner& runner)
    : runner_(runner),
      problem_(runner.problem()),
      n_q_(runner.plant().n_q()),
      n_u_(runner.plant().info().n_u),
      n_theta_(2 * n_q_ + n_u_ + 1),
      is_time_free_(problem_.is_time_free),
      n_x_(static_cast<int>(2 * n_q_) + (is_time_free_ ? 1 : 0)),
      scale_(n_u_),
      running_(problem_.running_cost, problem_.running_residuals),
      terminal_(problem_.terminal_cost, problem_.terminal_residuals) {
  for (Eigen::Index c = 0; c < n_u_; ++c) {
    const double width = problem_.u.upper[c] - problem_.u.lower[c];
    scale_[c] = std::isfinite(width) && width > 0 ? width / 2 : 1;
  }
}

/// z from theta: the column of H moves behind x, or away.
Vector ShootingProgram::by_z(const Eigen::RowVectorXd& by_theta) const {
  Vector z(n_x_ + n_u_);
  z.head(2 * n_q_) = by_theta.head(2 * n_q_);
  if (is_time_free_) z[2 * n_q_] = by_theta[n_theta_ - 1];
  z.tail(n_u_) = by_theta.segment(2 * n_q_, n_u_);
  return z;
}

/// (1) and (2) of one stage.
void ShootingProgram::add_stage(const Element& e, const Sensitivity::ElementDerivatives& derivatives, int j,
                                HorizonStage& stage, Rows& all) {
  const double b = runner_.tableau().b[j];
  point_.head(n_q_) = e.q.col(j);
  point_.segment(n_q_, n_q_) = e.v.col(j);
  D_.topLeftCorner(n_q_, 2 * n_q_) = derivatives.q.block(j * n_q_, 0, n_q_, 2 * n_q_);
  D_.block(n_q_, 0, n_q_, 2 * n_q_) = derivatives.v.block(j * n_q_, 0, n_q_, 2 * n_q_);
  D_.topRightCorner(n_q_, n_u_) = derivatives.q.block(j * n_q_, 2 * n_q_, n_q_, n_u_);
  D_.block(n_q_, n_x_, n_q_, n_u_) = derivatives.v.block(j * n_q_, 2 * n_q_, n_q_, n_u_);
  if (is_time_free_) {
    D_.block(0, 2 * n_q_, n_q_, 1) = derivatives.q.block(j * n_q_, n_theta_ - 1, n_q_, 1);
    D_.block(n_q_, 2 * n_q_, n_q_, 1) = derivatives.v.block(j * n_q_, n_theta_ - 1, n_q_, 1);
  }
  double L = 0;
  problem_.running_cost.evaluate(point_.data(), &L);
  problem_.running_cost.jacobian(point_.data(), gradient_L_.data());
  stage.g.noalias() += e.h * b * D_.transpose() * gradient_L_;
  stage.g += b * L * by_z(derivatives.h.transpose());
  stage.H.noalias() += e.h * b * D_.transpose() * running_.at(point_.data()) * D_;

  runner_.constraints().values(point_, c_);
  if (c_.size() == 0) return;
  runner_.constraints().jacobian(point_, J_);
  const Eigen::Index before = all.d.size();
  Eigen::Index used = before;
  const int first = n_seen_;
  n_seen_ += static_cast<int>(c_.size());
  all.C.conservativeResize(before + c_.size(), n_x_ + n_u_);
  all.d.conservativeResize(before + c_.size());
  for (Eigen::Index i = 0; i < c_.size(); ++i) {
    all.C.row(used).noalias() = J_.row(i) * D_;
    if (all.C.row(used).lpNorm<Eigen::Infinity>() <= kConstant) continue;
    all.d[used++] = c_[i];
    all.origin.push_back(first + static_cast<int>(i));
  }
  all.C.conservativeResize(used, Eigen::NoChange);
  all.d.conservativeResize(used);
}

/// The running cost of the time up to a switch at the start of interval k. It has no element there, but a length that
/// changes with theta, (6) of sensitivity.h: by what the lengths of the elements leave of H.
void ShootingProgram::add_cost_before_switch(const PlantMotion& motion, const LinearisedInterval& interval,
                                             std::size_t k, HorizonStage& stage) {
  Eigen::RowVectorXd length = Eigen::RowVectorXd::Unit(n_theta_, n_theta_ - 1);
  for (int n = 0; n < motion.steps[k].n_elements; ++n)
    length -= interval.elements[static_cast<std::size_t>(n)].h.transpose();
  point_.head(2 * n_q_) = motion.x.col(static_cast<Eigen::Index>(k));
  double L = 0;
  problem_.running_cost.evaluate(point_.data(), &L);
  stage.g += L * by_z(length);
}

void ShootingProgram::set_H_bounds(double lower, double upper) {
  H_lower_ = lower;
  H_upper_ = upper;
}

void ShootingProgram::set(const PlantMotion& motion, const MotionLineariser& linearised) {
  const auto N = motion.steps.size();
  const std::vector<HorizonStage> before = qp_.stages;
  qp_.stages.resize(N);
  qp_.dx_0.setZero(n_x_);
  u_ = motion.u;
  H_ = motion.H;
  if (is_time_free_) H_scale_ = std::max((H_upper_ - H_lower_) / 2, kSmallestRange * H_);
  has_guards_ = false;
  guards_.clear();
  rows_.resize(N);
  point_.resize(2 * n_q_ + n_u_);
  gradient_L_.resize(2 * n_q_ + n_u_);
  D_.setZero(2 * n_q_ + n_u_, n_x_ + n_u_);
  D_.bottomRightCorner(n_u_, n_u_).setIdentity();
  slack_at_0_ = motion.terminal.lpNorm<1>();
  for (std::size_t k = 0; k < N; ++k) {
    const LinearisedInterval& interval = linearised.intervals()[k];
    HorizonStage& stage = qp_.stages[k];
    stage.A.setZero(n_x_, n_x_);
    stage.B.setZero(n_x_, n_u_);
    stage.c.setZero(n_x_);
    stage.A.topLeftCorner(2 * n_q_, 2 * n_q_) = interval.x.leftCols(2 * n_q_);
    stage.B.topRows(2 * n_q_) = interval.x.middleCols(2 * n_q_, n_u_);
    if (is_time_free_) {
      stage.A.col(2 * n_q_).head(2 * n_q_) = interval.x.col(n_theta_ - 1);
      stage.A(2 * n_q_, 2 * n_q_) = 1;
    }
    stage.H.setZero(n_x_ + n_u_, n_x_ + n_u_);
    stage.g.setZero(n_x_ + n_u_);
    Rows& rows = rows_[k];
    rows.C.resize(0, n_x_ + n_u_);
    rows.d.resize(0);
    rows.origin.clear();
    n_seen_ = 0;
    point_.tail(n_u_) = motion.u.col(static_cast<Eigen::Index>(k));
    const FesdStep& step = motion.steps[k];
    for (int n = 0; n < step.n_elements; ++n) {
      for (int j = 0; j < runner_.tableau().n_s; ++j)
        add_stage(step.elements[n], interval.elements[static_cast<std::size_t>(n)], j, stage, rows);
    }
    add_cost_before_switch(motion, interval, k, stage);
    slack_at_0_ += (-rows.d).cwiseMax(0).sum();
    rows.n_constraints = rows.d.size();
    rows.correction.setZero(rows.d.size());
    rows.is_used.resize(static_cast<std::size_t>(rows.d.size()));
    for (Eigen::Index i = 0; i < rows.d.size(); ++i) rows.is_used[static_cast<std::size_t>(i)] = rows.d[i] <= kNear;
  }
  set_end(motion);
  learn(motion, before);
}

/// (4). @param before  stages of the last motion
void ShootingProgram::learn(const PlantMotion& motion, const std::vector<HorizonStage>& before) {
  const std::size_t N = qp_.stages.size();
  const bool is_known = before.size() == N && lambda_.size() == N + 1 && last_.steps.size() == N;
  if (!is_known) curvature_.assign(N, Matrix::Zero(n_x_ + n_u_, n_x_ + n_u_));
  Vector s(n_x_ + n_u_), w(n_x_ + n_u_);
  for (std::size_t k = 0; k < N; ++k) {
    HorizonStage& stage = qp_.stages[k];
    Matrix& S = curvature_[k];
    const auto column = static_cast<Eigen::Index>(k);
    if (is_known && !has_same_sequence(motion.steps[k], last_.steps[k])) {
      S.setZero();
    } else if (is_known) {
      s.setZero();
      s.head(2 * n_q_) = motion.x.col(column) - last_.x.col(column);
      if (is_time_free_) s[2 * n_q_] = motion.H - last_.H;
      s.tail(n_u_) = motion.u.col(column) - last_.u.col(column);
      const Vector& lambda = lambda_[k + 1];
      w = stage.g - before[k].g - (stage.H + S) * s;
      w.head(n_x_) += (stage.A - before[k].A).transpose() * lambda;
      w.tail(n_u_) += (stage.B - before[k].B).transpose() * lambda;
      if (const double ws = w.dot(s); std::abs(ws) > kSmallUpdate * w.norm() * s.norm()) S += w * w.transpose() / ws;
    }
    if (!S.isZero(0)) stage.H = positive_part(stage.H + S);
  }
  last_ = motion;
}

void ShootingProgram::set_end(const PlantMotion& motion) {
  const Vector x = motion.x.col(motion.x.cols() - 1);
  HorizonEnd& end = qp_.end;
  end.H.setZero(n_x_, n_x_);
  end.g.setZero(n_x_);
  Vector g(2 * n_q_);
  problem_.terminal_cost.jacobian(x.data(), g.data());
  end.g.head(2 * n_q_) = g;
  end.H.topLeftCorner(2 * n_q_, 2 * n_q_) = terminal_.at(x.data());
  end.C.resize(0, n_x_);
  end.d.resize(0);
  end.weight.resize(0);
  const Eigen::Index p = motion.terminal.size();
  end.E.setZero(p, n_x_);
  if (p > 0) {
    Matrix J(p, 2 * n_q_);
    problem_.terminal.jacobian(x.data(), J.data());
    end.E.leftCols(2 * n_q_) = J;
  }
  end.r = motion.terminal;
}

void ShootingProgram::add_guards(const PlantMotion& motion, const MotionLineariser& linearised) {
  if (has_guards_) return;
  has_guards_ = true;
  for (std::size_t k = 0; k < qp_.stages.size(); ++k) {
    const std::size_t first = guards_.size();
    ricochet::add_guards(runner_.plant(), linearised.point(), motion, static_cast<int>(k), linearised.intervals()[k],
                         guards_);
    Rows& rows = rows_[k];
    Eigen::Index row = rows.d.size();
    rows.C.conservativeResize(row + static_cast<Eigen::Index>(guards_.size() - first), n_x_ + n_u_);
    rows.d.conservativeResize(rows.C.rows());
    for (std::size_t i = first; i < guards_.size(); ++i) {
      const Vector slope = by_z(guards_[i].slope);
      const double size = slope.lpNorm<Eigen::Infinity>();
      if (!(size > 0)) continue;
      rows.C.row(row) = slope.transpose() / size;
      rows.d[row] = std::max(guards_[i].value, 0.0) / size;
      rows.is_used.push_back(rows.d[row++] <= kNear);
    }
    rows.C.conservativeResize(row, Eigen::NoChange);
    rows.d.conservativeResize(row);
    rows.correction.setZero(row);
  }
}

void ShootingProgram::set_bounds(double Delta, double nu) {
  nu_ = nu;
  double slope = std::max(nu, 1 + qp_.end.g.lpNorm<Eigen::Infinity>());
  for (const HorizonStage& stage : qp_.stages) slope = std::max(slope, stage.g.lpNorm<Eigen::Infinity>());
  guard_weight_ = kGuardWeight * slope;
  for (std::size_t k = 0; k < qp_.stages.size(); ++k) {
    HorizonStage& stage = qp_.stages[k];
    const Vector u = u_.col(static_cast<Eigen::Index>(k));
    stage.lower = (problem_.u.lower - u).cwiseMax(-Delta * scale_).cwiseMin(0);
    stage.upper = (problem_.u.upper - u).cwiseMin(Delta * scale_).cwiseMax(0);
  }
  qp_.end.E_weight.setConstant(qp_.end.r.size(), nu);
  qp_.free.clear();
  if (!is_time_free_) return;
  qp_.free.push_back({static_cast<int>(2 * n_q_), std::min(std::max(H_lower_ - H_, -Delta * H_scale_), 0.0),
                      std::max(std::min(H_upper_ - H_, Delta * H_scale_), 0.0)});
}

void ShootingProgram::use_rows(double margin) {
  for (std::size_t k = 0; k < qp_.stages.size(); ++k) {
    HorizonStage& stage = qp_.stages[k];
    const Rows& rows = rows_[k];
    const auto n = std::count(rows.is_used.begin(), rows.is_used.end(), char{1});
    stage.C.resize(n, n_x_ + n_u_);
    stage.d.resize(n);
    stage.weight.resize(n);
    Eigen::Index used = 0;
    for (Eigen::Index i = 0; i < rows.d.size(); ++i) {
      if (!rows.is_used[static_cast<std::size_t>(i)]) continue;
      stage.C.row(used) = rows.C.row(i);
      stage.d[used] = rows.d[i] + rows.correction[i] - (i < rows.n_constraints ? 0 : margin);
      stage.weight[used++] = i < rows.n_constraints ? nu_ : guard_weight_;
    }
  }
}

bool ShootingProgram::add_violated(const HorizonQpSolution& solution, double margin) {
  bool has_added = false;
  Vector z(n_x_ + n_u_), value;
  for (std::size_t k = 0; k < rows_.size(); ++k) {
    Rows& rows = rows_[k];
    z << solution.dx[k], solution.du[k];
    value.noalias() = rows.C * z;
    value += rows.d + rows.correction;
    value.tail(value.size() - rows.n_constraints).array() -= margin;
    for (Eigen::Index i = 0; i < value.size(); ++i) {
      char& is_used = rows.is_used[static_cast<std::size_t>(i)];
      if (is_used || value[i] >= -kMayMiss) continue;
      is_used = 1;
      has_added = true;
    }
  }
  return has_added;
}

const HorizonQpSolution& ShootingProgram::solve(double Delta, double nu, double margin, double tolerance) {
  set_bounds(Delta, nu);
  return solve(margin, tolerance);
}

const HorizonQpSolution& ShootingProgram::solve(double margin, double tolerance) {
  for (;;) {
    use_rows(margin);
    const HorizonQpSolution& solution =
        solver_.solve(qp_, {.tolerance = tolerance, .gains_without_bounds = true, .is_interrupted = is_interrupted_});
    if (solution.is_solved()) lambda_ = solution.lambda;
    if (!solution.is_solved() || !add_violated(solution, margin)) return solution;
  }
}

const HorizonQpSolution& ShootingProgram::correct(const PlantMotion& motion, const PlantMotion& trial, double margin,
                                                  double tolerance) {
  Vector z = Vector::Zero(n_x_ + n_u_), next = Vector::Zero(n_x_), values;
  if (is_time_free_) z[2 * n_q_] = next[2 * n_q_] = trial.H - motion.H;
  for (std::size_t k = 0; k < rows_.size(); ++k) {
    const auto column = static_cast<Eigen::Index>(k);
    HorizonStage& stage = qp_.stages[k];
    z.head(2 * n_q_) = trial.x.col(column) - motion.x.col(column);
    z.tail(n_u_) = trial.u.col(column) - motion.u.col(column);
    next.head(2 * n_q_) = trial.x.col(column + 1) - motion.x.col(column + 1);
    stage.c = next - stage.A * z.head(n_x_) - stage.B * z.tail(n_u_);
    if (trial.steps[k].n_elements != motion.steps[k].n_elements) continue;  // its stages are others
    constraints_of(trial, static_cast<int>(k), values);
    Rows& rows = rows_[k];
    for (Eigen::Index i = 0; i < rows.n_constraints; ++i)
      rows.correction[i] = values[rows.origin[static_cast<std::size_t>(i)]] - rows.d[i] - rows.C.row(i).dot(z);
  }
  const Vector r = qp_.end.r;
  qp_.end.r = trial.terminal - qp_.end.E * next;
  const HorizonQpSolution& solution = solve(margin, tolerance);
  qp_.end.r = r;
  for (std::size_t k = 0; k < rows_.size(); ++k) {
    qp_.stages[k].c.setZero();
    rows_[k].correction.setZero();
  }
  return solution;
}

/// All constraints of all stages of an interval, in the order of add_stage().
void ShootingProgram::constraints_of(const PlantMotion& motion, int k, Vector& values) {
  const FesdStep& step = motion.steps[static_cast<std::size_t>(k)];
  const int n_s = runner_.tableau().n_s, size = runner_.constraints().size();
  values.resize(step.n_elements * n_s * size);
  point_.tail(n_u_) = motion.u.col(k);
  for (int n = 0; n < step.n_elements; ++n) {
    for (int j = 0; j < n_s && size > 0; ++j) {
      point_.head(n_q_) = step.elements[n].q.col(j);
      point_.segment(n_q_, n_q_) = step.elements[n].v.col(j);
      runner_.constraints().values(point_, c_);
      values.segment((n * n_s + j) * size, size) = c_;
    }
  }
}

ShootingProgram::Slacks ShootingProgram::sums(const HorizonQpSolution& solution) const {
  Slacks sums{.constraints = (qp_.end.E * solution.dx.back() + qp_.end.r).lpNorm<1>()};
  for (std::size_t k = 0; k < rows_.size(); ++k) {
    const Eigen::Index n =
        std::count(rows_[k].is_used.begin(), rows_[k].is_used.begin() + rows_[k].n_constraints, char{1});
    sums.constraints += solution.slack[k].head(n).sum();
    sums.guards += solution.slack[k].tail(solution.slack[k].size() - n).sum();
  }
  return sums;
}

double ShootingProgram::predicted_decrease(const HorizonQpSolution& solution) const {
  return nu_ * slack_at_0_ - solution.cost - solution.penalty + guard_weight_ * sums(solution).guards;
}

double ShootingProgram::largest_multiplier(const HorizonQpSolution& solution) const {
  double largest = solution.y_E.size() > 0 ? solution.y_E.lpNorm<Eigen::Infinity>() : 0;
  for (std::size_t k = 0; k < rows_.size(); ++k) {
    const Eigen::Index n =
        std::count(rows_[k].is_used.begin(), rows_[k].is_used.begin() + rows_[k].n_constraints, char{1});
    if (n > 0) largest = std::max(largest, solution.y[k].head(n).maxCoeff());
  }
  return largest;
}

double ShootingProgram::step_size(const HorizonQpSolution& solution) const {
  double size = is_time_free_ ? std::abs(solution.dx[0][2 * n_q_]) / H_scale_ : 0;
  for (const Vector& du : solution.du) size = std::max(size, du.cwiseQuotient(scale_).lpNorm<Eigen::Infinity>());
  return size;
}

/// Gradient by the controls of  lambda' dx_from + sum_k<from g_k' z_k.  @param g  null for none
ShootingProgram::Gradient ShootingProgram::adjoint(int from, Vector lambda, const std::vector<Vector>* g) const {
  Gradient result{Matrix::Zero(n_u_, static_cast<Eigen::Index>(qp_.stages.size())), 0};
  for (int k = from - 1; k >= 0; --k) {
    const HorizonStage& stage = qp_.stages[static_cast<std::size_t>(k)];
    result.u.col(k) = stage.B.transpose() * lambda;
    lambda = (stage.A.transpose() * lambda).eval();
    if (!g) continue;
    const Vector& own = (*g)[static_cast<std::size_t>(k)];
    result.u.col(k) += own.tail(n_u_);
    lambda += own.head(n_x_);
  }
  if (is_time_free_) result.H = lambda[2 * n_q_];
  return result;
}

ShootingProgram::Gradient ShootingProgram::gradient() const {
  std::vector<Vector> g;
  for (const HorizonStage& stage : qp_.stages) g.push_back(stage.g);
  return adjoint(static_cast<int>(g.size()), qp_.end.g, &g);
}

/// z_k of a step, k = 0 .. N - 1, then dx_N.
std::vector<Vector> ShootingProgram::stages_after(const Matrix& du, double dH) const {
  std::vector<Vector> z;
  Vector dx = Vector::Zero(n_x_);
  if (is_time_free_) dx[2 * n_q_] = dH;
  for (std::size_t k = 0; k < qp_.stages.size(); ++k) {
    z.emplace_back(n_x_ + n_u_) << dx, du.col(static_cast<Eigen::Index>(k));
    dx = qp_.stages[k].A * dx + qp_.stages[k].B * z.back().tail(n_u_);
  }
  z.push_back(dx);
  return z;
}

ShootingProgram::Gradient ShootingProgram::gradient_after(const Matrix& du, double dH) const {
  const std::vector<Vector> z = stages_after(du, dH);
  std::vector<Vector> g;
  for (std::size_t k = 0; k < qp_.stages.size(); ++k) g.push_back(qp_.stages[k].g + qp_.stages[k].H * z[k]);
  return adjoint(static_cast<int>(g.size()), qp_.end.g + qp_.end.H * z.back(), &g);
}

double ShootingProgram::curvature(const Matrix& du, double dH) const {
  const std::vector<Vector> z = stages_after(du, dH);
  double sum = z.back().dot(qp_.end.H * z.back());
  for (std::size_t k = 0; k < qp_.stages.size(); ++k) sum += z[k].dot(qp_.stages[k].H * z[k]);
  return sum;
}

ShootingProgram::Gradient ShootingProgram::gradient(int interval, const Eigen::RowVectorXd& by_theta) const {
  const Vector z = by_z(by_theta);
  Gradient result = adjoint(interval, z.head(n_x_), nullptr);
  result.u.col(interval) += z.tail(n_u_);
  return result;
}

std::vector<ShootingProgram::ConstraintGradient> ShootingProgram::constraint_gradients(double largest) const {
  std::vector<ConstraintGradient> gradients;
  for (std::size_t k = 0; k < qp_.stages.size(); ++k) {
    const Rows& rows = rows_[k];
    for (Eigen::Index row = 0; row < rows.n_constraints; ++row) {
      if (rows.d[row] > largest) continue;
      gradients.push_back({adjoint(static_cast<int>(k), rows.C.row(row).head(n_x_).transpose(), nullptr), rows.d[row]});
      gradients.back().gradient.u.col(static_cast<Eigen::Index>(k)) += rows.C.row(row).tail(n_u_).transpose();
    }
  }
  return gradients;
}

std::vector<ShootingProgram::Gradient> ShootingProgram::terminal_gradients() const {
  std::vector<Gradient> gradients;
  for (Eigen::Index row = 0; row < qp_.end.E.rows(); ++row)
    gradients.push_back(adjoint(static_cast<int>(qp_.stages.size()), qp_.end.E.row(row).transpose(), nullptr));
  return gradients;
}

}  // namespace ricochet
