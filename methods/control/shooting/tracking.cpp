#include "methods/control/shooting/tracking.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "methods/control/shooting/horizon_qp.h"
#include "problems/input_error.h"

namespace ricochet {
namespace {

/// Trust region, relative to s: of the first step of a window, and where a window ends.
constexpr double kFirstRegion = 1, kLastRegion = 1e-3;
/// A step that reduces (1) by less than this part of it is the last one of its window.
constexpr double kSmallDecrease = 1e-3;

void check(const Matrix& u, const Matrix& y, const PlantRunner& runner, const TrackingOptions& options) {
  const ProblemInfo& info = runner.problem().plant->info();
  if (u.rows() != info.n_u || u.cols() < 1)
    throw InputError("controls", fmt::format("{} x {}", u.rows(), u.cols()),
                     fmt::format("{} x the number of intervals are required", info.n_u));
  if (y.rows() != 2 * info.n_q || y.cols() != u.cols() + 1 || !y.allFinite())
    throw InputError("states", fmt::format("{} x {}", y.rows(), y.cols()),
                     fmt::format("{} x {} finite numbers are required", 2 * info.n_q, u.cols() + 1));
  if (options.window < 1) throw InputError("window", options.window, "a number >= 1 is required");
  if (options.iterations < 1) throw InputError("iterations", options.iterations, "a number >= 1 is required");
  if (!(options.by_control > 0) || !std::isfinite(options.by_control))
    throw InputError("by_control", options.by_control, "a finite number > 0 is required");
}

/// (1) from one interval on.
class Window {
 public:
  Window(PlantRunner& runner, const Matrix& u, double H, const Matrix& y, const TrackingOptions& options)
      : runner_(runner),
        lineariser_(runner),
        bounds_(runner.problem().u),
        w_(u),
        y_(y),
        H_(H),
        options_(options),
        n_q_(runner.plant().n_q()),
        weight_(2 * n_q_),
        scale_((bounds_.upper - bounds_.lower) / 2) {
    weight_ << Vector::Ones(n_q_), Vector::Constant(n_q_, H);
    for (double& s : scale_) s = std::isfinite(s) && s > 0 ? s : 1;
  }

  /// Adapts the controls from interval `first` on, from the state x there. @return empty, or why that is not possible
  std::string adapt(Eigen::Index first, const Vector& x, Matrix& u) {
    first_ = first;
    n_ = std::min<Eigen::Index>(options_.window, u.cols() - first);
    runner_.run(x.head(n_q_), x.tail(n_q_), u.middleCols(first, n_), H_, motion_);
    if (!motion_.succeeded()) return motion_.message;
    double Delta = kFirstRegion;
    bool is_linearised = false;
    for (int iteration = 0; iteration < options_.iterations && Delta >= kLastRegion;) {
      if (!is_linearised && !lineariser_.linearise(motion_).empty()) break;  // as good as it was
      if (!is_linearised) set_program();
      is_linearised = true;
      const HorizonQpSolution& step = solve(Delta);
      if (!step.is_solved()) break;
      const double before = distance(motion_);
      run(step);
      const double actual = trial_.succeeded() ? before - distance(trial_) : -1;
      if (actual <= 0) {
        Delta *= 0.3;
        continue;
      }
      std::swap(motion_, trial_);
      is_linearised = false;
      ++iteration;
      if (actual <= kSmallDecrease * before) break;
    }
    u.middleCols(first, n_) = motion_.u;
    return {};
  }

  const PlantMotion& motion() const { return motion_; }
  Eigen::VectorXd deviation(Eigen::Index node, const Vector& x) const { return weight_.cwiseProduct(x - y_.col(node)); }

 private:
  /// (1) of a motion, with b of the last set_program().
  double distance(const PlantMotion& motion) const {
    double sum = 0;
    for (Eigen::Index j = 0; j < n_; ++j)
      sum += deviation(first_ + j + 1, motion.x.col(j + 1)).squaredNorm() +
             ((motion.u.col(j) - w_.col(first_ + j)).cwiseQuotient(scale_) * by_control_).squaredNorm();
    return sum;
  }

