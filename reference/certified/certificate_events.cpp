#include <fmt/format.h>

#include <algorithm>
#include <map>

#include "reference/certified/certificate_checker.h"

// Statements (1) and (4) of a Certificate: the start, and what happens at events. Leading coefficients that vanish
// after an event: of a gap one after an impact, two where a contact opens from rest, three where its force vanishes; of
// a slip velocity one after a reversal, two where sticking ends.

namespace ricochet::reference::certified {

void CertificateChecker::assume(const std::string& what) {
  assumptions_.push_back(what);
}

int CertificateChecker::sign_at_start(const Ball& value, bool is_zero, const std::string& what) {
  if (is_zero || value.is_zero()) return 0;
  if (value.sign() == Sign::unknown) assume(what + " is zero at t = 0");
  return static_cast<int>(value.sign());
}

/// Sorts contact i into those that are hit, those that touch, or neither. @returns whether it is closed
bool CertificateChecker::touches(int i, std::vector<int>& hit, std::vector<int>& touching,
                                 std::vector<int>& slip_sign) {
  const ContactFormulas& contact = scene_.contacts[i];
  const int gap = sign_at_start(p_.value_of(contact.gap), contact.gap_is_zero, "the gap of " + contact.name);
  if (gap < 0 || (contact.is_bilateral && gap != 0)) throw Refused("the gap at the start, of " + contact.name);
  if (gap > 0) return false;
  const int v_n =
      sign_at_start(p_.value_of(contact.v_n), contact.v_n_is_zero, "the normal velocity of " + contact.name);
  if (v_n > 0 && !contact.is_bilateral) {
    states_.vanishing_gap[i] = 1;
    return false;
  }
  if (v_n != 0) {
    hit.push_back(i);
    return true;
  }
  touching.push_back(i);
  Ball slip;
  if (contact.n_t() == 1) slip = p_.value_of(contact.v_t[0]);
  if (contact.n_t() == 2) slip = p_.value_of(p_.dot(contact.v_t, contact.v_t));
  slip_sign[i] = sign_at_start(slip, contact.v_t_is_zero, "the slip velocity of " + contact.name);
  return true;
}

/// (1), with the modes of the first step.
void CertificateChecker::begin() {
  std::vector<int> hit, touching, slip_sign(scene_.n_c(), 0);
  taylor_.load(x_, t_);
  for (int i = 0; i < scene_.n_c(); ++i) touches(i, hit, touching, slip_sign);
  const CertificateEvent* event = event_at_end_of(-1);
  if (hit.empty() != (event == nullptr)) throw Refused("an impact at the start is missing, or there is none");
  if (!event) {
    decisions_.decide_modes(x_, t_, touching, slip_sign, states_);
    return;
  }
  std::vector<char> closed(scene_.n_c(), 0);
  for (const int i : touching) closed[i] = 1;
  std::vector<int> candidates = hit;
  candidates.insert(candidates.end(), touching.begin(), touching.end());
  strike(candidates, closed, *event);
  require_event(*event, "impact", scene_.contacts[hit.front()].name);
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
    taylor_.load(x_, t_);
    if (p_.value_of(scene_.contacts[i].v_n).sign() != Sign::negative) throw Refused("v_n < 0 at the impact of " + name);
    const std::vector<int> candidates = coupled_with(i);
    std::vector<char> closed(scene_.n_c(), 0);
    for (const int j : candidates) closed[j] = j != i;
    strike(candidates, closed, stated);
    return require_event(stated, "impact", name);
  }
  if (!stated.Lambda_n.empty()) throw Refused("impulses of an event that is no impact");
  if (function.kind == EventKind::detach) {
    open_by_force(i);
    require_event(stated, "detach", name);
  } else if (function.kind == EventKind::cone) {
    begin_slip(function);
    require_event(stated, "stick_to_slip", name);
  } else {
    require_event(stated, end_slip(i), name);
  }
}

