#include "methods/fesd/element_gaps.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>

#include "methods/contact_laws/bernstein.h"

namespace ricochet {
namespace {

constexpr double kOfFirstStage = 0.01;  // of the gap there, that q(s) may be wrong by before it
constexpr double kDistinct = 1e-10;     // abscissae

}  // namespace

/// Those with abscissae of their own.
std::vector<ElementGaps::Point> ElementGaps::points_of(const ButcherTableau& tableau) {
  std::vector<Point> points{{-1, 0}, {tableau.n_s, 1}};
  for (int j = 0; j < tableau.n_s; ++j) {
    const double c = tableau.c[j];
    if (std::ranges::none_of(points, [&](const Point& p) { return std::abs(p.s - c) < kDistinct; }))
      points.push_back({j, c});
  }
  std::ranges::sort(points, {}, &Point::s);
  return points;
}

/// The inverse of (2) for the Bernstein coefficients: B_k(s) at the points, and the slopes d (b_1 - b_0), d (b_d -
/// b_d-1) at the ends.
Matrix ElementGaps::bernstein_from(const std::vector<Point>& points) {
  const int d = static_cast<int>(points.size()) + 1;
  Matrix B = Matrix::Zero(d + 1, d + 1);
  for (int row = 0; row < d - 1; ++row) B.row(row) = bernstein::basis(points[static_cast<std::size_t>(row)].s, d);
  B(d - 1, 0) = B(d, d - 1) = -d;
  B(d - 1, 1) = B(d, d) = d;
  return B.inverse();
}

ElementGaps::ElementGaps(const Problem& problem, const ButcherTableau& tableau, const ContactScales& scales)
    : problem_(problem),
      scales_(scales),
      n_s_(tableau.n_s),
      points_(points_of(tableau)),
      from_values_(bernstein_from(points_).transpose()),
      search_(problem, static_cast<int>(points_.size()) + 1),
      values_(Vector::Zero(from_values_.cols())),
      is_set_(static_cast<std::size_t>(problem.n_q()), 0),
      J_n_(Vector::Zero(problem.info().n_normal_entries)) {}

/// (2), of the coordinates that gaps of open contacts depend on.
void ElementGaps::set_path(const Element& stages) {
  const auto& info = problem_.info();
  std::ranges::fill(is_set_, 0);
  const Eigen::Index n = from_values_.cols();
  for (const int i : info.unilateral) {
    if (is_closed(stages.modes[static_cast<std::size_t>(i)])) continue;
    for (const int k : info.contacts[static_cast<std::size_t>(i)].support) {
      if (is_set_[static_cast<std::size_t>(k)]) continue;
      is_set_[static_cast<std::size_t>(k)] = 1;
      double* value = values_.data();
      for (const Point& point : points_)
        *value++ = point.stage < 0 ? stages.q0[k] : point.stage < n_s_ ? stages.q(k, point.stage) : stages.q1[k];
      *value++ = stages.h * stages.v0[k];
      *value = stages.h * stages.v1[k];
      for (Eigen::Index row = 0; row < n; ++row) {
        const double* weight = from_values_.col(row).data();
        double sum = 0;
        for (Eigen::Index c = 0; c < n; ++c) sum += weight[c] * values_[c];
        search_.path()(k, row) = sum;
      }
    }
  }
}

Violation ElementGaps::check(const Element& stages, std::span<const int> unloaded) {
  Violation first;
  const auto& info = problem_.info();
  const auto is_open = [&](int i) { return !is_closed(stages.modes[static_cast<std::size_t>(i)]); };
  if (std::ranges::none_of(info.unilateral, is_open)) return first;
  set_path(stages);
  search_.begin(stages.modes);
  if (!unloaded.empty()) problem_.normal_jacobian(stages.q0.data(), J_n_.data());
  for (const int i : info.unilateral) {
    if (!is_open(i)) continue;
    double touching = std::max(scales_.touching(i), -2 * search_.left_gap(i));
    if (std::ranges::find(unloaded, i) != unloaded.end())
      touching += ContactScales::of_positions(info.contacts[static_cast<std::size_t>(i)], J_n_.data(), stages.q0);
    GapSearch::Allowance allowed{.gap = touching, .rounding = touching};
    if (search_.left_gap(i) <= scales_.nearly_touching(i)) {
      allowed.until = points_[1].s;
      allowed.gap_until = std::max(touching, kOfFirstStage * search_.gap(i, points_[1].s));
    }
    const auto closing = search_.first_closing(i, allowed);
    if (!closing) continue;
    const double time = search_.zero(i, closing) * stages.h;
    if (first && time >= first.time) continue;
    first = {.kind = Violation::Kind::past_switch,
             .passed = Switch::Kind::gap_closes,
             .contact = i,
             .time = time,
             .value = search_.gap(i, closing.to)};
  }
  return first;
}

}  // namespace ricochet
