#pragma once

#include <algorithm>
#include <span>
#include <vector>

#include "methods/linear_algebra/rank_revealing.h"
#include "methods/modes/mode_rows.h"
#include "problems/problem.h"
#include "problems/small_factors.h"
#include "problems/solution.h"

namespace ricochet {

/// The motion while every contact keeps its mode: an ordinary differential equation in (q, v), of index 1. The gaps of
/// closed contacts are differentiated twice, the slip velocities of sticking ones once,
///
///   M a = f + C lambda                                                                   (1)
///   R' a + b = 0                                                                         (2)
///
/// R has a column J_n of each closed contact and J_t of each that sticks, C the same but J_n - mu J_t d of one that
/// slips along d; b is v' (grad^2 f_c) v in the rows of gaps, T v in those of slip velocities. So
///
///   lambda = -D^-1 (R' M^-1 f + b),   a = M^-1 f + M^-1 C lambda,   D = R' M^-1 C         (3)
///
/// and where M is constant, the closed contacts are affine and d does not turn, b = 0 and (3) is
///
///   lambda = L f,   a = P f                                                              (4)
///
/// with matrices that belong to the modes. Redundant contacts make D singular: of all lambda that fulfil (2), the one
/// nearest to the forces of the contact law for these modes is used, in the norm that makes the diagonal of D one. With
/// a worse division a contact would reach its cone too early.
class ModeDynamics {
 public:
  ModeDynamics(const Problem& problem, Counters& counters);
  /// Before a run. @param redundant  part of their terms by which redundant rows of (2) may differ, see ContactScales;
  /// StepCheck ends a run whose closed gaps drift
  void start(double redundant) { consistent_ = std::max(kConsistent, redundant); }

  /// Message of a run that ends where accelerate() or project() fails.
  static constexpr const char* kUndetermined = "the contact forces do not determine the motion";

  /// Sets the modes from now on, first at (q, v). @param modes  n_c, bilateral contacts closed
  void set_modes(std::span<const ContactMode> modes, const double* q, const double* v);
  const std::vector<ContactMode>& modes() const { return rows_.modes(); }
  const std::vector<int>& closed() const { return rows_.closed(); }  ///< contacts that are not open

  /// The forces of the contact law for these modes. @param lambda_n  n_c, @param lambda_t  n_lambda_t
  void set_forces(const Vector& lambda_n, const Vector& lambda_t);

  /// The same by rows, for later: set_modes() forgets them.
  const Vector& law_forces() const { return law_; }
  void set_law_forces(const Vector& law) { law_ = law; }

  /// The direction of slip in space while it is zero or held. @param d  2, a unit vector; null to follow the velocity
  void hold_direction(int contact, const double* d) { rows_.hold_direction(contact, d); }
  bool holds_direction(int contact) const { return rows_.holds_direction(contact); }

  /// a, and the forces below. @return false when M is not positive definite or (2) contradicts itself
  /// @tparam N  n_q, 0 where it is known at run time only
  template <int N = 0>
  bool accelerate(const double* q, const double* v, double* a) {
    problem_.force(q, v, u_, f_.data());
    ++counters_.force_evaluations;
    if (kind_ != Kind::map) return kind_ == Kind::general ? accelerate_in_general(q, v, a) : accelerate_by_factors(a);
    if constexpr (N > 0) {
      // Stored at once, since a step reads it at once.
      const Eigen::Map<const Eigen::Matrix<double, N, N>> P(P_.data());
      const Eigen::Map<const Eigen::Matrix<double, N, 1>> f(f_.data());
      Eigen::Matrix<double, N, 1> product = P.lazyProduct(f);
      Eigen::Map<Eigen::Matrix<double, N, 1>> acceleration(a);
      acceleration = product;
    } else {
      Eigen::Map<Vector>(a, info_.n_q).noalias() = P_.lazyProduct(f_);
    }
    if (!rows_.empty()) multiply(L_.data(), static_cast<int>(rows_.size()), lambda_.data());
    return true;
  }