/// Closed contacts that exchange momentum with a contact, which comes first.
std::vector<int> CertificateChecker::coupled_with(int contact) const {
  std::vector<int> all{contact}, coupled;
  for (int j = 0; j < scene_.n_c(); ++j) {
    if (j != contact && states_.modes[j] != Mode::open) all.push_back(j);
  }
  const std::vector<int> labels = momentum_groups(scene_, all, p_).of_contact;
  for (std::size_t k = 0; k < all.size(); ++k) {
    if (labels[k] == labels[0]) coupled.push_back(all[k]);
  }
  return coupled;
}

/// Impact law Decisions (2), then the modes (1) of contacts that stay closed.
void CertificateChecker::strike(const std::vector<int>& candidates, const std::vector<char>& closed,
                                const CertificateEvent& stated) {
  const ImpactOutcome outcome = decisions_.decide_impact(x_, t_, candidates, closed);
  std::vector<int> resting, slip_sign(scene_.n_c(), 0);
  for (std::size_t k = 0; k < candidates.size(); ++k) {
    const int i = candidates[k];
    states_.modes[i] = Mode::open;
    const bool stays = closed[i] || scene_.contacts[i].is_bilateral || scene_.contacts[i].eps_r.is_zero();
    if (outcome.modes[k] == Mode::open || !stays) {
      states_.vanishing_gap[i] = 1;
      continue;
    }
    resting.push_back(i);
    const Mode mode = outcome.modes[k];
    slip_sign[i] = mode == Mode::slip_plus || mode == Mode::slip ? 1 : mode == Mode::slip_minus ? -1 : 0;
  }
  std::ranges::copy(outcome.velocity, x_.begin() + scene_.n);
  decisions_.decide_modes(x_, t_, resting, slip_sign, states_);
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

void CertificateChecker::open_by_force(int i) {
  states_.modes[i] = Mode::open;
  states_.vanishing_gap[i] = 3;
  taylor_.load(x_, t_);
  taylor_.expand(mode_motion(scene_, states_.modes, p_), 3);
  if (Ball(p_.coefficient(scene_.contacts[i].gap, 3)).sign() != Sign::positive)
    throw Refused("d3/dt3 gap > 0 after the force vanishes, of " + scene_.contacts[i].name);
}

void CertificateChecker::begin_slip(const EventFunction& function) {
  const ContactFormulas& contact = scene_.contacts[function.contact];
  if (contact.n_t() == 2) throw Refused("slip in space begins from rest: " + contact.name);
  const bool plus = function.side < 0;  // friction acts against slip
  states_.modes[function.contact] = plus ? Mode::slip_plus : Mode::slip_minus;
  states_.vanishing_slip[function.contact] = 2;
  taylor_.load(x_, t_);
  taylor_.expand(mode_motion(scene_, states_.modes, p_), 2);
  const Ball rate(p_.coefficient(contact.v_t[0], 2));
  if ((plus ? rate : -rate).sign() != Sign::positive)
    throw Refused("d2/dt2 v_t has the sign of the slip that begins, of " + contact.name);
}

/// @returns the kind of event
std::string CertificateChecker::end_slip(int i) {
  if (scene_.contacts[i].n_t() == 2) throw Refused("slip in space ends: " + scene_.contacts[i].name);
  const std::vector<int> candidates = coupled_with(i);
  std::vector<int> slip_sign(scene_.n_c(), 0);
  for (const int j : candidates) {
    if (j == i) continue;
    const Mode mode = states_.modes[j];
    slip_sign[j] = mode == Mode::slip_plus || mode == Mode::slip ? 1 : mode == Mode::slip_minus ? -1 : 0;
  }
  decisions_.decide_modes(x_, t_, candidates, slip_sign, states_);
  const Mode after = states_.modes[i];
  return after == Mode::stick ? "slip_to_stick" : after == Mode::open ? "slip_end" : "slip_reversal";
}

}  // namespace ricochet::reference::certified
