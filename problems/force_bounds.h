#pragma once

#include <Eigen/LU>
#include <span>
#include <vector>

#include "problems/interval.h"
#include "problems/problem.h"
#include "problems/solution.h"

namespace ricochet {

/// Bounds of the contact forces over boxes of q and v while every contact keeps its mode. Let x = (v', lambda) contain
/// the accelerations and the unknown forces of the closed contacts. It solves
///
///   [ M   -C ] x = [ f    ]
///   [ R'   0 ]     [ -bias ]                                                             (1)
///
/// R has the columns J_n, and J_t for a sticking contact. C has the same columns, but J_n - mu J_t d for a contact that
/// slips along d. bias is v' (grad^2 f_c) v and T v. Let K be the matrix and b the right-hand side over the boxes, Y
/// the inverse of K at their middle, and x_0 = Y b there. If
///
///   d + |I - Y K| e <= e,   d = |Y (b - K x_0)|                                          (2)
///
/// holds in every component, x lies within x_0 +- e (Krawczyk's test; Neumaier, Interval Methods for Systems of
/// Equations, 1990, section 4.1). If K is constant, (2) contains only its rounding error, and Y is kept until the modes
/// change.
///
/// There are no bounds for redundant contacts, for modes on a friction polygon, and for more than 60 coordinates.
/// Nothing is allocated while sizes stay the same.
class ForceBounds {
 public:
  /// @param problem  must outlive this object and have structure.has_bounds
  explicit ForceBounds(const Problem& problem);

  /// Whether the problem has bounds and few enough coordinates.
  static bool exist_for(const Problem& problem) { return problem.n_q() <= kMostCoordinates; }

  /// Modes of all contacts until the next call; bilateral ones are closed. Releases held directions.
  void set_modes(std::span<const ContactMode> modes);
  /// Sets a direction of slip in space that does not follow v. @param d  2, a unit vector
  void hold_direction(int contact, const double* d);
  const std::vector<int>& closed() const { return closed_; }  ///< contacts that are not open

  /// Evaluates the bounds over boxes with these middles. False if there are no bounds.
  bool evaluate(const Interval* q, const Interval* v, const double* q_middle, const double* v_middle);
  /// Bounds of the last evaluate() for a closed contact.
  const Interval& normal_force(int contact) const { return x_[static_cast<std::size_t>(row_[contact])]; }
  /// Bounds of mu lambda_n - ||lambda_t|| for a sticking contact.
  Interval cone_margin(int contact) const;

 private:
  static constexpr int kMostCoordinates = 60;  // for more, dense interval matrices cost more than short steps

  void set_matrix(const Interval* q, const Interval* v);
  void set_direction(int contact, const Interval* v, Interval* direction) const;
  void set_right_side(const Interval* q, const Interval* v);
  bool invert(const double* q, const double* v);
  bool contract();

  const Problem& problem_;
  const ProblemInfo& info_;
  std::vector<ContactMode> modes_;
  std::vector<int> closed_;
  std::vector<char> is_held_;                                        // the same
  std::vector<double> held_;                                         // n_lambda_t
  std::vector<int> row_;                                             // by contact, of its first unknown force
  Eigen::Index size_ = 0;                                            // of (1)
  bool has_modes_ = false, is_tried_ = false, has_inverse_ = false,  // tried: to invert a constant K
      is_constant_ = false, is_on_polygon_ = false;
  Eigen::PartialPivLU<Matrix> factors_;
  Matrix middle_, Y_, E_;
  Vector x_0_, d_, e_, next_;
  std::vector<Interval> K_, b_, x_, M_, normal_, tangent_, bias_, T_, q_point_, v_point_;
};

}  // namespace ricochet
