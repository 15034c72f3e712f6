#include "methods/linear_algebra/rank_revealing.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace ricochet {
namespace {

constexpr double kRounding = std::numeric_limits<double>::epsilon();
/// A diagonal entry of which elimination leaves a smaller part depends on the others: some thousand roundings, since a
/// pivot is a difference of sums of products.
constexpr double kDependent = 1e-12;
/// Smallest pivot of SmallLu, relative to its column, up to which complete pivoting takes its place: the equations of
/// redundant contacts are singular but for rounding.
constexpr double kSuspicious = 1e-10;

void make_room(std::vector<double>& values, Eigen::Index size) {
  if (static_cast<Eigen::Index>(values.size()) < size) values.resize(static_cast<std::size_t>(size));
}

/// In place: the lower triangle of a positive definite A becomes its Cholesky factor.
void factorize_definite(Eigen::Map<Matrix> A) {
  const Eigen::Index n = A.rows();
  for (Eigen::Index j = 0; j < n; ++j) {
    for (Eigen::Index k = 0; k < j; ++k) A.col(j).tail(n - j) -= A(j, k) * A.col(k).tail(n - j);
    A.col(j).tail(n - j) /= std::sqrt(A(j, j));
  }
}

/// X <- (L L')^-1 X
void solve_definite(const Eigen::Map<Matrix>& L, Eigen::Map<Matrix> X) {
  L.triangularView<Eigen::Lower>().solveInPlace(X);
  L.transpose().triangularView<Eigen::Upper>().solveInPlace(X);
}

}  // namespace

void CompletePivotingLu::factorize(const Eigen::Ref<const Matrix>& A) {
  n_ = A.rows();
  make_room(lu_, n_ * n_);
  make_room(x_, n_);
  rows_.resize(static_cast<std::size_t>(n_));
  columns_.resize(static_cast<std::size_t>(n_));
  Eigen::Map<Matrix> LU = lu();
  LU = A;
  double largest = 0;
  rank_ = 0;
  is_finite_ = A.allFinite();
  for (Eigen::Index k = 0; k < n_; ++k) {
    Eigen::Index row = k, column = k;
    double pivot = -1;
    for (Eigen::Index j = k; j < n_; ++j) {
      for (Eigen::Index i = k; i < n_; ++i) {
        if (std::abs(LU(i, j)) <= pivot) continue;
        pivot = std::abs(LU(i, j));
        row = i;
        column = j;
      }
    }
    rows_[static_cast<std::size_t>(k)] = row;
    columns_[static_cast<std::size_t>(k)] = column;
    largest = std::max(largest, pivot);
    if (pivot <= largest * kRounding * static_cast<double>(n_)) {
      for (auto rest = static_cast<std::size_t>(k); rest < rows_.size(); ++rest)
        rows_[rest] = columns_[rest] = static_cast<Eigen::Index>(rest);
      return;
    }
    ++rank_;
    if (row != k) LU.row(k).swap(LU.row(row));
    if (column != k) LU.col(k).swap(LU.col(column));
    const Eigen::Index rest = n_ - k - 1;
    LU.col(k).tail(rest) /= LU(k, k);
    for (Eigen::Index j = k + 1; j < n_; ++j) LU.col(j).tail(rest) -= LU(k, j) * LU.col(k).tail(rest);
  }
}

void CompletePivotingLu::solve_in_place(Eigen::Ref<Matrix> B) {
  if (!is_finite_) {
    B.setConstant(std::numeric_limits<double>::quiet_NaN());
    return;
  }
  const Eigen::Map<Matrix> LU = lu();
  for (Eigen::Index c = 0; c < B.cols(); ++c) {
    auto x = B.col(c);
    for (Eigen::Index k = 0; k < n_; ++k) std::swap(x[k], x[rows_[static_cast<std::size_t>(k)]]);
    for (Eigen::Index k = 0; k < rank_; ++k) x.tail(n_ - k - 1) -= x[k] * LU.col(k).tail(n_ - k - 1);
    x.tail(n_ - rank_).setZero();
    for (Eigen::Index k = rank_ - 1; k >= 0; --k) {
      x[k] /= LU(k, k);
      x.head(k) -= x[k] * LU.col(k).head(k);
    }
    for (Eigen::Index k = n_ - 1; k >= 0; --k) std::swap(x[k], x[columns_[static_cast<std::size_t>(k)]]);
  }
}

void ConsistentLu::factorize(const Matrix& A) {
  lu_.factorize(A);
  is_singular_ = !(lu_.smallest_pivot() > kSuspicious);
  if (!is_singular_) return;
  scale_ = A.cwiseAbs().rowwise().maxCoeff();
  scale_ = (scale_.array() > 0).select(scale_.cwiseInverse(), 1);
  scaled_ = scale_.asDiagonal() * A;
  complete_.factorize(scaled_);
}

void ConsistentLu::solve_in_place(Eigen::Map<Matrix> B) {
  if (!is_singular_) return lu_.solve_in_place(B.data(), static_cast<int>(B.cols()));
  B.array().colwise() *= scale_.array();
  complete_.solve_in_place(B);
}

void SemidefiniteInverse::factorize(const Eigen::Ref<const Matrix>& A) {
  n_ = A.rows();
  rank_ = 0;
  is_finite_ = A.allFinite();
  make_room(L_, n_ * n_);
  make_room(gram_, n_ * n_);
  make_room(rest_, n_);
  make_room(y_, n_);
  Eigen::Map<Matrix> L(L_.data(), n_, n_);
  Eigen::Map<Vector> rest(rest_.data(), n_);
  rest = A.diagonal();
  for (; rank_ < n_; ++rank_) {
    Eigen::Index pivot = -1;
    double largest = kDependent;
    for (Eigen::Index i = 0; i < n_; ++i) {
      if (!(A(i, i) > 0) || rest[i] <= largest * A(i, i)) continue;
      pivot = i;
      largest = rest[i] / A(i, i);
    }
    if (pivot < 0) break;
    auto column = L.col(rank_);
    column = A.col(pivot);
    for (Eigen::Index k = 0; k < rank_; ++k) column -= L(pivot, k) * L.col(k);
    column /= std::sqrt(rest[pivot]);
    rest -= column.cwiseAbs2();
    rest[pivot] = 0;
  }
  Eigen::Map<Matrix> gram(gram_.data(), rank_, rank_);
  gram.noalias() = L.leftCols(rank_).transpose().lazyProduct(L.leftCols(rank_));
  factorize_definite(gram);
  make_room(K_, rank_ * n_);
  Eigen::Map<Matrix> K(K_.data(), rank_, n_);
  K = L.leftCols(rank_).transpose();
  solve_definite(gram, K);
}

void SemidefiniteInverse::apply_in_place(Eigen::Ref<Matrix> B) {
  if (!is_finite_) {
    B.setConstant(std::numeric_limits<double>::quiet_NaN());
    return;
  }
  const Eigen::Map<Matrix> K(K_.data(), rank_, n_);
  Eigen::Map<Vector> y(y_.data(), rank_);
  for (Eigen::Index c = 0; c < B.cols(); ++c) {
    y.noalias() = K * B.col(c);
    B.col(c).noalias() = K.transpose() * y;
  }
}

}  // namespace ricochet
