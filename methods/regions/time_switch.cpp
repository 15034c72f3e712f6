#include "methods/regions/time_switch.h"

#include <cmath>
#include <utility>
#include <vector>

namespace ricochet {
namespace {

constexpr int kSpans = 64;             // in which a zero is searched first
constexpr double kResolution = 1e-12;  // of the span: where bounds are divided no further

}  // namespace

double first_time_switch(const Problem& problem, int k, const Interval& span, Vector q, const Vector& v) {
  const int clock = problem.info().clock;
  const std::size_t n_s = problem.info().switches.size();
  const double from = span.lower, to = span.upper;
  Vector psi(static_cast<Eigen::Index>(n_s));
  const auto value = [&](double t) {
    q[clock] = t;
    problem.switching(q.data(), v.data(), psi.data());
    return psi[k];
  };
  std::vector<Interval> q_box(q.data(), q.data() + q.size()), v_box(v.data(), v.data() + v.size()), bounds(n_s);
  const auto may_vanish = [&](double a, double b) {
    q_box[clock] = {a, b};
    problem.switching_bounds(q_box.data(), v_box.data(), bounds.data());
    return !(bounds[k].lower > 0 || bounds[k].upper < 0);
  };
  const double least = kResolution * (to - from);
  std::vector<std::pair<double, double>> spans;  // the next one last
  for (int m = kSpans; m > 0; --m)
    spans.emplace_back(from + (to - from) * (m - 1) / kSpans, from + (to - from) * m / kSpans);
  while (!spans.empty()) {
    auto [a, b] = spans.back();
    spans.pop_back();
    if (!may_vanish(a, b)) continue;
    const double middle = 0.5 * (a + b);
    if (b - a > least) {
      spans.emplace_back(middle, b);
      spans.emplace_back(a, middle);
      continue;
    }
    double f_a = value(a - least);
    if (const double f_b = value(b + least); f_a * f_b > 0) continue;  // touches zero
    for (a -= least, b += least; b - a > 1e-16 * std::abs(b);) {
      const double m = 0.5 * (a + b), f = value(m);
      if (m <= a || m >= b) break;
      (f_a * f > 0 ? a : b) = m;
    }
    return b;
  }
  return to;
}

}  // namespace ricochet
