#include <algorithm>
#include <cmath>

#include "reference/certified/boxes.h"
#include "reference/certified/contact_law.h"
#include "reference/certified/friction_in_space.h"
#include "reference/certified/hybrid_motion.h"

// Infinitely many impacts of one contact i in finite time, while the contacts C that exchange momentum with it are
// closed. The state is that after an impact, with gap = 0 and v_n = delta > 0. Let boxes Q, V contain the motion on the
// window t_0 <= t <= t_0 + w, and let the gap's acceleration without contact force be within [-b, -a] there, a > 0.
// Then
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
// Boxes that (4) maps into themselves contain the motion. If a contact with friction slips, it must slip all the time,
// in the plane in one direction, in space in those of V; a_c is then that of slip, and J_n stands for J_n - mu J_t d as
// a direction of impulses.
//
// If the last impact stuck, v_t = 0 after it, exactly. With the acceleration A_t of v_t without contact force, a flight
// from the speed v returns with
//
//     v_n- in -v [sqrt(a/b), sqrt(b/a)],   v_t- in v [0, 2/a] A_t                                                   (5)
//
// so that the impulse is v L, with L in a ball that does not depend on v. If the impact law with (5) for v = 1 allows
// sticking alone, the next impact sticks too, and so on; the sum of their v is at most delta / (1 - rho), and
//
//     V = v_0 + [0, w] hull(a_o, a_c) + [0, delta / (1 - rho)] M^-1 J' L                                            (6)
//
// After the limit, the law of forces must allow sticking alone.
//
// If C is not empty, all of these contacts are frictionless. Forces of C are positive in flights and after the limit.
// In an impact, let C keep w = 0, and w_i+ = -eps_r w_i-. The equations of impulses are those of forces, so that, with
// the forces lambda^o and lambda^c of the open and the closed contact i at the same state,
//
//     Lambda_j = Lambda_i (lambda_j^c - lambda_j^o) / lambda_i^c,   Lambda_i > 0                                    (7)
//
// If lambda_j^c - lambda_j^o > 0, or exactly zero, for all j in C that are no joints, these impulses satisfy Moreau's
// law at every impact. They are the only ones: the equations of all contacts together are regular, so that G = J M^-1
// J' of them is positive definite, and this complementarity problem has one solution. The contacts of C stay closed.

