#pragma once

#include <span>

#include "methods/contact_laws/friction_polygon.h"
#include "methods/contact_laws/switch_kind.h"
#include "methods/elements/element.h"
#include "problems/solution.h"

namespace ricochet {

class SwitchFunction;
struct RunResponse;

/// The switch at the end of a run of equal elements.
struct Switch {
  SwitchKind kind = SwitchKind::gap_closes;
  int contact = -1;            ///< -1: no switch, the run ends with its time
  int zeros_at_start = 0;      ///< number of zeros h = 0 of the switch function, which are divided out
  double left_gap = 0;         ///< [m] of a contact that touches at the left end: its gap closes at this value again
  bool together = false;       ///< contacts of the same bodies that slip in space come to rest with this one
  FacetCondition condition{};  ///< on a polygon: the condition that becomes zero; its facet is -1 elsewhere

  bool on_polygon() const { return condition.facet >= 0; }
  bool is(SwitchKind its_kind, int its_contact) const { return contact == its_contact && kind == its_kind; }
};

/// Properties of a kind of switch in FESD-J. A new kind needs a row, with its value and its slope in SwitchFunction, and
/// the sign condition in SignConditions that announces it.
struct SwitchProperties {
  SwitchKind kind;
  const char* name;
  bool needs_force;  ///< its function is one of the forces at the right end, which not every tableau gives
  bool is_of_slip;   ///< its function is of the slip velocity: at a slip that starts from rest, zero at the left end
  double (SwitchFunction::*value)(const Element& last, const Switch& end);
  void (SwitchFunction::*slope)(const Element& last, const Switch& end, const RunResponse& response,
                                Eigen::RowVector2d& slope);
  EventKind event;                     ///< the event there, unless an impact or another switch coincides
  std::span<const ContactMode> after;  ///< modes that the contact may have after it
  const char* refusal;                 ///< message of a run that goes past it; arguments: contact, value, -value, where
};

/// One row for each SwitchKind, in their order.
std::span<const SwitchProperties> switch_kinds();
const SwitchProperties& properties(SwitchKind kind);

}  // namespace ricochet
