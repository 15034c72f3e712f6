#include <algorithm>

#include "reference/certified/decisions.h"
#include "reference/certified/redundant_rows.h"

// Coordinates and velocities that are exactly zero at a state because contacts touch, rest or stick.

namespace ricochet::reference::certified {

Decisions::ContactZeros Decisions::zeros_of(const ContactStates& states) const {
  ContactZeros zeros;
  for (int i = 0; i < scene_.n_c(); ++i) {
    if (states.modes[i] == Mode::open) continue;
    zeros.touching.push_back(i);
    zeros.resting.push_back(i);
    if (states.modes[i] == Mode::stick) zeros.sticking.push_back(i);
  }
  return zeros;
}

void Decisions::narrow(std::vector<Ball>& x, const Ball& t, const ContactZeros& zeros) {
  const Precision& a = p_.precision();
  const int n = scene_.n;
  // (5): gaps that do not belong to such a set are left out until the rest does.
  std::vector<int> gaps = zeros.touching;
  while (!gaps.empty()) {
    step_.load(x, t);
    BallMatrix J;
    for (const int i : gaps) J.push_back(p_.values_of(scene_.contacts[i].J_n));
    const std::vector<int> S = locked_coordinates(J, a);
    std::vector<Ball> y = x;
    std::vector<int> far;  // coordinates that are not zero
    for (const int k : S) {
      if (arb_contains_zero(x[k].get()) == 0) far.push_back(k);
      y[k] = Ball();
    }
    step_.load(y, t);
    std::vector<int> rest;
    for (std::size_t r = 0; r < gaps.size(); ++r) {
      const bool is_far = std::ranges::any_of(far, [&](int k) { return !J[r][k].is_zero(); });
      if (!leaves(J[r], S) && !is_far && p_.value_of(scene_.contacts[gaps[r]].gap).is_zero()) rest.push_back(gaps[r]);
    }
    if (rest.size() == gaps.size()) {
      x = std::move(y);
      break;
    }
    gaps = std::move(rest);
  }
  std::vector<Ball> at_rest = x;
  std::fill(at_rest.begin() + n, at_rest.end(), Ball());
  step_.load(at_rest, t);
  BallMatrix rows;  // J' v = 0, without a drift
  for (const int i : zeros.resting) {
    if (p_.value_of(scene_.contacts[i].v_n).is_zero()) rows.push_back(p_.values_of(scene_.contacts[i].J_n));
  }
  for (const int i : zeros.sticking) {
    const ContactFormulas& contact = scene_.contacts[i];
    for (int d = 0; d < contact.n_t(); ++d) {
      if (p_.value_of(contact.v_t[d]).is_zero()) rows.push_back(p_.values_of(contact.J_t[d]));
    }
  }
  for (const int k : locked_coordinates(rows, a)) x[n + k] = Ball();
}

}  // namespace ricochet::reference::certified
