#include <algorithm>
#include <cmath>

#include "reference/certified/boxes.h"
#include "reference/certified/contact_law.h"
#include "reference/certified/friction_in_space.h"
#include "reference/certified/hybrid_motion.h"

// Slip in space that stops, or nearly so, and does not stick, of one contact that exchanges no momentum with others: a
// block that slides up a slope and returns. Let |v_t| <= s at t_0, and let boxes Q, V contain the motion on the window
// t_0 <= t <= t_0 + w. Let d be the direction in which slip from rest begins, e the direction across, and l = d . v_t,
// m = e . v_t. Whether it slips along (cos theta, sin theta) in this basis, or sticks, friction is that of slip times a
// number in [0, 1], and with c, c' in [-1, 1]
//
//     lambda_n = -r_n / D,    D = G_nn - mu (c G_nd + c' G_ne) > 0                                                  (1)
//     dl/dt = r_d + lambda_n (G_dn - mu (c G_dd + c' G_de)) >= alpha > 0                                            (2)
//     dm/dt = r_e + lambda_n (G_en - mu c G_ed) - mu lambda_n G_ee sin theta                                        (3)
//
// (2) refutes sticking. With G_ee > 0 the last term of (3) has the sign of -m, and the others are within +-epsilon, which
// is small where friction is the same in all directions. So
//
//     l >= alpha (t - t_0) - s,    |m| <= s + epsilon w                                                             (4)
//
// The angle of slip is within +-pi until t_1 = 4 s / alpha, and then |theta| <= |m| / l:
//
//     int_0^w |theta| <= I = pi t_1 + (s + epsilon w) / alpha log((alpha w - s) / (alpha t_1 - s))                  (5)
//
// With |dLambda/dtheta| <= K and the accelerations A of slip along d, over the boxes,
//
//     v(t_0 + w) in v_0 + w A +- |M^-1 J'| K I,    q(t_0 + w) in q_0 + w V                                          (6)
//
// s is small, and w is about its root. If v_t does vanish, slip from rest begins along the only direction that the laws
// allow.

