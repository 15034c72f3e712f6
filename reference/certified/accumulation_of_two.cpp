#include "reference/certified/accumulation_of_two.h"

#include <algorithm>
#include <cmath>

#include "reference/certified/boxes.h"
#include "reference/certified/contact_law.h"

// Infinitely many impacts of two frictionless contacts that exchange momentum, in finite time and in any order, while
// the contacts C that exchange momentum with them are closed, or none. The rows J and the masses M do not depend on the
// state. With the rates w of the two gaps g, impulses dL >= 0 and the gaps' accelerations c(t) while both are open,
//
//     dw = c dt + G dL,   G = J~ M^-1 J~',   J~ = J + S' J_C,   S = -G_CC^-1 G_CN                                   (1)
//
// where G_CC and G_CN are the blocks of J M^-1 J' of all these contacts: impulses S dL keep C at rest. If the forces of
// C are positive while both are open, and S >= 0 in the rows that are no joints, C stays closed, whatever the two do;
// Moreau's law has one solution because J M^-1 J' is positive definite. Let boxes Q, V contain the motion on t_0 <= t
// <= t_0 + w, with c in a box there, c_0 in it, l = -G^-1 c_0 > 0, and -G^-1 c > 0 for all its members. The energy
//
//     E = w' G^-1 w / 2 + l' g,   dE = w' G^-1 (c - c_0) dt - D,   D = sum_k (1 - e_k) |w_k-| L_k / 2 at impacts    (2)
//
// changes by the losses D >= 0 and by c - c_0; forces of closed contacts do no work. With kappa^2 the largest
// (c - c_0)' G^-1 (c - c_0), the root of E rises by kappa / sqrt(2) per second at most. An impact with the loss D has
//
//     |L|^2 := L' G L = sum_k (1 + e_k) |w_k-| L_k <= 2 D / b,   b = min_k (1 - e_k) / (1 + e_k) > 0
//     |w_k-| <= (1 + e_k) |w_k-| = (G L)_k <= sqrt(2 G_kk D / b) =: h_k   where L_k > 0, and w_k+ <= h_k            (3)
//
// Let E_0 be E at the beginning of an interval of the length T, and r bound its rise. Without impulses at k, y_k =
// (G^-1 w)_k falls at the rate (-G^-1 c)_k, and |y_k| <= sqrt(2 E (G^-1)_kk). So both contacts get impulses within
//
//     T = sqrt(E_0) T_1,   T_1 = sum_k 4 sqrt(2 (G^-1)_kk) / min (-G^-1 c)_k,   r = kappa T_1 / sqrt(2) <= 1        (4)
//
// Choose an n with c_n < 0: there is one, because l' c_0 = -l' G l < 0. Let s be the last time at which one contact
// gets impulses before the first time s' >= s at which the other one gets some. (In the closed supports of the dL_k,
// where no atom is, w_k = 0 on the side of the limit.) Between s and s' both are open. The gap of n, which is zero at
// one of the two times with a speed below h_n, can be positive at the other one only within 2 h_n / min |c_n|. There
// the state has
//
//     |w_n| <= 2 h_n max|c_n| / min|c_n|,   g_n <= h_n^2 / (2 min|c_n|),   |w_k| <= h_k,   g_k = 0    (k != n)      (5)
//
// and also if s = s'. So E <= K D_T at this time, where D_T is the loss of the interval and, by (3) and (5),
//
//     b K = |G^-1|_11 G_11 f_1^2 + 2 |G^-1|_12 sqrt(G_11 G_22) f_1 f_2 + |G^-1|_22 G_22 f_2^2 + l_n G_nn / min|c_n|  (6)
//
// with f_n = 2 max|c_n| / min|c_n|, and f = 1 of the other. But E >= E_0 (1 - 2 r (1 + r)) - D_T. Hence
//
//     D_T >= eps E_0,   eps = (1 - 2 r (1 + r)) / (1 + K),   E <= p E_0 after T,   p = 1 - eps + 2 r (1 + r)        (7)
//
// and if p < 1, one interval after the other, each shorter by sqrt(p), the contacts come to rest within
//
//     w = sqrt(E_0) T_1 / (1 - sqrt(p))                                                                            (8)
//
// E never exceeds E_0 (1 + r)^2. They do not leave rest: E rises continuously only, so that it would pass every small
// E_0, and not exceed E_0 (1 + r)^2 from then on. Impulses add up to
//
//     P_k <= 2 sqrt(2 E_0 (G^-1)_kk) (1 + r) + w max (-G^-1 c)_k                                                    (9)
//
// Flights may become short much faster than the speeds: with a plastic contact their length is squared by each impact.
// Then E is far from zero where gaps are too small for any precision. So (2) to (9) begin after impacts with known
// order and unknown flights. Contact k was hit last, with g_k = 0, w_k > 0 or w_k = 0 exactly, and w_j < 0 of the other
// one, whose gap is g_j <= u. If
//
//     d = 2 u / |w_j|,   d max|c_j| <= |w_j| / 2,   and   d max|c_k| <= w_k / 2   or   w_k = 0 and c_k > 0         (10)
//
// for the least |w_j| and w_k, then k stays open, and j hits within d. Before it w has changed by c [0, d], and
//
//     w_j+ = -e_j w_j-,   L_j = -(1 + e_j) w_j- / G_jj,   w_k+ = w_k- + G_kj L_j,   g_k <= d (w_k + d max|c_k|)    (11)
//
// Let d_A be the sum of all d, A_k that of these impulses, and a_o the accelerations while both are open. The length of
// the window is w + d_A. Within it, and at its end, where w = 0 gives the impulses,
//
//     V = v_0 + [0, w + d_A] a_o + sum_k [0, A_k + P_k] M^-1 J~_k',    Q = q_0 + [0, w + d_A] V
//     v = v_0 + [0, w + d_A] a_o - sum_k (G^-1 (w_0 + [0, w + d_A] c))_k M^-1 J~_k'                                (12)
//
// Boxes Q, V whose images under (12) lie inside of them contain every motion until then. There is one: impulses are
// bounded, so that v has limits, and after each time impacts and forces are those of regular complementarity problems.

