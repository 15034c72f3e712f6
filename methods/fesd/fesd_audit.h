#pragma once

#include <vector>

#include "methods/contact_laws/friction_cone.h"
#include "methods/elements/fesd_step.h"

namespace ricochet {

/// The FESD-J equations of a step, numbered as in the paper's section 3; n counts elements, i contacts, j stages.
enum class FesdCondition {
  stage_position,         ///< q_nj = q_n0 + h_n sum_k a_jk v_nk
  stage_velocity,         ///< v_nj = v_n0 + h_n sum_k a_jk F_v(q_nk, v_nk, u, lambda_nk)
  end_position,           ///< q_{n+1} = q_n0 + h_n sum_k b_k v_nk
  end_velocity,           ///< v_{n+1} = P (v_n0 + h_n sum_k b_k F_v(...)), P: end_projection.h, (10)  (correction 1)
  continuity,             ///< q_n0 = q_n
  impulse_balance,        ///< M(q_n) (v_n0 - v_n) = sum_i J_n^i Lambda_n^i
  impulse_sign,           ///< Lambda_n^i >= 0
  impulse_gap,            ///< Lambda_n^i f_c^i(q_n) = 0
  impulse_restitution,    ///< Lambda_n^i J_n^i' (v_n0 + eps_r^i v_n) = 0                            (correction 4)
  closed_separation,      ///< J_n^i' (v_n0 + eps_r^i v_n) >= 0 where f_c^i(q_n) = 0                 (correction 9)
  grid_gap,               ///< f_c^i(q_n) >= 0
  stage_gap,              ///< f_c^i(q_nj) >= 0
  stage_force,            ///< lambda_nj^i >= 0
  cross_complementarity,  ///< lambda_nj^i f_c^i(q_nj') = 0, j' = 0..n_s and the right end           (correction 8)
  step_equilibration,     ///< (h_n - h_{n-1}) eta_n = 0                                             (correction 6)
  pinned_breaking,        ///< lambda_n^i(right end of n-1) sum_j f_c^i(q_nj) = 0                    (open question 1)
  // With friction; v_t = J_t' v, beta = mu lambda_n - ||lambda_t||.                                 (correction 5)
  impulse_cone,    ///< ||Lambda_t|| <= mu Lambda_n
  impulse_slip,    ///< mu Lambda_n v_t + ||v_t|| Lambda_t = 0 at v_n0
  stage_cone,      ///< ||lambda_t,nj|| <= mu lambda_n,nj
  stage_slip,      ///< mu lambda_n,nj v_t,nj + ||v_t,nj|| lambda_t,nj = 0
  cross_friction,  ///< in the plane xi+_nj' (mu lambda_n + lambda_t)_nj = 0 = xi-_nj' (mu lambda_n - lambda_t)_nj with
                   ///< v_t = xi+ - xi-, in space ||v_t,nj'|| beta_nj = 0; j' = 0..n_s and the right end
  pinned_sliding,  ///< beta^i(right end of n-1) sum_j ||v_t,nj^i|| = 0                              (open question 1)
                   // With FrictionCone::squared, v_t + 2 gamma lambda_t = 0 with gamma >= 0 and (mu lambda_n)^2 -
                   // ||lambda_t||^2 >= 0 instead, and cross_friction is gamma_nj' times the latter. It has no solution
                   // where a contact without force slips: Residual::impossible.
                   // With FrictionCone::polyhedral in space, gamma = -min_f d_f' v_t instead of ||v_t||, the distance
                   // to the border of the polygon instead of beta, and mu lambda_n gamma + lambda_t' v_t = 0 in place
                   // of the slip laws: with lambda_t = sum_f l_f d_f it is the sum of l_f (d_f' v_t + gamma) over f and
                   // of gamma (mu lambda_n - sum_f l_f), each of which is not negative.
  // With bilateral constraints; the conditions of single contacts above and below are those of unilateral ones.
  bilateral_gap,       ///< f_c^i = 0 at q_n, q_nj and q_{n+1}
  bilateral_velocity,  ///< J_n^i' v = 0 at v_n0 and v_{n+1}
  // With curved contacts, where P acts. The forces at the right end take the place of those of the last stage in the
  // signs, the cone and the pinned switches.
  end_tangency,  ///< J_n^i' v_{n+1} = 0 of closed contacts, J_t^i' v_{n+1} = 0 of sticking ones
  end_force,     ///< (J_n^i' v)^. = 0 at v_{n+1} with the forces at the right end, (J_t^i' v)^. = 0 of sticking ones
  // Other forms of conditions above, with the same solutions.
  aggregated_complementarity,  ///< sum_j lambda_nj^i sum_j' f_c^i(q_nj') = 0, one equation for n_s (n_s + 1)
  tanh_equilibration,          ///< (h_n - h_{n-1}) tanh(eta_n) = 0, of the size of the step when no switch happens
  step_length,                 ///< sum_n h_n = H
};
/// Evaluates every condition of `step` afresh from q_nj, v_nj, lambda_nj, Lambda_n, h_n: none of the solver's formulas
/// are used. Residuals are relative to the size of the terms that cancel: |q| + h |v| for positions, |v| + h max(|M^-1
/// f_v|, |M^-1 J_n lambda|) for velocities; gaps to |J_n|' (|q| + H |v| + H^2 |M^-1 f_v|), forces to the largest
/// contact force or load J_n' M^-1 f_v / G of the step, normal velocities to sum_k |J_n,k v_k| + H G force, impulses to
/// m |v|; slip velocities to |J_t|' (|v| + H |M^-1 f_v|) + H G_t mu lambda_n; products to the product of both sizes.
/// Indicators in eta_n are normalised in the same way. Squared cones have the square of the force for a size.
/// Forces of bilateral constraints are load to the other contacts.
class FesdAudit {
 public:
  /// What a solver says of its steps.
  struct Claims {
    bool pinned = true;          ///< they fulfil FesdCondition::pinned_breaking and pinned_sliding
    double gap_tolerance = 0;    ///< [m] by which the gap of a contact that has just broken may be negative
    FrictionConeOptions cone{};  ///< the form of the friction conditions
  };
  FesdAudit(const Problem& problem, const ButcherTableau& tableau, const Claims& claims);
  /// @param previous  the left neighbour, or null; @param t  start of the step [s]
  void add(const FesdStep& step, const FesdStep* previous, double t);