namespace ricochet::reference::certified {

/// Boxes on the window, and bounds over them.
struct HybridMotion::SlipTurn {
  int contact;
  ModeMotion open;
  std::vector<Node> rates;       ///< accelerations of gap and slip without contact force
  std::vector<Ball> start, box;  ///< q_0, v_0 and Q, V
  std::vector<Ball> end;         ///< (6)
  Ball s, w, t_1;
};

namespace {

/// [-1, 1] times x.
Ball both_signs(const Ball& x) {
  Ball result;
  result.widen(Magnitude(x).get());
  return result;
}

}  // namespace

/// The boxes that contain the motion from those that may, and (6). @throws Undecided
void HybridMotion::map_slip_turn(SlipTurn& turn) {
  const Precision& a = p_.precision();
  const ContactFormulas& formulas = scene_.contacts[turn.contact];
  const std::string doubt = "undecided how the slip of " + formulas.name + " turns";
  const auto require = [&](const Ball& positive) {
    if (positive.sign() != Sign::positive) throw Undecided(doubt);
  };
  const Ball window = a.hull(Ball(), turn.w), one(1.0);
  taylor_.load(turn.box, a.add(t_, window));
  for (const EventFunction& event : turn.open.events) {
    if (event.kind != EventKind::impact || event.contact != turn.contact) require(p_.value_of(event.node));
  }
  const ContactLaw law = contact_law(scene_, turn.contact, p_);
  ContactInSpace contact;
  contact.mu = formulas.mu;
  for (int i = 0; i < 3; ++i) {
    std::ranges::copy(law.G[i], contact.G[i].begin());
    contact.r[i] = p_.value_of(turn.rates[i]);
  }
  const SlipDirections from_rest = slip_directions(contact, a);
  if (!from_rest.is_complete || from_rest.n_proven != 1 || !from_rest.is_stable) throw Undecided(doubt);
  // The basis (n, d, e), with numbers without radii.
  const Ball x = from_rest.d[0].midpoint(), y = from_rest.d[1].midpoint();
  const std::array<std::array<Ball, 3>, 3> basis{{{one, {}, {}}, {Ball(), x, y}, {Ball(), -y, x}}};
  std::array<std::array<Ball, 3>, 3> G;
  std::array<Ball, 3> r;
  for (int i = 0; i < 3; ++i) {
    for (int k = 0; k < 3; ++k) {
      r[i] = a.add(r[i], a.mul(basis[i][k], contact.r[k]));
      for (int j = 0; j < 3; ++j) {
        for (int l = 0; l < 3; ++l) G[i][j] = a.add(G[i][j], a.mul(a.mul(basis[i][k], contact.G[k][l]), basis[j][l]));
      }
    }
  }
  // |d| = 1 up to rounding, so that friction along any direction is within [-1, 1] mu lambda_n (1 + rounding) of each.
  Ball friction = contact.mu;
  mag_t rounding;
  mag_init(rounding);
  mag_set_ui_2exp_si(rounding, 1, 8 - a.bits);
  friction.widen(rounding);
  mag_clear(rounding);
  const auto along = [&](int i, int j) { return both_signs(a.mul(friction, G[i][j])); };
  const Ball coupling = a.add(along(0, 1), along(0, 2)), D = a.sub(G[0][0], coupling), fall = -r[0];
  require(fall);
  require(D);
  require(G[2][2]);
  const Ball push = a.div(fall, D);  // (1)
  const auto rate = [&](const Ball& free, const Ball& by_force) { return a.add(free, a.mul(push, by_force)); };
  Ball alpha, epsilon;
  arb_get_lbound_arf(arb_midref(alpha.get()), rate(r[1], a.sub(G[1][0], a.add(along(1, 1), along(1, 2)))).get(),
                     a.bits);  // (2)
  require(alpha);
  arf_set_mag(arb_midref(epsilon.get()), Magnitude(rate(r[2], a.sub(G[2][0], along(2, 1)))).get());  // (3)
  turn.t_1 = a.div(a.mul(Ball(4.0), turn.s), alpha);
  const Ball late = a.sub(a.mul(alpha, turn.w), turn.s);
  require(a.sub(turn.w, turn.t_1));
  Ball angle, grows;
  arb_const_pi(angle.get(), a.bits);
  arb_log(grows.get(), a.div(late, a.sub(a.mul(alpha, turn.t_1), turn.s)).get(), a.bits);
  const Ball across = a.div(a.add(turn.s, a.mul(epsilon, turn.w)), alpha);
  angle = a.add(a.mul(angle, turn.t_1), a.mul(across, grows));  // (5)
  const Ball push_slope = a.div(a.mul(push, coupling), D), slope = a.mul(friction, a.add(push, both_signs(push_slope)));
  const std::array<Ball, 3> K{both_signs(push_slope), both_signs(slope), both_signs(slope)};
  const Ball along_d = a.div(fall, a.sub(G[0][0], a.mul(friction, G[0][1]))), brakes = -a.mul(friction, along_d);
  const std::array<Ball, 3> of_d{along_d, a.mul(brakes, x), a.mul(brakes, y)};
  std::vector<Ball> next = turn.start;
  for (int i = 0; i < scene_.n; ++i) {
    const int v = scene_.n + i;
    Ball on_the_way = p_.value_of(turn.open.acceleration[i]), of_slip = on_the_way, turned;
    for (int j = 0; j < 3; ++j) {
      const Ball any = j == 0 ? push : both_signs(a.mul(friction, push));
      on_the_way = a.add(on_the_way, a.mul(law.moved[i][j], any));
      of_slip = a.add(of_slip, a.mul(law.moved[i][j], of_d[j]));
      turned = a.add(turned, both_signs(a.mul(law.moved[i][j], K[j])));
    }
    next[v] = a.add(turn.start[v], a.mul(window, on_the_way));
    next[i] = a.add(turn.start[i], a.mul(window, turn.box[v]));
    turn.end[v] = a.add(turn.start[v], a.add(a.mul(turn.w, of_slip), a.mul(angle, turned)));
    turn.end[i] = a.add(turn.start[i], a.mul(turn.w, turn.box[v]));
  }
  turn.box = std::move(next);
}

/// If a contact slips so slowly that the digits do not suffer, and cannot stick, the motion goes on where it slips in
/// the other direction. @param s  upper bound of |v_t|  @returns whether it does
bool HybridMotion::pass_slip_turn(int i, const Ball& s) {
  constexpr double kSpare = 4;  // digits that the turn may cost
  const double longest = std::pow(10., -options_.digits - kSpare);
  if (!(s.nearest() < longest)) return false;
  SlipTurn turn;
  turn.contact = i;
  turn.s = p_.precision().mul(Ball(1.001), s);  // |d| = 1 up to rounding
  turn.w = Ball(std::sqrt(longest));
  std::vector<Mode> modes = states_.modes;
  modes[i] = Mode::open;
  turn.open = mode_motion(scene_, modes, p_);
  turn.rates = contact_rates(turn.open, scene_.contacts[i], scene_, p_);
  turn.start = turn.box = turn.end = set_.box();
  const Precision& a = p_.precision();
  try {
    for (int k = 0; k < kMostInflations; ++k) {
      inflate(turn.box, a.bits);
      const std::vector<Ball> box = turn.box;
      map_slip_turn(turn);
      if (!contains(box, turn.box)) continue;
      pass_window(turn.end, turn.w, turn.t_1, std::vector<Mode>(states_.modes), "slip_reversal",
                  scene_.contacts[i].name);
      result_.no_certificate = "slip in space turns back";
      set_.take_mean_value_form();  // friction is stiff at first
      begin_motion();
      return true;
    }
  } catch (const Undecided&) {  // not slow enough, or another contact changes
  }
  return false;
}

}  // namespace ricochet::reference::certified
