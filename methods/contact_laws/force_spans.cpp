#include "methods/contact_laws/force_spans.h"

#include <algorithm>
#include <cmath>

namespace ricochet {
namespace {

constexpr double kFirstSpan = 1.0 / 16;  // of the end time: span that is tried first
constexpr int kSpanHalvings = 24;
constexpr std::size_t kMaxSpans = 20'000;  // of a run; later ones are not halved
constexpr double kOfForce = 1e-3;          // (1), of a force
constexpr double kOfRange = 0.5;           // (1), of the range of its values
constexpr double kOfParabola = 0.25;       // (1b)
constexpr double kOfLargest = 1e-12;       // (1), of the largest force
constexpr double kWidthOfZero = 1e-280;    // bounds of a zero have a width that is less
constexpr double kSpansPerStep = 2;        // (2), spans
constexpr double kStepsAhead = 8;          // planned steps that are looked at ahead

}  // namespace

bool ForceSpans::uses_time(const Problem& problem) {
  const ProblemInfo& info = problem.info();
  if (info.clock < 0 || !info.structure.force_uses_position) return false;
  if (!info.structure.constant_force_jacobian) return true;
  Matrix f_q(info.n_q, info.n_q), f_v(info.n_q, info.n_q);
  problem.force_jacobians(info.q0.data(), info.v0.data(), info.u.data(), f_q.data(), f_v.data());
  return !f_q.col(info.clock).isZero(0);
}

ForceSpans::ForceSpans(const Problem& problem)
    : problem_(problem),
      T_(problem.info().end_time),
      start_(problem.info().start_time()),
      is_limited_(problem.info().structure.has_bounds && uses_time(problem)) {
  if (!is_limited_) return;
  for (auto* box : {&q_, &v_, &f_}) box->assign(static_cast<std::size_t>(problem.n_q()), Interval(0.0));
  for (auto* x : {&place_, &low_, &high_}) x->setZero(problem.n_q());
  for (Vector& f : value_) f.setZero(problem.n_q());
  const ProblemInfo& info = problem.info();
  hold(info.q0, info.v0);
  q_[static_cast<std::size_t>(info.clock)] = {start_, start_ + T_};
  problem.force_bounds(q_.data(), v_.data(), info.u.data(), f_.data());
  negligible_.setConstant(info.n_q, kWidthOfZero);
  for (Eigen::Index i = 0; i < negligible_.size(); ++i) {
    const double largest = f_[static_cast<std::size_t>(i)].magnitude();
    if (std::isfinite(largest)) negligible_[i] += kOfLargest * largest;
  }
}

void ForceSpans::hold(const Vector& q, const Vector& v) {
  place_ = q;
  for (Eigen::Index k = 0; k < q.size(); ++k) {
    q_[static_cast<std::size_t>(k)] = q[k];
    v_[static_cast<std::size_t>(k)] = v[k];
  }
}

/// (1), (1b)
bool ForceSpans::is_explained(double from, double to, const Vector& v) {
  const ProblemInfo& info = problem_.info();
  q_[static_cast<std::size_t>(info.clock)] = {start_ + from, start_ + to};
  problem_.force_bounds(q_.data(), v_.data(), info.u.data(), f_.data());
  for (int k = 0; k < 5; ++k) {
    place_[info.clock] = start_ + from + 0.25 * k * (to - from);
    problem_.force(place_.data(), v.data(), info.u.data(), value_[k].data());
    low_ = k == 0 ? value_[k] : low_.cwiseMin(value_[k]);
    high_ = k == 0 ? value_[k] : high_.cwiseMax(value_[k]);
  }
  for (Eigen::Index i = 0; i < low_.size(); ++i) {
    const double size = std::max(std::abs(low_[i]), std::abs(high_[i]));
    if (!std::isfinite(size)) return true;  // no number: the step there ends the run
    const double r = std::max({kOfRange * (high_[i] - low_[i]), kOfForce * size, negligible_[i]});
    const Interval& bounds = f_[static_cast<std::size_t>(i)];
    if (!(bounds.lower >= low_[i] - r && bounds.upper <= high_[i] + r)) return false;
    const auto f = [&](int k) { return value_[k][i]; };
    if (std::abs(f(1) - (3 * f(0) + 6 * f(2) - f(4)) / 8) > kOfParabola * r) return false;
    if (std::abs(f(3) - (-f(0) + 6 * f(2) + 3 * f(4)) / 8) > kOfParabola * r) return false;
  }
  return true;
}

double ForceSpans::longest_step(double t, double h, const Vector& q, const Vector& v) {
  double longest = T_ - t;
  if (!is_limited_) return longest;
  const double until = std::min(T_, t + h);
  if (known_until_ < until) {
    hold(q, v);
    const double end = std::min(T_, t + kStepsAhead * h);
    while (known_until_ < end) {
      const double from = known_until_;
      double to = std::min(T_, from + kFirstSpan * T_);
      for (int n = 0; n < kSpanHalvings && spans_.size() < kMaxSpans && !is_explained(from, to, v); ++n)
        to = from + 0.5 * (to - from);
      if (T_ - to < 1e-12 * T_) to = T_;
      spans_.push_back({from, to});
      known_until_ = to;
    }
  }
  while (passed_ < spans_.size() && spans_[passed_].to <= t) ++passed_;
  for (std::size_t k = passed_; k < spans_.size() && spans_[k].from < t + longest; ++k)
    longest = std::min(longest, std::max(spans_[k].from - t, kSpansPerStep * (spans_[k].to - spans_[k].from)));
  return longest;
}

}  // namespace ricochet
