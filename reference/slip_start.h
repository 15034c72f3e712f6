#pragma once

#include <functional>
#include <optional>
#include <vector>

#include "reference/contact_dynamics.h"
#include "reference/scales.h"

namespace ricochet::reference {

/// A contact that starts to slip in space: its slip velocity is still zero, but its direction is known.
struct BeginningSlip {
  int contact = -1;
  Vector direction;  ///< 2, unit vector
  double fast = 0;   ///< slip velocity from which a multistep method can continue [m/s]
};

/// State a short time after slip in space began.
struct SlipStart {
  double duration = 0;  ///< [s]
  Vector q, v;
};

struct SlipStartSettings {
  double longest_step = 0;  ///< first step tried [s]
  double end = 0;           ///< longest duration [s]
  double tolerance = 0;     ///< of q and v per step, relative to |q| + Q and |v| + V of Scales
  /// Whether no contact changes its mode up to this state; steps end before a change.
  std::function<bool(const Vector& q, const Vector& v)> keeps_modes;
};

/// Integrates the first moments of slip in space, where (4) of contact_dynamics.h is singular: the direction v_t /
/// |v_t| has a limit for v_t -> 0, but returns to it at a rate of mu lambda_n / (m |v_t|). A multistep method would
/// need millions of steps, or would lose the direction in its error tolerance. The motion is smooth, so collocation can
/// cross it: Radau IIA with five stages (order 9, stage order 5; Hairer, Wanner, Solving ODEs II, section IV.5), with
/// the angle phi of the direction as an additional unknown of each stage:
///
///   q_i = q + c_i h v + h^2 sum_j (A^2)_ij a_j,   v_i = v + h sum_j A_ij a_j            (1)
///   a_i = acceleration at (q_i, v_i) with the slip directions d(phi_i)                  (2)
///   0 = d_perp(phi_i)' v_t(q_i, v_i)                                                    (3)
///
/// (2) is solved by fixed-point iteration for small h, (3) by Newton's method with divided differences. A step h is
/// accepted if two halves of it agree with it within the tolerance; the result of the halves is used. Steps continue
/// until every contact is fast enough, or slows down again before, or another mode would change.
/// @return nothing if no first step is accepted
std::optional<SlipStart> start_slip(const Problem& problem, const Scales& scales, ContactDynamics& dynamics,
                                    const Vector& q, const Vector& v, const std::vector<BeginningSlip>& beginning,
                                    const SlipStartSettings& settings);

}  // namespace ricochet::reference
