#pragma once

#include <Eigen/Cholesky>
#include <string>
#include <vector>

#include "problems/problem.h"
#include "problems/solution.h"
#include "reference/coulomb_law.h"
#include "reference/force_division.h"
#include "reference/force_equations.h"
#include "reference/scales.h"

namespace ricochet::reference {

/// The equations of motion while every contact keeps its mode, and the laws that change the modes. Index 1: the closed
/// gaps are differentiated twice, the slip velocities of sticking contacts once,
///
///   M v' = f_v + B_u u + sum_i J_n^i lambda_n^i + J_t^i lambda_t^i                       (1)
///   0 = J_n^i' v' + v' (grad^2 f_c^i) v          closed, sticking, slipping              (2)
///   0 = J_t^i' v' + T^i v                        sticking                                (3)
///   lambda_t^i = -mu^i lambda_n^i d^i            slipping, d the direction of slip       (4)
///
/// With R = [J_n, J_t of sticking contacts] and C = [J_n - mu J_t d, J_t of sticking contacts] the unknown forces are
///
///   lambda = -(R' M^-1 C)^-1 (R' M^-1 (f_v + B_u u) + bias)                              (5)
///
/// symmetric where nothing slips. d is the sign of the mode in the plane and v_t / |v_t| in space; where v_t = 0 in
/// space it has to be held from outside.
///
/// Bilateral constraints are closed in every mode, and their forces may pull. The laws of the other contacts hold for
/// motions that keep them: with their Jacobian G, an impulse p leads from v- to v+, and a force p to v', by
///
///   [ M  -G ] [ v+ ]   [ M v- + p ]       [ M  -G ] [ v' ]   [ f_v + B_u u + p    ]
///   [ G'  0 ] [ m  ] = [ 0        ],      [ G'  0 ] [ m  ] = [ -v' (grad^2 f_c) v ]       (7)
class ContactDynamics {
 public:
  /// @param scales  of the problem; both have to outlive this
  ContactDynamics(const Problem& problem, const Scales& scales);

  /// Modes of all contacts until the next call; bilateral ones have to be closed. Releases held directions.
  void set_modes(const std::vector<ContactMode>& modes);
  const std::vector<ContactMode>& modes() const { return modes_; }
  const std::vector<int>& closed() const { return closed_; }  ///< contacts that are not open

  /// Fixes d in (4) for contact i, which slips in space. @param d 2, a unit vector; empty to follow the velocity again
  void hold_direction(int i, const Vector& d) { held_[static_cast<std::size_t>(i)] = d; }

  /// v' and, for the closed contacts, lambda_n (n_c) and lambda_t (n_lambda_t), else untouched. False when M is not
  /// positive definite or (5) does not determine v'.
  bool acceleration(const double* q, const double* v, double* acceleration, double* lambda_n, double* lambda_t);

  /// Whether the forces of contact i in the last acceleration() were the only ones. Redundant contacts share
  /// them as steadiest_division() says.
  bool determines_forces(int i) const { return !is_redundant_ || determined_[static_cast<std::size_t>(i)]; }

  /// What a law says of the contacts it was asked about.
  struct Decision {
    std::string failure;             ///< why the law decides nothing; empty when it does
    std::vector<ContactMode> modes;  ///< in the order of the question
    Vector motion;                   ///< n_q, v_plus or v'
    Vector normal, tangential;       ///< n_c and n_lambda_t, impulses or forces of these contacts, else zero; the
                                     ///< impulses of bilateral constraints, too
  };

  /// Newton's law with Coulomb's on the impulses and the velocities behind the impact, at the touching contacts:
  ///   0 <= Lambda_n _|_ J_n'(v+ + eps_r v-) >= 0,  ||Lambda_t|| <= mu Lambda_n, opposite to J_t' v+      (6)
  /// @param last  by contact (n_c): whether its restitution counts as zero; empty for none
  Decision impact(const Vector& q, const Vector& v_minus, const std::vector<int>& touching,
                  const std::vector<char>& last = {}) const;

  /// Modes of candidates, touching with zero normal velocity: (1)-(4) with 0 <= lambda_n _|_ gap acceleration >= 0.
  /// @param directions by contact (n_c), the direction of slip where it is known; empty where v_t = 0 and the
  ///   acceleration decides. Not read without friction.
  Decision decide(const Vector& q, const Vector& v, const std::vector<int>& candidates,
                  const std::vector<Vector>& directions) const;

  /// Moves q to where the gaps of `touching` contacts vanish, and v to where the rates of `closed` ones and the slip
  /// velocities of those that rest do, least in the metric of M. @param resting  by contact
  /// @return false when that fails
  bool project(Vector& q, Vector& v, const std::vector<int>& touching, const std::vector<int>& closed,
               const std::vector<char>& resting) const;

  long force_evaluations = 0, mass_factorizations = 0;

 private:
  bool add_contact_forces(const double* q, const double* v, Eigen::Ref<Vector> a, double* lambda_n);
  bool add_frictional_forces(const double* q, const double* v, Eigen::Ref<Vector> a, double* lambda_n,
                             double* lambda_t);
  Matrix jacobian(const Vector& q, const std::vector<int>& contacts) const;
  /// Solves (7). @return columns (v+ or v', m)
  Matrix under_constraints(const Vector& q, const Matrix& right_hand_side) const;
  /// v+ or v' of (7) for columns p alone
  Matrix response(const Vector& q, const Matrix& p) const;
  void add_bilateral_impulses(const Vector& q, const Vector& v_minus, Decision& decision) const;
  /// Completes the question with the laws of the contacts. @param directions  by contact, or empty
  Decision coulomb_law(ContactQuestion question, const std::vector<int>& contacts,
                       const std::vector<Vector>& directions) const;
  std::optional<Vector> solve_for_forces(const Matrix& R, const Matrix& MR, const Matrix& MC, const Vector& bias,
                                         Eigen::Ref<Vector> a);
  std::vector<ForceCone> force_cones() const;
  void note_redundancy(const ForceEquations& equations);

  const Problem& problem_;
  const Scales& scales_;
  const bool constant_mass_, diagonal_mass_;
  std::vector<ContactMode> modes_;
  std::vector<int> closed_;
  bool rubs_ = false;  // a closed contact has friction
  std::vector<Vector> held_;
  bool is_redundant_ = false;     // (5) was singular
  std::vector<char> determined_;  // by contact
  Matrix M_;
  Eigen::LLT<Matrix> llt_;
  Vector inverse_diagonal_, f_, packed_, bias_;
};

}  // namespace ricochet::reference
