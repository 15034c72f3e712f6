#include "methods/control/shooting/shooting.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <limits>
#include <optional>

#include "problems/input_error.h"

namespace ricochet {
namespace {

/// A step is accepted with this part of the predicted decrease, and good or bad for the trust region from these parts on.
constexpr double kAccepted = 0.01, kGood = 0.75, kBad = 0.25;
constexpr double kLargestDelta = 2;  // the whole range of a control
constexpr double kSmallestDelta = 1e-11;
/// Rounding of a cost, relative: sums of some hundred terms.
constexpr double kMeritRounding = 1e-14;
/// A predicted decrease of this part of the cost is rounding: steps that do not shrink any more are the last ones.
constexpr double kNoDecrease = 1e-15, kShrinking = 0.9;
/// nu at most, relative to 1 + the cost; violations that count as none; part of the reduction that is possible within the
/// trust region and that a step has to bring (Byrd, Nocedal, Waltz, Steering exact penalty methods for nonlinear
/// programming, Optim. Methods Softw. 23, 2008: both rules).
constexpr double kLargestNu = 1e6, kNoSlack = 1e-7, kSteered = 0.1;
/// nu is lowered to the first multiple of the largest multiplier where it is above the second one; so many times at most,
/// so that a merit which goes up and down does not keep an iteration going.
constexpr double kEnoughNu = 10, kTooLargeNu = 100;
constexpr int kMaxLowered = 10;
/// Tolerances of the quadratic program, the second one after steps up to this size: terms of one stage are often 1e5 times
/// as large as the gradient by a control.
constexpr double kTolerance = 1e-9, kLastTolerance = 1e-12, kNearEnd = 1e-5;
/// Trust regions tried in one iteration.
constexpr int kMaxTrials = 60;
/// Iterations of each of several guesses.
constexpr int kPolish = 5;
/// Distance that a step keeps from the guards, relative to the scale of the controls: the quadratic program fulfils them to
/// 1e-9 only, and nearer to a border rounding says what a motion does.
constexpr double kMargin = 1e-9;
/// Distances from borders of Shooting::retreat(), relative to the scale of the controls; iterations with one, and the part
/// of the first trust region after them.
constexpr double kRetreats[] = {1e-6, 1e-4, 1e-3, 1e-6, 1e-4}, kRestart = 0.1;
constexpr int kMaxRetreat = 20;
/// Descents into neighbouring pieces, and the part of the predicted decrease that a step along one has to reach.
constexpr int kMaxDescents = 30, kMaxHalvings = 40;
constexpr double kArmijo = 1e-3;
/// Multiples of the step that showed a jump downwards, at most.
constexpr double kLongestJump = 1e9;
/// Parts of a direction away from all borders that are added to a descent.
constexpr double kInside[] = {0, 1e-3, 0.03, 0.5};

void check(const ShootingOptions& options) {
  if (options.max_iterations < 1)
    throw InputError("--max-iterations", options.max_iterations, "a number >= 1 is required");
  if (!(options.time_limit >= 0)) throw InputError("--time-limit", options.time_limit, "a number >= 0 is required");
  if (!(options.Delta > 0) || !std::isfinite(options.Delta))
    throw InputError("trust region", options.Delta, "a finite number > 0 is required");
}

}  // namespace

Shooting::Shooting(const OptimalControlProblem& problem, const ButcherTableau& tableau, const ShootingOptions& options)
    : problem_(problem), options_(options), runner_(problem, tableau), lineariser_(runner_), program_(runner_) {
  check(options);
  const auto is_interrupted = [this] { return is_out_of_time(); };
  lineariser_.set_interrupt(is_interrupted);
  program_.set_interrupt(is_interrupted);
}

double Shooting::now() const {
  if (options_.clock) return options_.clock();
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

void Shooting::set_time_limit(double time_limit) {
  options_.time_limit = time_limit;
  check(options_);
}

double Shooting::violation(const PlantMotion& motion) {
  return motion.violation + motion.terminal.lpNorm<1>();
}

double Shooting::merit(const PlantMotion& motion) const {
  return motion.cost + nu_ * violation(motion);
}

bool Shooting::is_out_of_time() const {
  return options_.time_limit > 0 && now() - start_ > options_.time_limit;
}

/// Ends with the motion at hand.
void Shooting::end_out_of_time() {
  status_ = Status::time_limit;
  message_ = fmt::format("the time limit of {:g} s was reached", options_.time_limit);
  is_linearised_ = false;
}

/// Runs the first motion. @return whether it can be optimised
bool Shooting::begin(const Matrix& u, double T) {
  const ProblemInfo& info = problem_.plant->info();
  const Eigen::Index N = u.cols();
  if (u.rows() != info.n_u || N < 1)
    throw InputError("controls", fmt::format("{} x {}", u.rows(), N),
                     fmt::format("{} x the number of intervals are required", info.n_u));
  const double time = problem_.is_time_free ? std::clamp(T, problem_.T_lower, problem_.T_upper) : T;
  program_.set_H_bounds(problem_.T_lower / static_cast<double>(N), problem_.T_upper / static_cast<double>(N));
  runner_.run(info.q0, info.v0, problem_.u.clamp(u), time / static_cast<double>(N), motion_);
  gains_.clear();
  restart();
  nu_ = first_nu_ = 1 + std::abs(motion_.cost);
  return motion_.succeeded();
}

/// The state of an iteration that starts from motion_.
void Shooting::restart() {
  // Whatever kept the plant from moving, there is no motion under these controls.
  status_ = motion_.succeeded() || motion_.status == Status::non_finite ? motion_.status : Status::infeasible;
  message_ = motion_.succeeded() ? "" : "first guess: " + motion_.message;
  iterations_ = 0;
  is_examined_ = false;
  retreat_ = 0;
  next_retreat_ = 0;
  lowered_ = 0;
  last_size_ = std::numeric_limits<double>::infinity();
  Delta_ = options_.Delta;
  is_linearised_ = false;
}

/// @param step  that was accepted
void Shooting::lower_nu(const HorizonQpSolution& step) {
  const double needed = std::max(first_nu_, program_.largest_multiplier(step));
  if (nu_ <= kTooLargeNu * needed || lowered_ >= kMaxLowered) return;
  nu_ = kEnoughNu * needed;
  ++lowered_;
}

/// Runs (2). @param actual  decrease of (3). @return whether it is accepted
bool Shooting::try_step(const HorizonQpSolution& step, bool has_feedback, double predicted, PlantMotion& trial,
                        double& actual) {
  const Eigen::Index n_q = 2 * runner_.plant().n_q();
  const auto policy = [&](int k, const Eigen::Ref<const Vector>& x, Eigen::Ref<Vector> u) {
    const auto i = static_cast<std::size_t>(k);
    u = motion_.u.col(k) + step.du[i];
    if (has_feedback) u += step.K[i].leftCols(n_q) * (x - motion_.x.col(k) - step.dx[i].head(n_q));
    u = u.cwiseMax(problem_.u.lower).cwiseMin(problem_.u.upper).eval();
  };
  const double H = motion_.H + (problem_.is_time_free ? step.dx[0][n_q] : 0);
  const Vector x = motion_.x.col(0);
  runner_.run(x.head(n_q / 2), x.tail(n_q / 2), policy, static_cast<int>(motion_.u.cols()), H, trial);
  const double before = merit(motion_);
  actual = trial.succeeded() ? before - merit(trial) : -std::numeric_limits<double>::infinity();
  return actual + kMeritRounding * (1 + std::abs(before)) >= kAccepted * predicted;
}

/// One accepted step, or the end.
Shooting::Outcome Shooting::iterate(ShootingIteration& report) {
  if (is_out_of_time()) return Outcome::out_of_time;
  if (!is_linearised_) {
    const double begin = now();
    const std::string reason = lineariser_.linearise(motion_);
    derivative_seconds_ += now() - begin;
    if (is_out_of_time()) return Outcome::out_of_time;
    if (!reason.empty()) {
      message_ = reason;
      return Outcome::stalled;
    }
    is_linearised_ = true;
  }
  program_.set(motion_, lineariser_);
  const double largest_nu = kLargestNu * (1 + std::abs(motion_.cost));
  report.guarded = false;
  double margin = retreat_ * program_.scale().maxCoeff();
  for (int trial = 0; trial < kMaxTrials; ++trial) {
    if (is_out_of_time()) return Outcome::out_of_time;
    const double tolerance = last_size_ > kNearEnd ? kTolerance : kLastTolerance;
    const HorizonQpSolution* step = &program_.solve(Delta_, nu_, margin, tolerance);
    if (step->is_solved() && nu_ < largest_nu && program_.slack(*step) > kNoSlack) {
      const double slack = program_.slack(*step),
                   least = program_.slack(program_.solve(Delta_, largest_nu, margin, tolerance));
      const double enough = least <= kNoSlack ? kNoSlack : program_.slack() - kSteered * (program_.slack() - least);
      if (slack > enough && slack > least + kNoSlack) {
        nu_ = std::min(10 * nu_, largest_nu);
        continue;
      }
      step = &program_.solve(Delta_, nu_, margin, tolerance);
    }
    if (is_out_of_time()) return Outcome::out_of_time;
    if (step->status == QpStatus::non_finite) {
      message_ = "a derivative of the motion is not finite";
      return Outcome::stalled;
    }
    gains_ = step->K;
    const double predicted = program_.predicted_decrease(*step), size = program_.step_size(*step);
    const double no_decrease = kNoDecrease * (1 + std::abs(merit(motion_)));
    report.step = size;
    const bool is_rounding = predicted <= no_decrease && size >= kShrinking * last_size_;
    last_size_ = size;
    if (size <= options_.step_tolerance || predicted <= 0 || is_rounding) {
      if (step->is_solved()) return Outcome::stationary;
      message_ = fmt::format("quadratic program: {}", step->message);
      return Outcome::stalled;
    }
    double actual = 0;
    bool is_accepted = try_step(*step, true, predicted, trial_, actual);
    bool left = !trial_.succeeded() || !has_same_sequence(motion_, trial_);
    // A step along tangents of curved constraints violates them by its square, and would have to stay short.
    if (!is_out_of_time() && trial_.succeeded() && (!left || program_.has_guards()) && actual < kGood * predicted &&
        violation(trial_) > program_.slack(*step) + kMeritRounding) {
      double corrected = 0;
      step = &program_.correct(motion_, trial_, margin, tolerance);
      if (step->is_solved() && !is_out_of_time() && try_step(*step, true, predicted, corrected_, corrected) &&
          corrected > actual) {
        std::swap(trial_, corrected_);
        actual = corrected;
        is_accepted = true;
        left = !has_same_sequence(motion_, trial_);
      }
    }
    if (!is_accepted && !is_out_of_time()) {
      is_accepted = try_step(*step, false, predicted, trial_, actual);
      left = left || !trial_.succeeded() || !has_same_sequence(motion_, trial_);
    }
    if (is_accepted) {
      const double begin = now();
      const std::string reason = lineariser_.linearise(trial_);
      derivative_seconds_ += now() - begin;
      if (is_out_of_time()) {  // with or without derivatives, it is a better motion
        std::swap(motion_, trial_);
        return Outcome::out_of_time;
      }
      if (reason.empty()) {
        report.same_sequence = !left;
        if (actual > kGood * predicted && size > 0.9 * Delta_) Delta_ = std::min(2 * Delta_, kLargestDelta);
        if (actual < kBad * predicted) Delta_ = std::max(0.5 * size, kSmallestDelta);
        if (program_.slack(*step) <= kNoSlack) lower_nu(*step);
        std::swap(motion_, trial_);
        return Outcome::accepted;
      }
      message_ = reason;
      lineariser_.linearise(motion_);
    }
    if (left && !program_.has_guards()) {
      program_.add_guards(motion_, lineariser_);
      report.guarded = true;
    } else {
      Delta_ = 0.3 * std::min(Delta_, size);
      // Guards curve: on the border of their linearisation a step of this size misses them by its square.
      if (left) margin = (Delta_ * Delta_ + kMargin) * program_.scale().maxCoeff();
      if (Delta_ < kSmallestDelta) break;
    }
  }
  message_ = "no step is accepted, however short";
  return Outcome::stalled;
}

void Shooting::iterate_until_done(int max_iterations, const Progress& progress) {
  for (int k = 0; k < max_iterations; ++k) {
    ShootingIteration report{.number = iterations_ + 1, .cost = motion_.cost, .violation = violation(motion_)};
    const Outcome outcome = iterate(report);
    ++iterations_;
    report.Delta = Delta_;
    report.seconds = now() - start_;
    if (progress) progress(report);
    if (outcome == Outcome::accepted) continue;
    if (outcome == Outcome::out_of_time) {
      end_out_of_time();
    } else if (outcome == Outcome::stalled) {
      status_ = Status::inner_solver_failed;
    } else {
      status_ = Status::success;
      message_.clear();
    }
    return;
  }
  status_ = Status::step_limit;
  message_ = fmt::format("not stationary after {} iterations", iterations_);
}

/// Iterations, and descents into neighbouring pieces, until the end is certified.
void Shooting::finish(const Progress& progress) {
  for (int round = 0; round < kMaxDescents; ++round) {
    iterate_until_done(options_.max_iterations - iterations_, progress);
    const bool may_be_stationary = status_ == Status::success || status_ == Status::inner_solver_failed;
    if (!may_be_stationary || !is_linearised_) return;
    program_.set(motion_, lineariser_);
    certificate_ =
        certify(runner_, lineariser_, program_, motion_, nu_, {.is_interrupted = [this] { return is_out_of_time(); }});
    is_linearised_ = false;
    if (is_out_of_time()) return end_out_of_time();
    is_examined_ = true;
    // Where pieces remain that are not examined, a way round their borders is tried before the point is accepted.
    const bool is_done = certificate_.is_stationary && (certificate_.n_unexamined == 0 || !retreat(progress));
    if (is_done) {
      status_ = Status::success;
      message_.clear();
      return;
    }
    if (!certificate_.is_stationary && !descend(certificate_) && !retreat(progress)) break;
    if (is_out_of_time()) break;
    is_examined_ = false;
  }
  if (is_out_of_time()) {
    is_examined_ = false;
    return end_out_of_time();
  }
  if (status_ == Status::step_limit) return;
  status_ = Status::inner_solver_failed;
  message_ = "a neighbouring piece of the cost descends, but no step along it is accepted";
}

/// Leaves a point where no step is accepted, because it lies on borders that curve or that J jumps across: iterations that
/// keep a distance from all borders, larger each time. @return whether J has fallen
bool Shooting::retreat(const Progress& progress) {
  for (; next_retreat_ < std::size(kRetreats) && !is_out_of_time(); ++next_retreat_) {
    const double before = merit(motion_);
    retreat_ = kRetreats[next_retreat_];
    Delta_ = std::max(Delta_, 100 * retreat_);
    last_size_ = std::numeric_limits<double>::infinity();
    is_linearised_ = false;
    iterate_until_done(std::min(kMaxRetreat, options_.max_iterations - iterations_), progress);
    retreat_ = 0;
    if (before - merit(motion_) <= kMeritRounding * (1 + std::abs(before))) continue;
    ++next_retreat_;
    Delta_ = std::max(Delta_, options_.Delta * kRestart);
    last_size_ = std::numeric_limits<double>::infinity();
    return true;
  }
  return false;
}

/// Takes a step along a descent of a certificate. @return whether one is accepted
bool Shooting::descend(const Certificate& certificate) {
  if (certificate.jump) {  // as far as the cost falls: beside a border its slope may be infinite
    double t = 1;
    while (t < kLongestJump && try_direction(certificate.jump->u, certificate.jump->H, t, 0)) t *= 2;
    if (t > 1) Delta_ = std::max(Delta_, options_.Delta * kRestart);
    return t > 1;
  }
  for (const auto& [value, d, into, into_value] : certificate.descents) {
    for (const double inside : kInside) {  // d lies on borders, which may curve
      const double slope = -(value + inside * into_value);
      if (slope <= 0) continue;
      double t = 1;
      for (int k = 0; k < kMaxHalvings; ++k, t *= 0.5)
        if (try_direction(d.u + inside * into.u, d.H + inside * into.H, t, slope)) {
          Delta_ = std::clamp(t, Delta_, kLargestDelta);
          return true;
        }
    }
  }
  return false;
}

/// Takes a step of length t along a direction, if the cost falls by a part of t slope.
bool Shooting::try_direction(const Matrix& d, double d_H, double t, double slope) {
  const Eigen::Index n_q = runner_.plant().n_q();
  const Vector x = motion_.x.col(0);
  if (is_out_of_time()) return false;
  runner_.run(x.head(n_q), x.tail(n_q), problem_.u.clamp(motion_.u + t * d), motion_.H + t * d_H, trial_);
  if (!trial_.succeeded() || merit(motion_) - merit(trial_) <= kArmijo * t * slope) return false;
  std::swap(motion_, trial_);
  last_size_ = std::numeric_limits<double>::infinity();
  return true;
}

ControlSolution Shooting::solve(const Matrix& u, double T, const Progress& progress) {
  return solve(std::span(&u, 1), T, progress);
}

ControlSolution Shooting::solve(std::span<const Matrix> guesses, double T, const Progress& progress) {
  start_ = now();
  derivative_seconds_ = 0;
  int iterations = 0;
  if (guesses.size() > 1) {
    std::optional<PlantMotion> best;
    double nu = 0, Delta = 0;
    for (const Matrix& u : guesses) {
      if (&u != &guesses.front() && is_out_of_time()) break;
      if (!begin(u, T)) continue;
      nu_ = std::max(nu_, nu);  // motions are compared with the largest so far
      iterate_until_done(kPolish, {});
      iterations += iterations_;
      nu = nu_;
      if (best && merit(motion_) >= merit(*best)) continue;
      best = motion_;
      Delta = Delta_;
    }
    if (!best) return result();
    motion_ = *best;
    Delta_ = Delta;
    is_linearised_ = false;
    iterations_ = iterations;
    message_.clear();
  } else if (!begin(guesses.front(), T)) {
    return result();
  }
  finish(progress);
  return result();
}

ControlSolution Shooting::resolve(int passed, const Vector& q, const Vector& v, const Progress& progress) {
  start_ = now();
  derivative_seconds_ = 0;
  const Eigen::Index n = 2 * runner_.plant().n_q();
  const int N = static_cast<int>(motion_.u.cols()) - passed;
  std::vector<Matrix> gains;
  if (!gains_.empty()) gains.assign(gains_.begin() + passed, gains_.end());
  bool has_feedback = false;
  const auto policy = [&](int k, const Eigen::Ref<const Vector>& x, Eigen::Ref<Vector> u) {
    u = motion_.u.col(passed + k);
    if (!has_feedback) return;
    u += gains[static_cast<std::size_t>(k)].leftCols(n) * (x - motion_.x.col(passed + k));
    u = u.cwiseMax(problem_.u.lower).cwiseMin(problem_.u.upper).eval();
  };
  runner_.run(q, v, policy, N, motion_.H, trial_);
  if (!gains.empty() && !(trial_.succeeded() && is_out_of_time())) {
    PlantMotion with_feedback;
    has_feedback = true;
    runner_.run(q, v, policy, N, motion_.H, with_feedback);
    if (with_feedback.succeeded() && (!trial_.succeeded() || merit(with_feedback) < merit(trial_)))
      std::swap(trial_, with_feedback);
  }
  if (!trial_.succeeded()) {
    ControlSolution failed;
    failed.status = trial_.status;
    failed.message = "rest of the last motion: " + trial_.message;
    failed.seconds = now() - start_;
    return failed;
  }
  std::swap(motion_, trial_);
  gains_ = std::move(gains);
  restart();
  finish(progress);
  return result();
}

ControlSolution Shooting::result() const {
  ControlSolution solution;
  solution.status = status_;
  solution.message = message_;
  if (motion_.succeeded()) solution.trajectory = runner_.trajectory(motion_);
  const WorstConstraint worst = runner_.worst(motion_);
  solution.violation = worst.value;
  solution.violated = worst.name;
  solution.iterations = iterations_;
  solution.rollouts = runner_.rollouts();
  solution.seconds = now() - start_;
  solution.derivative_seconds = derivative_seconds_;
  if (is_examined_) {
    solution.stationarity = certificate_.describe();
    solution.is_b_stationary = certificate_.is_b_stationary();
  }
  if (solution.succeeded() && worst.value > options_.feasibility) {
    solution.status = Status::infeasible;
    solution.message = fmt::format("the least violation found is {:.3g}: {}", worst.value, worst.name);
  }
  return solution;
}

}  // namespace ricochet
