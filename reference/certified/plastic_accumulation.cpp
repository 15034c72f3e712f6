#include "reference/certified/accumulation_of_two.h"

// Infinitely many impacts of two contacts k and j of accumulation_of_two.cpp, with (1), (10), (11) and (12) there,
// where k is plastic, e_k = 0, and j is not, and where k opens from rest, c_k > 0. Flights are squared by each impact,
// so that they are decided by their bounds. After an impact of k, with w_k = 0, w_j = -W and g_j <= u, let
//
//     x = u A / W^2,   A = max(|c_k|, |c_j|),   s = -G_kj (1 + e_j) / G_jj > 0,   h = |G_jk| / G_kk                 (1)
//
// By (10), j hits within d = 2 u / W; this changes its speed by 2 x W at most, and g_k <= d^2 A = 4 x u, 0 <= w_k- <= 2
// x W. Then k approaches with the speed
//
//     W_k in W (s (1 +- 2 x) - [0, 2 x]) >= s W / 2    if  2 x <= 1/2  and  2 x (1 + s) <= s / 2                    (2)
//
// and hits within d' = 2 g_k / W_k <= 16 x u / (s W), while speeds change by d' A <= z W with z = 16 x^2 / s. (10)
// holds if z <= s/4 and z <= e_j (1 - 2 x) / 2. After this impact of k, as before,
//
//     W+ in W (h s - e_j +- y),  y = 2 x (h s + e_j + h) + (1 + h) z;   0 < q_1 <= W+ / W <= q_2 < 1                (3)
//     u+ <= d' W (e_j (1 + 2 x) + z) <= 32 x u / s,   x+ <= x    if  32 x <= s q_1^2                                (4)
//
// so that all of this holds again and again, with the same x: W falls to zero, and with it all gaps and rates. One
// cycle lasts d (1 + 8 x / s) at most, and the next one is shorter by the ratio 32 x / (s q_1) <= q_1. The impulses are
//
//     sum L_j <= (1 + e_j) (1 + 2 x) W / (G_jj (1 - q_2)),   sum L_k <= (s (1 + 2 x) + z) W / (G_kk (1 - q_2))      (5)
//
// At the limit all contacts of the group are at rest with w = 0 and g = 0, exactly; which of them open is decided
// there.

namespace ricochet::reference::certified {

/// (1) to (5). @returns false if a condition is not proven
bool HybridMotion::map_plastic_pair(PairCollapse& pair) {
  const Precision& a = p_.precision();
  const slong bits = a.bits;
  const Ball one(1.0), two(2.0);
  const auto restitution = [&](int i) { return scene_.contacts[pair.contacts[i]].eps_r; };
  if (!load_pair(pair, {&pair.open})) return false;
  const int first_impacts = restitution(0).is_zero() ? 0 : 1;
  const PairImpacts state = impacts_of_pair(pair, 0, first_impacts);
  const int k = first_impacts, j = 1 - k;
  const Ball e = restitution(j), W = -state.w[j];
  const bool is_plastic = restitution(k).is_zero() && state.last == k && state.w[k].is_zero();
  if (!is_plastic || e.sign() != Sign::positive) return false;
  if (W.sign() != Sign::positive || pair.c[k].sign() != Sign::positive) return false;
  // (1)
  Ball A;
  arb_max(A.get(), greatest_size(pair.c[k], bits).get(), greatest_size(pair.c[j], bits).get(), bits);
  const Ball least_W = least_size(W, bits), u = state.g[j];
  const Ball x = upper_bound(a.div(a.mul(u, A), a.mul(least_W, least_W)), bits), x2 = a.mul(two, x);
  const Ball s = a.div(a.mul(-pair.G[k][j], a.add(one, e)), pair.G[j][j]);
  const Ball h = a.div(greatest_size(pair.G[j][k], bits), pair.G[k][k]);
  if (s.sign() != Sign::positive) return false;
  // (2), (3), (4)
  const Ball z = a.div(a.mul(Ball(16.0), a.mul(x, x)), s), hs = a.mul(h, s);
  const Ball y = a.add(a.mul(x2, a.add(a.add(hs, e), h)), a.mul(a.add(one, h), z));
  const Ball q_1 = a.sub(a.sub(hs, e), y), q_2 = a.add(a.sub(hs, e), y);
  const auto at_most = [](const Ball& p, const Ball& q) { return arb_le(p.get(), q.get()) != 0; };
  const bool holds = at_most(x2, Ball(0.5)) && at_most(a.mul(x2, a.add(one, s)), a.mul(Ball(0.5), s)) &&
                     at_most(z, a.mul(Ball(0.25), s)) && at_most(a.mul(two, z), a.mul(e, a.sub(one, x2))) &&
                     q_1.sign() == Sign::positive && a.sub(one, q_2).sign() == Sign::positive &&
                     at_most(a.mul(Ball(32.0), x), a.mul(s, a.mul(q_1, q_1)));
  if (!holds) return false;
  const Ball d = a.div(a.mul(two, u), least_W), ratio = a.div(a.mul(Ball(32.0), x), a.mul(s, q_1));
  const Ball cycle = a.mul(d, a.add(one, a.div(a.mul(Ball(8.0), x), s)));
  const Ball duration = a.add(state.duration, a.div(cycle, a.sub(one, ratio)));
  // (5)
  const Ball whole = a.div(W, a.sub(one, q_2)), grown = a.add(one, x2);
  std::array<Ball, 2> most = state.sums;
  most[j] = a.add(most[j], a.div(a.mul(a.mul(a.add(one, e), grown), whole), pair.G[j][j]));
  most[k] = a.add(most[k], a.div(a.mul(a.add(a.mul(s, grown), z), whole), pair.G[k][k]));
  map_pair(pair, duration, most);
  return true;
}

/// Goes on at the limit of the impacts, an event within the window.
void HybridMotion::pass_limit(const PairCollapse& pair, const std::string& contact) {
  const Precision& a = p_.precision();
  t_ = a.add(t_, a.hull(Ball(), pair.w));
  states_.moved();
  decisions_.decide_modes(pair.end, t_, pair.group, std::vector<int>(scene_.n_c(), 0), states_);
  set_.set_box(pair.end);
  record("zeno_end", contact);
}

}  // namespace ricochet::reference::certified
