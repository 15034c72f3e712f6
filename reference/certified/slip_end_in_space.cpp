#include <algorithm>
#include <cmath>

#include "reference/certified/boxes.h"
#include "reference/certified/contact_law.h"
#include "reference/certified/friction_in_space.h"
#include "reference/certified/hybrid_motion.h"

// The end of slip in space, of one contact that exchanges no momentum with others. Its direction turns like a power of
// the time that is left, whose exponent is no integer, so that no series reaches the end. Steps become shorter until
// |v_t| = s is small. Let boxes Q, V contain the motion on the window t_0 <= t <= t_0 + w, and let friction brake slip
// in every direction d there,
//
//     d . dv_t/dt <= -kappa < 0   with the forces of slip along d                                                   (1)
//
// Then slip ends within w = s / kappa. Afterwards the contact sticks if that satisfies the contact laws strictly on
// Q, V; (1) refutes slip. With the accelerations A_s of slip, for all d, and A_c of sticking,
//
//     V = v_0 + [0, w] hull(A_s, A_c),    Q = q_0 + [0, w] V                                                        (2)
//
// Boxes that (2) maps into themselves contain the motion.

namespace ricochet::reference::certified {

/// Boxes of (2).
struct HybridMotion::LastSlip {
  int contact;
  ModeMotion open, sticking;
  std::vector<Node> rates;       ///< accelerations of gap and slip without contact force
  std::vector<Ball> start, box;  ///< q_0, v_0 and Q, V
  Ball speed;                    ///< upper bound of s
  Ball w;                        ///< upper bound, exact
};

/// The right-hand sides of (2). @throws Undecided
void HybridMotion::map_last_slip(LastSlip& last) {
  const Precision& a = p_.precision();
  const int n = scene_.n;
  const Ball window = a.hull(Ball(), last.w);
  taylor_.load(last.box, a.add(t_, window));
  for (const ModeMotion* motion : {&last.open, &last.sticking}) {
    for (const EventFunction& event : motion->events) {
      const bool is_own_gap = event.kind == EventKind::impact && event.contact == last.contact;
      if (!is_own_gap && p_.value_of(event.node).sign() != Sign::positive)
        throw Undecided(name_of_event(event) + " while slip in space ends");
    }
  }
  const ContactLaw law = contact_law(scene_, last.contact, p_);
  ContactInSpace contact;
  contact.mu = scene_.contacts[last.contact].mu;
  for (int i = 0; i < 3; ++i) {
    std::ranges::copy(law.G[i], contact.G[i].begin());
    contact.r[i] = p_.value_of(last.rates[i]);
  }
  const auto bounds = slip_bounds(contact, a);
  if (!bounds) throw Undecided("friction may not end the slip of " + scene_.contacts[last.contact].name);
  arb_get_ubound_arf(arb_midref(last.w.get()), a.div(last.speed, bounds->braking).get(), a.bits);
  const Ball next_window = a.hull(Ball(), last.w);
  std::vector<Ball> next = last.start;
  for (int r = 0; r < n; ++r) {
    Ball slipping = p_.value_of(last.open.acceleration[r]);
    for (int j = 0; j < 3; ++j) slipping = a.add(slipping, a.mul(law.moved[r][j], bounds->force[j]));
    const Ball change = a.mul(next_window, a.hull(slipping, p_.value_of(last.sticking.acceleration[r])));
    next[n + r] = a.add(last.start[n + r], change);
    next[r] = a.add(last.start[r], a.mul(next_window, last.box[n + r]));
  }
  last.box = std::move(next);
}

/// If the slip of a contact is so slow that the digits do not suffer, the motion goes on after its end, or its turn.
/// @returns whether it does
bool HybridMotion::pass_slip_end(int i) {
  constexpr double kSpare = 3;  // digits that the window may cost
  const Precision& a = p_.precision();
  const ContactFormulas& contact = scene_.contacts[i];
  const double longest = std::pow(10., -options_.digits - kSpare);
  taylor_.load(set_.box(), t_);
  const Magnitude square{p_.value_of(p_.dot(contact.v_t, contact.v_t))};
  LastSlip last;
  arf_set_mag(arb_midref(last.speed.get()), square.get());
  arb_sqrt(last.speed.get(), last.speed.get(), a.bits);
  arb_get_ubound_arf(arb_midref(last.speed.get()), last.speed.get(), a.bits);
  mag_zero(arb_radref(last.speed.get()));
  if (!(last.speed.nearest() < std::sqrt(longest)) || coupled_contacts(scene_, states_.modes, {i}, p_).size() > 1)
    return false;
  last.contact = i;
  std::vector<Mode> modes = states_.modes;
  modes[i] = Mode::open;
  last.open = mode_motion(scene_, modes, p_, {}, states_.left_out);
  modes[i] = Mode::stick;
  last.sticking = mode_motion(scene_, modes, p_, {}, states_.left_out);
  last.rates = contact_rates(last.open, contact, scene_, p_);
  last.start = last.box = set_.box();
  try {
    map_last_slip(last);
  } catch (const Undecided&) {
    return pass_slip_turn(i, last.speed);
  }
  if (!(last.w.nearest() < longest)) return false;
  const bool is_inside = enclose(last, a, [&](LastSlip& window) { map_last_slip(window); });
  if (!is_inside) throw Undecided("no enclosure of the end of slip of " + contact.name);
  pass_window(last.box, last.w, last.w, modes, "slip_to_stick", contact.name);
  result_.no_certificate = "slip in space ends";
  begin_motion();
  return true;
}

}  // namespace ricochet::reference::certified