  /// a_q, a_v: n_q x n_q, derivatives of a: P f_q, P f_v with (4), else differences of first order, for Newton's
  /// iteration. @param a  at (q, v) @return false when there is no acceleration somewhere
  bool acceleration_jacobians(const Vector& q, const Vector& v, const Vector& a, Matrix& a_q, Matrix& a_v);
  int mode_changes() const { return mode_changes_; }  ///< calls of set_modes()
  Counters& counters() { return counters_; }

  /// @param d  n_t, of a contact that slips
  void direction(int contact, double* d) const {
    for (int k = 0; k < info_.contacts[contact].n_t; ++k) d[k] = rows_.direction(contact)[k];
  }

  // Results of the last accelerate():
  double normal_force(int contact) const { return lambda_[rows_.first(contact)]; }
  /// @param force  n_t
  void tangential_force(int contact, double* force) const;
  /// mu lambda_n - ||lambda_t|| of a contact that sticks [N].
  double cone_margin(int contact) const;

  /// Which of v and q project() corrects first.
  enum class Order : std::uint8_t {
    velocity_first,  ///< v at the positions before
    position_first   ///< v at the new positions, which curved contacts distinguish
  };
  /// Moves q to where the closed gaps vanish, least in the metric of M, and v to where the rates of (2) do, by impulses
  /// along the forces C of the closed contacts: a bounce that is closed loses the friction impulse of the rebound, too.
  /// @return false when that fails
  bool project(double* q, double* v, Order order = Order::velocity_first);

 private:
  // Largest residual of (2) in redundant rows, relative to its terms.
  static constexpr double kConsistent = 1e-9;
  using RowMatrix = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
  /// (4); (4) for many coordinates, P = M^-1 + M^-1 C L without forming it; (3)
  enum class Kind : std::uint8_t { map, factors, general };

  /// y = A f. @param A  row after row
  void multiply(const double* A, int rows, double* y) const {
    const int columns = info_.n_q;
    const double* f = f_.data();
    for (int i = 0; i < rows; ++i, A += columns) {
      double sum = 0;
      for (int k = 0; k < columns; ++k) sum += A[k] * f[k];
      y[i] = sum;
    }
  }
  bool accelerate_in_general(const double* q, const double* v, double* a);
  bool factorize_mass(const double* q);
  void set_columns(const double* q, const double* v);
  bool accelerate_by_factors(double* a);
  void set_maps(const double* q, const double* v);
  void set_delassus_row(Eigen::Index r);
  bool set_point(const double* q, const double* v);
  void remove_rates(double* x);
  void correct_velocities(double* v);
  void correct_positions(const Vector& gap, double* q);
  template <class Columns>
  bool eliminate(Columns& X);
  enum class Consistency : std::uint8_t { required, as_near_as_possible };
  bool solve_rows(const double* a, Consistency consistency = Consistency::required);
  double approach_redundant();

  const Problem& problem_;
  const ProblemInfo& info_;
  Counters& counters_;
  const double* const u_;
  const bool constant_mass_;
  Kind kind_ = Kind::general;
  int mode_changes_ = 0;
  bool is_redundant_ = false;  // a pivot of D has vanished since set_modes()
  double consistent_ = kConsistent;
  ModeRows rows_;
  Matrix P_;
  RowMatrix L_;  // (4)
  SymmetricFactors mass_;
  Matrix M_, D_;   // (3)
  struct Scaled {  // D lambda = b with a diagonal of ones
    Matrix A;
    Vector scale, b, law, x;  // law: the forces to be near to
    Vector residual, step;
  } scaled_;
  SemidefiniteInverse redundant_;  // of scaled_.A
  bool has_inverse_ = false;
  double left_by_inverse_ = 0;  // part of the residual
  Matrix C_, MC_;               // n_q x rows
  Vector f_, lambda_, rates_, law_;
  Vector diagonal_, row_, q_, v_, zero_, kept_law_, gap_;  // scratch
};

}  // namespace ricochet
