#pragma once

#include <cstdint>
#include <vector>

#include "methods/linear_algebra/small_inverse.h"
#include "problems/disjoint_sets.h"

namespace ricochet {

/// Inverse of a mass matrix or an iteration matrix by its blocks: the sets of coordinates that no entry couples, found
/// from the matrix itself. A diagonal matrix has blocks of one coordinate. Allocates only when the blocks change.
class BlockInverse {
 public:
  /// @param A  n x n; entries of the inverse are not finite when A is singular
  /// @param as_one  one block, whatever A is
  void compute(const Matrix& A, bool as_one = false);

  std::int64_t version() const { return version_; }  ///< changes with every compute()
  int n() const { return static_cast<int>(block_of_.size()); }
  int n_blocks() const { return static_cast<int>(inverses_.size()); }
  int block_of(int coordinate) const { return block_of_[coordinate]; }
  /// Ascending coordinates of a block.
  const int* coordinates(int block) const { return coordinates_.data() + first_[block]; }
  int size(int block) const { return first_[block + 1] - first_[block]; }

  /// y = A^-1 x, and the same for one block: entries of y at its coordinates.
  void apply(const Vector& x, Vector& y) const;
  void apply(int block, const Vector& x, Vector& y) const;

 private:
  bool find_blocks(const Matrix& A, bool as_one);

  std::int64_t version_ = 0;
  DisjointSets blocks_;
  std::vector<int> block_of_, first_, coordinates_;
  std::vector<Matrix> parts_, inverses_;
  std::vector<SmallInverse> factors_;
};

}  // namespace ricochet
