#pragma once

#include <algorithm>
#include <memory>
#include <vector>

#include "problems/problem.h"

namespace ricochet {

using MatrixMap = Eigen::Map<Matrix>;
using VectorMap = Eigen::Map<Vector>;

/// Storage for intermediate matrices whose sizes vary from call to call. Matrices are taken one after the other and given
/// back together, where a Frame ends. The storage stays, so that the same work allocates nothing the second time.
class ScratchPool {
 public:
  /// Gives back at its end what was taken during its life.
  class Frame {
   public:
    explicit Frame(ScratchPool& pool) : pool_(pool), block_(pool.block_), used_(pool.used_) {}
    ~Frame() {
      pool_.block_ = block_;
      pool_.used_ = used_;
    }
    Frame(const Frame&) = delete;
    Frame& operator=(const Frame&) = delete;

   private:
    ScratchPool& pool_;
    const std::size_t block_, used_;
  };

  ScratchPool() = default;
  ScratchPool(const ScratchPool&) = delete;
  ScratchPool& operator=(const ScratchPool&) = delete;

  /// Entries are undefined.
  MatrixMap matrix(Eigen::Index rows, Eigen::Index cols) { return {take(rows * cols), rows, cols}; }
  VectorMap vector(Eigen::Index size) { return {take(size), size}; }
  MatrixMap zeros(Eigen::Index rows, Eigen::Index cols) {
    MatrixMap values = matrix(rows, cols);
    values.setZero();
    return values;
  }

 private:
  static constexpr std::size_t kSmallestBlock = 1 << 12;
  struct Block {
    std::unique_ptr<double[]> values;
    std::size_t size;
  };

  double* take(Eigen::Index size) {
    const auto n = static_cast<std::size_t>(size);
    while (block_ < blocks_.size() && used_ + n > blocks_[block_].size) {
      ++block_;
      used_ = 0;
    }
    if (block_ == blocks_.size()) {
      const std::size_t length = std::max(kSmallestBlock, n);
      blocks_.push_back({std::make_unique_for_overwrite<double[]>(length), length});
    }
    double* values = blocks_[block_].values.get() + used_;
    used_ += n;
    return values;
  }

  std::vector<Block> blocks_;
  std::size_t block_ = 0, used_ = 0;  // the next value
};

}  // namespace ricochet
