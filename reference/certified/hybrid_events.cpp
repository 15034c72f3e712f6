#include <algorithm>

#include "reference/certified/hybrid_motion.h"

// What happens at an event. After it, leading coefficients that vanish exactly are left out: of a gap one after an
// impact, two where a contact opens from rest, three where its force vanishes; of a slip velocity one after a reversal,
// two where sticking ends.

namespace ricochet::reference::certified {

void HybridMotion::handle(const EventFunction& event) {
  switch (event.kind) {
    case EventKind::impact:
      pass_accumulation(event.contact, handle_impact(event.contact));
      break;
    case EventKind::detach:
      handle_detach(event.contact);
      break;
    case EventKind::slip_end:
      handle_slip_end(event.contact);
      break;
    case EventKind::cone:
      handle_cone(event);
      break;
  }
  begin_motion();
}

/// Contacts that are closed and exchange momentum with a contact, which comes first.
std::vector<int> HybridMotion::coupled_with(int contact) const {
  std::vector<int> all{contact};
  for (int j = 0; j < scene_.n_c(); ++j) {
    if (j != contact && states_.modes[j] != Mode::open) all.push_back(j);
  }
  const std::vector<int> labels = momentum_groups(scene_, all, p_).of_contact;
  std::vector<int> coupled;
  for (std::size_t k = 0; k < all.size(); ++k) {
    if (labels[k] == labels[0]) coupled.push_back(all[k]);
  }
  return coupled;
}

/// @returns the mode of the contact in the impact
Mode HybridMotion::handle_impact(int i) {
  last_impact_ = i;
  taylor_.load(set_.box(), t_);
  if (p_.value_of(scene_.contacts[i].v_n).sign() != Sign::negative)
    throw Undecided("a grazing impact of " + scene_.contacts[i].name);
  const std::vector<int> candidates = coupled_with(i);
  std::vector<char> closed(scene_.n_c(), 0);
  for (const int j : candidates) closed[j] = j != i;
  return strike(candidates, closed, scene_.contacts[i].name);
}

/// The impact of the candidates, and the modes of those that stay closed. @returns the first one's mode in the impact
Mode HybridMotion::strike(const std::vector<int>& candidates, const std::vector<char>& closed,
                          const std::string& contact) {
  const ImpactOutcome outcome = decisions_.decide_impact(set_.box(), t_, candidates, closed);
  std::vector<int> resting, slip_sign(scene_.n_c(), 0);
  for (std::size_t k = 0; k < candidates.size(); ++k) {
    const int i = candidates[k];
    const ContactFormulas& formulas = scene_.contacts[i];
    states_.modes[i] = Mode::open;
    const bool stays = closed[i] || formulas.is_bilateral || formulas.eps_r.is_zero();
    if (outcome.modes[k] == Mode::open || !stays) {
      states_.vanishing_gap[i] = 1;
      continue;
    }
    resting.push_back(i);
    const Mode mode = outcome.modes[k];
    slip_sign[i] = mode == Mode::slip_plus || mode == Mode::slip ? 1 : mode == Mode::slip_minus ? -1 : 0;
  }
  std::vector<Ball> x = set_.box();
  std::ranges::copy(outcome.velocity, x.begin() + scene_.n);
  set_.set_box(std::move(x));
  decisions_.decide_modes(set_.box(), t_, resting, slip_sign, states_);
  record("impact", contact, outcome.Lambda_n);
  return outcome.modes.front();
}

void HybridMotion::handle_detach(int i) {
  const ContactFormulas& contact = scene_.contacts[i];
  states_.modes[i] = Mode::open;
  states_.vanishing_gap[i] = 3;
  taylor_.load(set_.box(), t_);
  const ModeMotion motion = mode_motion(scene_, states_.modes, p_);
  taylor_.expand(motion, 3);
  if (Ball(p_.coefficient(contact.gap, 3)).sign() != Sign::positive)
    throw Undecided("detach of " + contact.name + ": the third derivative of the gap is undecided");
  record("detach", contact.name);
}

void HybridMotion::handle_cone(const EventFunction& event) {
  const ContactFormulas& contact = scene_.contacts[event.contact];
  if (contact.n_t() == 2) throw Unsupported("slip in space begins from rest: " + contact.name);
  const bool plus = event.side < 0;  // friction acts against slip
  states_.modes[event.contact] = plus ? Mode::slip_plus : Mode::slip_minus;
  states_.vanishing_slip[event.contact] = 2;
  taylor_.load(set_.box(), t_);
  const ModeMotion motion = mode_motion(scene_, states_.modes, p_);
  taylor_.expand(motion, 2);
  const Ball rate(p_.coefficient(contact.v_t[0], 2));
  if ((plus ? rate : -rate).sign() != Sign::positive)
    throw Undecided("end of sticking of " + contact.name + ": the second derivative of the slip velocity is undecided");
  record("stick_to_slip", contact.name);
}

void HybridMotion::handle_slip_end(int i) {
  if (scene_.contacts[i].n_t() == 2) throw Unsupported("slip in space ends: " + scene_.contacts[i].name);
  const std::vector<int> candidates = coupled_with(i);
  std::vector<int> slip_sign(scene_.n_c(), 0);
  for (const int j : candidates) {
    if (j != i) slip_sign[j] = states_.modes[j] == Mode::slip_plus ? 1 : states_.modes[j] == Mode::slip_minus ? -1 : 0;
    if (j != i && states_.modes[j] == Mode::slip) slip_sign[j] = 1;
  }
  decisions_.decide_modes(set_.box(), t_, candidates, slip_sign, states_);
  const Mode after = states_.modes[i];
  record(after == Mode::stick  ? "slip_to_stick"
         : after == Mode::open ? "slip_end"
                               : "slip_reversal",
         scene_.contacts[i].name);
}

}  // namespace ricochet::reference::certified
