#pragma once

#include <vector>

#include "methods/linear_algebra/small_lu.h"
#include "methods/runge_kutta/butcher_tableau.h"
#include "methods/time_freezing/regions.h"
#include "problems/solution.h"

namespace ricochet {

/// A Runge-Kutta element of the time-freezing system, in pseudo time tau, with constant regions of all contacts. With '
/// for the derivative by tau and weights beta^i, tau^i of the auxiliary dynamics of contact i, whose force is push^i:
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
/// has to end at a time of the clock: h sum_j b_j s_j = dt (9). (4), (7) are of index 2. Behind the element the auxiliary
/// dynamics alone remove, while time stands still, what the right end violates of (4), (7), and of f_c = 0 where that is
/// curved.
class PseudoTimeElement {
 public:
  PseudoTimeElement(const Problem& problem, const ButcherTableau& tableau, const AuxiliaryDynamics& auxiliary,
                    double tolerance, Counters& counters);

  // Left end.
  Vector q0, v0;  ///< n_q
  Vector y0;      ///< n_c, depth of a bounce [m]

  void set_regions(const Regions& regions);
  /// First guess: the same derivatives at all stages. @param w  n_q, v'; @param beta  n_c; @param tau  n_lambda_t
  void guess(double h, double s, const Vector& w, const Vector& beta, const Vector& tau);
  /// From the right end of the last element on, with the derivatives there.
  void continue_guess();

  /// With (9). @return false where Newton's method fails; the unknowns are then of no use
  bool solve_to_clock(double dt);
  /// While time is frozen: of length h.
  bool solve_length(double h);

  double h = 0;               ///< length in pseudo time [s]
  Matrix q, v, w;             ///< n_q x n_s, w = v'
  Matrix y;                   ///< n_c x n_s
  Vector s;                   ///< n_s
  Matrix beta;                ///< n_c x n_s
  Matrix tau;                 ///< n_lambda_t x n_s
  Vector q1, v1, y1;          ///< right end
  Vector Lambda_n, Lambda_t;  ///< n_c, n_lambda_t: impulses of a frozen element [N s]

 private:
  struct Held {
    int contact = -1, row = 0;  // first unknown, behind w and s
    bool is_bilateral = false;
  };

  bool is_same(const Regions& regions) const;
  bool newton(double dt, double length);
  void set_stages();
  void set_depths();
  double slip_direction(const Held& held, int j, double* d) const;
  void set_residual(int j);
  void set_contact_derivatives(int j, const Held& held);
  void set_derivatives(int j);
  void factorize();
  double apply_correction(double dt, double& size);
  void set_right_end();
  void correct_right_end();
  bool correct(const Vector& violation, bool positions);

  const Problem& problem_;
  const ProblemInfo& info_;
  const ButcherTableau& tableau_;
  const AuxiliaryDynamics& auxiliary_;
  const double tolerance_;
  Counters& counters_;
  const bool is_stiffly_accurate_;

  Regions regions_;
  std::vector<Held> held_;
  int n_rows_ = 0, n_stage_ = 0;  // contact unknowns, and all unknowns of a stage
  bool has_curved_ = false, has_friction_ = false;
  bool has_mass_ = false, has_factors_ = false, is_redundant_ = false;
  double load_ = 0;  // largest |f_i| / M_ii of the last residual

  Matrix K_;      // Newton matrix
  Vector r_, x_;  // residual, correction
  SmallLu lu_;
  Matrix dq_dh_, dv_dh_;  // n_q x n_s: of the stages, by h; (v_j - v_0) / h is the latter
  Vector lambda_n_, lambda_t_, f_, packed_n_, packed_t_, weight_;
  Matrix M_, f_q_, f_v_, T_, H_;
  Matrix R_q_, R_v_, R_w_, R_s_, R_x_;  // partial derivatives of the rows of a stage
};

}  // namespace ricochet
