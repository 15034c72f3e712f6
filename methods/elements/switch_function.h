#pragma once

#include "methods/elements/element_system.h"
#include "methods/elements/switch.h"

namespace ricochet {

/// How the right end of a run and the unknowns of its last element respond: a constant column, and one per unit of h.
struct RunResponse {
  const Matrix& q;  ///< n_q x 2: of q_1
  const Matrix& v;  ///< n_q x 2: of v_1
  const Matrix& x;  ///< n_s n_unknowns x 2
};

/// Value and slope of the function whose zero at the right end of an element is a switch (switch.h): a gap, a normal
/// force, the slack of the friction cone or the polygon, or a component of the slip velocity. All are those of the
/// right end, with the forces of (11) of end_projection.h.
///
/// Slip in space that comes to rest at the right end is singular in (7c) of stage_equations.h. A stage there - the last
/// one of a stiffly accurate tableau - has (7a) instead, and the element length makes its force reach the cone from
/// outside:
///
///   J_t' v_{n_s} = 0,   ||lambda_t,n_s|| = mu lambda_n,n_s.                                                       (8)
///
/// This force is that of the stage, also where (11) replaces it: (11) sticks already, and lies inside the cone.
/// Other tableaus cannot make both components of v_t at the right end zero with one length. A rigid body that slides
/// and spins on several contacts, all of one support, comes to rest on all of them at once. Then the first half of (8)
/// holds for each contact, although these equations are redundant. (9) replaces the second half: the power of friction
/// is the largest that the cones allow, with the slip accelerations in place of the velocities, which vanish:
///
///   sum_i lambda_t^i' s^i = sum_i mu^i lambda_n^i ||s^i||,   s = (J_t' v)^. = J_t' w + T v   at stage n_s.        (9)
///
/// Redundant contacts (four corners on a plane) have no unique forces: the smallest are taken, see redundant_system.h;
/// for (9), those nearest to mu^i lambda_n^i s^i / ||s^i||, which is the limit at rest.
class SwitchFunction {
 public:
  explicit SwitchFunction(ElementSystem& system);

  /// At the right end of a solved element, zeros at the start included. The tableau must reach the right end
  /// (ButcherTableau::right_end) for a switch of forces.
  double value(const Element& last, const Switch& end);
  /// Derivative of value(): constant part, per unit of h.
  void slope(const Element& last, const Switch& end, const RunResponse& response, Eigen::RowVector2d& slope);
  /// Value without its zeros at h = 0, and its slope.
  double deflated(const Element& last, const Switch& end, double h, const RunResponse& response,
                  Eigen::RowVector2d& slope);

  /// Whether a gap that closes is as small as the rounding of the positions whose difference it is.
  bool is_rounding_of_gap(const Element& last, const Switch& end);
  /// Chooses those friction forces at the last stage of (9) that are nearest to the limit at rest; all have the same
  /// effect.
  void spread_friction(Element& last);

  // The functions of switch_kinds().
  double gap(const Element& last, const Switch& end);
  void gap_slope(const Element& last, const Switch& end, const RunResponse& response, Eigen::RowVector2d& slope);
  double normal_force(const Element& last, const Switch& end);
  double cone_margin(const Element& last, const Switch& end);
  void force_slope(const Element& last, const Switch& end, const RunResponse& response, Eigen::RowVector2d& slope);
  double slip(const Element& last, const Switch& end);
  void slip_slope(const Element& last, const Switch& end, const RunResponse& response, Eigen::RowVector2d& slope);

 private:
  static bool slip_component(const Element& last, const Switch& end, double* direction);
  double margin(const Switch& end, const Eigen::Ref<const Vector>& lambda_n,
                const Eigen::Ref<const Vector>& lambda_t) const;
  void end_force_slope(const Element& last, const Switch& end, const RunResponse& response, Eigen::RowVector2d& slope);
  void stage_force_slope(const Element& last, const Switch& end, const RunResponse& response,
                         Eigen::RowVector2d& slope) const;
  void set_slip_terms(const Element& last);
  double slip_acceleration(const ActiveContact& active, const Element& last, double* s) const;
  double missing_power(const Element& last, const RunResponse* response, Eigen::RowVector2d* slope);

  ElementSystem& system_;
  const Problem& problem_;
  const int n_s_;

  // Scratch of one function at a time.
  Vector J_n_, J_t_, gap_, q_, v_;
  Matrix T_, T_a_;  // d(J_t' v)/dq, and with accelerations in place of v
};

}  // namespace ricochet
