#include "methods/fesd/gap_minima.h"

#include <cmath>
#include <utility>

#include "methods/contact_laws/gap_cubic.h"
#include "problems/packed_column.h"

namespace ricochet {
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
      const GapCubic gap(left_gap_[i], length * left_rate_[i], gap_[i], length * rate_[i]);
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
