#pragma once

#include <cstdint>
#include <span>

#include "methods/contact_laws/friction_polygon.h"
#include "methods/elements/element.h"
#include "problems/solution.h"

namespace ricochet {

class SwitchFunction;
struct RunResponse;

/// Where a run of equal elements ends.
struct Switch {
  /// In the order of the rows of switch_kinds().
  enum class Kind : std::uint8_t {
    gap_closes,      ///< f_c = 0
    force_vanishes,  ///< lambda_n = 0
    slip_stops,      ///< v_t = 0 in the plane; in space see switch_function.h (8)
    cone_reached,    ///< ||lambda_t|| = mu lambda_n of a sticking contact
    slip_turns,      ///< on a polygon, vertex slip becomes normal to an edge
    edge_left,       ///< on a polygon, the force reaches the end of its edge
  };
  Kind kind = Kind::gap_closes;
  int contact = -1;            ///< -1: no switch, the run ends with its time
  int zeros_at_start = 0;      ///< of the switch function at the left end; these roots h = 0 are divided out
  double left_gap = 0;         ///< [m] of a contact that starts the run touching: its gap closes where it is this again
  bool together = false;       ///< the contacts of the same bodies that slip in space come to rest with this one
  FacetCondition condition{};  ///< on a polygon: the one that becomes zero; its facet is -1 elsewhere

  bool on_polygon() const { return condition.facet >= 0; }
  bool is(Kind its_kind, int its_contact) const { return contact == its_contact && kind == its_kind; }
};

/// All that is known of a kind of switch. Another kind is another row, with its value and its slope in SwitchFunction,
/// and the sign condition in SignConditions that announces it.
struct SwitchKind {
  Switch::Kind kind;
  const char* name;
  bool needs_force;  ///< its function is one of the forces at the right end, which not every tableau gives
  bool is_of_slip;   ///< its function is of the slip velocity: at a slip that starts from rest, zero at the left end
  double (SwitchFunction::*value)(const Element& last, const Switch& end);
  void (SwitchFunction::*slope)(const Element& last, const Switch& end, const RunResponse& response,
                                Eigen::RowVector2d& slope);
  EventKind event;                      ///< what happens there, unless an impact or another switch coincides
  std::span<const ContactMode> behind;  ///< modes that the contact may have behind it
  const char* refusal;                  ///< of a run that goes past it; arguments: contact, value, -value, where
};

std::span<const SwitchKind> switch_kinds();
const SwitchKind& properties(Switch::Kind kind);

}  // namespace ricochet
