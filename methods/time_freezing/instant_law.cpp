#include "methods/time_freezing/instant_law.h"

#include <algorithm>
#include <cmath>

namespace ricochet {
namespace {

// Velocities after an element carry the rounding of its stage equations.
constexpr double kLawRounding = 1e-12;
constexpr double kForceRounding = 1e-11;

}  // namespace

InstantLaw::InstantLaw(const InstantSystem& system, const ProblemInfo& info, const AuxiliaryDynamics& auxiliary,
                       const ContactScales& scales, Counters& counters)
    : system_(system), info_(info), auxiliary_(auxiliary), scales_(scales), counters_(counters) {}

/// Sets the law of a contact, with the slip as far as it is known before.
void InstantLaw::set_law(int contact, const Vector& v, RegionSwitch cause, const ContactRegion& before,
                         const RegionForces& forces, FrictionProblem::Contact& law) const {
  const ContactInfo& info = info_.contacts[contact];
  law = {.mu = info.mu, .n_t = info.n_t};
  if (info.n_t == 0) return;
  double v_t[2]{0, 0};
  if (cause.is(SwitchKind::cone_reached, contact)) {  // slip begins against the force
    for (int d = 0; d < info.n_t; ++d) v_t[d] = -forces.lambda_t[info.tangent_index + d];
  } else if (cause.is(SwitchKind::slip_stops, contact) && info.n_t == 1) {
    return;
  } else {
    system_.slip_velocity(contact, v, v_t);
    const bool rests = cause.kind == SwitchKind::slip_stops && info.n_t == 2;
    const double least =
        std::max((before.sticks ? 10 : 1) * kLawRounding * scales_.slip(contact), rests ? resting_speed_ : 0);
    if (std::hypot(v_t[0], v_t[1]) <= least) return;
  }
  const double size = std::hypot(v_t[0], v_t[1]);
  if (!(size > 0)) return;
  law.slides = true;
  for (int d = 0; d < info.n_t; ++d) law.direction[d] = v_t[d] / size;
}

void InstantLaw::set_region(const FrictionProblem::Contact& law, const double* r, ContactRegion& region) {
  region.sticks = law.mode == ContactMode::stick;
  region.turns = law.mode == ContactMode::slip;
  region.direction = {0, 0};
  if (!is_slipping(law.mode)) return;
  if (law.slides) {
    region.direction = {law.direction[0], law.n_t == 2 ? law.direction[1] : 0};
  } else if (law.n_t == 1) {
    region.direction = {static_cast<double>(slip_sign(law.mode)), 0};
  } else {
    const double size = std::hypot(r[1], r[2]);
    region.direction = {-r[1] / size, -r[2] / size};
  }
}

/// The laws of the chosen contacts, laws_ set: law_r_ is the solution.
LcpStatus InstantLaw::solve(bool is_frozen, const Regions& regions) {
  int n = 0;
  std::vector<int> columns;
  for (const int i : chosen_) {
    for (int d = 0; d <= system_.n_t(i); ++d) columns.push_back(system_.column(i) + d);
    n += 1 + system_.n_t(i);
  }
  law_G_.resize(n, n);
  law_b_.resize(n);
  law_r_.setZero(n);
  double size = 0;
  const Vector rates = is_frozen ? Vector(Vector::Zero(system_.G().rows()))
                                 : Vector(system_.R().transpose() * system_.load() + system_.bias());
  for (int a = 0; a < n; ++a) {
    for (int b = 0; b < n; ++b) law_G_(a, b) = system_.G()(columns[a], columns[b]);
    law_b_[a] = rates[columns[a]];
    if (!is_frozen) size = std::max(size, system_.R().col(columns[a]).cwiseAbs().dot(system_.load().cwiseAbs()));
  }
  int row = 0;
  for (const int i : chosen_) {
    if (is_frozen) size = std::max(size, auxiliary_.push[i] * system_.G()(system_.column(i), system_.column(i)));
    if (is_frozen && regions.of[i].region != Region::sliding) {  // r_n = push: a row of its own
      law_G_.row(row).setZero();
      law_G_(row, row) = 1;
      law_b_[row] = -auxiliary_.push[i];
    }
    row += 1 + system_.n_t(i);
  }
  ++counters_.complementarity_solves;
  const LcpStatus status = friction_.solve(law_G_, law_b_, kLawRounding * size, laws_, law_r_);
  counters_.pivots += friction_.pivots();
  return status;
}

/// A flight that is lower than rounding of the gap is none: r^2 <= 2 |a| (rounding), r the rate of the gap and a < 0 its
/// acceleration by the load.
bool InstantLaw::separates(int contact, const Vector& v) const {
  const double r = system_.normal_velocity(contact, v), a = system_.load_rate(contact);
  if (r <= kLawRounding * scales_.approach(contact)) return false;
  return !(a < 0 && r * r <= -2 * a * scales_.nearly_touching(contact));
}

LcpStatus InstantLaw::select_sliding(const Vector& v, RegionSwitch cause, Regions& regions, RegionForces& forces) {
  chosen_.clear();
  laws_.clear();
  for (const int i : system_.contacts()) {
    ContactRegion& region = regions.of[i];
    const ContactRegion before = region;
    region = {};
    if (cause.ends(Region::sliding, i) || separates(i, v)) continue;
    chosen_.push_back(i);
    set_law(i, v, cause, before, forces, laws_.emplace_back());
  }
  regions.is_frozen = false;
  forces.lambda_n.setZero();
  forces.lambda_t.setZero();
  if (chosen_.empty()) return LcpStatus::solved;
  if (const LcpStatus status = solve(false, regions); status != LcpStatus::solved) return status;
  const double* r = law_r_.data();
  for (std::size_t k = 0; k < chosen_.size(); ++k) {
    const int i = chosen_[k];
    // What shares a force that vanishes, vanishes with it.
    const bool vanishes = cause.ends(Region::sliding) && r[0] <= kForceRounding * scales_.force(i);
    if (is_closed(laws_[k].mode) && !vanishes) {
      regions.of[i].region = Region::sliding;
      set_region(laws_[k], r, regions.of[i]);
    }
    forces.lambda_n[i] = r[0];
    for (int d = 0; d < system_.n_t(i); ++d) forces.lambda_t[info_.contacts[i].tangent_index + d] = r[1 + d];
    r += 1 + system_.n_t(i);
  }
  return LcpStatus::solved;
}

LcpStatus InstantLaw::select_frozen(const Vector& v, const Vector& y, RegionSwitch cause, Regions& regions,
                                    RegionForces& forces) {
  const bool pulls = std::ranges::any_of(system_.contacts(), [&](int i) {
    return regions.of[i].region == Region::bouncing &&
           auxiliary_.k * y[i] + auxiliary_.damping[i] * system_.normal_velocity(i, v) > 0;
  });
  const std::vector<ContactRegion> before = regions.of;
  regions.is_frozen = true;
  for (;;) {
    chosen_.clear();
    laws_.clear();
    for (const int i : system_.contacts()) {
      ContactRegion& region = regions.of[i];
      if (region.region == Region::free || region.region == Region::sliding) {
        region = {};
        if (pulls || cause.ends(Region::sliding, i) ||
            system_.normal_velocity(i, v) > kLawRounding * scales_.approach(i))
          continue;
        region.region = Region::sliding;
      }
      chosen_.push_back(i);
      set_law(i, v, cause, before[i], forces, laws_.emplace_back());
    }
    if (const LcpStatus status = solve(true, regions); status != LcpStatus::solved) return status;
    bool is_full = false;
    const double* r = law_r_.data();
    forces.lambda_n.setZero();
    forces.lambda_t.setZero();
    for (std::size_t k = 0; k < chosen_.size(); ++k) {
      const int i = chosen_[k];
      ContactRegion& region = regions.of[i];
      if (region.region == Region::sliding) {
        if (r[0] > auxiliary_.push[i] * (1 + kLawRounding)) {  // beta > 1
          region.region = Region::pushed;
          is_full = true;
        } else if (!is_closed(laws_[k].mode)) {
          region = {};
        }
      }
      if (region.is_held()) set_region(laws_[k], r, region);
      forces.lambda_n[i] = r[0];
      for (int d = 0; d < system_.n_t(i); ++d) forces.lambda_t[info_.contacts[i].tangent_index + d] = r[1 + d];
      r += 1 + system_.n_t(i);
    }
    if (!is_full) return LcpStatus::solved;
  }
}

}  // namespace ricochet
