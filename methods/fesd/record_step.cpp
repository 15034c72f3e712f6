#include "methods/fesd/record_step.h"

#include <optional>

namespace ricochet {
namespace {

/// Event of a contact at the left end of an element, if any; on a polygon a change of vertex or edge counts, too.
std::optional<EventKind> kind_of_event(const Element* left, const Element& element, int i, double Lambda_n) {
  const ContactMode before = left ? left->modes[i] : ContactMode::open, after = element.modes[i];
  const bool is_on_polygon = after == ContactMode::vertex_slip || after == ContactMode::edge_slip;
  if (is_on_polygon && is_slipping(before) && (before != after || left->facets[i] != element.facets[i]))
    return EventKind::facet_change;
  return event_kind(before, after, Lambda_n > 0);
}

}  // namespace

void record_step(const Problem& problem, Recording recording, const FesdStep& step, const FesdStep* previous, double t,
                 const Sensitivity* sensitivity, Solution& solution) {
  const Element* left = previous ? &previous->last() : nullptr;
  if (!left) solution.initial_modes = step.elements[0].modes;
  const bool may_have_events = step.touches || (previous && previous->touches);
  if (!may_have_events && recording < Recording::grid) return;
  for (int n = 0; n < step.n_elements; ++n) {
    const Element& element = step.elements[n];
    for (const int i : problem.info().unilateral) {
      const auto kind = kind_of_event(left, element, i, step.Lambda_n(i, n));
      if (!kind) continue;
      ++solution.counters.events;
      if (recording == Recording::final_state) continue;
      solution.events.push_back({.t = t,
                                 .kind = *kind,
                                 .contact = i,
                                 .q = element.q0,
                                 .v_minus = step.v_minus.col(n),
                                 .v_plus = element.v0,
                                 .Lambda_n = step.Lambda_n.col(n),
                                 .Lambda_t = step.Lambda_t.col(n),
                                 .modes = element.modes,
                                 .dt = sensitivity ? sensitivity->dt_of_element(n) : Vector()});
    }
    if (recording >= Recording::grid) solution.samples.push_back({t, element.q0, step.v_minus.col(n), element.v0});
    t += element.h;
    left = &element;
  }
}

}  // namespace ricochet