  void set_program() {
    const Eigen::Index n_x = 2 * n_q_, n_u = scale_.size();
    qp_.dx_0.setZero(n_x);
    qp_.stages.resize(static_cast<std::size_t>(n_));
    double effect = 0;
    for (Eigen::Index j = 0; j < n_; ++j) {
      HorizonStage& stage = qp_.stages[static_cast<std::size_t>(j)];
      const Matrix& x = lineariser_.intervals()[static_cast<std::size_t>(j)].x;
      stage.A = x.leftCols(n_x);
      stage.B = x.middleCols(n_x, n_u);
      stage.c.setZero(n_x);
      stage.C.resize(0, n_x + n_u);
      stage.d.resize(0);
      stage.weight.resize(0);
      effect = std::max(effect, (weight_.asDiagonal() * stage.B * scale_.asDiagonal()).lpNorm<Eigen::Infinity>());
    }
    by_control_ = options_.by_control * std::max(effect, H_ * H_);
    for (Eigen::Index j = 0; j < n_; ++j) {
      HorizonStage& stage = qp_.stages[static_cast<std::size_t>(j)];
      stage.H.setZero(n_x + n_u, n_x + n_u);
      stage.g.setZero(n_x + n_u);
      const Vector by_u = (by_control_ / scale_.array()).square();
      stage.H.bottomRightCorner(n_u, n_u) = by_u.asDiagonal();
      stage.g.tail(n_u) = by_u.cwiseProduct(motion_.u.col(j) - w_.col(first_ + j));
      if (j == 0) continue;
      stage.H.topLeftCorner(n_x, n_x) = weight_.cwiseAbs2().asDiagonal();
      stage.g.head(n_x) = weight_.cwiseProduct(deviation(first_ + j, motion_.x.col(j)));
    }
    HorizonEnd& end = qp_.end;
    end.H = weight_.cwiseAbs2().asDiagonal();
    end.g = weight_.cwiseProduct(deviation(first_ + n_, motion_.x.col(n_)));
    end.C.resize(0, n_x);
    end.E.resize(0, n_x);
    for (Vector* none : {&end.d, &end.weight, &end.r, &end.E_weight}) none->resize(0);
  }

  const HorizonQpSolution& solve(double Delta) {
    for (Eigen::Index j = 0; j < n_; ++j) {
      HorizonStage& stage = qp_.stages[static_cast<std::size_t>(j)];
      stage.lower = (bounds_.lower - motion_.u.col(j)).cwiseMax(-Delta * scale_).cwiseMin(0);
      stage.upper = (bounds_.upper - motion_.u.col(j)).cwiseMin(Delta * scale_).cwiseMax(0);
    }
    return solver_.solve(qp_, {.tolerance = 1e-8, .gains_without_bounds = true});
  }

  /// With the feedback of the program.
  void run(const HorizonQpSolution& step) {
    const auto policy = [&](int j, const Eigen::Ref<const Vector>& x, Eigen::Ref<Vector> u) {
      const auto i = static_cast<std::size_t>(j);
      u = motion_.u.col(j) + step.du[i] + step.K[i] * (x - motion_.x.col(j) - step.dx[i]);
      u = u.cwiseMax(bounds_.lower).cwiseMin(bounds_.upper).eval();
    };
    const Vector x = motion_.x.col(0);
    runner_.run(x.head(n_q_), x.tail(n_q_), policy, static_cast<int>(n_), H_, trial_);
  }

  PlantRunner& runner_;
  MotionLineariser lineariser_;
  const OptimalControlProblem::Bounds& bounds_;
  const Matrix &w_, &y_;
  const double H_;
  const TrackingOptions options_;
  const Eigen::Index n_q_;
  Vector weight_, scale_;  // W and s
  Eigen::Index first_ = 0, n_ = 0;
  double by_control_ = 0;
  PlantMotion motion_, trial_;
  HorizonQp qp_;
  HorizonQpSolver solver_;
};

}  // namespace

Tracking track(PlantRunner& runner, const Matrix& u, double H, const Matrix& y, const TrackingOptions& options) {
  check(u, y, runner, options);
  Tracking result;
  result.u = runner.problem().u.clamp(u);
  Window window(runner, u, H, y, options);
  Vector x = y.col(0);
  for (Eigen::Index k = 0; k < u.cols(); ++k) {
    result.message = window.adapt(k, x, result.u);
    if (!result.message.empty()) {
      result.message = fmt::format("interval {} of {}: {}", k + 1, u.cols(), result.message);
      break;
    }
    x = window.motion().x.col(1);
    result.distance = std::max(result.distance, window.deviation(k + 1, x).norm());
  }
  return result;
}

}  // namespace ricochet
