#include <algorithm>
#include <cmath>

#include "reference/certified/hybrid_motion.h"

// Infinitely many impacts of one contact that exchanges no momentum with others, in finite time. The
// state is that after an impact, with gap = 0 and v_n = delta > 0. Let boxes Q, V contain the motion on the window
// t_0 <= t <= t_0 + w, and let the gap's acceleration without contact force be within [-b, -a] there, a > 0. Then
//
//     a flight from the speed v lasts 2 v / a at most and returns with v sqrt(b/a) at most                          (1)
//     speeds fall by the ratio  rho = eps_r sqrt(b/a) < 1;  flights last  2 delta / (a (1 - rho))  =: w  together   (2)
//     the sum of speeds before impacts is at most  S = delta sqrt(b/a) / (1 - rho)                                  (3)
//
// After their limit the contact is closed, and its force is positive because a > 0. With the accelerations a_o and a_c
// of the open and the closed contact, M^-1 J_n (J_n' M^-1 J_n)^-1 = (a_c - a_o) / (-d2/dt2 gap), so that
//
//     V = v_0 + [0, w] hull(a_o, a_c) + (1 + eps_r) [0, S] (a_c - a_o) / (-d2/dt2 gap),    Q = q_0 + [0, w] V       (4)
//
// Boxes that (4) maps into themselves contain the motion. A planar contact with friction must slip in one direction all
// the time; a_c is then that of slip, and J_n stands for J_n -+ mu J_t as a direction of impulses.

