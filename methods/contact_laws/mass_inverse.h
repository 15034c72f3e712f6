#pragma once

#include <Eigen/Cholesky>
#include <span>

#include "methods/linear_algebra/islands.h"
#include "problems/problem.h"
#include "problems/solution.h"

namespace ricochet {

/// The inverse of the mass matrix M(q) by Cholesky's factorisation, or by its diagonal where it has no other entries.
/// A constant M is factorised once. Its islands are those of ProblemInfo::Structure::couplings, at any q; bilateral
/// constraints join all coordinates in one island.
class MassInverse {
 public:
  MassInverse(const Problem& problem, Counters& counters);

  /// @return false when M(q) is not positive definite
  bool set_position(const Vector& q);

  const Islands& islands() const { return islands_; }  ///< of coordinates

  /// x <- M^-1 x
  void solve_in_place(Eigen::Ref<Vector> x) const;
  /// y = M^-1 x, and the same for some islands, when x is zero outside of them: entries of y at their coordinates.
  void apply(const Vector& x, Vector& y) const;
  void apply(std::span<const int> islands, const Vector& x, Vector& y) const;

 private:
  bool factorize(const Vector& q);

  const Problem& problem_;
  const ProblemInfo::Structure& structure_;
  Counters& counters_;
  Islands islands_;
  Matrix M_;
  Eigen::LLT<Matrix> llt_;  // unless M is diagonal
};

}  // namespace ricochet
