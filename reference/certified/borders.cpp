#include <fmt/format.h>

#include <algorithm>

#include "reference/certified/hybrid_motion.h"

// Where a motion leaves a region and enters the next one. Numbers of equations are those of MotionByRegions.

namespace ricochet::reference::certified {

void HybridMotion::place_at(const HybridMotion& before) {
  if (before.set_.mean_value_form()) set_.take_mean_value_form();
  set_.set_box(before.set_.box());
  t_ = before.t_;
  result_ = before.result_;
  event_times_ = before.event_times_;
  states_ = before.states_;
  last_impact_ = before.last_impact_;
  has_begun_ = true;
}

std::vector<int> HybridMotion::borders_left(const std::vector<int>& but) {
  taylor_.load(set_.box(), t_);
  std::vector<int> left;
  for (int k = 0; k < std::ssize(scene_.borders); ++k) {
    if (std::ranges::count(but, k) > 0) continue;
    const Sign sign = p_.value_of(scene_.borders[k].function).sign();
    if (sign == Sign::negative) left.push_back(k);
    if (sign == Sign::unknown) throw Undecided(fmt::format("the sign of {} is undecided", scene_.borders[k].formula));
  }
  return left;
}

/// After an impact.
bool HybridMotion::leaves_region() {
  std::vector<int> changed = borders_left({});
  if (!changed.empty()) exit_ = Exit{-1, std::move(changed)};
  return exit_.has_value();
}

std::vector<Sign> HybridMotion::begin_on_borders(const std::vector<int>& zero) {
  constexpr int kLastOrder = 8;
  begin();
  if (exit_ || !result_.events.empty()) throw Unsupported("an impact at t = 0, on the border of a region");
  taylor_.load(set_.box(), t_);
  taylor_.expand(motion_, kLastOrder);
  std::vector<Sign> signs;
  for (const int k : zero) {
    const Border& border = scene_.borders[k];
    const int m = p_.leading(border.function, 1, kLastOrder);  // (7)
    const bool is_of_time = !border.has_place && !border.has_speed;
    const int most = is_of_time ? kLastOrder : border.has_speed ? 1 : 2;
    if (m > most) throw Unsupported(fmt::format("undecided how the motion leaves {} = 0 at t = 0", border.formula));
    signs.push_back(Ball(p_.coefficient(border.function, m)).sign());
    if (signs.back() == Sign::unknown)
      throw Undecided(fmt::format("undecided how the motion leaves {} = 0 at t = 0", border.formula));
    states_.vanishing_border[k] = m;
  }
  return signs;
}

/// The first inequality (3).
void HybridMotion::reach_border(int k) {
  const Border& border = scene_.borders[k];
  if (!motion_.starts.empty()) begin_motion();  // with a slip velocity that is not zero any more
  taylor_.load(set_.box(), t_);
  taylor_.expand(motion_, 1);
  if (Ball(p_.coefficient(border.function, 1)).sign() != Sign::negative)
    throw Undecided(fmt::format("undecided whether the motion crosses {} = 0", border.formula));
  exit_ = Exit{k, {k}};
}

/// Opens contacts by (4), and finds those that are `hit` by (5) and the signs of slip of the others.
void HybridMotion::change_contacts(const HybridMotion& before, std::vector<int>& slip_sign, std::vector<int>& hit) {
  const int border = before.exit_->border;
  const RegionChange change = change_between(before.scene_, scene_, border);
  if (border < 0 && !change.same_mass_everywhere) throw Unsupported("the mass matrix jumps in an impact");
  taylor_.load(set_.box(), t_);
  for (int i = 0; i < scene_.n_c(); ++i) {
    const ContactFormulas& contact = scene_.contacts[i];
    const RegionChange::OfContact& formulas = change.contacts[i];
    const bool is_closed = states_.modes[i] != Mode::open;
    const auto require = [&](bool is_possible) {
      if (!is_possible) throw Unsupported(contact.name + " changes where a formula jumps");
    };
    const auto sign_of = [&](Node node, const char* what) {
      const Sign sign = p_.value_of(node).sign();
      if (sign == Sign::unknown) throw Undecided(fmt::format("{} of {} after a border", what, contact.name));
      return sign;
    };
    require(border >= 0 || formulas.same_everywhere);
    if (is_closed ? formulas.same_slope && formulas.same_directions : formulas.same_everywhere) {
      if (is_closed && states_.vanishing_slip[i] == 0) slip_sign[i] = slip_sign_of(states_.modes[i]);
    } else if (!is_closed) {
      require(sign_of(contact.gap, "the gap") == Sign::positive);
    } else if (formulas.same_slope) {
      require(contact.n_t() == 1);
      slip_sign[i] = static_cast<int>(sign_of(contact.v_t[0], "the slip velocity"));
      states_.modes[i] = slip_sign[i] > 0 ? Mode::slip_plus : Mode::slip_minus;
    } else {
      require(!contact.is_bilateral);
      states_.modes[i] = Mode::open;
      if (!formulas.same_gap)
        require(sign_of(contact.gap, "the gap") == Sign::positive);
      else if (sign_of(contact.v_n, "the normal velocity") == Sign::positive)
        states_.vanishing_gap[i] = 1;
      else
        hit.push_back(i);
    }
  }
}

/// The impact (5), with (6). @param before  with the gap before the border
void HybridMotion::strike_corner(HybridMotion& before, const std::vector<int>& hit) {
  const int border = before.exit_->border;
  const std::vector<int> candidates = coupled_contacts(scene_, states_.modes, hit, p_);
  const bool has_friction = std::ranges::any_of(candidates, [&](int i) { return scene_.contacts[i].n_t() > 0; });
  const std::string& name = scene_.contacts[hit.front()].name;
  if (hit.size() > 1 || has_friction || scene_.borders[border].has_speed)
    throw Unsupported("an impact with friction, or of several contacts, at a corner: " + name);
  std::vector<Ball> x = set_.box();
  const ImpactOutcome outcome = decisions_.close_gaps(x, t_, hit, states_);
  before.taylor_.load(x, t_);
  if (before.p_.value_of(before.scene_.contacts[hit.front()].v_n).sign() != Sign::positive)
    throw Undecided("two faces may push at the corner: " + name);
  last_impact_ = hit.front();
  keep_impact(std::move(x), outcome, name);
  if (!borders_left({border}).empty()) throw Unsupported("an impact at a corner changes the region: " + name);
}

void HybridMotion::enter(HybridMotion& before) {
  const int border = before.exit_->border;
  std::vector<int> slip_sign(scene_.n_c(), 0), hit, candidates;
  change_contacts(before, slip_sign, hit);
  const std::vector<int> struck = hit.empty() ? hit : coupled_contacts(scene_, states_.modes, hit, p_);
  std::vector<Ball> x = set_.box();
  decisions_.narrow(x, t_, decisions_.zeros_of(states_));
  for (int i = 0; i < scene_.n_c(); ++i) {
    const bool opens_from_rest = states_.modes[i] == Mode::open && states_.vanishing_gap[i] > 1;
    if ((states_.modes[i] == Mode::open && !opens_from_rest) || std::ranges::count(struck, i) > 0) continue;
    if (opens_from_rest && scene_.contacts[i].n_t() > 0)
      throw Unsupported("an impact changes the region, and opens " + scene_.contacts[i].name);
    candidates.push_back(i);
    states_.vanishing_gap[i] = states_.vanishing_slip[i] = 0;
  }
  decisions_.decide_modes(x, t_, candidates, slip_sign, states_);
  if (border < 0)
    result_.events.back().modes = names_of(states_.modes);
  else
    record("border", scene_.borders[border].formula);
  if (!hit.empty()) strike_corner(before, hit);
  begin_motion();
  if (border < 0) return;
  const Border& crossed = scene_.borders[border];
  taylor_.load(set_.box(), t_);
  taylor_.expand(motion_, 1);
  const Sign rate = Ball(p_.coefficient(crossed.function, 1)).sign();  // the second inequality (3)
  if (rate == Sign::negative)
    throw Unsupported(fmt::format("the motion slides on {} = 0, where a formula jumps", crossed.formula));
  if (rate == Sign::unknown) throw Undecided(fmt::format("undecided whether it crosses {} = 0", crossed.formula));
  states_.vanishing_border[border] = 1;
}

}  // namespace ricochet::reference::certified
