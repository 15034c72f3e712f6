#pragma once

#include <span>
#include <vector>

#include "problems/problem.h"
#include "problems/solution.h"

namespace ricochet {

/// The scene at one state (q, v), for the unilateral contacts that touch there: with the columns R of rates, J_n and J_t
/// of every contact one after the other, and the columns C of the directions of their forces,
///
///   load = P M^-1 f_v,   X = P M^-1 C,   G = R' X                                                          (1)
///
/// where P is the identity, or the forces of bilateral constraints answer every force. Rates change by R' w + bias.
class InstantSystem {
 public:
  InstantSystem(const Problem& problem, Counters& counters);

  /// Evaluates the scene for `contacts`. False where M is not positive definite.
  bool prepare(const Vector& q, const Vector& v, std::span<const int> contacts);

  const std::vector<int>& contacts() const { return contacts_; }
  const ContactInfo& contact(int i) const { return info_.contacts[i]; }
  int n_t(int contact) const { return info_.contacts[contact].n_t; }
  int column(int contact) const { return first_column_[contact]; }  ///< of J_n; those of J_t follow
  const Matrix& R() const { return R_; }
  const Matrix& X() const { return X_; }
  const Matrix& G() const { return G_; }
  const Vector& bias() const { return bias_; }
  const Vector& load() const { return load_; }  ///< [m/s^2]

  double normal_velocity(int contact, const Vector& v) const;
  void slip_velocity(int contact, const Vector& v, double* v_t) const;
  double normal_terms(int contact, const Vector& x) const;   ///< |J_n|' |x|
  double tangent_terms(int contact, const Vector& x) const;  ///< the largest |J_t|' |x|
  double normal_delassus(int contact) const;
  double tangential_delassus(int contact) const;  ///< the largest of its tangents
  const double* normal(int contact) const;        ///< J_n, packed
  double load_rate(int contact) const;            ///< acceleration of the gap by the load alone

 private:
  void evaluate(const Vector& q, const Vector& v);
  void set_column(int contact, const double* J, Eigen::Index k, Matrix& R, Matrix& C) const;
  void set_columns();

  const Problem& problem_;
  const ProblemInfo& info_;
  Counters& counters_;
  std::vector<int> contacts_, first_column_;
  Vector f_, gap_bias_, slip_bias_, J_n_, J_t_;  // of the scene, J packed
  Matrix M_, T_;
  Matrix R_, C_, X_, G_;
  Vector load_, bias_;
};

}  // namespace ricochet
