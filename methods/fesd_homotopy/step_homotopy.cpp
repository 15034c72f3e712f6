#include "methods/fesd_homotopy/step_homotopy.h"

#include <Eigen/Cholesky>
#include <algorithm>

namespace ricochet {
namespace {

// Forces and impulses of the cold guess: inside of their bounds.
constexpr double kPositive = 0.1;
// A gap up to here at the end of a step is closed: what the crossover solves to [m].
constexpr double kTouching = 1e-9;
// Places where the smallest gap of a free flight is looked for.
constexpr int kProbes = 50;
// An impact is not guessed nearer to an end of the step than this part of it.
constexpr double kMargin = 0.05;

}  // namespace

StepHomotopy::StepHomotopy(const Problem& problem, const ButcherTableau& tableau, const Options& options, double H)
    : problem_(problem),
      info_(problem.info()),
      tableau_(tableau),
      options_(options),
      H_(H),
      equations_(problem, tableau, options.equations, mpcc_),
      initial_(equations_.add_initial_state(info_.q0, info_.v0)),
      right_(equations_.add_interval(initial_, {}, H, -1, 1)),
      solver_(mpcc_, options.homotopy) {
  if (options.guess == Guess::pivoting)
    pivoting_.emplace(problem, tableau, PivotingSolver::Options{.n_fe = options.equations.n_fe}, pivoting_counters_);
}

void StepHomotopy::start(const Vector& q, const Vector& v) {
  q_ = q;
  v_ = v;
  n_steps_ = 0;
  const Vector gap = problem_.gap(q);
  is_closed_.assign(info_.contacts.size(), false);
  for (int i = 0; i < info_.n_c(); ++i) is_closed_[i] = gap[i] <= kTouching;
  if (pivoting_) pivoting_->start(q, v);
}

Status StepHomotopy::advance() {
  equations_.set_initial_state(initial_, q_, v_, is_closed_);
  const bool has_pivoted = pivoting_ && pivoting_->advance(H_) == Status::success;
  if (pivoting_ && !has_pivoted) pivoting_.reset();
  const bool is_cold = options_.guess == Guess::cold;
  equations_.set_guess(has_pivoted ? pivoting_->step() : is_cold ? cold() : ballistic(), 0);
  for (attempts_ = 1;; ++attempts_) {
    HomotopyOptions homotopy = options_.homotopy;
    if (attempts_ > 1 && options_.retry_sigma_0 > 0) homotopy.sigma_0 = options_.retry_sigma_0;
    solver_.set_options(homotopy);
    solution_ = solver_.solve();
    if (solution_.succeeded() || attempts_ > options_.retries) break;
    equations_.set_guess(bounce(), 0);
  }
  if (solution_.succeeded()) accept();
  return solution_.status;
}

void StepHomotopy::accept() {
  current_ = 1 - current_;
  steps_[current_] = equations_.read(solution_.x, 0);
  ++n_steps_;
  FesdStep& step = steps_[current_];
  step.touches = true;
  q_ = step.last().q1;
  v_ = step.last().v1;
  for (std::size_t i = 0; i < is_closed_.size(); ++i)
    is_closed_[i] = is_closed(step.last().modes[i]) || solution_.x[right_.gap[i]] <= kTouching;
}

FesdStep StepHomotopy::cold() const {
  FesdStep step;
  const int n_fe = options_.equations.n_fe;
  step.resize(problem_, tableau_.n_s, n_fe);
  step.n_elements = n_fe;
  for (auto& element : step.elements) {
    element.h = H_ / n_fe;
    element.q0 = element.q1 = q_;
    element.v0 = element.v1 = v_;
    element.q = q_.replicate(1, tableau_.n_s);
    element.v = v_.replicate(1, tableau_.n_s);
    element.a.setZero();
    element.lambda_n.setConstant(kPositive);
    element.lambda_t.setZero();
  }
  step.v_minus = v_.replicate(1, n_fe);
  step.Lambda_n.setConstant(kPositive);
  return step;
}

/// An element of length h with constant acceleration M^-1 f_v, from (q, v).
void StepHomotopy::fly(Stages& element, const Vector& q, const Vector& v, double h) const {
  const Vector a = problem_.mass_matrix(q).llt().solve(problem_.force(q, v));
  const auto q_at = [&](double t) -> Vector { return q + t * v + t * t / 2 * a; };
  element.h = h;
  element.q0 = q;
  element.v0 = v;
  for (int j = 0; j < tableau_.n_s; ++j) {
    element.q.col(j) = q_at(tableau_.c[j] * h);
    element.v.col(j) = v + tableau_.c[j] * h * a;
    element.a.col(j) = a;
  }
  element.q1 = q_at(h);
  element.v1 = v + h * a;
  element.lambda_n.setZero();
  element.lambda_t.setZero();
}

FesdStep StepHomotopy::ballistic() const {
  FesdStep step;
  const int n_fe = options_.equations.n_fe;
  step.resize(problem_, tableau_.n_s, n_fe);
  step.n_elements = n_fe;
  Vector q = q_, v = v_;
  for (int n = 0; n < n_fe; ++n) {
    step.v_minus.col(n) = v;
    fly(step.elements[n], q, v, H_ / n_fe);
    q = step.elements[n].q1;
    v = step.elements[n].v1;
  }
  return step;
}

double StepHomotopy::time_of_smallest_gap(int& contact) const {
  const Vector a = problem_.mass_matrix(q_).llt().solve(problem_.force(q_, v_));
  double smallest = kInfinity, time = 0;
  for (int k = 0; k <= kProbes; ++k) {
    const double t = H_ * (kMargin + (1 - 2 * kMargin) * k / kProbes);
    const Vector gap = problem_.gap(q_ + t * v_ + t * t / 2 * a);
    Eigen::Index i = 0;
    const double least = gap.minCoeff(&i);
    if (least >= smallest) continue;
    smallest = least;
    time = t;
    contact = static_cast<int>(i);
    if (smallest <= 0) break;
  }
  return time;
}

FesdStep StepHomotopy::bounce() const {
  FesdStep step = ballistic();
  const int n_fe = options_.equations.n_fe;
  if (n_fe < 2 || info_.n_c() == 0) return step;
  int contact = 0;
  const double t = time_of_smallest_gap(contact);
  const int n_impact = std::clamp(static_cast<int>(std::lround(n_fe * t / H_)), 1, n_fe - 1);
  Vector q = q_, v = v_;
  for (int n = 0; n < n_fe; ++n) {
    step.v_minus.col(n) = v;
    if (n == n_impact) {
      const Vector J = problem_.normal_jacobian(q).col(contact);
      const Vector M_J = problem_.mass_matrix(q).llt().solve(J);
      const double Lambda = (1 + info_.contacts[contact].eps_r) * std::abs(J.dot(v)) / J.dot(M_J);
      step.Lambda_n(contact, n) = Lambda;
      v += Lambda * M_J;
    }
    fly(step.elements[n], q, v, n < n_impact ? t / n_impact : (H_ - t) / (n_fe - n_impact));
    q = step.elements[n].q1;
    v = step.elements[n].v1;
  }
  return step;
}

}  // namespace ricochet
