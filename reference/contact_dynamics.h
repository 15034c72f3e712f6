#pragma once

#include <vector>

#include "problems/problem.h"
#include "problems/small_factors.h"
#include "problems/solution.h"
#include "reference/closed_contacts.h"
#include "reference/force_division.h"
#include "reference/force_system.h"

namespace ricochet::reference {

class ForceEquations;

/// The equations of motion while every contact keeps its mode. Index 1: the closed gaps are differentiated twice, the
/// slip velocities of sticking contacts once,
///
///   M v' = f_v + B_u u + sum_i (J_n^i lambda_n^i + J_t^i lambda_t^i)                     (1)
///   0 = J_n^i' v' + v' (grad^2 f_c^i) v          closed, sticking, slipping              (2)
///   0 = J_t^i' v' + T^i v                        sticking                                (3)
///   lambda_t^i = -mu^i lambda_n^i d^i            slipping, d the direction of slip       (4)
///
/// With R = [J_n, J_t of sticking contacts] and C = [J_n - mu J_t d, J_t of sticking contacts] the unknown forces are
///
///   lambda = -(R' M^-1 C)^-1 (R' M^-1 (f_v + B_u u) + bias)                              (5)
///
/// The matrix is symmetric if nothing slips. d is the sign of the mode in the plane and v_t / |v_t| in space; if v_t =
/// 0 in space, it must be given. Bilateral constraints are closed in every mode, and their forces may pull.
///
/// (5) is evaluated at every stage of every step. It allocates nothing while it is regular. If M and the closed
/// contacts do not vary, M^-1 C and the factors are reused until the modes or a direction change. If (5) is singular,
/// or was at the last call, ForceEquations solves it.
class ContactDynamics {
 public:
  /// @param problem  must outlive this object
  explicit ContactDynamics(const Problem& problem);

  /// Sets the modes of all contacts; bilateral ones must be closed. Releases fixed directions.
  void set_modes(const std::vector<ContactMode>& modes);
  const std::vector<ContactMode>& modes() const { return contacts_.modes(); }
  const std::vector<int>& closed() const { return contacts_.closed(); }  ///< contacts that are not open

  /// Fixes d in (4) for contact i, which slips in space. @param d 2, a unit vector; empty: d follows the velocity
  void hold_direction(int i, const Vector& d);

  /// Computes v' and, for closed contacts, lambda_n (n_c) and lambda_t (n_lambda_t); other entries stay unchanged.
  /// False if M is not positive definite or (5) does not determine v'.
  bool acceleration(const double* q, const double* v, double* acceleration, double* lambda_n, double* lambda_t);

  /// Whether the forces of contact i in the last acceleration() are unique. Redundant contacts share
  /// them by steadiest_division().
  bool determines_forces(int i) const { return !is_redundant_ || determined_[static_cast<std::size_t>(i)]; }

  long force_evaluations = 0, mass_factorizations = 0;

 private:
  void resize();
  void evaluate_columns(const double* q);
  void assemble(const double* v);
  void evaluate_bias(const double* q, const double* v);
  bool solve_for_forces(double* a);
  void refine_forces(double* a);
  bool divide_forces(const double* a);
  std::vector<ForceCone> force_cones() const;
  void note_redundancy(const ForceEquations& equations);

  const Problem& problem_;
  const bool constant_mass_;
  Matrix M_;
  SymmetricFactors mass_;

  ClosedContacts contacts_;
  bool has_columns_ = false, has_equations_ = false;  // reusable in the next call while modes and directions are kept
  Matrix MJ_, MC_;                                    // n_q x columns, n_q x unknowns: M^-1 J, M^-1 C
  ForceSystem system_;                                // (5)
  Vector right_, forces_;                             // by unknown
  Vector push_;                                       // n_q, accelerations by contact forces
  Vector bias_n_, bias_;                              // n_c, of gaps; by unknown
  Matrix T_;                                          // n_lambda_t x n_q

  bool is_redundant_ = false;     // (5) was singular
  std::vector<char> determined_;  // by contact
};

}  // namespace ricochet::reference
