#pragma once

#include "reports/table.h"

namespace ricochet {

/// Change of the kinetic energy in an impact under each impact law, for two problems: the tip of Kane's double pendulum
/// (the scene kane_pendulum at its start, planar_impact.h), and a row of n equal touching beads, hit by the first, with
/// Hertz's springs (lzb_impact.h) and with Newton's law at all contacts at once (Moreau's law).
struct ImpactLawStudy {
  Table kane, cradle;
};

/// @param e  restitution of all contacts, in (0, 1]  @param beads  in the longest row, at least 2
ImpactLawStudy run_impact_law_study(double e, int beads);

}  // namespace ricochet
