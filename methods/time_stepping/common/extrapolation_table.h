#pragma once

#include <array>

#include "problems/problem.h"

namespace ricochet {

/// Extrapolation of results T_{j,1} of j steps of length h/j, whose error has an expansion in powers of h,
///
///   T_{j,i+1} = T_{j,i} + (T_{j,i} - T_{j-1,i}) / (j / (j - i) - 1),   j = 1, 2, ..         (1)
///
/// (Aitken, Neville): T_{j,j} has order j, and T_{j,j} - T_{j,j-1} is the error of T_{j,j-1}.
class ExtrapolationTable {
 public:
  static constexpr int kMaxRows = 8;

  explicit ExtrapolationTable(Eigen::Index n) : x_(Vector::Zero(n)), y_(x_) {
    for (auto& x : row_) x = x_;
  }

  void clear() { j_ = 0; }
  int rows() const { return j_; }
  /// T_{j,1} of the next row, to be filled before extrapolate().
  Vector& next() { return x_; }
  /// (1) of the next row.
  void extrapolate() {
    ++j_;
    for (int i = 1; i < j_; ++i) {  // T_{j-1,i} -> T_{j,i} in place
      y_ = row_[i];
      row_[i] = x_;
      x_ += (x_ - y_) / (static_cast<double>(j_) / (j_ - i) - 1);
    }
    row_[j_] = x_;
  }

  const Vector& best() const { return row_[j_]; }        ///< T_{j,j} of the last row
  const Vector& before() const { return row_[j_ - 1]; }  ///< T_{j,j-1}

 private:
  std::array<Vector, kMaxRows + 1> row_;  // T_{j,i}, i = 1 .. j, of the last row
  Vector x_, y_;
  int j_ = 0;
};

}  // namespace ricochet
