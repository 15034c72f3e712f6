#pragma once

#include <span>
#include <vector>

#include "methods/contact_laws/contact_observer.h"
#include "methods/contact_laws/contact_operator.h"
#include "methods/contact_laws/solvers/contact_solver.h"
#include "methods/linear_algebra/block_inverse.h"
#include "problems/problem.h"
#include "problems/solution.h"

namespace ricochet {

/// Laws of the contacts in a step.
struct ContactLaws {
  FrictionLaw friction = FrictionLaw::coulomb;
  bool normal_only = false;  ///< as if nothing had friction: for positions instead of velocities
};

/// The contact problem of one step of velocity-level time stepping,
///
///   v+ = v_free + W (J r + G m)                                                          (1)
///   w = J' v+ + s,  and r, w fulfil the laws of contact_problem.h                        (2)
///   G' v+ + s = 0                                                                        (3)
///
/// for the active contacts with directions J = (J_n, J_t), and the bilateral constraints G with impulses m, which (3)
/// eliminates (bilateral_constraints.h). W is the inverse of the iteration matrix of the method, s a shift: of the
/// normal velocity by the impact law or by the gap, of the slip velocity where a method takes slip elsewhere than in v+.
/// The solver of (2) starts from the impulses of the step before.
///
/// J, W J and the operator of (2) are those of contact_operator.h. They are reused while the directions, the active
/// contacts and W do not change.
class ContactStep {
 public:
  ContactStep(const Problem& problem, const ContactSolverOptions& options, const ContactLaws& laws, Counters& counters,
              ContactObserver* observer = nullptr);

  /// Contact directions at q, of all contacts.
  void set_position(const Vector& q);
  /// @param active  unilateral contacts, ascending
  void set_active(std::span<const int> active);

  /// Delassus operator for W. @param W  n_q, one block where there are bilateral constraints
  ContactStatus set_inverse_mass(const BlockInverse& W);

  const std::vector<int>& active() const { return active_; }
  /// J_n' v
  double normal_velocity(int contact, const Vector& v) const {
    return operator_.dot(contact, 0, v);  // active or not
  }
  double slip_speed(int contact, const Vector& v) const;  ///< ||J_t' v||

  /// G' v, n_c; entries of unilateral contacts are left alone.
  void bilateral_velocities(const Vector& v, Vector& rates) const { operator_.bilateral().velocities(v, rates); }

  /// J_t' v of all contacts, n_lambda_t
  void slip_velocities(const Vector& v, Vector& slip) const;

  /// Adds an impulse of the k-th active contact and the reaction of the bilateral constraints. @param Lambda_n  n_c
  void add_normal_impulse(std::size_t k, double impulse, Vector& v, Vector& Lambda_n) const;
  /// Adds factor (r_n, r_t) of all active contacts to v, and the reaction of the bilateral constraints to Lambda_n.
  /// @param r_n, Lambda_n  n_c; @param r_t  n_lambda_t
  void add_impulses(double factor, const Vector& r_n, const Vector& r_t, Vector& v, Vector& Lambda_n) const;

  /// Solves (1)-(3) and replaces v_free by v+.
  /// @param shift       s of all contacts in (3) and in the normal direction of (2), n_c
  /// @param present     p of the active contacts; empty is zero
  /// @param slip_shift  s of all contacts in the tangential directions of (2), n_lambda_t; empty is zero
  ContactStatus solve(Vector& v, const Vector& shift, const Vector& present, const Vector& slip_shift = {});

  /// Error bound of J_n' v+ + s at an active contact with an impulse, where it should be zero [m/s]: a fraction of the
  /// velocities at that contact, or for an iterative solver of the largest velocity at any contact, to which its
  /// tolerance is relative; plus the rounding of J_n' v+. Zero for a contact without impulse.
  double velocity_rounding(int contact) const { return velocity_rounding_[contact]; }

  /// Why the last problem was not solved, with the names of its contacts.
  std::string reason(ContactStatus status);

  const Vector& Lambda_n() const { return Lambda_n_; }  ///< n_c, of the last solve(), m included; zero where not active
  const Vector& Lambda_t() const { return Lambda_t_; }  ///< n_lambda_t

  /// Largest violation of (2), (3) by v+, relative to the velocities and impulses in them.
  double residual(const Vector& v_plus, const Vector& shift, const Vector& slip_shift = {});

 private:
  int n_t(int k) const { return problem_.contacts[k].n_t; }
  double shift_of(int contact, int d, const Vector& shift, const Vector& slip_shift) const {
    if (d == 0) return shift[contact];
    return slip_shift.size() > 0 ? slip_shift[info_.contacts[contact].tangent_index + d - 1] : 0;
  }

  const ProblemInfo& info_;
  Counters& counters_;
  ContactObserver* const observer_;
  const bool has_bilateral_;
  const ContactSolverOptions options_;
  bool is_affine_;                             // no direction depends on q
  bool has_position_ = false, is_new_ = true;  // directions or active contacts have changed since W was set
  const BlockInverse* W_ = nullptr;
  std::int64_t W_version_ = -1;
  ContactOperator operator_;
  std::unique_ptr<ContactSolver> solver_;
  ContactProblem problem_;
  std::vector<int> active_;
  Vector r_, w_, terms_, last_n_, last_t_, velocity_rounding_;
  Vector Lambda_n_, Lambda_t_;
};

}  // namespace ricochet
