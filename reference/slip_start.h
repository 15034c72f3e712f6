#pragma once

#include <optional>
#include <vector>

#include "reference/contact_dynamics.h"

namespace ricochet::reference {

/// A contact that begins to slip in space: no slip velocity yet, but the direction that it will have.
struct BeginningSlip {
  int contact = -1;
  Vector direction;  ///< 2, unit vector
};

/// State a short time after slip in space began.
struct SlipStart {
  double duration = 0;  ///< [s]
  Vector q, v;
};

/// The first moments of slip in space, where (4) of contact_dynamics.h is singular: the direction v_t / |v_t| has a
/// limit for v_t -> 0, but its rate grows like 1/|v_t|, beyond what a multistep method can start from. The motion
/// itself is smooth, so collocation crosses it: one step of Radau IIA with three stages (Hairer, Wanner, Solving ODEs
/// II, table IV.5.6; order 5, stage order 3) whose stages know the direction as an angle phi of its own,
///
///   q_i = q + c_i h v + h^2 sum_j (A^2)_ij a_j,   v_i = v + h sum_j A_ij a_j            (1)
///   a_i = acceleration at (q_i, v_i) with the slip directions d(phi_i)                  (2)
///   0 = d_perp(phi_i)' v_t(q_i, v_i)                                                    (3)
///
/// (2) is a fixed point for small h; (3) is solved for the angles by Newton's method with divided differences. h is
/// halved until one step and two halves agree within `tolerance`; the halves are returned.
/// @param longest  first h tried [s]; @param tolerance  of q and v, relative and absolute
/// @return nothing when no h does
std::optional<SlipStart> start_slip(const Problem& problem, ContactDynamics& dynamics, const Vector& q, const Vector& v,
                                    const std::vector<BeginningSlip>& beginning, double longest, double tolerance);

}  // namespace ricochet::reference