  /// One entry per condition, in the order of FesdCondition; those of friction, bilateral constraints and curved
  /// contacts only if the scene has some.
  std::vector<Residual> residuals() const;

 private:
  void report(FesdCondition condition, double residual, double size, int contact);
  Vector slip(int contact, const Vector& q, const Vector& v) const;  // v_t, n_t
  Vector stage_velocity(const Element& e, int j, int n_t) const;
  Vector end_velocity_residual(const Element& e, const Matrix& accelerations) const;
  TangentialLaw law_of(const Element& e, int contact) const;
  void add_right_end(const Element& e, const Vector& force_size);
  void add_bilateral(const Element& e, const Matrix& gaps);
  bool forces_jump(const Element& left, const Element& right) const;
  /// A friction force, or impulse, and the slip velocity that it belongs to.
  struct FrictionPoint {
    double cone;  ///< mu lambda_n
    Vector force, v_t;
  };
  void add_cone(FesdCondition condition, const FrictionPoint& at, int contact, double force);
  void add_slip(FesdCondition condition, const FrictionPoint& at, int contact, double force, double slip_size);
  double missing_dissipation(const FrictionPoint& at, const Vector& v_t) const;
  double published_gamma(const FrictionPoint& at, double force) const;
  double cone_margin(double cone, const Vector& force) const;
  void add_cross_friction(const std::vector<FrictionPoint>& stages, const std::vector<Vector>& slips, int i,
                          double force, double slip_size);
  void add_friction(const FesdStep& step, int n, int i, double force, double Lambda_size, double slip_size);
  void add_pinned_sliding(const Element& left, const Element& e, int i, double force, double slip_size);
  double friction_indicator(const Element& left, const Element& e, int i, double force, double slip_size) const;
  double facet_indicator(const Element& left, const Element& e, int i, double force, double slip_size) const;

  const Problem& problem_;
  const ButcherTableau tableau_;
  const bool stiffly_accurate_, pinned_;
  const double gap_tolerance_;
  const FrictionCone cone_;
  const FrictionPolygon polygon_;
  std::vector<Residual> residuals_;
  // Over all steps so far: a body at rest has the rounding of its journey.
  Vector gap_size_, speed_size_, slip_size_;
  double t_ = 0;
};

}  // namespace ricochet
