#include "methods/contact_laws/contacts_after_impact.h"

#include <algorithm>
#include <cmath>

namespace ricochet {
namespace {

/// (2). A force of zero has no direction.
void slide_against(const double* force, int n_t, ImpactSolver::ClosedContact& closed) {
  double size = 0;
  for (int d = 0; d < n_t; ++d) size = std::hypot(size, force[d]);
  closed.slides = size > 0;
  for (int d = 0; d < n_t && closed.slides; ++d) closed.direction[d] = -force[d] / size;
}

}  // namespace

void contacts_after_impact(const ImpactSolver& law, const ContactScales& scales, std::span<const int> touching,
                           const ImpactedState& at, std::vector<ContactAfterImpact>& contacts) {
  contacts.clear();
  for (const int i : touching) {
    const bool is_cause = i == at.switched;
    if (is_cause && at.cause == SwitchKind::force_vanishes) continue;
    const ContactInfo& info = law.contact(i);
    const ContactMode before = at.modes ? (*at.modes)[i] : ContactMode::open;
    ContactAfterImpact contact{.closed = {.contact = i}};
    contact.is_struck =
        at.is_impact && std::ranges::any_of(info.support, [&](int k) { return at.v[k] != at.v_minus[k]; });
    contact.rests = is_closed(before) && !contact.is_struck;
    contact.separates = law.normal_velocity(i, at.v) > scales.no_approach(i);
    const bool stops = (is_cause && at.cause == SwitchKind::slip_stops) || std::ranges::count(at.stopped, i) > 0;
    if (info.n_t > 0 && !contact.is_struck && is_cause && at.cause == SwitchKind::cone_reached)
      slide_against(at.force, info.n_t, contact.closed);
    else if (info.n_t > 0 && (contact.is_struck || (before != ContactMode::stick && !stops)))
      law.set_slide(contact.closed, at.v, scales.no_slip(i));  // up to the slip that contacts which stop together keep
    contacts.push_back(contact);
  }
}

}  // namespace ricochet
