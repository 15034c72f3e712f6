#pragma once

#include <Eigen/Cholesky>
#include <optional>
#include <vector>

#include "problems/problem.h"

namespace ricochet::reference {

/// The equations of motion for a given set of closed contacts, and the laws that change the set. Index 1: the closed
/// gaps are differentiated twice,
///
///   M v' = f_v + B_u u + J_c lambda_c                                                    (1)
///   0 = J_c' v' + v' (grad^2 f_c) v                                                      (2)
///
/// so lambda_c = -(J_c' M^-1 J_c)^-1 (J_c' M^-1 f + bias)                                  (3)
class ContactDynamics {
 public:
  explicit ContactDynamics(const Problem& problem);

  /// Contacts that stay closed until the next call.
  void set_closed(const std::vector<int>& closed) { closed_ = closed; }
  const std::vector<int>& closed() const { return closed_; }

  /// v' and, for the closed contacts, lambda_n (n_c, else untouched). False when M is not positive definite or the
  /// closed contacts are redundant.
  bool acceleration(const double* q, const double* v, double* acceleration, double* lambda_n);

  /// Newton's law at the touching contacts: 0 <= Lambda_n _|_ J_n'(v+ + eps_r v-) >= 0. Nothing when it has no
  /// solution.
  struct Impact {
    Vector v_plus, Lambda_n;
  };
  std::optional<Impact> impact(const Vector& q, const Vector& v_minus, const std::vector<int>& touching) const;

  /// Which of the candidates, touching with zero normal velocity, carry a force: 0 <= lambda _|_ gap acceleration >= 0.
  std::optional<std::vector<int>> closing(const Vector& q, const Vector& v, const std::vector<int>& candidates) const;

  long force_evaluations = 0, mass_factorizations = 0;

 private:
  const Problem& problem_;
  const bool constant_mass_, diagonal_mass_;
  std::vector<int> closed_;
  Matrix M_;
  Eigen::LLT<Matrix> llt_;
  Vector inverse_diagonal_, f_, packed_, bias_;
};

}  // namespace ricochet::reference
