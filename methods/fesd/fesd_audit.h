#pragma once

#include <vector>

#include "methods/contact_laws/friction_cone.h"
#include "methods/elements/fesd_step.h"
#include "methods/fesd/fesd_conditions.h"
#include "methods/runge_kutta/butcher_tableau.h"

namespace ricochet {

/// Evaluates every condition of `step` afresh from q_nj, v_nj, lambda_nj, Lambda_n, h_n: none of the solver's formulas
/// are used. Residuals are relative to the size of the terms that cancel: |q| + h |v| for positions, |v| + h max(|M^-1
/// f_v|, |M^-1 J_n lambda|) for velocities; gaps to |J_n|' (|q| + H |v| + H^2 |M^-1 f_v|), forces to the largest
/// contact force or load J_n' M^-1 f_v / G of the step, normal velocities to sum_k |J_n,k v_k| + H G force, impulses to
/// m |v|; slip velocities to |J_t|' (|v| + H |M^-1 f_v|) + H G_t mu lambda_n; products to the product of both sizes.
/// Indicators in eta_n are normalised in the same way. The size of squared cones is the square of the force. Forces of
/// bilateral constraints count as load of the other contacts.
///
/// If the tableau holds accelerations (explicit_run.h), only the Runge-Kutta equations are evaluated at its stages. Signs,
/// cones and complementarity are evaluated at the right end.
class FesdAudit {
 public:
  /// Properties that a solver claims of its steps.
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
  /// An element with the data that several sections use.
  struct View {
    const FesdStep& step;
    int n;
    const Element& e;
    const Element* left;       ///< its neighbour, or null
    Matrix M, J_n, J_t;        ///< at its left end
    Vector v_minus, Lambda_n;  ///< there
    Vector left_gaps, right_gaps;
    Matrix accelerations, gaps;  ///< at the stages; n_q x n_s, n_c x n_s
    double momentum;             ///< size of those before and after the left end
    bool obeys_newton;           ///< one impact at most, by Newton's law
    bool forces_jump;            ///< at the left end, whatever switches there
  };

  void set_sizes(const FesdStep& step);
  View view(const FesdStep& step, int n, const Element& element, const Element* left);
  const Element& at_right_end(const Element& element);
  void add_stages(const View& at);
  void add_impulses(const View& at);
  void add_gaps_and_forces(const View& at, int i);
  void add_pinned_breaking(const View& at, int i);
  void add_bilateral(const View& at);
  void add_end_stage(const Element& e);
  void add_right_end(const View& at);
  void add_lengths(const View& at);
  double indicator(const View& at, int i) const;
  /// Whether the solver claims that the switch at the left end of an element, which is no jump, is pinned.
  bool is_pinned(const View& at) const {
    return at.n > 0 && pinned_ && tableau_.right_end.size() > 0 && !at.forces_jump;
  }
  Vector of_captures(const View& at, const Vector& momentum) const;
  static double impulse_size(const View& at, int i);
  void report(FesdCondition condition, double residual, double size, int contact);
  Matrix held_directions(const Element& e, const Vector& q) const;
  Matrix held_and_normals(const Element& e, const Vector& q) const;
  Vector end_position_residual(const Element& e) const;
  Vector end_velocity_residual(const Element& e, const Matrix& accelerations) const;
  TangentialLaw law_of(const Element& e, int contact) const;
  static bool forces_jump(const Element& left, const Element& right);

  /// A friction force, or impulse, and the slip velocity that it belongs to.
  struct FrictionPoint {
    double cone;  ///< mu lambda_n
    Vector force, v_t;
  };
  Vector slip(int contact, const Vector& q, const Vector& v) const;  // v_t, n_t
  Vector stage_velocity(const Element& e, int j, int n_t) const;
  void add_friction(const View& at, int i);
  void add_cone(FesdCondition condition, const FrictionPoint& at, int contact, double force);
  void add_slip(FesdCondition condition, const FrictionPoint& at, int contact, double force);
  void add_cross_friction(const std::vector<FrictionPoint>& stages, const std::vector<Vector>& slips, int i);
  void add_pinned_sliding(const Element& left, const Element& e, int i);
  double missing_dissipation(const FrictionPoint& at, const Vector& v_t) const;
  double published_gamma(const FrictionPoint& at, double force) const;
  double cone_margin(double cone, const Vector& force) const;
  double friction_indicator(const Element& left, const Element& e, int i) const;
  double facet_indicator(const Element& left, const Element& e, int i) const;

  const Problem& problem_;
  const ButcherTableau tableau_;
  const bool stiffly_accurate_;
  const int n_points_;  // at which signs hold: stages, or the right end alone
  const bool pinned_;
  const double gap_tolerance_;
  const FrictionCone cone_;
  const FrictionPolygon polygon_;
  std::vector<Residual> residuals_;
  // Sizes that residuals are compared with, n_c. Over all steps so far: a body at rest keeps the rounding of its
  // earlier motion.
  Vector gap_size_, speed_size_, slip_size_;
  Vector force_size_;             // in the step
  double acceleration_size_ = 0;  // of the terms of M^-1 (f_v + J_n lambda), in the step so far
  double t_ = 0;
  Element right_end_;
};

}  // namespace ricochet
