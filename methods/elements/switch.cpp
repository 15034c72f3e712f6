#include "methods/elements/switch.h"

#include <iterator>

#include "methods/elements/switch_function.h"

namespace ricochet {
namespace {

using enum ContactMode;
constexpr ContactMode kTouches[] = {open, closed, stick, slip_positive, slip_negative, slip, vertex_slip, edge_slip};
constexpr ContactMode kParts[] = {open};
constexpr ContactMode kStops[] = {stick, slip_positive, slip_negative};
constexpr ContactMode kSlips[] = {slip_positive, slip_negative, slip, vertex_slip, edge_slip};
constexpr ContactMode kOnPolygon[] = {vertex_slip, edge_slip};

constexpr SwitchProperties kKinds[] = {
    {.kind = SwitchKind::gap_closes,
     .name = "gap closes",
     .needs_force = false,
     .is_of_slip = false,
     .value = &SwitchFunction::gap,
     .slope = &SwitchFunction::gap_slope,
     .event = EventKind::impact,
     .after = kTouches,
     .refusal = "{0} would penetrate to a gap of {1:.3g} m {3}"},
    {.kind = SwitchKind::force_vanishes,
     .name = "force vanishes",
     .needs_force = true,
     .is_of_slip = false,
     .value = &SwitchFunction::normal_force,
     .slope = &SwitchFunction::force_slope,
     .event = EventKind::detach,
     .after = kParts,
     .refusal = "{0} would pull with {1:.3g} N {3}"},
    {.kind = SwitchKind::slip_stops,
     .name = "slip stops",
     .needs_force = false,
     .is_of_slip = true,
     .value = &SwitchFunction::slip,
     .slope = &SwitchFunction::slip_slope,
     .event = EventKind::slip_to_stick,
     .after = kStops,
     .refusal = "{0} would slip back with {2:.3g} m/s {3}"},
    {.kind = SwitchKind::cone_reached,
     .name = "cone reached",
     .needs_force = true,
     .is_of_slip = false,
     .value = &SwitchFunction::cone_margin,
     .slope = &SwitchFunction::force_slope,
     .event = EventKind::stick_to_slip,
     .after = kSlips,
     .refusal = "{0} would stick with {2:.3g} N more than its friction cone has {3}"},
    {.kind = SwitchKind::slip_turns,
     .name = "slip turns",
     .needs_force = false,
     .is_of_slip = true,
     .value = &SwitchFunction::slip,
     .slope = &SwitchFunction::slip_slope,
     .event = EventKind::facet_change,
     .after = kOnPolygon,
     .refusal = "{0} would slip with {2:.3g} m/s past an edge of its friction polygon {3}"},
    {.kind = SwitchKind::edge_left,
     .name = "edge left",
     .needs_force = true,
     .is_of_slip = false,
     .value = &SwitchFunction::cone_margin,
     .slope = &SwitchFunction::force_slope,
     .event = EventKind::facet_change,
     .after = kOnPolygon,
     .refusal = "{0} would slip with {2:.3g} N beyond an edge of its friction polygon {3}"},
};

constexpr bool rows_are_in_order() {
  for (std::size_t k = 0; k < std::size(kKinds); ++k) {
    if (static_cast<std::size_t>(kKinds[k].kind) != k) return false;
  }
  return true;
}
static_assert(rows_are_in_order());

}  // namespace

std::span<const SwitchProperties> switch_kinds() {
  return kKinds;
}

const SwitchProperties& properties(SwitchKind kind) {
  return kKinds[static_cast<std::size_t>(kind)];
}

}  // namespace ricochet
