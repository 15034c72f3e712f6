#pragma once

#include <functional>
#include <optional>
#include <vector>

#include "reference/contact_dynamics.h"
#include "reference/scales.h"

namespace ricochet::reference {

/// A contact that begins to slip in space: no slip velocity yet, but the direction that it will have.
struct BeginningSlip {
  int contact = -1;
  Vector direction;  ///< 2, unit vector
  double fast = 0;   ///< slip velocity from which a multistep method can go on [m/s]
};

/// State a short time after slip in space began.
struct SlipStart {
  double duration = 0;  ///< [s]
  Vector q, v;
};

struct SlipStartSettings {
  double longest_step = 0;  ///< first step tried [s]
  double end = 0;           ///< duration that may not be exceeded [s]
  double tolerance = 0;     ///< of q and v per step, as a part of |q| + Q and |v| + V of Scales
  /// Whether no contact changes its mode before this state; steps end before one does.
  std::function<bool(const Vector& q, const Vector& v)> keeps_modes;
};

/// The first moments of slip in space, where (4) of contact_dynamics.h is singular: the direction v_t / |v_t| has a
/// limit for v_t -> 0, but returns to it at a rate of mu lambda_n / (m |v_t|). A multistep method would follow that
/// with millions of steps, or step over it and lose the direction in its error tolerance. The motion itself is smooth,
/// so collocation crosses it, Radau IIA with five stages (order 9, stage order 5; Hairer, Wanner, Solving ODEs II,
/// section IV.5), whose stages know the direction as an angle phi of its own:
///
///   q_i = q + c_i h v + h^2 sum_j (A^2)_ij a_j,   v_i = v + h sum_j A_ij a_j            (1)
///   a_i = acceleration at (q_i, v_i) with the slip directions d(phi_i)                  (2)
///   0 = d_perp(phi_i)' v_t(q_i, v_i)                                                    (3)
///
/// (2) is a fixed point for small h; (3) is solved for the angles by Newton's method with divided differences. A step h
/// is accepted when two halves of it agree with it within the tolerance, and the halves are kept. Steps follow until
/// every contact is as fast as it has to be, or slows down again before it is, or another mode would change.
/// @return nothing when no first step is accepted
std::optional<SlipStart> start_slip(const Problem& problem, const Scales& scales, ContactDynamics& dynamics,
                                    const Vector& q, const Vector& v, const std::vector<BeginningSlip>& beginning,
                                    const SlipStartSettings& settings);

}  // namespace ricochet::reference
