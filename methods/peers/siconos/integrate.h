#pragma once

#include "methods/method.h"

namespace ricochet::siconos {

// Siconos' integrators, run on a problem of this suite. Failures of Siconos are returned as a status with its message.
// Siconos keeps state in static variables: one run at a time.

/// Whether and how Moreau-Jean time stepping moves positions back onto the surfaces.
enum class Projection { none, direct, combined };

/// The most contacts of a problem: Siconos enumerates the 2^n cases of a direct projection, without a limit of time; in
/// a combined one it writes a block for each contact and one more into arrays of 200 (its MLCP.hpp).
constexpr int max_contacts(Projection projection) {
  return projection == Projection::direct ? 16 : projection == Projection::combined ? 198 : 1 << 30;
}

/// moreau_jean.cpp has the equations. Reads settings.steps.
Solution integrate_moreau_jean(const Problem& problem, const Settings& settings, double theta,
                               Projection projection = Projection::none);

/// schatzman_paoli.cpp has the equations. Reads settings.steps.
Solution integrate_schatzman_paoli(const Problem& problem, const Settings& settings, double theta);

/// d1_minus.cpp has the equations. Reads settings.steps.
Solution integrate_d1_minus(const Problem& problem, const Settings& settings);

/// event_driven.cpp has the equations. Reads settings.tolerance.
Solution integrate_event_driven(const Problem& problem, const Settings& settings);

}  // namespace ricochet::siconos
