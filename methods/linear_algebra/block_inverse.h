#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "methods/linear_algebra/islands.h"
#include "methods/linear_algebra/small_lu.h"
#include "problems/disjoint_sets.h"

namespace ricochet {

/// Inverse of a mass matrix or an iteration matrix, a block per island: no entry couples coordinates of two islands,
/// which are found from the matrix itself. A diagonal matrix has islands of one coordinate. Allocates only when the
/// islands change.
class BlockInverse {
 public:
  /// @param A  n x n; entries of the inverse are not finite when A is singular
  /// @param as_one  one island, whatever A is
  void compute(const Matrix& A, bool as_one = false);

  std::int64_t version() const { return version_; }    ///< changes with every compute()
  const Islands& islands() const { return islands_; }  ///< of coordinates

  /// y = A^-1 x, and the same for some islands: entries of y at their coordinates.
  void apply(const Vector& x, Vector& y) const;
  void apply(std::span<const int> islands, const Vector& x, Vector& y) const;

 private:
  bool islands_change(const Matrix& A, bool as_one);
  void apply(int island, const Vector& x, Vector& y) const;

  std::int64_t version_ = 0;
  DisjointSets sets_;  // of coordinates: one per island
  Islands islands_;
  std::vector<Matrix> blocks_, inverses_;  // per island
  std::vector<SmallLu> factors_;
};

}  // namespace ricochet
