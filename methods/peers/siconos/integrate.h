#pragma once

#include "methods/method.h"

namespace ricochet::siconos {

// Siconos' integrators, run on a problem of this suite. What Siconos gives up on is a status with its message. Siconos
// keeps state in static variables: one run at a time.

/// moreau_jean.cpp has the equations. Reads settings.steps.
Solution integrate_moreau_jean(const Problem& problem, const Settings& settings, double theta);

/// d1_minus.cpp has the equations. Reads settings.steps.
Solution integrate_d1_minus(const Problem& problem, const Settings& settings);

/// event_driven.cpp has the equations. Reads settings.tolerance.
Solution integrate_event_driven(const Problem& problem, const Settings& settings);

}  // namespace ricochet::siconos