namespace ricochet::reference::certified {

namespace {

/// u' A u with the sizes of the entries of A, for u >= 0.
Ball form_of_sizes(const BallMatrix& A, const std::array<Ball, 2>& u, const Precision& a) {
  Ball sum;
  for (int i = 0; i < 2; ++i) {
    for (int j = 0; j < 2; ++j) sum = a.add(sum, a.mul(greatest_size(A[i][j], a.bits), a.mul(u[i], u[j])));
  }
  return sum;
}

/// Whether every component of `inner` is in the interior of that of `outer`, or the same number.
bool lies_inside(const std::vector<Ball>& inner, const std::vector<Ball>& outer) {
  return std::ranges::equal(inner, outer, [](const Ball& x, const Ball& y) {
    const bool is_same = arb_is_exact(y.get()) != 0 && arb_equal(x.get(), y.get()) != 0;
    return is_same || arb_contains_interior(y.get(), x.get()) != 0;
  });
}

}  // namespace

/// Whether impacts of contact i and another one may accumulate in a way that pass_accumulation_of_two() proves.
bool HybridMotion::may_collapse_with_another(int i) {
  constexpr double kShort = 1e-6;  // of gaps that close soon
  taylor_.load(set_.box(), t_);
  for (int j = 0; j < scene_.n_c(); ++j) {
    const bool is_frictionless = scene_.contacts[i].n_t() == 0 && scene_.contacts[j].n_t() == 0;
    if (j == i || !is_frictionless || !(Magnitude(p_.value_of(scene_.contacts[j].gap)).upper() < kShort)) continue;
    const std::vector<int> labels = momentum_groups(scene_, with_closed({i, j}, states_.modes), p_).of_contact;
    if (labels[0] == labels[1]) return true;
  }
  return false;
}

/// The open contact, except i, that exchanges momentum with i where both are closed and whose gap is tiny, if there is
/// exactly one.
std::optional<int> HybridMotion::neighbour_of(int i) {
  const double tiny = std::pow(10., -options_.digits);
  std::optional<int> neighbour;
  if (!scene_.borders.empty()) return neighbour;
  taylor_.load(set_.box(), t_);
  for (int j = 0; j < scene_.n_c(); ++j) {
    if (j == i || states_.modes[j] != Mode::open) continue;
    if (!(Magnitude(p_.value_of(scene_.contacts[j].gap)).upper() < tiny)) continue;
    const std::vector<int> labels = momentum_groups(scene_, with_closed({i, j}, states_.modes), p_).of_contact;
    if (labels[0] != labels[1]) continue;
    if (neighbour) return std::nullopt;
    neighbour = j;
  }
  return neighbour;
}

/// The matrices of (1). @returns false if the contacts are not as they must be
bool HybridMotion::set_pair(PairCollapse& pair) {
  const std::vector<int>& group = pair.group;
  const Precision& a = p_.precision();
  const int n = scene_.n;
  BallMatrix J;
  for (std::size_t k = 0; k < group.size(); ++k) {
    const ContactFormulas& contact = scene_.contacts[group[k]];
    if (contact.n_t() > 0 || states_.left_out.count({group[k], -1}) > 0) return false;
    if (!std::ranges::all_of(contact.J_n, [&](Node entry) { return p_.is_constant(entry); })) return false;
    if (k < 2 && contact.is_bilateral) return false;
    J.push_back(p_.values_of(contact.J_n));
  }
  for (const auto& row : scene_.M) {
    if (!std::ranges::all_of(row, [&](Node entry) { return p_.is_constant(entry); })) return false;
  }
  BallMatrix columns(n);
  for (const auto& row : J) {
    for (int r = 0; r < n; ++r) columns[r].push_back(row[r]);
  }
  const auto moved = solve(p_.values_of(scene_.M), columns, a.bits);
  if (!moved) return false;
  const auto product = [&](std::size_t i, std::size_t j) {
    Ball sum;
    for (int r = 0; r < n; ++r) sum = a.add(sum, a.mul(J[i][r], (*moved)[r][j]));
    return sum;
  };
  BallMatrix G_CC, G_CN;
  for (std::size_t i = 2; i < group.size(); ++i) {
    G_CC.emplace_back();
    for (std::size_t j = 2; j < group.size(); ++j) G_CC.back().push_back(product(i, j));
    G_CN.push_back({-product(i, 0), -product(i, 1)});
  }
  BallMatrix S;
  if (!G_CC.empty()) {
    auto solution = solve(G_CC, G_CN, a.bits);
    if (!solution) return false;
    S = std::move(*solution);
  }
  for (std::size_t i = 0; i < S.size(); ++i) {
    for (const Ball& share : S[i]) {
      const bool pushes = share.is_zero() || share.sign() == Sign::positive;
      if (!pushes && !scene_.contacts[group[i + 2]].is_bilateral) return false;
    }
  }
  pair.G.assign(2, std::vector<Ball>(2));
  for (std::size_t k = 0; k < 2; ++k) {
    pair.moved[k].assign(n, Ball());
    for (int r = 0; r < n; ++r) {
      pair.moved[k][r] = (*moved)[r][k];
      for (std::size_t i = 0; i < S.size(); ++i)
        pair.moved[k][r] = a.add(pair.moved[k][r], a.mul((*moved)[r][i + 2], S[i][k]));
    }
    for (std::size_t i = 0; i < 2; ++i) {
      for (int r = 0; r < n; ++r) pair.G[i][k] = a.add(pair.G[i][k], a.mul(J[i][r], pair.moved[k][r]));
    }
  }
  auto inverse = solve(pair.G, {{Ball(1.0), Ball()}, {Ball(), Ball(1.0)}}, a.bits);
  if (!inverse) return false;
  pair.inverse = std::move(*inverse);
  return true;
}

/// As many impacts (11) as (10) proves, until all speeds are below `least`.
HybridMotion::PairImpacts HybridMotion::impacts_of_pair(const PairCollapse& pair, double least, int most) const {
  const std::array<Ball, 2>& c = pair.c;
  const Precision& a = p_.precision();
  const slong bits = a.bits;
  PairImpacts state;
  state.w = pair.w0;
  state.g = pair.g0;
  int k = 0;  // hit last
  for (int impact = 0; impact < most; ++impact, k = 1 - k) {
    const int j = 1 - k;
    Ball &w_k = state.w[k], &w_j = state.w[j];
    if (std::max(Magnitude(w_k).upper(), Magnitude(w_j).upper()) < least) break;
    if (w_j.sign() != Sign::negative) break;
    const Ball speed = least_size(w_j, bits);
    const Ball d = upper_bound(a.div(a.mul(Ball(2.0), state.g[j]), speed), bits);
    const auto is_small = [&](int i, const Ball& rate) {  // d max|c_i| <= rate / 2
      return arb_le(a.mul(a.mul(Ball(2.0), d), greatest_size(c[i], bits)).get(), rate.get()) != 0;
    };
    const bool opens = w_k.is_zero() ? c[k].sign() == Sign::positive
                                     : w_k.sign() == Sign::positive && is_small(k, least_size(w_k, bits));
    if (!opens || !is_small(j, speed)) break;
    state.g[k] = upper_bound(a.mul(d, a.add(w_k, a.mul(d, greatest_size(c[k], bits)))), bits);
    const Ball flight = a.hull(Ball(), d);
    w_k = a.add(w_k, a.mul(flight, c[k]));
    w_j = a.add(w_j, a.mul(flight, c[j]));
    const Ball& e = scene_.contacts[pair.contacts[j]].eps_r;
    const Ball impulse = a.div(a.mul(a.add(Ball(1.0), e), -w_j), pair.G[j][j]);
    w_k = a.add(w_k, a.mul(pair.G[k][j], impulse));
    w_j = e.is_zero() ? Ball() : a.mul(e, -w_j);
    state.g[j] = Ball();
    state.sums[j] = a.add(state.sums[j], impulse);
    state.duration = upper_bound(a.add(state.duration, d), bits);
    state.last = j;
  }
  return state;
}

/// Sets c and -G^-1 c in the box. @returns whether nothing else happens within the window, by the event functions of
/// `motions`
bool HybridMotion::load_pair(PairCollapse& pair, const std::vector<const ModeMotion*>& motions) {
  const Precision& a = p_.precision();
  taylor_.load(pair.box, a.add(t_, a.hull(Ball(), pair.w)));
  for (const ModeMotion* motion : motions) {
    for (const EventFunction& event : motion->events) {
      const bool is_own = event.kind == EventKind::impact && std::ranges::count(pair.contacts, event.contact) > 0;
      if (!is_own && p_.value_of(event.node).sign() != Sign::positive) return false;
    }
  }
  for (int i = 0; i < 2; ++i) pair.c[i] = p_.value_of(pair.rates[i]);
  for (int i = 0; i < 2; ++i)
    pair.push[i] = -a.add(a.mul(pair.inverse[i][0], pair.c[0]), a.mul(pair.inverse[i][1], pair.c[1]));
  return true;
}

/// The right-hand sides of (12). @param duration  of the window  @param most  upper bounds of impulses
void HybridMotion::map_pair(PairCollapse& pair, const Ball& duration, const std::array<Ball, 2>& most) {
  const Precision& a = p_.precision();
  pair.w = upper_bound(duration, a.bits);
  const Ball window = a.hull(Ball(), pair.w);
  std::array<Ball, 2> within, at_end;
  for (int i = 0; i < 2; ++i) {
    within[i] = a.hull(Ball(), upper_bound(most[i], a.bits));
    at_end[i] = a.mul(window, pair.push[i]);
    for (int k = 0; k < 2; ++k) at_end[i] = a.sub(at_end[i], a.mul(pair.inverse[i][k], pair.w0[k]));
  }
  std::vector<Ball> next = pair.start;
  pair.end = pair.start;
  for (int i = 0; i < scene_.n; ++i) {
    const auto after = [&](const std::array<Ball, 2>& impulses) {
      const Ball by_forces = a.add(pair.start[scene_.n + i], a.mul(window, p_.value_of(pair.open.acceleration[i])));
      return a.add(by_forces, a.add(a.mul(impulses[0], pair.moved[0][i]), a.mul(impulses[1], pair.moved[1][i])));
    };
    pair.end[scene_.n + i] = after(at_end);
    next[scene_.n + i] = after(within);
    next[i] = pair.end[i] = a.add(pair.start[i], a.mul(window, pair.box[scene_.n + i]));
  }
  pair.box = std::move(next);
}

/// (2) to (12). @param small  of speeds that do not matter  @returns false if a condition is not proven
bool HybridMotion::map_rest_of_two(PairCollapse& pair, double small) {
  constexpr double kShareOfSpeeds = 1e-9;
  constexpr int kMostImpacts = 100000;
  const Precision& a = p_.precision();
  const slong bits = a.bits;
  const Ball one(1.0), two(2.0);
  const auto is_positive = [](const Ball& x) { return x.sign() == Sign::positive; };
  if (!load_pair(pair, {&pair.open, &pair.closed})) return false;
  const std::array<Ball, 2>& c = pair.c;
  std::array<Ball, 2> deviation, l, b;
  for (int i = 0; i < 2; ++i) {
    arf_set_mag(arb_midref(deviation[i].get()), arb_radref(c[i].get()));
    l[i] = -a.add(a.mul(pair.inverse[i][0], c[0].midpoint()), a.mul(pair.inverse[i][1], c[1].midpoint()));
    const Ball& e = scene_.contacts[pair.contacts[i]].eps_r;
    b[i] = a.div(a.sub(one, e), a.add(one, e));
    if (!is_positive(l[i]) || !is_positive(pair.push[i]) || !is_positive(b[i])) return false;
  }
  const PairImpacts state = impacts_of_pair(pair, kShareOfSpeeds * small, kMostImpacts);
  // (2)
  Ball E;
  for (int i = 0; i < 2; ++i) {
    E = a.add(E, a.mul(l[i], state.g[i]));
    for (int k = 0; k < 2; ++k)
      E = a.add(E, a.mul(a.mul(Ball(0.5), pair.inverse[i][k]), a.mul(state.w[i], state.w[k])));
  }
  E = upper_bound(E, bits);
  if (!is_positive(E)) return false;
  const Ball speed = square_root(E, bits), kappa = square_root(form_of_sizes(pair.inverse, deviation, a), bits);
  // (4)
  Ball T_1;
  std::array<Ball, 2> y;  // largest |y| of E_0 = 1
  for (int k = 0; k < 2; ++k) {
    y[k] = square_root(a.mul(two, pair.inverse[k][k]), bits);
    T_1 = a.add(T_1, a.div(a.mul(Ball(4.0), y[k]), least_size(pair.push[k], bits)));
  }
  const Ball r = upper_bound(a.div(a.mul(kappa, T_1), square_root(two, bits)), bits);
  const Ball drift = a.mul(a.mul(two, r), a.add(one, r));
  if (!is_positive(a.sub(one, r))) return false;
  // (5), (6)
  const int larger = least_size(c[0], bits).nearest() >= least_size(c[1], bits).nearest() ? 0 : 1;
  const int n = c[larger].sign() == Sign::negative ? larger : 1 - larger;
  if (c[n].sign() != Sign::negative) return false;
  const Ball least = least_size(c[n], bits);
  std::array<Ball, 2> f{one, one};
  f[n] = a.div(a.mul(two, greatest_size(c[n], bits)), least);
  for (int k = 0; k < 2; ++k) f[k] = a.mul(f[k], square_root(pair.G[k][k], bits));
  const Ball of_gap = a.div(a.mul(l[n], pair.G[n][n]), least);
  Ball least_b;
  arb_min(least_b.get(), b[0].get(), b[1].get(), bits);
  const Ball K = a.div(a.add(form_of_sizes(pair.inverse, f, a), of_gap), least_b);
  // (7), (8)
  const Ball loss = a.div(a.sub(one, drift), a.add(one, K));
  const Ball p = a.add(a.sub(one, loss), drift);
  const Ball rest = a.sub(one, square_root(p, bits));
  if (!is_positive(loss) || !is_positive(p) || !is_positive(rest)) return false;
  const Ball w = upper_bound(a.div(a.mul(speed, T_1), rest), bits);
  // (9)
  std::array<Ball, 2> most;
  for (int k = 0; k < 2; ++k) {
    const Ball P = a.add(a.mul(a.mul(two, y[k]), a.mul(speed, a.add(one, r))), a.mul(w, pair.push[k]));
    most[k] = a.add(state.sums[k], P);
  }
  map_pair(pair, a.add(w, state.duration), most);
  return true;
}

/// Boxes that `map` takes into their interior. @returns false if it fails
template <class Map>
bool HybridMotion::enclose_pair(PairCollapse& pair, Map map) {
  pair.box = pair.start;
  pair.w = Ball();
  for (int trial = 0; trial <= kMostInflations; ++trial) {
    if (trial > 0) inflate(pair.box, p_.precision().bits);
    pair.w = p_.precision().mul(Ball(2.0), pair.w);
    const std::vector<Ball> box = pair.box;
    const Ball w = pair.w;
    if (!map()) return false;
    if (arb_le(pair.w.get(), w.get()) != 0 && lies_inside(pair.box, box)) return true;
  }
  return false;
}

/// After an impact of contact i, of which contact j is the neighbour: if the digits do not notice how long they go on,
/// the motion goes on after both have come to rest. @returns whether it does
bool HybridMotion::pass_accumulation_of_two(int i, int j) {
  constexpr double kSpare = 3;  // digits that the window may cost
  constexpr double kShareOfBits = 0.3;
  const Precision& a = p_.precision();
  const double small = std::pow(10., -options_.digits - kSpare);
  taylor_.load(set_.box(), t_);
  PairCollapse pair;
  pair.contacts = {i, j};
  pair.group = coupled_contacts(scene_, states_.modes, {i, j}, p_);
  for (int k = 0; k < 2; ++k) pair.w0[k] = p_.value_of(scene_.contacts[pair.contacts[k]].v_n);
  if (states_.modes[i] != Mode::open || states_.vanishing_gap[i] > 1) pair.w0[0] = Ball();
  pair.g0 = {Ball(), upper_bound(p_.value_of(scene_.contacts[j].gap), a.bits)};
  const double approach = std::abs(pair.w0[1].nearest()), speed = std::max(approach, std::abs(pair.w0[0].nearest()));
  if (!(std::min(pair.g0[1].nearest() / approach, speed) < small) || !set_pair(pair)) return false;
  std::vector<Mode> modes = states_.modes;
  modes[i] = modes[j] = Mode::open;
  pair.open = mode_motion(scene_, modes, p_, {}, states_.left_out);
  for (int k = 0; k < 2; ++k) pair.rates[k] = rate_along(pair.open, scene_.contacts[pair.contacts[k]].v_n, scene_, p_);
  modes[i] = modes[j] = Mode::closed;
  pair.closed = mode_motion(scene_, modes, p_, {}, states_.left_out);
  pair.start = set_.box();
  const std::string& name = scene_.contacts[i].name;
  if (enclose_pair(pair, [&] { return map_plastic_pair(pair); })) {
    // Each impact squares the flights: a window that no ball notices costs one impact more.
    double width = -kShareOfBits * static_cast<double>(a.bits) * std::log10(2.0);
    for (const Ball& x : pair.start) width = std::max(width, x.log10_radius());
    const bool is_short = pair.w.nearest() < std::min(small, std::pow(10., width));
    if (is_short) pass_limit(pair, name);
    return is_short;
  }
  if (!enclose_pair(pair, [&] { return map_rest_of_two(pair, small); }) || !(pair.w.nearest() < small)) return false;
  pass_window(pair.end, pair.w, pair.w, modes, "zeno_end", name);
  return true;
}

}  // namespace ricochet::reference::certified
