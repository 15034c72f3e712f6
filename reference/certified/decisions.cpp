#include "reference/certified/decisions.h"

#include <fmt/format.h>

#include <algorithm>

#include "reference/certified/contact_law.h"

namespace ricochet::reference::certified {

void ContactStates::moved() {
  std::ranges::fill(vanishing_gap, 0);
  std::ranges::fill(vanishing_slip, 0);
  std::ranges::fill(gap_is_bounded_only, 0);
  std::ranges::fill(sticks_at_limit, 0);
  vanishing_border.clear();
  starting.clear();
}

Combinations::Combinations(std::vector<std::vector<Mode>> options)
    : options_(std::move(options)), index_(options_.size(), 0) {
  constexpr double kMost = 20000;
  double count = 1;
  for (const auto& list : options_) count *= static_cast<double>(list.size());
  if (count > kMost) throw Unsupported(fmt::format("{:.0f} combinations of contact modes", count));
}

bool Combinations::next() {
  for (std::size_t k = 0; k < index_.size(); ++k) {
    if (++index_[k] < options_[k].size()) return true;
    index_[k] = 0;
  }
  return false;
}

bool Verdict::add(Sign sign, const std::string& alternative) {
  if (sign == Sign::positive) ++n_proven_;
  if (sign == Sign::unknown && n_undecided_++ == 0) undecided_ = alternative;
  return sign == Sign::positive;
}

void Verdict::require_one(const std::string& what) const {
  if (n_proven_ == 1 && n_undecided_ == 0) return;
  if (all_are_refuted()) throw Unsupported(what + ": every combination violates the contact laws strictly");
  throw Undecided(fmt::format("{}: {} alternatives proven, {} undecided{}", what, n_proven_, n_undecided_,
                              undecided_.empty() ? "" : ", for example " + undecided_));
}

Sign all_of(const std::vector<Sign>& signs) {
  if (std::ranges::count(signs, Sign::negative) > 0) return Sign::negative;
  return std::ranges::count(signs, Sign::unknown) > 0 ? Sign::unknown : Sign::positive;
}

std::vector<Mode> Decisions::mode_options(int i, int slip_sign) const {
  const ContactFormulas& contact = scene_.contacts[i];
  std::vector<Mode> options;
  if (!contact.is_bilateral) options.push_back(Mode::open);
  if (contact.n_t() == 0) {
    options.push_back(Mode::closed);
  } else if (contact.n_t() == 2) {
    options.push_back(slip_sign != 0 ? Mode::slip : Mode::stick);
  } else {
    if (slip_sign == 0) options.push_back(Mode::stick);
    if (slip_sign >= 0) options.push_back(Mode::slip_plus);
    if (slip_sign <= 0) options.push_back(Mode::slip_minus);
  }
  return options;
}

std::string Decisions::names(const std::vector<int>& candidates, const Combinations& combination) const {
  std::string text;
  for (std::size_t k = 0; k < candidates.size(); ++k)
    text += fmt::format("{}{}: {}", k ? ", " : "", scene_.contacts[candidates[k]].name, name_of(combination[k]));
  return text;
}

/// Inequalities (1): the first coefficient of every event function that is not exactly zero is positive. The series of
/// `motion` must be there up to `order`. @param first_only  later coefficients depend on modes of others
/// @returns unknown if more orders are needed
Sign Decisions::check_modes(const std::vector<int>& candidates, const std::vector<int>& slip_sign,
                            const std::vector<char>& sticks_at_limit, const ModeMotion& motion, int order,
                            bool first_only) {
  std::vector<Sign> signs;
  for (const EventFunction& event : motion.events) {
    if (std::ranges::count(candidates, event.contact) == 0) continue;
    int first = event.kind == EventKind::impact ? 2 : 0;  // f_c = v_n = 0
    if (event.kind == EventKind::cone && sticks_at_limit[event.contact]) {
      if (first_only) signs.push_back(Sign::unknown);
      first = 1;
    }
    if (event.kind == EventKind::slip_end) {
      if (slip_sign[event.contact] != 0) continue;
      if (const auto start = motion.starts.find(event.contact); start != motion.starts.end()) {
        const bool depends = first_only && start->second.onset.order > 1;
        if (depends || Ball(p_.coefficient(start->second.F, 0)).sign() != Sign::negative) return Sign::unknown;
        signs.push_back(Ball(p_.coefficient(event.node, start->second.onset.order)).sign());
        continue;
      }
      if (p_.is_constant(event.node)) return Sign::negative;  // no slip is possible
      first = 1;
    }
    const int last = first_only ? first : order;
    const int k = p_.leading(event.node, first, last);
    signs.push_back(k > last ? Sign::unknown : Ball(p_.coefficient(event.node, k)).sign());
  }
  return all_of(signs);
}

/// The sign of a combination, by two orders and, if coefficients vanish exactly, by more; and what keeps at rest.
void Decisions::check_alternative(const std::vector<Ball>& x, const Ball& t, const Group& group,
                                  const std::vector<int>& slip_sign, const std::vector<char>& sticks_at_limit,
                                  ModeAlternative& alternative) {
  constexpr int kFirstOrder = 2, kLastOrder = 8;
  bool has_no_acceleration_of_rest = false;
  step_.load(x, t);
  if (alternative.starting.empty() && is_refuted(group, slip_sign, alternative)) {
    alternative.sign = Sign::negative;
    return;
  }
  alternative.kept = kept_at_rest(group, alternative.modes);
  try {
    step_.load(x, t);
    const ModeMotion motion = mode_motion(scene_, alternative.modes, p_, alternative.starting, alternative.left_out);
    for (const auto& [contact, force] : motion.normal_force) {
      if (p_.is_zero(force) && scene_.contacts[contact].n_t() == 0) alternative.idle.push_back(contact);
    }
    const bool first_only = depends_on_others(motion, group, false);
    for (const int order : {kFirstOrder, kLastOrder}) {
      step_.load(x, t);
      step_.expand(motion, order);
      alternative.sign = check_modes(group.candidates, slip_sign, sticks_at_limit, motion, order, first_only);
      if (alternative.sign != Sign::unknown) break;
    }
    has_no_acceleration_of_rest = has_no_acceleration(motion, group, alternative.kept);
  } catch (const Undecided&) {  // singular equations
  }
  if (alternative.sign == Sign::negative) return;
  if (has_no_acceleration_of_rest) alternative.kept = group.pushed;
  step_.load(x, t);
  set_reaching(group, slip_sign, alternative);
}

/// Whether a combination differs from a proven one only in that contacts without force are open.
bool Decisions::has_same_motion(const ModeAlternative& open, const ModeAlternative& proven) {
  for (std::size_t i = 0; i < open.modes.size(); ++i) {
    if (open.modes[i] == proven.modes[i]) continue;
    if (open.modes[i] != Mode::open || std::ranges::count(proven.idle, static_cast<int>(i)) == 0) return false;
  }
  return true;
}

/// Whether (3) says so.
bool Decisions::has_same_motion_kept(const ModeAlternative& one, const ModeAlternative& other) {
  return one.has_one_motion && other.has_one_motion && one.kept == other.kept && one.reaching == other.reaching;
}

/// Slip from rest of a contact in space that exchanges no momentum with others: its directions do not depend on their
/// modes.
Decisions::SlipFromRest Decisions::slip_from_rest(const std::vector<Ball>& x, const Ball& t, int i,
                                                  bool sticks_at_limit) {
  const ContactFormulas& contact = scene_.contacts[i];
  std::vector<Mode> modes(scene_.n_c(), Mode::open);
  step_.load(x, t);
  const std::vector<Node> rates = contact_rates(mode_motion(scene_, modes, p_), contact, scene_, p_);
  const ContactLaw law = contact_law(scene_, i, p_);
  ContactInSpace in_space;
  in_space.mu = contact.mu;
  for (int r = 0; r < 3; ++r) {
    std::ranges::copy(law.G[r], in_space.G[r].begin());
    in_space.r[r] = p_.value_of(rates[r]);
  }
  if (sticks_at_limit) {
    modes[i] = Mode::stick;
    const SlipOnset onset = onset_at_limit(x, t, i, modes);
    const SlipDirections others = slip_directions(in_space, p_.precision(), onset.d);
    return {others.is_complete && others.n_proven == 0, onset};
  }
  const SlipDirections directions = slip_directions(in_space, p_.precision());
  const bool is_unique = directions.n_proven == 1 && directions.is_stable;
  SlipFromRest slip{directions.is_complete && (directions.n_proven == 0 || is_unique), {}};
  if (is_unique) slip.onset = SlipOnset{directions.d, 1};
  return slip;
}

std::vector<Decisions::Group> Decisions::groups_of(const std::vector<Ball>& x, const Ball& t,
                                                   const std::vector<int>& candidates, const ContactStates& states) {
  const std::vector<int> all = with_closed(candidates, states.modes);
  const std::vector<int> labels = momentum_groups(scene_, all, p_).of_contact;
  std::map<int, Group> groups;
  std::vector<int> order;
  for (std::size_t k = 0; k < candidates.size(); ++k) {
    if (groups.count(labels[k]) == 0) order.push_back(labels[k]);
    groups[labels[k]].candidates.push_back(candidates[k]);
  }
  step_.load(x, t);
  std::vector<Group> result;
  for (const int label : order) {
    Group& group = groups[label];
    std::vector<int> members;  // with those that are no candidates
    for (std::size_t k = 0; k < all.size(); ++k) {
      if (labels[k] == label) members.push_back(all[k]);
    }
    group.is_single = members.size() == 1;
    group.pushed = pushed_coordinates(scene_, members, p_);
    std::ranges::copy_if(group.pushed, std::back_inserter(group.resting),
                         [&](int k) { return x[scene_.n + k].is_zero(); });
    result.push_back(std::move(group));
  }
  return result;
}

void Decisions::decide_modes(const std::vector<Ball>& x, const Ball& t, const std::vector<int>& candidates,
                             const std::vector<int>& slip_sign, ContactStates& states) {
  if (candidates.empty()) return;
  const std::vector<Group> groups = groups_of(x, t, candidates, states);
  for (const int i : candidates) {
    states.modes[i] = Mode::open;
    std::erase_if(states.left_out, [&](const auto& force) { return force.first.first == i; });
  }
  states.starting.clear();
  for (const Group& group : groups) decide_group(x, t, group, slip_sign, states);
}

void Decisions::decide_group(const std::vector<Ball>& x, const Ball& t, const Group& group,
                             const std::vector<int>& slip_sign, ContactStates& states) {
  const std::vector<int>& candidates = group.candidates;
  std::vector<std::vector<Mode>> options;
  for (const int i : candidates) options.push_back(mode_options(i, slip_sign[i]));
  std::optional<SlipFromRest> slip;
  const int first = candidates.front();
  if (group.is_single && scene_.contacts[first].n_t() == 2 && slip_sign[first] == 0) {
    slip = slip_from_rest(x, t, first, states.sticks_at_limit[first] != 0);
    if (!slip->is_complete) throw Undecided("undecided whether slip in space begins: " + scene_.contacts[first].name);
    if (slip->onset) options.front().push_back(Mode::slip);
  }
  Combinations combination(std::move(options));
  ModeAlternative best;
  best.left_out = states.left_out;
  std::vector<ModeAlternative> left;
  Verdict verdict;
  do {
    limit_.check();
    ModeAlternative next;
    next.modes = states.modes;
    next.left_out = states.left_out;
    for (std::size_t k = 0; k < candidates.size(); ++k) {
      next.modes[candidates[k]] = combination[k];
      if (combination[k] == Mode::slip && slip) next.starting[candidates[k]] = *slip->onset;
    }
    next.name = names(candidates, combination);
    check_alternative(x, t, group, slip_sign, states.sticks_at_limit, next);
    if (next.sign == Sign::negative) continue;
    left.push_back(std::move(next));
  } while (combination.next());
  std::vector<ModeAlternative> undecided;
  while (!left.empty()) {  // combinations with the same motion
    const ModeAlternative first = left.front();
    const auto others = std::ranges::partition(
        left, [&](const auto& next) { return next.name != first.name && !has_same_motion_kept(first, next); });
    const auto proven = std::ranges::find(others, Sign::positive, &ModeAlternative::sign);
    ModeAlternative one = proven != others.end() ? *proven : first;
    left.erase(others.begin(), others.end());
    if (proven == others.end() && one.has_one_motion && find_forces(x, t, group, slip_sign, one))
      one.sign = Sign::positive;
    if (one.sign == Sign::unknown) {
      undecided.push_back(std::move(one));
    } else if (verdict.add(one.sign, one.name)) {
      best = std::move(one);
    }
  }
  for (const auto& alternative : undecided) {
    if (best.modes.empty() || !has_same_motion(alternative, best)) verdict.add(Sign::unknown, alternative.name);
  }
  if (verdict.all_are_refuted()) {
    for (const int i : candidates) {
      if (scene_.contacts[i].n_t() == 2 && slip_sign[i] == 0)
        throw Unsupported("slip in space begins from rest: " + scene_.contacts[i].name);
    }
  }
  verdict.require_one("modes");
  states.starting.insert(best.starting.begin(), best.starting.end());
  states.left_out = best.left_out;
  for (const int i : candidates) {
    const Mode mode = best.modes[i];
    states.modes[i] = mode;
    if (mode == Mode::open) states.vanishing_gap[i] = 2;
    if (slip_sign[i] == 0 && slip_sign_of(mode) != 0) states.vanishing_slip[i] = 1;
    if (const auto start = states.starting.find(i); start != states.starting.end())
      states.vanishing_slip[i] = start->second.order;
    if (mode == Mode::stick && scene_.contacts[i].n_t() == 2 && !slip) sticking_in_space_.push_back(i);
  }
}

}  // namespace ricochet::reference::certified
