#include <fmt/format.h>

#include <algorithm>

#include "reference/certified/decisions.h"

// Decisions at events, for the search and for the checker of certificates. After an event, leading coefficients that
// vanish exactly are left out: of a gap one after an impact, two where a contact opens from rest, three where its force
// vanishes; of a slip velocity one after a reversal, two where sticking ends.

namespace ricochet::reference::certified {

std::vector<int> StartingContacts::candidates() const {
  std::vector<int> all = hit;
  all.insert(all.end(), touching.begin(), touching.end());
  return all;
}

std::vector<char> StartingContacts::closed(int n_c) const {
  std::vector<char> closed(n_c, 0);
  for (const int i : touching) closed[i] = 1;
  return closed;
}

StartingContacts Decisions::contacts_at_start(ContactStates& states) {
  StartingContacts start;
  start.slip_sign.assign(scene_.n_c(), 0);
  for (int i = 0; i < scene_.n_c(); ++i) {
    const ContactFormulas& contact = scene_.contacts[i];
    const auto sign_of = [&](const Ball& value, bool is_zero, const char* what) {
      if (is_zero || value.is_zero()) return 0;
      if (value.sign() == Sign::unknown)
        start.assumptions.push_back(fmt::format("{} of {} is zero at t = 0", what, contact.name));
      return static_cast<int>(value.sign());
    };
    const int gap = sign_of(p_.value_of(contact.gap), contact.gap_is_zero, "the gap");
    if (contact.is_bilateral && gap != 0) throw Unsupported("a violated constraint at the start: " + contact.name);
    if (gap < 0) throw Unsupported("penetration at the start: " + contact.name);
    if (gap > 0) continue;
    const int v_n = sign_of(p_.value_of(contact.v_n), contact.v_n_is_zero, "the normal velocity");
    if (v_n > 0 && !contact.is_bilateral) {
      states.vanishing_gap[i] = 1;
      continue;
    }
    if (v_n != 0) {
      start.hit.push_back(i);
      continue;
    }
    start.touching.push_back(i);
    states.sticks_at_limit[i] = contact.sticks_at_limit;
    Ball slip;
    if (contact.n_t() == 1) slip = p_.value_of(contact.v_t[0]);
    if (contact.n_t() == 2) slip = p_.value_of(p_.dot(contact.v_t, contact.v_t));
    start.slip_sign[i] = sign_of(slip, contact.v_t_is_zero, "the slip velocity");
  }
  return start;
}

ImpactOutcome Decisions::strike(std::vector<Ball>& x, const Ball& t, const std::vector<int>& candidates,
                                const std::vector<char>& closed, ContactStates& states) {
  ContactZeros before = zeros_of(states);
  before.touching = with_closed(candidates, states.modes);
  std::vector<Ball> narrow_x = x;
  narrow(narrow_x, t, before);
  ImpactOutcome outcome = decide_impact(narrow_x, t, candidates, closed);
  std::ranges::fill(states.sticks_at_limit, 0);  // at the velocities before
  std::vector<int> resting, slip_sign(scene_.n_c(), 0);
  for (std::size_t k = 0; k < candidates.size(); ++k) {
    const int i = candidates[k];
    const ContactFormulas& contact = scene_.contacts[i];
    states.modes[i] = Mode::open;
    if (!outcome.rebound[k].is_zero()) {
      states.vanishing_gap[i] = 1;
      continue;
    }
    resting.push_back(i);
    slip_sign[i] = slip_sign_of(outcome.modes[k]);
    if (contact.n_t() != 1) continue;
    slip_sign[i] = static_cast<int>(outcome.slip[k].sign());
    if (slip_sign[i] == 0 && !outcome.slip[k].is_zero()) throw Undecided("slip after an impact of " + contact.name);
  }
  std::ranges::copy(outcome.velocity, x.begin() + scene_.n);
  std::ranges::copy(outcome.velocity, narrow_x.begin() + scene_.n);
  decide_modes(narrow_x, t, resting, slip_sign, states);
  return outcome;
}

ImpactOutcome Decisions::close_gaps(std::vector<Ball>& x, const Ball& t, const std::vector<int>& hit,
                                    ContactStates& states) {
  step_.load(x, t);
  for (const int i : hit) {
    if (p_.value_of(scene_.contacts[i].v_n).sign() != Sign::negative)
      throw Undecided("a grazing impact of " + scene_.contacts[i].name);
  }
  const std::vector<int> candidates = coupled_contacts(scene_, states.modes, hit, p_);
  std::vector<char> closed(scene_.n_c(), 0);
  for (const int j : candidates) closed[j] = std::ranges::count(hit, j) == 0;
  return strike(x, t, candidates, closed, states);
}

/// Forces of redundant contacts are some of many: that one reaches a limit decides nothing.
void Decisions::require_determined_forces(int contact, const ContactStates& states) const {
  for (const int j : coupled_contacts(scene_, states.modes, {contact}, p_)) {
    if (states.left_out.count({j, -1}) > 0 || states.left_out.count({j, 0}) > 0)
      throw Unsupported("a force of redundant contacts reaches a limit: " + scene_.contacts[contact].name);
  }
}

void Decisions::open_contact(const std::vector<Ball>& x, const Ball& t, int i, ContactStates& states) {
  require_determined_forces(i, states);
  const ContactFormulas& contact = scene_.contacts[i];
  states.modes[i] = Mode::open;
  states.vanishing_gap[i] = 3;
  step_.load(x, t);
  step_.expand(mode_motion(scene_, states.modes, p_, {}, states.left_out), 3);
  if (Ball(p_.coefficient(contact.gap, 3)).sign() != Sign::positive)
    throw Undecided("detach of " + contact.name + ": the third derivative of the gap is undecided");
}

void Decisions::begin_slip(const std::vector<Ball>& x, const Ball& t, const EventFunction& event,
                           ContactStates& states) {
  require_determined_forces(event.contact, states);
  const ContactFormulas& contact = scene_.contacts[event.contact];
  if (contact.n_t() == 2) {
    begin_slip_in_space(x, t, event.contact, states);
    return;
  }
  const bool plus = event.side < 0;  // friction acts against slip
  states.modes[event.contact] = plus ? Mode::slip_plus : Mode::slip_minus;
  states.vanishing_slip[event.contact] = 2;
  step_.load(x, t);
  step_.expand(mode_motion(scene_, states.modes, p_, {}, states.left_out), 2);
  const Ball rate(p_.coefficient(contact.v_t[0], 2));
  if ((plus ? rate : -rate).sign() != Sign::positive)
    throw Undecided("end of sticking of " + contact.name + ": the second derivative of the slip velocity is undecided");
}

/// Friction at the limit acts against d. @param modes  with which the contact sticks
SlipOnset Decisions::onset_at_limit(const std::vector<Ball>& x, const Ball& t, int i, const std::vector<Mode>& modes) {
  const Precision& a = p_.precision();
  step_.load(x, t);
  const ModeMotion sticking = mode_motion(scene_, modes, p_);
  const Ball along = p_.value_of(sticking.friction.at(i)[0]), across = p_.value_of(sticking.friction.at(i)[1]);
  Ball length;
  arb_hypot(length.get(), along.get(), across.get(), a.bits);
  return {{-a.div(along, length), -a.div(across, length)}, 2};
}

/// v_t = s t^2 d + ..., where s > 0 is required.
void Decisions::begin_slip_in_space(const std::vector<Ball>& x, const Ball& t, int i, ContactStates& states) {
  states.starting[i] = onset_at_limit(x, t, i, states.modes);
  states.modes[i] = Mode::slip;
  states.vanishing_slip[i] = 2;
  step_.load(x, t);
  const ModeMotion slipping = mode_motion(scene_, states.modes, p_, states.starting);
  step_.expand(slipping, 2);
  const SlipStart& start = slipping.starts.at(i);
  if (p_.value_of(start.F).sign() != Sign::negative || Ball(p_.coefficient(start.S, 2)).sign() != Sign::positive)
    throw Undecided("end of sticking in space of " + scene_.contacts[i].name + ": the slip that begins is undecided");
}

std::string Decisions::end_slip(const std::vector<Ball>& x, const Ball& t, const EventFunction& event,
                                ContactStates& states) {
  const int i = event.contact;
  if (scene_.contacts[i].n_t() == 2) throw Unsupported("slip in space ends: " + scene_.contacts[i].name);
  const std::vector<int> candidates = coupled_contacts(scene_, states.modes, {i}, p_);
  std::vector<int> slip_sign(scene_.n_c(), 0);
  ContactZeros zeros = zeros_of(states);
  for (const int j : candidates) {
    const bool ends = j == i || std::ranges::count(event.with, j) > 0;
    if (ends)
      zeros.sticking.push_back(j);
    else
      slip_sign[j] = slip_sign_of(states.modes[j]);
  }
  std::vector<Ball> narrow_x = x;
  narrow(narrow_x, t, zeros);
  decide_modes(narrow_x, t, candidates, slip_sign, states);
  const Mode after = states.modes[i];
  return after == Mode::stick ? "slip_to_stick" : after == Mode::open ? "slip_end" : "slip_reversal";
}

}  // namespace ricochet::reference::certified
