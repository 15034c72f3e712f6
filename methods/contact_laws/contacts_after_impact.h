#pragma once

#include <span>
#include <vector>

#include "methods/contact_laws/contact_scales.h"
#include "methods/contact_laws/impact_solver.h"
#include "methods/contact_laws/switch_kind.h"

namespace ricochet {

/// An instant, after its impacts.
struct ImpactedState {
  const std::vector<ContactMode>* modes;  ///< n_c, before the instant; null at the start of a run
  Eigen::Ref<const Vector> v_minus, v;    ///< n_q, before and after the impacts
  bool is_impact;                         ///< whether an impact moves bodies at all
  SwitchKind cause;                       ///< the switch that led here, of contact `switched`
  int switched;                           ///< -1: none
  const double* force;                    ///< n_t, lambda_t of `switched` before; read if the cause is cone_reached
  std::span<const int> stopped;           ///< contacts whose slip has stopped together with that of `switched`
};

/// A touching contact after the impacts of an instant.
struct ContactAfterImpact {
  ImpactSolver::ClosedContact closed;  ///< with its slip direction; the load decides whether it stays closed
  bool is_struck = false;              ///< an impact has changed the velocity of its bodies
  bool rests = false;                  ///< it was closed before, and is not struck: it stays closed
  bool separates = false;              ///< its gap opens: J_n' v+ > 0
};

/// The touching contacts after the impacts of an instant, except one whose force has vanished. Of the slip of each:
///
///   struck                   slides if J_t' v+ != 0                          (1)
///   its cone was reached     slides against its force, -lambda_t             (2)
///   it stuck or stopped      does not slide                                  (3)
///   any other                as (1)
///
/// @param law  prepared for the touching contacts
void contacts_after_impact(const ImpactSolver& law, const ContactScales& scales, std::span<const int> touching,
                           const ImpactedState& at, std::vector<ContactAfterImpact>& contacts);

}  // namespace ricochet
