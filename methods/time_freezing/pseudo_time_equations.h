#pragma once

#include "methods/runge_kutta/butcher_tableau.h"
#include "methods/time_freezing/held_contacts.h"
#include "methods/time_freezing/pseudo_time_element.h"
#include "problems/solution.h"

namespace ricochet {

/// Values that one function of PseudoTimeEquations leaves for another; each states which it sets.
struct PseudoTimeWorkspace {
  Vector r;                   ///< n_unknowns: residual of (2)-(9), stage after stage
  Matrix K;                   ///< n_unknowns x n_unknowns: its derivatives
  double load = 0;            ///< largest |f_i| / M_ii of the last residual
  Matrix dq_dh, dv_dh;        ///< n_q x n_s: (10)
  Matrix M;                   ///< n_q x n_q: of the last stage, like all below
  bool has_mass = false;      ///< M has been evaluated: a constant one is kept
  Vector f;                   ///< n_q
  Vector J_n, J_t;            ///< packed
  Vector lambda_n, lambda_t;  ///< n_c, n_lambda_t: push beta, push tau [N]
};

/// The equations of an element of the time-freezing system, in pseudo time tau, with constant regions of all contacts.
/// With ' for the derivative by tau and weights beta^i, tau^i of the auxiliary dynamics of contact i, whose force is
/// push^i:
///
///   q' = s v,   t' = s                                                                                     (1)
///   M(q) v' = s (f_v + B_u u) + sum_i push^i (J_n^i beta^i + J_t^i tau^i)                                  (2)
///   s = prod_i (1 - beta^i),   0 <= beta^i <= 1,   |tau^i| <= mu^i beta^i                                  (3)
///
///   free      beta = 0
///   sliding   J_n' v = 0                                                                                   (4)
///   pushed    beta = 1                                                                                     (5)
///   bouncing  J_n' v' = -k y - c J_n' v,   y' = J_n' v                                                     (6)
///   stick     J_t' v = 0                                                                                   (7)
///   slip      tau = -mu beta d,   d = J_t' v / |J_t' v|                                                    (8)
///
/// (3) are Filippov's multipliers of the regions that meet at the state: the region in which the contacts of a set S are
/// pushed has the product of beta^i over S and of 1 - beta^i over the others. While a contact is pushed or bounces time is
/// frozen, s = 0, and q with it. Where it slides, s > 0, and lambda = push beta / s is the force of persistent contact.
///
/// Stages: x_j = x_0 + h sum_k a_jk x'_k for x = (q, v, y), unknowns v'_j, s_j, beta_j, tau_j, and h where the element
/// has to end at a time of the clock: h sum_j b_j s_j = dt (9). (4), (7) are of index 2: what the right end violates of
/// them is removed in pseudo_time_end.h.
class PseudoTimeEquations {
 public:
  /// All references must outlive this object.
  PseudoTimeEquations(const Problem& problem, const ButcherTableau& tableau, const AuxiliaryDynamics& auxiliary,
                      const HeldContacts& held, Counters& counters);

  /// Makes room in a new workspace.
  void prepare(PseudoTimeWorkspace& work) const;
  /// Resizes the workspace for the unknowns of new regions.
  void resize(PseudoTimeWorkspace& work);

  /// The left end of an element: while time is frozen s = 0, and J_n is that of q0. Sets J_n then.
  void begin(PseudoTimeElement& e, PseudoTimeWorkspace& work) const;
  /// The stages q, v, y of the unknowns, and their derivatives by h:
  ///
  ///   d v_j / d h = sum_k a_jk w_k,   d q_j / d h = sum_k a_jk s_k (v_k + h d v_k / d h)                    (10)
  ///
  /// Sets dq_dh, dv_dh; reads J_n of begin() or of the stage before.
  void set_stages(PseudoTimeElement& e, PseudoTimeWorkspace& work) const;
  /// Residual of (2)-(9); with derivatives also K. Sets tau of slipping contacts, r, load and the values of a stage.
  /// @param dt  of (9) [s]
  void evaluate(PseudoTimeElement& e, double dt, bool with_derivatives, PseudoTimeWorkspace& work);
  /// q1, v1, y1 and the impulses, from solved stages.
  void set_right_end(PseudoTimeElement& e, PseudoTimeWorkspace& work) const;

 private:
  /// Partial derivatives of the rows of one stage.
  struct Rows {
    Matrix q, v, w, s, x;
  };

  double slip_direction(const HeldContact& held, int j, const PseudoTimeElement& e, const PseudoTimeWorkspace& work,
                        double* d) const;
  void set_residual(int j, PseudoTimeElement& e, PseudoTimeWorkspace& work) const;
  void set_contact_derivatives(int j, const HeldContact& held, const PseudoTimeElement& e,
                               const PseudoTimeWorkspace& work);
  void set_derivatives(int j, const PseudoTimeElement& e, PseudoTimeWorkspace& work);
  void set_depths(PseudoTimeElement& e, const PseudoTimeWorkspace& work) const;

  const Problem& problem_;
  const ProblemInfo& info_;
  const ButcherTableau& tableau_;
  const AuxiliaryDynamics& auxiliary_;
  const HeldContacts& held_;
  Counters& counters_;

  // Scratch of set_derivatives().
  Rows R_;
  Matrix f_q_, f_v_, T_, H_;
  Vector weight_;
};

}  // namespace ricochet
