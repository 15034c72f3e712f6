#include "methods/fesd/gap_minima.h"

#include <gsl/gsl_poly.h>

#include <cmath>
#include <utility>

#include "problems/packed_column.h"

namespace ricochet {
namespace {

/// p of (1), s in units of the interval.
struct Cubic {
  double c0, c1, c2, c3;

  /// @param left_rate, right_rate  per unit of s
  Cubic(double left, double left_rate, double right, double right_rate)
      : c0(left),
        c1(left_rate),
        c2(3 * (right - left) - 2 * left_rate - right_rate),
        c3(2 * (left - right) + left_rate + right_rate) {}

  double operator()(double s) const { return c0 + s * (c1 + s * (c2 + s * c3)); }

  /// Where it has its minimum in (0, 1), when it falls at 0 and rises at 1.
  double minimum() const {
    double s[2]{0.5, 0.5};
    const int n = gsl_poly_solve_quadratic(3 * c3, 2 * c2, c1, &s[0], &s[1]);
    return n == 2 && !(s[0] > 0 && s[0] < 1) ? s[1] : s[0];
  }

  /// Its first root before a negative minimum.
  double first_root(double minimum) const {
    if (c3 == 0) {
      double s[2]{0, 0};
      gsl_poly_solve_quadratic(c2, c1, c0, &s[0], &s[1]);
      return s[0];
    }
    double s[3]{0, 0, 0};
    const int n = gsl_poly_solve_cubic(c2 / c3, c1 / c3, c0 / c3, &s[0], &s[1], &s[2]);
    for (int k = 0; k < n; ++k) {
      if (s[k] > 0 && s[k] < minimum) return s[k];
    }
    return 0.5 * minimum;  // only a guess is asked for
  }
};

}  // namespace

GapMinima::GapMinima(const Problem& problem, const ButcherTableau& tableau, const ContactScales& scales)
    : problem_(problem), tableau_(tableau), scales_(scales) {
  J_n_.setZero(problem.info().n_normal_entries);
  gap_.setZero(problem.n_c());
  rate_ = left_gap_ = left_rate_ = gap_;
}

void GapMinima::evaluate(const double* q, const double* v) {
  problem_.gap(q, gap_.data());
  problem_.normal_jacobian(q, J_n_.data());
  for (const int i : problem_.info().unilateral) {
    const auto& contact = problem_.info().contacts[i];
    rate_[i] = packed_dot(contact, J_n_.data() + contact.normal_begin, v);
  }
}

Violation GapMinima::check(const Element& stages) {
  Violation first;
  const int n_s = tableau_.n_s, n_points = tableau_.is_stiffly_accurate() ? n_s : n_s + 1;
  evaluate(stages.q0.data(), stages.v0.data());
  double left_time = 0;
  for (int j = 0; j < n_points && !first; ++j) {
    std::swap(gap_, left_gap_);
    std::swap(rate_, left_rate_);
    const double time = j < n_s ? tableau_.c[j] * stages.h : stages.h, length = time - left_time;
    if (j < n_s)
      evaluate(stages.q.col(j).data(), stages.v.col(j).data());
    else
      evaluate(stages.q1.data(), stages.v1.data());
    for (const int i : problem_.info().unilateral) {
      if (is_closed(stages.modes[i]) || !(left_rate_[i] < 0 && rate_[i] > 0 && length > 0)) continue;
      const Cubic gap(left_gap_[i], length * left_rate_[i], gap_[i], length * rate_[i]);
      const double s = gap.minimum();
      if (!(left_gap_[i] > 0) || gap(s) >= -scales_.touching(i)) continue;  // (1)
      const double t = left_time + length * gap.first_root(s);
      if (!first || t < first.time)
        first = {.kind = Violation::Kind::past_switch,
                 .passed = Switch::Kind::gap_closes,
                 .contact = i,
                 .time = t,
                 .value = gap(s)};
    }
    left_time = time;
  }
  return first;
}

}  // namespace ricochet
