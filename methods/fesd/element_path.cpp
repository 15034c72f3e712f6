#include "methods/fesd/element_path.h"

#include <algorithm>
#include <cmath>

#include "methods/contact_laws/bernstein.h"
#include "problems/dense_solve.h"

namespace ricochet {
namespace {

constexpr double kDistinct = 1e-10;  // abscissae

/// The sum of values and their weights.
double sum(const Vector& values, const double* weights, Eigen::Index n) {
  double total = 0;
  for (Eigen::Index k = 0; k < n; ++k) total += weights[k] * values[k];
  return total;
}

}  // namespace

/// The points without duplicate abscissae.
std::vector<ElementPath::Point> ElementPath::points_of(const ButcherTableau& tableau) {
  std::vector<Point> points{{-1, 0}, {tableau.n_s, 1}};
  for (int j = 0; j < tableau.n_s; ++j) {
    const double c = tableau.c[j];
    if (std::ranges::none_of(points, [&](const Point& p) { return std::abs(p.s - c) < kDistinct; }))
      points.push_back({j, c});
  }
  std::ranges::sort(points, {}, &Point::s);
  return points;
}

/// s^2 (1 - s)^2 prod (s_k - s) <= s^2 prod s_k up to the first of them
double ElementPath::nodes_of(const std::vector<Point>& points) {
  double product = 1;
  for (const Point& point : points) product *= point.s > 0 && point.s < 1 ? point.s : 1;
  return product;
}

/// The inverse of (1) for the Bernstein coefficients: B_k(s) at the points, and the slopes d (b_1 - b_0), d (b_d -
/// b_d-1) at the ends.
Matrix ElementPath::from_positions(const std::vector<Point>& points) {
  const int d = static_cast<int>(points.size()) + 1;
  Matrix B = Matrix::Zero(d + 1, d + 1);
  for (int row = 0; row < d - 1; ++row) B.row(row) = bernstein::basis(points[static_cast<std::size_t>(row)].s, d);
  B(d - 1, 0) = B(d, d - 1) = -d;
  B(d - 1, 1) = B(d, d) = d;
  return inverse_of(B);
}

/// The inverse of (2), of a degree that is two lower, raised twice: b_k <- (k b_k-1 + (d - k) b_k) / d.
Matrix ElementPath::from_velocities(const std::vector<Point>& points) {
  const auto n = static_cast<Eigen::Index>(points.size());
  Matrix B(n, n);
  for (Eigen::Index row = 0; row < n; ++row)
    B.row(row) = bernstein::basis(points[static_cast<std::size_t>(row)].s, static_cast<int>(n) - 1);
  Matrix weights = inverse_of(B);
  for (Eigen::Index d = n; d < n + 2; ++d) {
    Matrix raised = Matrix::Zero(d + 1, n);
    for (Eigen::Index k = 0; k <= d; ++k) {
      const double part = static_cast<double>(k) / static_cast<double>(d);
      if (k > 0) raised.row(k) += part * weights.row(k - 1);
      if (k < d) raised.row(k) += (1 - part) * weights.row(k);
    }
    weights = raised;
  }
  return weights;
}

ElementPath::ElementPath(const ButcherTableau& tableau)
    : n_s_(tableau.n_s),
      points_(points_of(tableau)),
      nodes_(nodes_of(points_)),
      from_positions_(from_positions(points_).transpose()),
      from_velocities_(from_velocities(points_).transpose()),
      values_(Vector::Zero(from_positions_.rows())) {}

/// @return after the values of the points
double* ElementPath::set_points(const Vector& left, const Matrix& stages, const Vector& right, int k) {
  double* value = values_.data();
  for (const Point& point : points_)
    *value++ = point.stage < 0 ? left[k] : point.stage < n_s_ ? stages(k, point.stage) : right[k];
  return value;
}

void ElementPath::set_position(const Element& stages, int k, Matrix& path) {
  double* slopes = set_points(stages.q0, stages.q, stages.q1, k);
  slopes[0] = stages.h * stages.v0[k];
  slopes[1] = stages.h * stages.v1[k];
  for (Eigen::Index j = 0; j < from_positions_.cols(); ++j)
    path(k, j) = sum(values_, from_positions_.col(j).data(), from_positions_.rows());
}

void ElementPath::set_velocity(const Element& stages, int k, Matrix& path, Eigen::Index row) {
  set_points(stages.v0, stages.v, stages.v1, k);
  for (Eigen::Index j = 0; j < from_velocities_.cols(); ++j)
    path(row, j) = sum(values_, from_velocities_.col(j).data(), from_velocities_.rows());
}

}  // namespace ricochet
