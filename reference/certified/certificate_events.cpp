#include <fmt/format.h>

#include <algorithm>
#include <map>

#include "reference/certified/certificate_checker.h"

// Statements (1) and (4) of a Certificate: the start, and what follows from events.

namespace ricochet::reference::certified {

void CertificateChecker::assume(const std::string& what) {
  assumptions_.push_back(what);
}

/// (1), with the modes of the first step.
void CertificateChecker::begin() {
  taylor_.load(x_, t_);
  const StartingContacts start = decisions_.contacts_at_start(states_);
  for (const auto& assumption : start.assumptions) assume(assumption);
  const CertificateEvent* event = event_at_end_of(-1);
  if (start.hit.empty() != (event == nullptr)) throw Refused("an impact at the start is missing, or there is none");
  if (!event) {
    decisions_.decide_modes(x_, t_, start.touching, start.slip_sign, states_);
    return;
  }
  require_impulses(decisions_.strike(x_, t_, start.candidates(), start.closed(scene_.n_c()), states_), *event);
  require_event(*event, "impact", scene_.contacts[start.hit.front()].name);
  if (names_of(states_.modes) != event->modes) throw Refused("the modes after the impact at the start");
  require_number(event->time, Ball(), "the time of the event");
}

const CertificateEvent* CertificateChecker::event_at_end_of(int step) const {
  const auto& events = certificate_.events;
  const auto found = std::ranges::find(events, step, &CertificateEvent::step);
  return found == events.end() ? nullptr : &*found;
}

/// The event function that a stated event says has a root.
const EventFunction* CertificateChecker::function_of(const CertificateEvent& event, const ModeMotion& motion) const {
  static const std::map<std::string, EventKind> kinds{
      {"impact", EventKind::impact},          {"detach", EventKind::detach},
      {"stick_to_slip", EventKind::cone},     {"slip_to_stick", EventKind::slip_end},
      {"slip_reversal", EventKind::slip_end}, {"slip_end", EventKind::slip_end}};
  const auto kind = kinds.find(event.kind);
  if (kind == kinds.end()) throw Refused("unknown event " + event.kind);
  for (const auto& function : motion.events) {
    const int i = function.contact;
    if (function.kind != kind->second || scene_.contacts[i].name != event.contact) continue;
    if (event.modes.size() != scene_.contacts.size()) throw Refused("modes of an event have the wrong size");
    const bool plus = event.modes[i] == name_of(Mode::slip_plus);
    if (function.kind == EventKind::cone && scene_.contacts[i].n_t() == 1 && (function.side < 0) != plus) continue;
    return &function;
  }
  throw Refused(fmt::format("{} of {} cannot happen in the modes of the step", event.kind, event.contact));
}

void CertificateChecker::require_event(const CertificateEvent& stated, const std::string& kind,
                                       const std::string& contact) const {
  if (stated.kind != kind || stated.contact != contact)
    throw Refused(fmt::format("the event is {} of {}, not {} of {}", kind, contact, stated.kind, stated.contact));
}

void CertificateChecker::apply(const EventFunction& function, const CertificateEvent& stated) {
  const int i = function.contact;
  const std::string& name = scene_.contacts[i].name;
  if (function.kind == EventKind::impact) {
    require_impulses(decisions_.close_gaps(x_, t_, {i}, states_), stated);
    return require_event(stated, "impact", name);
  }
  if (!stated.Lambda_n.empty()) throw Refused("impulses of an event that is no impact");
  if (function.kind == EventKind::detach) {
    decisions_.open_contact(x_, t_, i, states_);
    require_event(stated, "detach", name);
  } else if (function.kind == EventKind::cone) {
    decisions_.begin_slip(x_, t_, function, states_);
    require_event(stated, "stick_to_slip", name);
  } else {
    require_event(stated, decisions_.end_slip(x_, t_, function, states_), name);
  }
}

void CertificateChecker::require_impulses(const ImpactOutcome& outcome, const CertificateEvent& stated) const {
  if (stated.Lambda_n.size() != outcome.Lambda_n.size()) throw Refused("Lambda_n has the wrong size");
  for (std::size_t i = 0; i < outcome.Lambda_n.size(); ++i) {
    Ball interval;  // text +- radius
    arb_set_str(interval.get(), stated.Lambda_n[i].text.c_str(), 2 * p_.precision().bits);
    Magnitude radius;
    mag_set_d(radius.get(), stated.Lambda_n[i].radius);
    interval.widen(radius.get());
    if (!arb_contains(interval.get(), outcome.Lambda_n[i].get()))
      throw Refused(fmt::format("the impulse of {} is not the stated one", scene_.contacts[i].name));
  }
}

}  // namespace ricochet::reference::certified
