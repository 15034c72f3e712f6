#pragma once

#include "reports/table.h"

namespace ricochet {

/// What an impact does to the kinetic energy under each impact law: the tip of Kane's double pendulum (the scene
/// kane_pendulum at its start, planar_impact.h), and a row of n equal beads that touch, struck by the first, with
/// Hertz's springs (lzb_impact.h) beside Newton's law at all contacts at once (Moreau's).
struct ImpactLawStudy {
  Table kane, cradle;
};

/// @param e  restitution of all contacts, in (0, 1]  @param beads  of the longest row, 2 or more
ImpactLawStudy run_impact_law_study(double e, int beads);

}  // namespace ricochet
