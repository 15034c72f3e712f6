#pragma once

#include <vector>

#include "problems/interval.h"
#include "problems/problem.h"
#include "reference/contact_dynamics.h"
#include "reference/slips.h"

namespace ricochet::reference {

/// Bounds of the contact forces over boxes of q and v, with the modes of ContactDynamics: of the solution x = (v',
/// lambda) of its equations (1) to (4),
///
///   [ M   -C ] x = [ f    ]
///   [ R'   0 ]     [ -bias ]                                                             (1)
///
/// with K the matrix and b the right-hand side over the boxes, Y the inverse of K at their middle, and x_0 = Y b there.
/// Where
///
///   d + |I - Y K| e <= e,   d = |Y (b - K x_0)|                                          (2)
///
/// in every component, x lies within x_0 +- e (Krawczyk's test; Neumaier, Interval Methods for Systems of Equations,
/// 1990, section 4.1). Where K is constant, its rounding is all that (2) has, and Y is kept until the modes change.
class ForceBounds {
 public:
  ForceBounds(const Problem& problem, const ContactDynamics& dynamics, const Slips& slips);

  /// Boxes and their middle. False where there are no bounds.
  bool evaluate(const Interval* q, const Interval* v, const double* q_middle, const double* v_middle);
  /// Of the last evaluate().
  const Interval& normal_force(int i) const { return x_[static_cast<std::size_t>(row_[i])]; }
  Interval cone_margin(int i) const;

 private:
  void set_matrix(const Interval* q, const Interval* v);
  bool invert(const double* q, const double* v);
  bool is_constant() const;

  const Problem& problem_;
  const ContactDynamics& dynamics_;
  const Slips& slips_;
  std::vector<ContactMode> modes_;  // of Y
  bool has_inverse_ = false;
  std::vector<int> row_;  // by contact, of its first unknown force
  Eigen::Index size_ = 0;
  Matrix Y_, E_;
  std::vector<char> chosen_;
  std::vector<Interval> K_, b_, x_, M_, normal_, tangent_, bias_, T_;
};

}  // namespace ricochet::reference