namespace ricochet::reference::certified {

/// Boxes of (4).
struct HybridMotion::Collapse {
  int contact;
  ModeMotion open, closed;
  Mode mode;                 ///< of the contact after the limit
  std::vector<Node> shares;  ///< lambda_j^c - lambda_j^o of (7)
  std::vector<Node> rates;   ///< accelerations of gap and slip without contact force
  std::vector<Ball> start;   ///< q_0, v_0
  Ball delta;                ///< upper bound of v_n
  std::vector<Ball> box;     ///< Q, V
  Ball w;                    ///< upper bound, exact
  Ball least, most;          ///< a and b
  Ball rest;                 ///< 1 - rho
};

namespace {

/// Whether sticking is the only solution of the law w+ = r + G Lambda, in the plane or in space.
/// @param force  its Lambda
bool only_sticks(const BallMatrix& G, const std::vector<Ball>& r, const Ball& mu, const Precision& a,
                 std::vector<Ball>& force) {
  if (r[0].sign() != Sign::negative) return false;  // it may open
  if (r.size() == 3) {
    ContactInSpace law;
    for (int i = 0; i < 3; ++i) std::ranges::copy(G[i], law.G[i].begin());
    std::ranges::copy(r, law.r.begin());
    law.mu = mu;
    const auto sticking = sticking_force(law, a);
    if (!sticking || is_inside_cone(*sticking, mu, a) != Sign::positive) return false;
    force.assign(sticking->begin(), sticking->end());
    const SlipDirections slip = slip_directions(law, a);
    return slip.is_complete && slip.n_proven == 0;
  }
  const auto sticking = solve(G, {{-r[0]}, {-r[1]}}, a.bits);
  if (!sticking) return false;
  force = {(*sticking)[0][0], (*sticking)[1][0]};
  const Ball bound = a.mul(mu, force[0]);
  bool sticks = force[0].sign() == Sign::positive;
  for (const double side : {1., -1.}) {
    const Ball friction = a.mul(mu, Ball(side)), D = a.sub(G[0][0], a.mul(friction, G[0][1]));
    const Ball u = a.sub(a.mul(D, r[1]), a.mul(r[0], a.sub(G[1][0], a.mul(friction, G[1][1]))));
    sticks = sticks && a.add(bound, a.mul(Ball(side), force[1])).sign() == Sign::positive;
    sticks = sticks && D.sign() == Sign::positive && a.mul(Ball(side), u).sign() == Sign::negative;
  }
  return sticks;
}

}  // namespace

/// Whether impacts of this contact alone can accumulate in a way that pass_accumulation() proves.
bool HybridMotion::may_collapse(int i) const {
  const ContactFormulas& contact = scene_.contacts[i];
  const std::vector<int> coupled = coupled_contacts(scene_, states_.modes, {i}, p_);
  const bool is_frictionless = std::ranges::all_of(coupled, [&](int j) {
    return scene_.contacts[j].n_t() == 0 && states_.left_out.count({j, -1}) == 0;
  });
  return !contact.is_bilateral && contact.eps_r.sign() == Sign::positive &&
         p_.precision().sub(Ball(1.0), contact.eps_r).sign() == Sign::positive &&
         (coupled.size() == 1 || is_frictionless);
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
  for (const Node share : collapse.shares) {
    const Ball value = p_.value_of(share);
    if (value.sign() != Sign::positive && !value.is_zero())
      throw Undecided("a closed contact may open while impacts accumulate");
  }
  const Ball fall = -p_.value_of(collapse.rates[0]);
  if (fall.sign() != Sign::positive) throw Undecided("the gap may not fall while impacts accumulate");
  arb_get_lbound_arf(arb_midref(collapse.least.get()), fall.get(), a.bits);
  collapse.most = upper_bound(fall, a.bits);
  const Ball ratio = square_root(a.div(collapse.most, collapse.least), a.bits);
  collapse.rest = a.sub(Ball(1.0), a.mul(e, ratio));
  if (collapse.rest.sign() != Sign::positive) throw Undecided("impacts may not become weaker");
  collapse.w = upper_bound(a.div(a.mul(Ball(2.0), collapse.delta), a.mul(collapse.least, collapse.rest)), a.bits);
  const std::vector<Ball> jumps = collapse.mode == Mode::stick ? jumps_of_sticking(collapse) : jumps_of_slip(collapse);
  const Ball window = a.hull(Ball(), collapse.w);
  std::vector<Ball> next = collapse.start;
  for (int r = 0; r < n; ++r) {
    const Ball a_o = p_.value_of(collapse.open.acceleration[r]), a_c = p_.value_of(collapse.closed.acceleration[r]);
    next[n + r] = a.add(collapse.start[n + r], a.add(a.mul(window, a.hull(a_o, a_c)), jumps[r]));
    next[r] = a.add(collapse.start[r], a.mul(window, collapse.box[n + r]));
  }
  collapse.box = std::move(next);
}

/// The last term of (4).
std::vector<Ball> HybridMotion::jumps_of_slip(const Collapse& collapse) {
  const Precision& a = p_.precision();
  const Ball ratio = square_root(a.div(collapse.most, collapse.least), a.bits);
  const Ball speeds = a.hull(Ball(), upper_bound(a.div(a.mul(collapse.delta, ratio), collapse.rest), a.bits));
  const Ball impulses = a.mul(a.add(Ball(1.0), scene_.contacts[collapse.contact].eps_r), speeds);
  std::vector<Ball> jumps;
  for (int r = 0; r < scene_.n; ++r) {
    const Ball a_o = p_.value_of(collapse.open.acceleration[r]), a_c = p_.value_of(collapse.closed.acceleration[r]);
    jumps.push_back(a.mul(impulses, a.div(a.sub(a_c, a_o), -p_.value_of(collapse.rates[0]))));
  }
  return jumps;
}

/// The last term of (6). @throws Undecided unless sticking is the only solution
std::vector<Ball> HybridMotion::jumps_of_sticking(const Collapse& collapse) {
  const Precision& a = p_.precision();
  const ContactFormulas& contact = scene_.contacts[collapse.contact];
  const ContactLaw law = contact_law(scene_, collapse.contact, p_);
  const Ball ratio = square_root(a.div(collapse.most, collapse.least), a.bits);
  const Ball flight = a.hull(Ball(), upper_bound(a.div(Ball(2.0), collapse.least), a.bits));
  const Ball speed = a.hull(ratio, a.div(Ball(1.0), ratio));
  std::vector<Ball> impact{-a.mul(a.add(Ball(1.0), contact.eps_r), speed)}, forces{p_.value_of(collapse.rates[0])}, L,
      unused;
  for (std::size_t k = 1; k < law.G.size(); ++k) {
    forces.push_back(p_.value_of(collapse.rates[k]));
    impact.push_back(a.mul(flight, forces.back()));
  }
  if (!only_sticks(law.G, impact, contact.mu, a, L) || !only_sticks(law.G, forces, contact.mu, a, unused))
    throw Undecided("impacts accumulate, and not all of them need stick: " + contact.name);
  const Ball speeds = a.hull(Ball(), upper_bound(a.div(collapse.delta, collapse.rest), a.bits));
  std::vector<Ball> jumps(scene_.n);
  for (int r = 0; r < scene_.n; ++r) {
    for (std::size_t k = 0; k < law.G.size(); ++k)
      jumps[r] = a.add(jumps[r], a.mul(law.moved[r][k], a.mul(speeds, L[k])));
  }
  return jumps;
}

/// The mode after the limit. @param last  mode of the last impact; if it stuck, the slip velocity is exactly zero
Mode HybridMotion::mode_of_collapse(int i, Mode last) {
  const ContactFormulas& contact = scene_.contacts[i];
  if (contact.n_t() == 0) return Mode::closed;
  if (last == Mode::stick) return Mode::stick;
  taylor_.load(set_.box(), t_);
  const Sign slip = p_.value_of(contact.n_t() == 1 ? contact.v_t[0] : p_.dot(contact.v_t, contact.v_t)).sign();
  if (slip == Sign::unknown) throw Undecided("impacts accumulate while slip ends: " + contact.name);
  if (contact.n_t() == 2) return Mode::slip;
  return slip == Sign::positive ? Mode::slip_plus : Mode::slip_minus;
}

/// After an impact of contact i: if its speed is so small that the digits do not suffer, the motion goes on after the
/// limit of all further impacts, with the contact closed. @param last  mode of the impact  @returns whether it does
bool HybridMotion::pass_accumulation(int i, Mode last) {
  constexpr double kSpare = 3;             // digits that the window may cost,
  constexpr double kMorePerBit = 1. / 60;  // of a second attempt: other contacts may need more
  const Precision& a = p_.precision();
  if (states_.modes[i] != Mode::open || !may_collapse(i)) return false;
  const ContactFormulas& contact = scene_.contacts[i];
  taylor_.load(set_.box(), t_);
  const Ball v_n = p_.value_of(contact.v_n);
  const double rest = 1 - contact.eps_r.nearest();
  const double more = kMorePerBit * static_cast<double>(a.bits - 10 * options_.digits / 3 - 60);
  const double spare = kSpare + (scene_.n_c() > 1 ? std::max(0.0, more) : 0.0);
  if (v_n.sign() != Sign::positive || !(v_n.nearest() < rest * std::pow(10., -options_.digits - spare))) return false;
  Collapse collapse;
  collapse.contact = i;
  collapse.open = mode_motion(scene_, states_.modes, p_, {}, states_.left_out);
  collapse.mode = mode_of_collapse(i, last);
  std::vector<Mode> modes = states_.modes;
  modes[i] = collapse.mode;
  collapse.closed = mode_motion(scene_, modes, p_, {}, states_.left_out);
  collapse.rates = contact_rates(collapse.open, contact, scene_, p_);
  for (const int j : coupled_contacts(scene_, states_.modes, {i}, p_)) {
    if (j != i && !scene_.contacts[j].is_bilateral)
      collapse.shares.push_back(p_.sub(collapse.closed.normal_force.at(j), collapse.open.normal_force.at(j)));
  }
  collapse.start = collapse.box = set_.box();
  collapse.delta = upper_bound(v_n, a.bits);
  map_collapse(collapse);
  const bool is_inside = enclose(collapse, a, [&](Collapse& window) { map_collapse(window); });
  if (!is_inside) throw Undecided("no enclosure of the impacts of " + contact.name + " that accumulate");
  pass_window(collapse.box, collapse.w, collapse.w, modes, "zeno_end", contact.name);
  return true;
}

}  // namespace ricochet::reference::certified
