#include <algorithm>

#include "reference/certified/decisions.h"
#include "reference/certified/redundant_rows.h"

// Combinations of modes with redundant contacts, or with the same motion, see Decisions::decide_modes() (3) and (4).

namespace ricochet::reference::certified {

/// Whether accelerations or event functions of a group depend on coordinates of others, or on time.
bool Decisions::depends_on_others(const ModeMotion& motion, const Group& group, bool with_time) const {
  std::vector<Node> outputs;
  for (const int k : group.pushed) outputs.push_back(motion.acceleration[k]);
  for (const EventFunction& event : motion.events) {
    if (std::ranges::count(group.candidates, event.contact) > 0) outputs.push_back(event.node);
  }
  const std::vector<Node> schedule = p_.schedule(outputs);
  const auto is_used = [&](Node variable) { return std::ranges::binary_search(schedule, variable); };
  for (int k = 0; k < scene_.n; ++k) {
    if (std::ranges::count(group.pushed, k) == 0 && (is_used(scene_.q[k]) || is_used(scene_.v[k]))) return true;
  }
  return with_time && is_used(scene_.clock);
}

/// (4), of the coordinates that are not kept. The motion must be expanded at the state.
bool Decisions::has_no_acceleration(const ModeMotion& motion, const Group& group, const std::vector<int>& kept) {
  if (group.resting != group.pushed || !motion.starts.empty()) return false;
  for (const int i : group.candidates) {
    if (!is_at_rest_with_its_bodies(scene_, i, p_)) return false;
  }
  const bool is_zero = std::ranges::all_of(group.pushed, [&](int k) {
    const Node a = motion.acceleration[k];
    return std::ranges::count(kept, k) > 0 || p_.is_zero(a) || p_.value_of(a).is_zero();
  });
  return is_zero && !depends_on_others(motion, group, true);
}

/// S of the `modes` at the loaded state.
std::vector<int> Decisions::kept_at_rest(const Group& group, const std::vector<Mode>& modes) {
  const auto of_group = [&](const std::vector<int>& locked) {
    std::vector<int> kept;
    std::ranges::set_intersection(locked, group.pushed, std::back_inserter(kept));
    return kept;
  };
  const std::vector<int> by_formulas = locked_by(scene_, modes, true, p_);
  const auto has_same_slip = [&](int i, int j) {
    for (int k = 0; k < scene_.n; ++k) {
      const bool is_same = scene_.contacts[i].J_t[0][k] == scene_.contacts[j].J_t[0][k];
      if (!is_same && std::ranges::count(by_formulas, k) == 0) return false;
    }
    return is_at_rest_with_its_bodies(scene_, i, p_) && is_at_rest_with_its_bodies(scene_, j, p_);
  };
  std::vector<Mode> with_opposed = modes;
  for (const int i : group.candidates) {
    for (const int j : group.candidates) {
      if (modes[i] == Mode::slip_plus && modes[j] == Mode::slip_minus && has_same_slip(i, j))
        with_opposed[i] = Mode::stick;
    }
  }
  std::vector<int> kept = of_group(locked_by(scene_, with_opposed, false, p_));
  if (kept != group.pushed) kept = of_group(locked_by(scene_, with_opposed, true, p_));
  return std::ranges::includes(group.resting, kept) ? kept : std::vector<int>();
}

/// The contacts that reach T, and whether (3) is regular.
void Decisions::set_reaching(const Group& group, const std::vector<int>& slip_sign, ModeAlternative& alternative) {
  alternative.reaching.assign(scene_.n_c(), Mode::open);
  const auto leaves_kept = [&](const std::vector<Node>& row) {
    for (int k = 0; k < scene_.n; ++k) {
      if (!p_.is_zero(row[k]) && std::ranges::count(alternative.kept, k) == 0) return true;
    }
    return false;
  };
  // The normal force of a contact whose friction reaches T follows from coordinates of its normal: they join T.
  for (bool is_new = true; is_new;) {
    is_new = false;
    for (const int i : group.candidates) {
      const ContactFormulas& contact = scene_.contacts[i];
      if (alternative.modes[i] == Mode::open || contact.n_t() != 1 || !leaves_kept(contact.J_t[0]) ||
          leaves_kept(contact.J_n))
        continue;
      is_new = std::erase_if(alternative.kept, [&](int k) { return !p_.is_zero(contact.J_n[k]); }) > 0 || is_new;
    }
  }
  bool others_rest = true;
  for (const int i : group.candidates) {
    const ContactFormulas& contact = scene_.contacts[i];
    if (contact.n_t() > 1) return;
    const bool reaches = leaves_kept(contact.J_n) || (contact.n_t() == 1 && leaves_kept(contact.J_t[0]));
    if (reaches)
      alternative.reaching[i] = alternative.modes[i];
    else
      others_rest = others_rest && slip_sign[i] == 0 && is_at_rest_with_its_bodies(scene_, i, p_);
  }
  const ModeSystem system = mode_system(scene_, alternative.modes, p_, alternative.left_out);
  std::vector<std::size_t> rows;
  for (const int k : group.pushed) {
    if (std::ranges::count(alternative.kept, k) == 0) rows.push_back(k);
  }
  for (std::size_t j = 0; j < system.unknowns.size(); ++j) {
    if (alternative.reaching[system.unknowns[j].first] != Mode::open) rows.push_back(scene_.n + j);
  }
  BallMatrix A, B;
  for (const std::size_t r : rows) {
    A.emplace_back();
    for (const std::size_t c : rows) A.back().push_back(system.A[r][c]);
    B.push_back({Ball()});
  }
  alternative.has_one_motion = others_rest && (rows.empty() || solve(A, B, p_.precision().bits));
}

/// At the loaded state.
std::vector<LinearForm> Decisions::inequalities(const Group& group, const std::vector<int>& slip_sign,
                                                const std::vector<Mode>& modes, const ModeSystem& system,
                                                std::vector<std::size_t>& order) {
  const std::size_t n = scene_.n, size = system.A.size();
  std::vector<LinearForm> forms;
  const auto add_rate = [&](const std::vector<Node>& J, Node rate) {
    LinearForm form{std::vector<Ball>(size), p_.value_of(bias_of(rate, scene_, p_))};
    for (std::size_t k = 0; k < n; ++k) form.along[k] = p_.value_of(J[k]);
    forms.push_back(std::move(form));
  };
  for (const int i : group.candidates) {
    const ContactFormulas& contact = scene_.contacts[i];
    if (modes[i] == Mode::open) add_rate(contact.J_n, contact.v_n);
    if (slip_sign[i] != 0 || (modes[i] != Mode::slip_plus && modes[i] != Mode::slip_minus)) continue;
    add_rate(contact.J_t[0], contact.v_t[0]);
    if (modes[i] == Mode::slip_minus) forms.back() = opposite(forms.back());
  }
  const auto index_of = [&](const Unknown& unknown) {
    return n + static_cast<std::size_t>(std::ranges::find(system.unknowns, unknown) - system.unknowns.begin());
  };
  for (const auto& [i, direction] : system.unknowns) {
    const ContactFormulas& contact = scene_.contacts[i];
    const std::size_t j = index_of({i, direction});
    order.insert(direction < 0 ? order.end() : order.begin(), j);
    if (contact.is_bilateral || std::ranges::count(group.candidates, i) == 0) continue;
    LinearForm form{std::vector<Ball>(size), {}};
    if (direction < 0) {
      form.along[j] = Ball(1.0);
      forms.push_back(form);
    } else if (contact.n_t() == 1) {
      form.along[index_of({i, -1})] = contact.mu;
      for (const double side : {1.0, -1.0}) {
        form.along[j] = Ball(side);
        forms.push_back(form);
      }
    }
  }
  return forms;
}

/// Whether (1) is violated strictly, at the loaded state, before any formula of the motion is derived.
bool Decisions::is_refuted(const Group& group, const std::vector<int>& slip_sign, const ModeAlternative& alternative) {
  const Precision& a = p_.precision();
  const ModeSystem system = mode_system(scene_, alternative.modes, p_, alternative.left_out);
  std::vector<std::size_t> order;
  const std::vector<LinearForm> forms = inequalities(group, slip_sign, alternative.modes, system, order);
  BallMatrix right;
  for (const Ball& entry : system.b) right.push_back({entry});
  if (const auto y = solve(system.A, right, a.bits)) {
    return std::ranges::any_of(forms, [&](const LinearForm& form) {
      Ball value = form.constant;
      for (std::size_t k = 0; k < y->size(); ++k) value = a.add(value, a.mul(form.along[k], (*y)[k][0]));
      return value.sign() == Sign::negative;
    });
  }
  for (const std::size_t j : order) {
    if (const auto row = RedundantRow::without(system.A, system.b, j, a)) return row->is_refuted(forms);
  }
  return false;
}

/// Whether the forces satisfy (1) strictly, and the rows that are not left out keep the same coordinates at rest.
bool Decisions::satisfies(const std::vector<Ball>& x, const Ball& t, const Group& group,
                          const std::vector<int>& slip_sign, const ModeAlternative& alternative,
                          const std::vector<Mode>& with_rows) {
  limit_.check();
  try {
    step_.load(x, t);
    const ModeMotion motion = mode_motion(scene_, alternative.modes, p_, {}, alternative.left_out);
    step_.load(x, t);
    step_.expand(motion, 2);
    std::vector<int> kept = kept_at_rest(group, with_rows);
    if (has_no_acceleration(motion, group, kept)) kept = group.pushed;
    const bool first_only = depends_on_others(motion, group, false);
    const std::vector<char> none_at_limit(scene_.n_c(), 0);  // a force at its limit stays undecided
    return std::ranges::includes(kept, alternative.kept) &&
           check_modes(group.candidates, slip_sign, none_at_limit, motion, 2, first_only) == Sign::positive;
  } catch (const Undecided&) {  // singular equations
    return false;
  }
}

/// Forces that satisfy (1) strictly: of independent rows, with those of all others zero, or with one that is not zero.
/// The contacts that reach T have the modes of the alternative and all of their rows.
bool Decisions::find_forces(const std::vector<Ball>& x, const Ball& t, const Group& group,
                            const std::vector<int>& slip_sign, ModeAlternative& alternative) {
  const LeftOut of_others = alternative.left_out;
  std::vector<std::vector<Mode>> options;  // rows that are kept: normal and friction, normal, none
  std::vector<int> resting;
  for (const int i : group.candidates) {
    const ContactFormulas& contact = scene_.contacts[i];
    if (alternative.reaching[i] != Mode::open) continue;
    bool reaches = false;  // T, while it is open
    for (int k = 0; k < scene_.n; ++k)
      reaches = reaches || (!p_.is_zero(contact.J_n[k]) && std::ranges::count(alternative.kept, k) == 0);
    if (reaches) continue;
    resting.push_back(i);
    alternative.modes[i] = contact.n_t() > 0 ? Mode::stick : Mode::closed;
    options.push_back({Mode::closed, Mode::open});
    if (contact.n_t() > 0) options.back().insert(options.back().begin(), Mode::stick);
  }
  if (resting.empty()) return false;
  Combinations combination(std::move(options));
  do {
    alternative.left_out = of_others;
    std::vector<Mode> with_rows = alternative.modes;
    for (std::size_t k = 0; k < resting.size(); ++k) {
      const int i = resting[k];
      with_rows[i] = combination[k];
      if (combination[k] == Mode::open) alternative.left_out[{i, -1}] = 0;
      if (combination[k] != Mode::stick && scene_.contacts[i].n_t() > 0) alternative.left_out[{i, 0}] = 0;
    }
    if (satisfies(x, t, group, slip_sign, alternative, with_rows)) return true;
  } while (combination.next());
  alternative.left_out = of_others;
  step_.load(x, t);
  const ModeSystem system = mode_system(scene_, alternative.modes, p_, alternative.left_out);
  std::vector<std::size_t> order;
  const std::vector<LinearForm> forms = inequalities(group, slip_sign, alternative.modes, system, order);
  for (const std::size_t j : order) {
    const Unknown unknown = system.unknowns[j - scene_.n];
    const auto row = RedundantRow::without(system.A, system.b, j, p_.precision());
    if (!row || unknown.second < 0 || std::ranges::count(resting, unknown.first) == 0) continue;
    alternative.left_out = of_others;
    alternative.left_out[unknown] = row->middle(forms).nearest();
    std::vector<Mode> with_rows = alternative.modes;
    with_rows[unknown.first] = Mode::closed;
    if (satisfies(x, t, group, slip_sign, alternative, with_rows)) return true;
  }
  alternative.left_out = of_others;
  return false;
}

}  // namespace ricochet::reference::certified
