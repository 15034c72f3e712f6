#include "methods/complementarity/lemke.h"

#include <Eigen/LU>
#include <cmath>
#include <limits>

#include "problems/dense_solve.h"

namespace ricochet {

namespace {

// Numbers that agree to this, relative to themselves or to what they were computed from, are equal: the rest is
// rounding.
constexpr double kTie = 1e-13;
// Values of delta, tried in turn, relative to the largest diagonal entry: above rounding, and below the differences of
// contacts.
constexpr double kRegularizations[] = {1e-8, 1e-10, 1e-6};
// Allowed residual of (1), relative to q: the rounding of several ties in succession.
constexpr double kTies = 10 * kTie;
constexpr int kMaxCorrections = 10;
// Exponent of two by which the scales of two rows may differ. Beyond it, pivots leave less of small terms than their
// rounding, as in the friction cone of a direction in which hardly anything moves: the equations of the last basis are
// solved again.
constexpr int kUneven = 8;
// Largest residual of (1) in redundant equations, relative to the terms of a row, but at most to q: below the error of
// any time step, and far below that of a problem without a solution.
constexpr double kInconsistency = 1e-9;
// Largest residual of (1) after pivoting, unless bases are nearly singular.
constexpr double kPivoted = 1e-11;
// Rounding of M z + q, relative to the sum of its terms; its upper limit relative to q, for large z.
constexpr double kRounding = 16 * std::numeric_limits<double>::epsilon();
constexpr double kMostRounding = 1e-5;

/// x / x_divisor - y / y_divisor, cross-multiplied; zero for a tie. `size` is that of the column x and y come from.
double compare_ratios(double x, double x_divisor, double y, double y_divisor, double size) {
  const double left = x * y_divisor, right = y * x_divisor;
  const double rounding = kTie * (std::abs(left) + std::abs(right) + 0.1 * size * (x_divisor + y_divisor));
  return std::abs(left - right) <= rounding ? 0 : left - right;
}

}  // namespace

void LemkeSolver::resize(int max_size) {
  if (max_size <= max_size_) return;
  max_size_ = max_size;
  tableau_.resize(max_size, 2 * max_size + 2);
  basis_.resize(static_cast<std::size_t>(max_size));
  active_matrix_.resize(max_size, max_size);
  scaled_.resize(max_size, max_size);
  for (Vector* x : {&active_rhs_, &scaled_q_, &R_, &C_, &path_z_}) x->resize(max_size);
  active_.reserve(static_cast<std::size_t>(max_size));
}

/// Gauss-Jordan step on the rows 0..n-1.
void LemkeSolver::pivot(int n, int row, int column) {
  auto T = tableau_.topLeftCorner(n, 2 * n + 2);
  T.row(row) /= T(row, column);
  for (int i = 0; i < n; ++i) {
    if (i == row) continue;
    const double factor = T(i, column);
    if (factor != 0) T.row(i) -= factor * T.row(row);
  }
  ++pivots_;
}

/// Lexicographic minimum of (q_i, B^-1_i) / m_i over the rows with m_i > 0; -1 when there is none.
int LemkeSolver::leaving_row(int n, int column) const {
  const auto T = tableau_.topLeftCorner(n, 2 * n + 2);
  const double smallest = 1e-12 * T.col(column).cwiseAbs().maxCoeff();  // below, an entry is rounding
  int best = -1;
  for (int i = 0; i < n; ++i) {
    const double m = T(i, column);
    if (!(m > smallest)) continue;
    if (best < 0) {
      best = i;
      continue;
    }
    const double m_best = T(best, column);
    double difference = compare_ratios(T(i, 2 * n + 1), m, T(best, 2 * n + 1), m_best, q_size_);
    for (int k = 0; difference == 0 && k < n; ++k) difference = compare_ratios(T(i, k), m, T(best, k), m_best, 0);
    if (difference < 0) best = i;
  }
  return best;
}

/// R, C of a problem, and R M C, R q.
void LemkeSolver::set_scales(const Eigen::Ref<const Matrix>& M, const Eigen::Ref<const Vector>& q) {
  const auto n = q.size();
  resize(static_cast<int>(n));
  const double largest = n > 0 ? M.diagonal().maxCoeff() : 0;
  const int e_max = largest > 0 ? std::ilogb(largest) : 0;
  is_uneven_ = false;
  for (Eigen::Index i = 0; i < n; ++i) {
    if (!(M(i, i) > 0)) continue;
    const int half = (std::ilogb(M(i, i)) - e_max) / 2;
    is_uneven_ = is_uneven_ || half < -kUneven;
    R_[i] = std::ldexp(1.0, -half - e_max);
    C_[i] = std::ldexp(1.0, -half);
  }
  for (Eigen::Index i = 0; i < n; ++i) {
    if (M(i, i) > 0) continue;
    double in_row = 0, in_column = 0;
    for (Eigen::Index j = 0; j < n; ++j) {
      if (!(M(j, j) > 0)) continue;
      in_row = std::max(in_row, std::abs(M(i, j)) * C_[j]);
      in_column = std::max(in_column, R_[j] * std::abs(M(j, i)));
    }
    R_[i] = in_row > 0 ? std::ldexp(1.0, -std::ilogb(in_row)) : 1;
    C_[i] = in_column > 0 ? std::ldexp(1.0, -std::ilogb(in_column)) : 1;
  }
  scaled_.topLeftCorner(n, n) = R_.head(n).asDiagonal() * M * C_.head(n).asDiagonal();
  scaled_q_.head(n) = R_.head(n).cwiseProduct(q);
}

/// The answer of solve(R M C, R q), in the units of the problem.
template <class Solve>
LcpStatus LemkeSolver::in_scales(const Eigen::Ref<const Matrix>& M, const Eigen::Ref<const Vector>& q,
                                 Eigen::Ref<Vector> z, const Solve& solve) {
  set_scales(M, q);
  pivots_ = 0;
  const auto n = q.size();
  const LcpStatus status = solve(scaled_.topLeftCorner(n, n), scaled_q_.head(n));
  z.array() *= C_.head(n).array();
  return status;
}

LcpStatus LemkeSolver::solve(const Eigen::Ref<const Matrix>& M, const Eigen::Ref<const Vector>& q,
                             Eigen::Ref<Vector> z) {
  return in_scales(M, q, z, [&](const auto& scaled, const auto& scaled_q) { return solve_cold(scaled, scaled_q, z); });
}

LcpStatus LemkeSolver::solve_smallest(const Eigen::Ref<const Matrix>& M, const Eigen::Ref<const Vector>& q,
                                      Eigen::Ref<Vector> z) {
  return in_scales(M, q, z, [&](const auto& scaled, const auto& scaled_q) {
    const LcpStatus status = solve_redundant(scaled, scaled_q, z);
    if (status == LcpStatus::solved) return status;
    pivots_ = 0;
    return solve_cold(scaled, scaled_q, z);
  });
}

LcpStatus LemkeSolver::solve_warm(const Eigen::Ref<const Matrix>& M, const Eigen::Ref<const Vector>& q,
                                  Eigen::Ref<Vector> z) {
  return in_scales(M, q, z, [&](const auto& scaled, const auto& scaled_q) {
    return try_active_set(scaled, scaled_q, z) ? LcpStatus::solved : solve_cold(scaled, scaled_q, z);
  });
}

LcpStatus LemkeSolver::solve_cold(const Eigen::Ref<const Matrix>& M, const Eigen::Ref<const Vector>& q,
                                  Eigen::Ref<Vector> z) {
  const LcpStatus path = follow_path(M, q, z);
  const bool is_exact = path == LcpStatus::solved && is_solution(M, q, z, Accuracy::exact);
  if (is_exact && !is_uneven_) return path;
  path_z_ = z;
  if (is_exact) {
    if (!try_active_set(M, q, z)) z = path_z_;
    return path;
  }
  const LcpStatus redundant = solve_redundant(M, q, z);
  if (redundant == LcpStatus::solved && (path != LcpStatus::solved || is_solution(M, q, z, Accuracy::exact)))
    return LcpStatus::solved;
  if (path == LcpStatus::ray) return path;
  if (path == LcpStatus::solved) {
    z = path_z_;
    if (is_solution(M, q, z, Accuracy::consistent)) return LcpStatus::solved;
    correct(M, q, z);
    if (is_solution(M, q, z, Accuracy::consistent)) return LcpStatus::solved;
    return LcpStatus::ray;
  }
  return path;
}

/// (1) holds: bases that rounding alone makes regular may end far from it.
bool LemkeSolver::is_solution(const Eigen::Ref<const Matrix>& M, const Eigen::Ref<const Vector>& q,
                              const Eigen::Ref<const Vector>& z, Accuracy accuracy) const {
  if (!z.allFinite()) return false;
  for (Eigen::Index i = 0; i < q.size(); ++i) {
    double w = q[i], terms = std::abs(q[i]);
    for (Eigen::Index j = 0; j < z.size(); ++j) {
      const double term = M(i, j) * z[j];
      w += term;
      terms += std::abs(term);
    }
    const bool is_exact = accuracy == Accuracy::exact;
    const double size = std::min(terms, q_size_),
                 rounding = (is_exact ? 0 : std::min(kRounding * terms, kMostRounding * size)) + kTies * q_size_;
    if (std::numeric_limits<double>::epsilon() * terms > kMostRounding * size + kTies * q_size_) return false;
    const double stated = M(i, i) > 0 ? rounding_ * R_[i] : 0;
    const double allowed = std::max((is_exact ? kPivoted : kInconsistency) * size + rounding, stated);
    if (w < -allowed || (z[i] > 0 && w > allowed)) return false;
  }
  return true;
}

LcpStatus LemkeSolver::solve_redundant(const Eigen::Ref<const Matrix>& M, const Eigen::Ref<const Vector>& q,
                                       Eigen::Ref<Vector> z) {
  const double size = q.size() > 0 ? M.diagonal().maxCoeff() : 0;
  bool is_solved = false;  // to the consistency of redundant equations at least
  for (const double regularization : kRegularizations) {
    if (!(size > 0) || solve_regularized(M, q, regularization, z) != LcpStatus::solved) continue;
    if (is_solution(M, q, z, Accuracy::exact)) return LcpStatus::solved;
    if (!is_solved) consistent_z_ = z;
    is_solved = true;
  }
  if (!is_solved) return LcpStatus::ray;
  z = consistent_z_;
  return LcpStatus::solved;
}

/// M + delta I instead of M, q without ties, then the active equations of M and q themselves.
LcpStatus LemkeSolver::solve_regularized(const Eigen::Ref<const Matrix>& M, const Eigen::Ref<const Vector>& q,
                                         double delta, Eigen::Ref<Vector> z) {
  const auto n = q.size();
  Matrix regular = M;
  regular.diagonal().array() += delta * M.diagonal().maxCoeff();
  const Vector without_ties = q + delta * q.cwiseAbs().maxCoeff() * Vector::LinSpaced(n, 0, 1);
  const int before = pivots_;
  pivots_ = 0;
  const LcpStatus status = follow_path(regular, without_ties, z);
  pivots_ += before;
  q_size_ = q.cwiseAbs().maxCoeff();
  if (status != LcpStatus::solved) return status;

  correct(M, q, z);
  return is_solution(M, q, z, Accuracy::consistent) ? LcpStatus::solved : LcpStatus::ray;  // else M itself has none
}

/// Least corrections of the active variables, as exactly as their equations are consistent: forces that rounding alone
/// tells apart stay as they are.
void LemkeSolver::correct(const Eigen::Ref<const Matrix>& M, const Eigen::Ref<const Vector>& q, Eigen::Ref<Vector> z) {
  const auto n = q.size();
  const double rounding = kTie * n * (M.cwiseAbs().maxCoeff() * z.maxCoeff() + q_size_);
  Vector w = M * z + q;
  double error = std::numeric_limits<double>::infinity();
  for (int correction = 0; correction < kMaxCorrections && error > rounding; ++correction) {
    active_.clear();
    for (int i = 0; i < n; ++i) {
      if (z[i] > 0 || w[i] < -rounding) active_.push_back(i);
    }
    if (active_.empty()) break;
    z(active_) -= least_squares(M(active_, active_), w(active_));
    z = z.cwiseMax(0);
    w = M * z + q;
    error = std::max(-w.minCoeff(), w(active_).cwiseAbs().maxCoeff());
  }
}

LcpStatus LemkeSolver::follow_path(const Eigen::Ref<const Matrix>& M, const Eigen::Ref<const Vector>& q,
                                   Eigen::Ref<Vector> z) {
  const int n = static_cast<int>(q.size());
  z.setZero();
  q_size_ = n > 0 ? q.cwiseAbs().maxCoeff() : 0;
  if (n == 0 || q.minCoeff() >= 0) return LcpStatus::solved;
  auto T = tableau_.topLeftCorner(n, 2 * n + 2);
  T.leftCols(n).setIdentity();
  T.middleCols(n, n) = -M;
  T.col(2 * n).setConstant(-1);
  T.col(2 * n + 1) = q;
  for (int i = 0; i < n; ++i) basis_[i] = i;

  // z_0 enters for the most negative q; of equal ones the lexicographically smallest row, the last.
  int row = 0;
  for (int i = 1; i < n; ++i) {
    if (q[i] <= q[row]) row = i;
  }
  int entering = 2 * n;
  const int limit = 50 * (n + 1);  // Lemke needs a small multiple of n in practice
  while (true) {
    const int leaving = basis_[row];
    pivot(n, row, entering);
    basis_[row] = entering;
    if (leaving == 2 * n) break;
    if (pivots_ >= limit) return LcpStatus::iteration_limit;
    entering = leaving < n ? leaving + n : leaving - n;  // the complement of what left
    row = leaving_row(n, entering);
    if (row < 0) return LcpStatus::ray;
    // z_0 leaves as soon as it may: among tied rows its own ends the method.
    for (int i = 0; i < n; ++i) {
      if (basis_[i] != 2 * n || !(T(i, entering) > 0)) continue;
      if (compare_ratios(T(i, 2 * n + 1), T(i, entering), T(row, 2 * n + 1), T(row, entering), q_size_) <= 0) row = i;
    }
  }
  for (int i = 0; i < n; ++i) {
    if (basis_[i] >= n && basis_[i] < 2 * n) z[basis_[i] - n] = std::max(0.0, T(i, 2 * n + 1));
  }
  return LcpStatus::solved;
}

/// Tries the complementary basis with z_i > 0. @return whether it is a solution, which is then in `z`
bool LemkeSolver::try_active_set(const Eigen::Ref<const Matrix>& M, const Eigen::Ref<const Vector>& q,
                                 Eigen::Ref<Vector> z) {
  const int n = static_cast<int>(q.size());
  active_.clear();
  for (int i = 0; i < n; ++i) {
    if (z[i] > 0) active_.push_back(i);
  }
  const int n_a = static_cast<int>(active_.size());
  auto A = active_matrix_.topLeftCorner(n_a, n_a);
  auto x = active_rhs_.head(n_a);
  for (int r = 0; r < n_a; ++r) {
    for (int c = 0; c < n_a; ++c) A(r, c) = M(active_[r], active_[c]);
    x[r] = -q[active_[r]];
  }
  // Small systems, in place: Gaussian elimination with partial pivoting on the preallocated block.
  bool regular = true;
  for (int k = 0; k < n_a && regular; ++k) {
    Eigen::Index p;
    regular = A.col(k).tail(n_a - k).cwiseAbs().maxCoeff(&p) > 1e-13 * A.cwiseAbs().maxCoeff();
    if (!regular) break;
    p += k;
    A.row(k).swap(A.row(p));
    std::swap(x[k], x[p]);
    for (int r = k + 1; r < n_a; ++r) {
      const double factor = A(r, k) / A(k, k);
      A.row(r).tail(n_a - k) -= factor * A.row(k).tail(n_a - k);
      x[r] -= factor * x[k];
    }
  }
  if (regular) {
    for (int k = n_a - 1; k >= 0; --k) {
      for (int c = k + 1; c < n_a; ++c) x[k] -= A(k, c) * x[c];
      x[k] /= A(k, k);
    }
    // A degenerate basis has variables of zero: what rounding makes of them is as good, of either sign.
    const double smallest = n_a > 0 ? -kTie * x.cwiseAbs().maxCoeff() : 0;
    regular = n_a == 0 || x.minCoeff() >= smallest;
    x = x.cwiseMax(0);
  }
  for (int i = 0; i < n && regular; ++i) {
    if (z[i] > 0) continue;
    double w = q[i], size = std::abs(q[i]);
    for (int r = 0; r < n_a; ++r) {
      const double term = M(i, active_[r]) * x[r];
      w += term;
      size += std::abs(term);
    }
    regular = w >= -kTie * size;
  }
  if (!regular) return false;
  z.setZero();
  for (int r = 0; r < n_a; ++r) z[active_[r]] = x[r];
  q_size_ = n > 0 ? q.cwiseAbs().maxCoeff() : 0;
  return is_solution(M, q, z, Accuracy::exact);
}

}  // namespace ricochet
