#include "problems/solution.h"

#include <algorithm>

namespace ricochet {

const char* to_string(Status status) {
  switch (status) {
    case Status::success:
      return "success";
    case Status::infeasible:
      return "infeasible";
    case Status::inner_solver_failed:
      return "inner_solver_failed";
    case Status::step_limit:
      return "step_limit";
    case Status::time_limit:
      return "time_limit";
    case Status::non_finite:
      return "non_finite";
  }
  return "unknown";
}

const char* to_string(EventKind kind) {
  switch (kind) {
    case EventKind::impact:
      return "impact";
    case EventKind::detach:
      return "detach";
    case EventKind::slip_to_stick:
      return "slip_to_stick";
    case EventKind::stick_to_slip:
      return "stick_to_slip";
    case EventKind::slip_reversal:
      return "slip_reversal";
    case EventKind::facet_change:
      return "facet_change";
  }
  return "unknown";
}

std::optional<EventKind> event_kind(ContactMode before, ContactMode after, bool has_impulse, bool slip_ended) {
  if (!is_closed(before)) return has_impulse ? std::optional(EventKind::impact) : std::nullopt;
  if (!is_closed(after)) return EventKind::detach;
  if (is_slipping(before) && is_slipping(after) && (before != after || slip_ended)) return EventKind::slip_reversal;
  if (before == after) return std::nullopt;
  return after == ContactMode::stick ? EventKind::slip_to_stick : EventKind::stick_to_slip;
}

const char* to_string(ContactMode mode) {
  switch (mode) {
    case ContactMode::open:
      return "open";
    case ContactMode::closed:
      return "closed";
    case ContactMode::stick:
      return "stick";
    case ContactMode::slip_positive:
      return "slip+";
    case ContactMode::slip_negative:
      return "slip-";
    case ContactMode::slip:
      return "slip";
    case ContactMode::vertex_slip:
      return "vertex slip";
    case ContactMode::edge_slip:
      return "edge slip";
  }
  return "unknown";
}

double Solution::max_residual() const {
  double largest = -1;
  for (const auto& residual : residuals) largest = std::max(largest, residual.value);
  return largest;
}

}  // namespace ricochet
