#pragma once

#include "methods/time_freezing/instant_system.h"
#include "methods/time_freezing/regions.h"

namespace ricochet {

/// Filippov's motion at a state with given regions: forces and derivative.
struct RegionForces {
  Vector lambda_n;  ///< n_c [N]; while time is frozen of the auxiliary dynamics
  Vector lambda_t;  ///< n_lambda_t [N]
  Vector w;         ///< n_q: v'

  explicit RegionForces(const ProblemInfo& info);

  /// Solves (1) of instant_law.h with J_n' w + ... = 0 of sliding contacts, or (3) with (6) of pseudo_time_equations.h.
  /// Redundant contacts get, of all forces, those nearest to the present ones. @param y  n_c, of bouncing contacts
  /// @return false where there are none
  bool solve(const InstantSystem& system, const AuxiliaryDynamics& auxiliary, const Regions& regions, const Vector& v,
             const Vector& y);
};

/// Removes what is left of the velocities of sliding contacts and those that stick. @param v  in and out
void project_velocity(const InstantSystem& system, const Regions& regions, Vector& v);

}  // namespace ricochet
