#pragma once

#include <vector>

#include "methods/elements/element.h"
#include "methods/runge_kutta/butcher_tableau.h"

namespace ricochet {

/// The motion in an element as polynomials of s, 0 <= s <= 1, by their Bernstein coefficients. With the points of the
/// element - left end, stages, right end - at s_k, those of a position and of a velocity are
///
///   q(s_k) = q_k,   q'(0) = h v_0,   q'(1) = h v_1                                        (1)
///   v(s_k) = v_k                                                                          (2)
class ElementPath {
 public:
  explicit ElementPath(const ButcherTableau& tableau);

  int degree() const { return static_cast<int>(from_positions_.cols()) - 1; }
  /// Abscissa of the first point after the left end.
  double first_point() const { return points_[1].s; }
  /// w of gap_search.h, the product of the abscissae inside.
  double nodes() const { return nodes_; }

  /// (1) of one coordinate, into the row k of `path`, n_q x (degree() + 1).
  void set_position(const Element& stages, int k, Matrix& path);
  /// (2) of one coordinate, raised to the same degree, into the given row.
  void set_velocity(const Element& stages, int k, Matrix& path, Eigen::Index row);

 private:
  /// A point of an element: the stage, -1 for the left and n_s for the right end.
  struct Point {
    int stage;
    double s;
  };
  static std::vector<Point> points_of(const ButcherTableau& tableau);
  static Matrix from_positions(const std::vector<Point>& points);
  static double nodes_of(const std::vector<Point>& points);
  static Matrix from_velocities(const std::vector<Point>& points);
  double* set_points(const Vector& left, const Matrix& stages, const Vector& right, int k);

  const int n_s_;
  const std::vector<Point> points_;  // ascending
  const double nodes_;
  const Matrix from_positions_;   // column k: weights of the values of (1) in coefficient k
  const Matrix from_velocities_;  // the same of (2)
  Vector values_;                 // of one coordinate
};

}  // namespace ricochet
