#include <algorithm>

#include "reference/certified/hybrid_motion.h"

// Impacts at exactly the same time, as of two corners of a body that does not turn. The difference of the gaps of
// contacts i and j is a formula D, in which equal terms are left out. On a step, every motion from the set has
//
//     D(q(t), t) = sum_{k<=N} D_k t^k + r(t),   |r(t)| <= rho (t/h)^(N+1)                                           (1)
//
// If all balls D_k are exactly zero, and rho is, then f_i = f_j on the step for each of these motions: their first roots
// are the same, and the impact is one of both contacts, which the laws of problem.h decide together.
//
// If both receive an impulse and have the same restitution e, their velocities after it are -e times those before. Since
// D = 0 before, so is its derivative, and
//
//     dD/dt = grad D' v+ + dD/dt(q, t) = -e dD/dt(v-) = 0                                                           (2)
//
// If D depends on one coordinate q_k alone, with a slope that is not zero, then v_k+ = 0, exactly.

namespace ricochet::reference::certified {

/// Whether all `reached` events are impacts whose gaps are equal on the step, by (1).
bool HybridMotion::are_tied_impacts(const std::vector<std::size_t>& reached, double h) {
  const auto is_impact = [&](std::size_t k) { return motion_.events[k].kind == EventKind::impact; };
  if (!std::ranges::all_of(reached, is_impact)) return false;
  const int first = motion_.events[reached.front()].contact;
  return std::ranges::all_of(reached, [&](std::size_t k) {
    const int other = motion_.events[k].contact;
    return other == first || taylor_.vanishes(scene_.compare(first, other).gap_difference, h);
  });
}

/// Sets velocities that are zero by (2). @param x  the state after the impact
void HybridMotion::keep_symmetry(std::vector<Ball>& x, int i, int j) {
  const auto [D, same_restitution] = scene_.compare(i, j);
  if (!same_restitution) return;
  int only = -1;
  for (int k = 0; k < scene_.n; ++k) {
    if (p_.is_zero(p_.derivative(D, scene_.q[k]))) continue;
    if (only >= 0) return;
    only = k;
  }
  if (only < 0 || !p_.is_zero(p_.derivative(D, scene_.clock))) return;
  taylor_.load(x, t_);
  if (p_.value_of(p_.derivative(D, scene_.q[only])).sign() != Sign::unknown) x[scene_.n + only] = Ball();
}

/// After advance(). The event is named after the first contact, as that of several impacts at t = 0.
void HybridMotion::handle_tied_impacts(const Step& step) {
  refuse_sensitivities("impacts at exactly the same time");
  std::vector<int> hit;
  for (const std::size_t k : step.reached) hit.push_back(motion_.events[k].contact);
  std::vector<Ball> x = set_.box();
  const ImpactOutcome outcome = decisions_.close_gaps(x, t_, hit, states_);
  for (std::size_t k = 1; k < hit.size(); ++k) {
    const bool both_push = outcome.modes[0] != Mode::open && outcome.modes[k] != Mode::open;
    if (both_push) keep_symmetry(x, hit[0], hit[k]);
  }
  keep_impact(std::move(x), outcome, scene_.contacts[hit.front()].name);
  last_impact_ = hit.front();
  result_.no_certificate = "impacts at exactly the same time";
  if (leaves_region()) return;
  pass_group_collapse(hit.front());
  begin_motion();
}

}  // namespace ricochet::reference::certified