namespace ricochet::reference::certified {

/// Boxes of (4).
struct HybridMotion::Collapse {
  int contact;
  ModeMotion open, closed;
  Node gap_acceleration;    ///< without contact force
  std::vector<Ball> start;  ///< q_0, v_0
  Ball delta;               ///< upper bound of v_n
  std::vector<Ball> box;    ///< Q, V
  Ball w;                   ///< upper bound, exact
};

namespace {

Ball upper_bound(const Ball& x, slong bits) {
  Ball bound;
  arb_get_ubound_arf(arb_midref(bound.get()), x.get(), bits);
  return bound;
}

}  // namespace

/// Whether impacts of this contact alone can accumulate in a way that pass_accumulation() proves.
bool HybridMotion::may_collapse(int i) const {
  const ContactFormulas& contact = scene_.contacts[i];
  return contact.n_t() <= 1 && !contact.is_bilateral && contact.eps_r.sign() == Sign::positive &&
         p_.precision().sub(Ball(1.0), contact.eps_r).sign() == Sign::positive && coupled_with(i).size() == 1;
}

/// The right-hand sides of (4). @throws Undecided
void HybridMotion::map_collapse(Collapse& collapse) {
  const Precision& a = p_.precision();
  const Ball& e = scene_.contacts[collapse.contact].eps_r;
  const int n = scene_.n;
  const Ball duration = a.hull(Ball(), collapse.w);
  taylor_.load(collapse.box, a.add(t_, duration));
  for (const ModeMotion* motion : {&collapse.open, &collapse.closed}) {
    for (const EventFunction& event : motion->events) {
      const bool is_own_gap = event.kind == EventKind::impact && event.contact == collapse.contact;
      if (!is_own_gap && p_.value_of(event.node).sign() != Sign::positive)
        throw Undecided(name_of_event(event) + " while impacts accumulate");
    }
  }
  const Ball fall = -p_.value_of(collapse.gap_acceleration);
  if (fall.sign() != Sign::positive) throw Undecided("the gap may not fall while impacts accumulate");
  Ball least, ratio;
  arb_get_lbound_arf(arb_midref(least.get()), fall.get(), a.bits);
  arb_sqrt(ratio.get(), a.div(upper_bound(fall, a.bits), least).get(), a.bits);
  const Ball rest = a.sub(Ball(1.0), a.mul(e, ratio));
  if (rest.sign() != Sign::positive) throw Undecided("impacts may not become weaker");
  const Ball speeds = a.div(a.mul(collapse.delta, ratio), rest);
  collapse.w = upper_bound(a.div(a.mul(Ball(2.0), collapse.delta), a.mul(least, rest)), a.bits);
  const Ball impulses = a.mul(a.add(Ball(1.0), e), a.hull(Ball(), upper_bound(speeds, a.bits)));
  const Ball window = a.hull(Ball(), collapse.w);
  std::vector<Ball> next = collapse.start;
  for (int r = 0; r < n; ++r) {
    const Ball a_o = p_.value_of(collapse.open.acceleration[r]), a_c = p_.value_of(collapse.closed.acceleration[r]);
    const Ball change = a.add(a.mul(window, a.hull(a_o, a_c)), a.mul(impulses, a.div(a.sub(a_c, a_o), fall)));
    next[n + r] = a.add(collapse.start[n + r], change);
    next[r] = a.add(collapse.start[r], a.mul(window, collapse.box[n + r]));
  }
  collapse.box = std::move(next);
}

/// After an impact of contact i: if its speed is so small that the digits do not suffer, the motion goes on behind the
/// limit of all further impacts, with the contact closed. @returns whether it does
bool HybridMotion::pass_accumulation(int i) {
  constexpr int kMostIterations = 20;
  constexpr double kSpare = 3;  // digits that the window may cost
  const Precision& a = p_.precision();
  if (states_.modes[i] != Mode::open || !may_collapse(i)) return false;
  const ContactFormulas& contact = scene_.contacts[i];
  taylor_.load(set_.box(), t_);
  const Ball v_n = p_.value_of(contact.v_n);
  const double rest = 1 - contact.eps_r.nearest();
  if (v_n.sign() != Sign::positive || !(v_n.nearest() < rest * std::pow(10., -options_.digits - kSpare))) return false;
  Collapse collapse;
  collapse.contact = i;
  collapse.open = mode_motion(scene_, states_.modes, p_);
  std::vector<Mode> modes = states_.modes;
  if (contact.n_t() == 0) {
    modes[i] = Mode::closed;
  } else {
    taylor_.load(set_.box(), t_);
    const Sign slip = p_.value_of(contact.v_t[0]).sign();
    if (slip == Sign::unknown) throw Unsupported("impacts accumulate without slip: " + contact.name);
    modes[i] = slip == Sign::positive ? Mode::slip_plus : Mode::slip_minus;
  }
  collapse.closed = mode_motion(scene_, modes, p_);
  collapse.gap_acceleration = p_.derivative(contact.v_n, scene_.clock);
  for (int k = 0; k < scene_.n; ++k) {
    const Node by_q = p_.mul(p_.derivative(contact.v_n, scene_.q[k]), scene_.v[k]);
    const Node by_v = p_.mul(p_.derivative(contact.v_n, scene_.v[k]), collapse.open.acceleration[k]);
    collapse.gap_acceleration = p_.add(collapse.gap_acceleration, p_.add(by_q, by_v));
  }
  collapse.start = collapse.box = set_.box();
  collapse.delta = upper_bound(v_n, a.bits);
  map_collapse(collapse);
  bool is_inside = false;
  for (int k = 0; k < kMostIterations && !is_inside; ++k) {
    inflate(collapse.box, a.bits);
    collapse.w = a.mul(Ball(2.0), collapse.w);
    const Collapse candidate = collapse;
    map_collapse(collapse);
    is_inside = arb_le(collapse.w.get(), candidate.w.get()) != 0;
    for (std::size_t r = 0; r < collapse.box.size(); ++r)
      is_inside = is_inside && arb_contains(candidate.box[r].get(), collapse.box[r].get()) != 0;
  }
  if (!is_inside) throw Undecided("no enclosure of the impacts of " + contact.name + " that accumulate");
  set_.set_box(collapse.box);
  states_.modes = modes;
  states_.moved();
  const Ball begin = t_;
  t_ = a.add(begin, a.hull(Ball(), collapse.w));
  record("zeno_end", contact.name);
  t_ = a.add(begin, collapse.w);
  return true;
}

}  // namespace ricochet::reference::certified
