#pragma once

#include <vector>

#include "problems/problem.h"

namespace ricochet {

enum class LcpStatus {
  solved,
  ray,  ///< Lemke ended on a ray; for a copositive matrix: the problem has no solution
  iteration_limit,
};

/// Linear complementarity problem: find z with
///
///   w = M z + q,   0 <= w  _|_  z >= 0                                                (1)
///
/// solved by Lemke's method with lexicographic pivoting. Source: Cottle, Pang, Stone, The Linear Complementarity
/// Problem, section 4.4 (Algorithm 4.4.5) and 4.9 (lexicographic degeneracy resolution).
///
/// The tableau of
///
///   w - M z - z_0 d = q,   d = 1                                                      (2)
///
/// is kept with the inverse basis beside it. The ratio test compares the rows (q_i, B^-1_i) / m_i lexicographically, so
/// that no basis returns, whatever ties occur: simultaneous contacts are ties.
///
/// Redundant contacts, such as a box on four corners, make M singular, and some bases regular only by rounding. If
/// pivoting ends there without a solution, it starts again with M + delta I, whose forces are unique and near the
/// smallest ones. The smallest correction of the active variables then removes delta from (1).
///
/// Units: the solver works on (R M C, R q) with diagonal matrices R and C of powers of two, which round nothing. Rows with
/// M_ii > 0 have R_i M_ii C_i near one and R_i / R_j = C_i / C_j; the others, the multipliers of friction, have largest
/// entries near one. So thresholds and pivots do not depend on the units of masses, lengths and times.
///
/// A solution is one where (1) holds relative to q and, as far as M z is known, to the rounding of its terms. Impulses
/// that grow without bound, so that only rounding remains, are not a solution.
///
/// A warm start tries the complementary basis of the last solution first: if the active set did not change, one
/// factorisation gives the solution, without a pivot.
///
/// All storage is allocated by the constructor; solve() allocates nothing for problems up to `max_size`, unless M is
/// redundant.
class LemkeSolver {
 public:
  explicit LemkeSolver(int max_size = 0) { resize(max_size); }

  void resize(int max_size);

  /// @param M  n x n, @param q n, @param z  n, overwritten with the solution
  LcpStatus solve(const Eigen::Ref<const Matrix>& M, const Eigen::Ref<const Vector>& q, Eigen::Ref<Vector> z);

  /// Like solve(), but first tries the active set {i : z_i > 0} of the given `z`.
  LcpStatus solve_warm(const Eigen::Ref<const Matrix>& M, const Eigen::Ref<const Vector>& q, Eigen::Ref<Vector> z);

  /// Like solve(), but returns a smallest solution z of a redundant problem, up to the rounding by delta.
  LcpStatus solve_smallest(const Eigen::Ref<const Matrix>& M, const Eigen::Ref<const Vector>& q, Eigen::Ref<Vector> z);

  /// @param size  error of q in rows with M_ii > 0, by which redundant equations may disagree
  void set_rounding(double size) { rounding_ = size; }

  int pivots() const { return pivots_; }  ///< of the last call

 private:
  enum class Accuracy { exact, consistent };  // what pivots leave; or what redundant equations and large z may leave

  // On the scaled problem.
  void set_scales(const Eigen::Ref<const Matrix>& M, const Eigen::Ref<const Vector>& q);
  template <class Solve>
  LcpStatus in_scales(const Eigen::Ref<const Matrix>& M, const Eigen::Ref<const Vector>& q, Eigen::Ref<Vector> z,
                      const Solve& solve);
  LcpStatus solve_cold(const Eigen::Ref<const Matrix>& M, const Eigen::Ref<const Vector>& q, Eigen::Ref<Vector> z);
  bool try_active_set(const Eigen::Ref<const Matrix>& M, const Eigen::Ref<const Vector>& q, Eigen::Ref<Vector> z);
  LcpStatus follow_path(const Eigen::Ref<const Matrix>& M, const Eigen::Ref<const Vector>& q, Eigen::Ref<Vector> z);
  LcpStatus solve_redundant(const Eigen::Ref<const Matrix>& M, const Eigen::Ref<const Vector>& q, Eigen::Ref<Vector> z);
  LcpStatus solve_regularized(const Eigen::Ref<const Matrix>& M, const Eigen::Ref<const Vector>& q, double delta,
                              Eigen::Ref<Vector> z);
  bool is_solution(const Eigen::Ref<const Matrix>& M, const Eigen::Ref<const Vector>& q,
                   const Eigen::Ref<const Vector>& z, Accuracy accuracy) const;
  void correct(const Eigen::Ref<const Matrix>& M, const Eigen::Ref<const Vector>& q, Eigen::Ref<Vector> z);
  void pivot(int n, int row, int column);
  int leaving_row(int n, int column) const;

  int max_size_ = 0;
  int pivots_ = 0;
  double q_size_ = 0;
  double rounding_ = 0;
  // Columns of (2): w_1..w_n | z_1..z_n | z_0 | q. The first n columns hold B^-1.
  Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor> tableau_;
  std::vector<int> basis_;  // variable of each row: 0..n-1 w, n..2n-1 z, 2n z_0
  Matrix active_matrix_, scaled_;
  Vector active_rhs_, scaled_q_, R_, C_, path_z_, consistent_z_;
  std::vector<int> active_;
  bool is_uneven_ = false;  // some scales differ by more than pivots can follow
};

}  // namespace ricochet
