#include "methods/fesd/pivoting_solver.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "methods/fesd/open_motion.h"

namespace ricochet {
namespace {

// Predictions tried in one step before the search gives up, per element.
constexpr int kMaxTrials = 100;
// Alternative modes of a start that are combined with each other.
constexpr std::size_t kMaxAlternatives = 4;
// Of the search for the earliest switching time: to a relative 1e-12.
constexpr int kBisections = 40;
// Lengths at which a switch function is sampled when Newton's method misses its root.
constexpr int kBracketSamples = 16;

/// The switch inside the element that explains why a sign condition is broken, where one does.
std::optional<Switch::Kind> explaining_switch(Verdict verdict) {
  switch (verdict) {
    case Verdict::gap_negative:
      return Switch::Kind::gap_closes;
    case Verdict::force_negative:
      return Switch::Kind::force_vanishes;
    case Verdict::cone_left:
      return Switch::Kind::cone_reached;
    case Verdict::slip_reversed:
      return Switch::Kind::slip_stops;
    case Verdict::slip_turned:
      return Switch::Kind::slip_turns;
    case Verdict::edge_left:
      return Switch::Kind::edge_left;
    case Verdict::fulfilled:
    case Verdict::drifts:
    case Verdict::undetermined:
    case Verdict::no_right_stage:
    case Verdict::accumulates:
    case Verdict::impacts_accumulate:
    case Verdict::newton_failed:
    case Verdict::no_impulse:
    case Verdict::no_forces:
    case Verdict::indeterminate:
      return std::nullopt;
  }
  return std::nullopt;
}

bool is_switch(Verdict verdict) {
  return explaining_switch(verdict).has_value();
}

}  // namespace

PivotingSolver::PivotingSolver(const Problem& problem, const ButcherTableau& tableau, const Options& options,
                               Counters& counters)
    : problem_(problem),
      options_(options),
      polygon_(options.facets),
      counters_(counters),
      scales_(problem),
      elements_(problem, tableau, counters, polygon_),
      element_solver_(elements_, options.tolerance),
      switch_solver_(elements_, options.tolerance),
      start_solver_(problem, elements_.tableau, polygon_, scales_, counters),
      sign_conditions_(problem, elements_.tableau, polygon_, scales_, options.gap_tolerance),
      force_division_(problem),
      n_q_(problem.n_q()),
      n_c_(problem.n_c()),
      n_s_(tableau.n_s),
      capacity_(options.as_needed ? std::max(options.n_fe, options.max_elements) : options.n_fe),
      regular_A_(tableau.A.fullPivLu().isInvertible()) {
  previous_->resize(problem, n_s_, options.n_fe);
  make_room(options.n_fe);
  gap_.setZero(n_c_);
  if (options.between_stages) gap_minima_.emplace(problem, elements_.tableau, scales_);
}

/// Storage for more elements than a step had so far. Not inside a run: references to elements move.
void PivotingSolver::make_room(int n_elements) {
  if (n_elements <= static_cast<int>(step_->elements.size())) return;
  step_->resize(problem_, n_s_, n_elements);
  const std::size_t before = starts_.size();
  starts_.resize(std::max(before, static_cast<std::size_t>(n_elements)));
  for (std::size_t k = before; k < starts_.size(); ++k) starts_[k].reserve(problem_.info());
}

void PivotingSolver::start(const Vector& q, const Vector& v) {
  step_->n_elements = previous_->n_elements = 0;
  step_->elements[0].q0 = q;
  step_->v_minus.col(0) = v;
}

/// Starts where the last step ended.
void PivotingSolver::begin_step(double H) {
  if (step_->n_elements > 0) {
    std::swap(step_, previous_);
    make_room(options_.n_fe);
    step_->elements[0].q0 = previous_->last().q1;
    step_->v_minus.col(0) = previous_->last().v1;
  }
  step_->H = H;
  step_->touches = false;
  scales_.begin_step(step_->elements[0].q0.data(), &step_->v_minus(0, 0), H, !has_previous_step());
  trials_ = 0;
  if (first_failure_.violation.verdict != Verdict::fulfilled) first_failure_ = deepest_failure_ = {};
  longest_ = 0;
}

Status PivotingSolver::finish_step(bool solved) {
  if (solved) {
    counters_.elements += step_->n_elements;
    ++counters_.steps;
    return Status::success;
  }
  step_->n_elements = 0;
  const Verdict verdict = first_failure_.violation.verdict;
  if (verdict == Verdict::accumulates || verdict == Verdict::impacts_accumulate) return Status::step_limit;
  return verdict == Verdict::newton_failed || !depends_on_length() ? Status::inner_solver_failed : Status::infeasible;
}

Status PivotingSolver::advance(double H) {
  begin_step(H);
  bool solved = search(0, H, options_.n_fe);
  if (!solved && options_.as_needed) {
    trials_ = 0;
    longest_ = H / options_.n_fe;
    solved = search(0, H, 0);
  }
  return finish_step(solved);
}

Status PivotingSolver::advance_to_switch(double H, double capture,
                                         const std::function<bool(const Element&)>& is_accurate) {
  begin_step(H);
  make_room(2);  // for what is known of the next step
  return finish_step(solve_one_element(H, capture, is_accurate));
}

/// The `count` elements are the flight of a contact that bounced no higher than rounding of its gap: which of the
/// alternatives of their start, or -1.
int PivotingSolver::first_unresolved_flight(int first, int count) const {
  const Element& flight = step_->elements[first];
  const auto& alternatives = starts_[first].alternatives;
  const auto found = std::find_if(alternatives.begin(), alternatives.end(), [&](const auto& alternative) {
    const int i = alternative.contact;
    return alternative.bounced() && flight.modes[i] == ContactMode::open &&
           step_->ends[first + count - 1].contact == i &&
           0.25 * alternative.v_n * count * flight.h <= scales_.touching(i);
  });
  return found == alternatives.end() ? -1 : static_cast<int>(found - alternatives.begin());
}

bool PivotingSolver::solve_one_element(double H, double capture,
                                       const std::function<bool(const Element&)>& is_accurate) {
  ElementStart& start = starts_[0];
  if (!begin_element(0)) return false;
  const auto& alternatives = start.alternatives;
  captured_ = false;
  bool is_unresolved = false;           // the flight predicted is lower than positions are known
  unsigned captured = 0, too_fast = 0;  // alternatives that close a contact that bounced
  for (std::size_t k = 0; k < std::min(alternatives.size(), kMaxAlternatives); ++k) {
    if (!alternatives[k].bounced()) continue;
    if (alternatives[k].v_n > capture)
      too_fast |= 1U << k;  // the error would be its velocity
    else if (start_solver_.is_pressed(step_->elements[0], alternatives[k].contact))
      captured |= 1U << k;
  }
  const unsigned n_alternatives = 1U << std::min(alternatives.size(), kMaxAlternatives);
  for (unsigned trial = 0; trial < n_alternatives; ++trial) {
    if (!is_unresolved && ((trial ^ captured) & too_fast) != 0) continue;
    if (!propose_modes(0, trial ^ captured)) continue;
    captured_ = (captured != 0 && trial == 0) || is_unresolved;
    captured_speed_ = 0;
    for (std::size_t k = 0; k < std::min(alternatives.size(), kMaxAlternatives); ++k) {
      if (((trial ^ captured) >> k & 1U) && alternatives[k].bounced())
        captured_speed_ = std::max(captured_speed_, alternatives[k].v_n);
    }
    const Violation violation = equal_elements(0, 1, H);
    step_->n_elements = 1;
    if (violation.verdict == Verdict::fulfilled) return true;
    note_failure(violation, H, 1);
    // A capture is for the whole step, or not at all.
    if (captured_ || !is_switch(violation.verdict)) continue;
    if (!is_accurate(step_->elements[0])) return true;
    if (!run_to_switch(0, 1, violation, H)) continue;
    is_unresolved = first_unresolved_flight(0, 1) >= 0;
    if (is_unresolved) {
      if (elements_.tableau.is_stiffly_accurate()) continue;
      first_failure_ = deepest_failure_ = {{Verdict::accumulates, 0, step_->ends[0].contact, 0, 0}, H, 1};
      return false;  // closing would not stop it
    }
    step_->H = step_->elements[0].h;
    return true;
  }
  return false;
}

void PivotingSolver::reject() {
  counters_.elements -= step_->n_elements;
  --counters_.steps;
  step_->n_elements = 0;
}

int PivotingSolver::max_trials() const {
  return kMaxTrials * (longest_ == 0 ? options_.n_fe : capacity_);
}

/// Number of equal elements for the remaining time: what is left of N_FE, or as many as longest_ asks for. 0 when the
/// storage ends.
int PivotingSolver::elements_for(int element, double remaining, int elements_left) const {
  if (longest_ == 0) return elements_left;
  const int wanted = std::max(1, static_cast<int>(std::ceil(remaining / longest_ * (1 - 1e-9))));
  return element + wanted <= capacity_ ? wanted : 0;
}

bool PivotingSolver::search(int element, double remaining, int elements_left) {
  const int count = elements_for(element, remaining, elements_left);
  if (count == 0) return false;
  make_room(std::min(element + count + 1, capacity_));
  if (!begin_element(element)) return false;
  // A switch may be preceded by all but one of the elements; by all of them when there may be more.
  const int most_before = longest_ == 0 ? count - 1 : count;
  const unsigned n_alternatives = 1U << std::min<std::size_t>(starts_[element].alternatives.size(), kMaxAlternatives);
  unsigned counted = 0, trial = 0;  // a flight that cannot be seen is closed before other alternatives are counted
  const auto next = [&] {
    const bool is_flight =
        unresolved_ >= 0 && unresolved_ < static_cast<int>(kMaxClosedInstead) && !(trial >> unresolved_ & 1U);
    return is_flight ? trial | 1U << unresolved_ : ++counted;
  };
  bool is_right = false;  // the prediction is: where elements can be added, only bounces may still be closed instead
  for (; counted < n_alternatives; trial = next()) {
    unresolved_ = -1;
    if (is_right && options_.as_needed && !only_closes(element, trial)) continue;
    if (++trials_ > max_trials()) return false;
    if (!propose_modes(element, trial)) continue;
    const double h = remaining / count;
    const Violation violation = equal_elements(element, count, h);
    if (violation.verdict == Verdict::fulfilled) {
      step_->n_elements = element + count;
      return true;
    }
    note_failure(violation, h, count);
    if (!is_switch(violation.verdict)) continue;

    reached_ = false;
    if (split_at_switch(element, count, most_before, violation, remaining)) return true;
    is_right = is_right || (trial == 0 && reached_);
  }
  return false;
}

/// Whether a trial differs from the prediction in bounces that are closed instead only.
bool PivotingSolver::only_closes(int element, unsigned trial) const {
  const auto& alternatives = starts_[element].alternatives;
  for (std::size_t k = 0; k < std::min(alternatives.size(), kMaxClosedInstead); ++k) {
    if ((trial >> k & 1U) && !alternatives[k].bounced()) return false;
  }
  return true;
}

/// Lets a switch follow some of the `count` elements, and solves what remains.
bool PivotingSolver::split_at_switch(int element, int count, int most_before, const Violation& violation,
                                     double remaining) {
  // How many equal elements up to the switch: first the number that changes their length least, then its neighbours.
  const double h = remaining / count;
  const int nearest = std::clamp(static_cast<int>(std::lround(violation.time / h)), 1, std::max(1, most_before));
  const auto for_all_candidates = [&](const auto& attempt) {
    for (int k = 0; k < 2 * count; ++k) {
      const int m = nearest + (k % 2 ? -(k + 1) / 2 : k / 2);
      const bool is_possible = m >= 1 && m <= most_before && element + m < capacity_;
      if (is_possible && attempt(m)) return true;
    }
    return false;
  };
  const bool may_float = options_.switches != Switches::pinned &&
                         (violation.verdict == Verdict::force_negative || violation.verdict == Verdict::cone_left);
  if (may_float && options_.switches == Switches::published_earliest)
    return for_all_candidates([&](int m) { return split_unpinned(element, m, count, violation, remaining); });
  const auto pinned = [&](int m) {
    if (unresolved_ >= 0 || !run_to_switch(element, m, violation, remaining)) return false;
    // Closing stops a bounce that cannot be seen.
    if (elements_.tableau.is_stiffly_accurate()) unresolved_ = first_unresolved_flight(element, m);
    if (unresolved_ >= 0) return false;
    const bool is_solved = continue_after(element, m, remaining, count);
    unresolved_ = -1;
    reached_ = true;
    return is_solved;
  };
  if (for_all_candidates(pinned)) return true;
  return may_float &&
         for_all_candidates([&](int m) { return split_unpinned(element, m, count, violation, remaining); });
}

/// A switch at some time that the published equations admit: the latest, which is nearest to the truth, or the
/// earliest.
bool PivotingSolver::split_unpinned(int element, int m, int count, const Violation& violation, double remaining) {
  const auto is_feasible = [&](double h) {
    return run_to_time(element, m, h, violation) && continue_after(element, m, remaining, count);
  };
  const double longest = remaining / m;
  double feasible = 0, infeasible = 0;
  if (options_.switches == Switches::published_earliest && run_to_switch(element, m, violation, remaining) &&
      continue_after(element, m, remaining, count)) {
    feasible = step_->elements[element].h;  // the pinned one
  }
  for (int part = kBracketSamples - 1; part > 0 && feasible == 0; --part) {
    if (is_feasible(longest * part / kBracketSamples)) feasible = longest * part / kBracketSamples;
  }
  if (feasible == 0) return false;
  if (options_.switches == Switches::published) return true;
  for (int halving = 0; halving < kBisections; ++halving) {
    trials_ = 0;
    const double middle = 0.5 * (feasible + infeasible);
    (is_feasible(middle) ? feasible : infeasible) = middle;
  }
  return is_feasible(feasible);
}

/// Searches the rest of the step behind `count` elements that are solved.
bool PivotingSolver::continue_after(int element, int count, double remaining, int elements_left) {
  const double rest = remaining - count * step_->elements[element].h;
  if (rest <= 0) return false;
  const int next = element + count;
  step_->elements[next].q0 = step_->elements[next - 1].q1;
  step_->v_minus.col(next) = step_->elements[next - 1].v1;
  return search(next, rest, elements_left - count);
}

const Element* PivotingSolver::left_neighbour(int element) const {
  if (element > 0) return &step_->elements[element - 1];
  return has_previous_step() ? &previous_->last() : nullptr;
}

/// The switch that ended the element before; its contact is -1 when none did.
Switch PivotingSolver::switch_before(int element) const {
  if (element > 0) return step_->ends[element - 1];
  return has_previous_step() ? previous_->ends[previous_->n_elements - 1] : Switch{};
}

bool PivotingSolver::begin_element(int element) {
  const Switch end = switch_before(element);
  const bool within_step = element > 0 || end.contact >= 0;
  const auto result = start_solver_.begin(*step_, element, left_neighbour(element), end, within_step, starts_[element]);
  if (result == ElementStartSolver::Result::done) return true;
  using Result = ElementStartSolver::Result;
  const Verdict verdict = result == Result::no_impulse    ? Verdict::no_impulse
                          : result == Result::no_forces   ? Verdict::no_forces
                          : result == Result::accumulates ? Verdict::impacts_accumulate
                                                          : Verdict::indeterminate;
  note_failure({verdict, element, starts_[element].culprit, 0, 0}, 0, 1);
  // Thousands of impacts, and no other division of the step changes what happens at this instant.
  if (verdict == Verdict::impacts_accumulate) trials_ = max_trials();
  return false;
}

/// Trial 0 is the prediction; bit k of a later trial takes the k-th alternative. False when the contact laws have no
/// solution with it.
bool PivotingSolver::propose_modes(int element, unsigned trial) {
  ElementStart& start = starts_[element];
  Element& stages = step_->elements[element];
  const auto n = std::min(start.alternatives.size(), kMaxClosedInstead);
  unsigned closed_instead = 0;
  for (std::size_t k = 0; k < n; ++k) closed_instead |= start.alternatives[k].bounced() ? trial & 1U << k : 0;
  if (closed_instead != 0 || start.closed_instead != 0) {
    const Switch end = switch_before(element);
    if (start_solver_.close_instead(*step_, element, left_neighbour(element), end, element > 0 || end.contact >= 0,
                                    closed_instead, start) != ElementStartSolver::Result::done)
      return false;
  }
  for (std::size_t k = 0; k < n; ++k) {
    const auto& alternative = start.alternatives[k];
    const int i = alternative.contact;
    const bool differs = trial >> k & 1U;
    // A contact that is closed instead of bouncing may be one that the load would open.
    if (differs ? alternative.bounced() && is_closed(stages.modes[i]) : closed_instead != 0) continue;
    stages.modes[i] = differs ? alternative.mode : alternative.predicted;
    if (!stages.facets.empty()) stages.facets[i] = differs ? alternative.facet : alternative.predicted_facet;
  }
  return true;
}

void PivotingSolver::first_guess(int element, double h) {
  Element& stages = step_->elements[element];
  const Element* left = left_neighbour(element);
  const ElementStart& start = starts_[element];
  stages.h = h;
  const bool has_impulse = !start.touching.empty() && !step_->Lambda_n.col(element).isZero(0);
  if (left && left->h == h && left->modes == stages.modes && left->facets == stages.facets && !has_impulse) {
    elements_.tableau.extrapolate(*left, stages);
  } else if (start.has_forces) {
    stages.a.colwise() = start.acceleration;
    stages.lambda_n.colwise() = start.lambda_n;
    stages.lambda_t.colwise() = start.lambda_t;
  } else {
    stages.a.setZero();
    stages.lambda_n.setZero();
    stages.lambda_t.setZero();
  }
}

/// Slip in space that would have to turn back leaves Newton's method without a solution: the contact comes to rest
/// before.
Violation PivotingSolver::after_failed_newton(int element) {
  const Element& stages = step_->elements[element];
  const bool slips_in_space =
      std::find(stages.modes.begin(), stages.modes.end(), ContactMode::slip) != stages.modes.end();
  double time = 0;
  const int contact = slips_in_space ? start_solver_.first_to_stop(stages, time) : -1;
  if (contact < 0) return {Verdict::newton_failed, element, -1, 0, 0};
  first_guess(element, stages.h);  // the failed iteration left none
  return {Verdict::slip_reversed, element, contact, time, 0};
}

/// Contact whose force vanished at the left end of the element, or -1.
int PivotingSolver::just_broken(int element) const {
  const Switch end = switch_before(element);
  return end.kind == Switch::Kind::force_vanishes ? end.contact : -1;
}

Violation PivotingSolver::equal_elements(int first, int count, double h) {
  if (!regular_A_) {
    for (int i = 0; i < n_c_; ++i) {
      if (is_closed(step_->elements[first].modes[i])) return {Verdict::undetermined, first, i, 0, 0};
    }
  }
  for (int k = 0; k < count; ++k) {
    const int element = first + k;
    if (k > 0 && !start_solver_.carry_on(*step_, element, starts_[element]))
      return {Verdict::no_impulse, element, -1, 0, 0};
    first_guess(element, h);
    step_->ends[element].contact = -1;
    Element& stages = step_->elements[element];
    Violation violation;
    if (element_solver_.solve(stages) == ElementSolver::Result::converged)
      violation = check_element(element, true);
    else
      violation = after_failed_newton(element);
    if (violation.verdict != Verdict::fulfilled) {
      violation.element = element;
      violation.time += k * h;
      const bool stops_in_space =
          violation.verdict == Verdict::slip_reversed && stages.modes[violation.contact] == ContactMode::slip;
      if (stops_in_space && !elements_.tableau.is_stiffly_accurate()) violation.verdict = Verdict::no_right_stage;
      return violation;
    }
  }
  return {};
}

/// Equal elements of one active set, before a switch.
void PivotingSolver::prepare_run(int first, int count) {
  for (int k = 0; k < count; ++k) {
    step_->ends[first + k].contact = -1;
    if (k == 0) continue;
    step_->elements[first + k].modes = step_->elements[first].modes;
    step_->elements[first + k].facets = step_->elements[first].facets;
    step_->elements[first + k].slip_start.setZero();
  }
}

/// @param is_first  of a run: a contact may just have broken
Violation PivotingSolver::check_element(int element, bool is_first) {
  Element& stages = step_->elements[element];
  const int broken = is_first ? just_broken(element) : -1;
  Violation violation = sign_conditions_.check(stages, broken);
  const bool is_of_forces = violation.verdict == Verdict::force_negative || violation.verdict == Verdict::cone_left;
  // Of redundant contacts these were the smallest forces; others may be allowed.
  if (is_of_forces && elements_.is_redundant() && force_division_.into_cones(stages))
    violation = sign_conditions_.check(stages, broken);
  return violation.verdict == Verdict::fulfilled && gap_minima_ ? gap_minima_->check(stages) : violation;
}

Violation PivotingSolver::check_run(int first, int count) {
  for (int k = 0; k < count; ++k) {
    const Element& stages = step_->elements[first + k];
    if (k > 0) {
      step_->v_minus.col(first + k) = stages.v0;
      step_->Lambda_n.col(first + k).setZero();
      step_->Lambda_t.col(first + k).setZero();
    }
    Violation violation = check_element(first + k, k == 0);
    violation.time += k * stages.h;
    if (violation.verdict != Verdict::fulfilled) return violation;
  }
  return {};
}

/// The switch that a violation in the run from `first` on announces.
Switch PivotingSolver::switch_for(int first, const Violation& violation) {
  Switch end{explaining_switch(violation.verdict).value(), violation.contact};
  const ElementStart& start = starts_[first];
  const Element& stages = step_->elements[first];
  const auto has = [&](const std::vector<int>& contacts) {
    return std::find(contacts.begin(), contacts.end(), violation.contact) != contacts.end();
  };
  if (end.kind == Switch::Kind::gap_closes && has(start.touching)) {
    end.zeros_at_start = 1;
    problem_.gap(stages.q0.data(), gap_.data());
    end.left_gap = gap_[end.contact];
  }
  if (violation.condition >= 0)
    end.condition = polygon_.condition(stages.modes[end.contact], stages.facets[end.contact], violation.condition);
  const bool on_its_edge = end.kind == Switch::Kind::slip_turns &&
                           std::any_of(start.on_edge.begin(), start.on_edge.end(), [&](const auto& on) {
                             return on.contact == end.contact && on.edge == end.condition.facet;
                           });
  const bool is_of_slip = end.kind == Switch::Kind::slip_stops || end.kind == Switch::Kind::slip_turns;
  if (on_its_edge || (is_of_slip && has(start.from_rest))) {
    const Switch before = switch_before(first);
    const bool by_force =
        before.is(Switch::Kind::cone_reached, end.contact) || before.is(Switch::Kind::edge_left, end.contact);
    end.zeros_at_start = by_force ? 2 : 1;  // the acceleration is zero, too
  }
  return end;
}

/// Solves `count` equal elements up to the switch that the violation announces. When the solution shows another switch
/// before it, that one is taken instead.
bool PivotingSolver::run_to_switch(int first, int count, Violation violation, double remaining) {
  prepare_run(first, count);
  const std::span<Element> run(step_->elements.data() + first, static_cast<std::size_t>(count));
  for (int attempt = 0; attempt < 4; ++attempt) {
    if (++trials_ > max_trials()) return false;
    Switch end = switch_for(first, violation);
    // Interpolated from the left end, a first violation may seem to be there; a refuted root says more.
    run.front().h = std::clamp(violation.time, (attempt == 0 ? 1e-3 : 1e-12) * remaining, remaining) / count;

    if (!solve_run(first, count, end, remaining)) return false;
    const Violation other = check_run(first, count);
    if (other.verdict == Verdict::fulfilled) {
      step_->ends[first + count - 1] = end;
      return true;
    }
    if (!is_switch(other.verdict)) return false;
    violation = other;
  }
  return false;
}

/// SwitchSolver::solve, from other guesses when it fails.
bool PivotingSolver::solve_run(int first, int count, Switch& end, double remaining) {
  const std::span<Element> run(step_->elements.data() + first, static_cast<std::size_t>(count));
  const double max_h = remaining / count, guess = run.front().h;
  const auto converges = [&] {
    return switch_solver_.solve(run, end, max_h) == SwitchSolver::Result::converged;
  };
  const auto slides_beside = [&](int i) {
    const auto& contacts = problem_.info().contacts;
    return i != end.contact && run.front().modes[i] == ContactMode::slip &&
           contacts[i].support == contacts[end.contact].support;
  };
  if (end.kind == Switch::Kind::slip_stops && run.front().modes[end.contact] == ContactMode::slip &&
      std::ranges::any_of(problem_.info().unilateral, slides_beside)) {
    end.together = true;
    if (converges()) return true;
    end.together = false;
    for (int k = 0; k < count; ++k) first_guess(first + k, guess);
  }
  return converges() || (bracket_switch(first, count, end, remaining) && converges());
}

/// Solves `count` equal elements of given length; the switch of the violation happens at their end.
bool PivotingSolver::run_to_time(int first, int count, double h, const Violation& violation) {
  if (++trials_ > max_trials()) return false;
  if (equal_elements(first, count, h).verdict != Verdict::fulfilled) return false;
  step_->ends[first + count - 1] = {.kind = explaining_switch(violation.verdict).value(), .contact = violation.contact};
  return true;
}

/// First guess for a switch that Newton's method did not find: the first sign change of the switch function over the
/// lengths of the run, then regula falsi (Illinois variant). Leaves the run solved for that length.
bool PivotingSolver::bracket_switch(int first, int count, const Switch& end, double remaining) {
  const auto value = [&](double h) {
    for (int k = 0; k < count; ++k) {
      if (k > 0 && !start_solver_.carry_on(*step_, first + k, starts_[first + k]))
        return std::numeric_limits<double>::quiet_NaN();
      first_guess(first + k, h);
      if (element_solver_.solve(step_->elements[first + k]) != ElementSolver::Result::converged)
        return std::numeric_limits<double>::quiet_NaN();
    }
    return switch_solver_.function().value(step_->elements[first + count - 1], end) / std::pow(h, end.zeros_at_start);
  };
  if (properties(end.kind).needs_force && elements_.tableau.right_end.size() == 0) return false;
  // Slip in space has no solution behind the switch that could bracket it.
  if (step_->elements[first].modes[end.contact] == ContactMode::slip) return false;

  double low = 0, high = 0, at_low = 0, at_high = 0;
  bool found = false;
  for (int part = 1; part <= kBracketSamples && !found; ++part) {
    low = high;
    at_low = at_high;
    high = remaining / count * part / kBracketSamples;
    at_high = value(high);
    found = part > 1 ? at_low > 0 && at_high <= 0 : at_high <= 0 && end.kind == Switch::Kind::gap_closes;
    if (part == 1 && found) {  // the gap at length zero is the one at the left end; deflated, some positive number
      problem_.gap(step_->elements[first].q0.data(), gap_.data());
      at_low = end.zeros_at_start > 0 ? std::abs(at_high) : gap_[end.contact];
    }
  }
  if (!found) return false;
  for (int iteration = 0; iteration < 60 && high - low > 1e-12 * high; ++iteration) {
    const double h = at_low > 0 ? (low * at_high - high * at_low) / (at_high - at_low) : 0.5 * (low + high);
    const double at_h = value(h);
    if (std::isnan(at_h)) return false;
    if (at_h > 0) {
      low = h;
      at_low = at_h;
      at_high /= 2;
    } else {
      high = h;
      at_high = at_h;
      at_low /= 2;
    }
    if (at_h == 0) break;
  }
  return !std::isnan(value(high));
}

void PivotingSolver::note_failure(const Violation& violation, double h, int count) {
  if (first_failure_.violation.verdict == Verdict::fulfilled) first_failure_ = {violation, h, count};
  const bool is_deeper = deepest_failure_.violation.verdict == Verdict::fulfilled ||
                         violation.element - count > deepest_failure_.violation.element - deepest_failure_.count;
  if (is_deeper) deepest_failure_ = {violation, h, count};
}

std::string PivotingSolver::describe(const Failure& failure) const {
  const Violation& v = failure.violation;
  const std::string contact =
      v.contact < 0 ? "a contact" : "contact '" + problem_.info().contacts[v.contact].name + "'";
  const std::string where =
      fmt::format("in element {} of {} equal ones of {:.6g} s", v.element + 1, failure.count, failure.h);
  switch (v.verdict) {
    case Verdict::gap_negative:
      return fmt::format("{} would penetrate to a gap of {:.3g} m {}", contact, v.value, where);
    case Verdict::force_negative:
      return fmt::format("{} would pull with {:.3g} N {}", contact, v.value, where);
    case Verdict::drifts:
      return fmt::format(
          "{} stays closed, but tableau {} has no stage at the right end and drifts to a gap or slip velocity of "
          "{:.3g} "
          "there {}: a curved persistent contact needs a stiffly accurate tableau",
          contact, elements_.tableau.name, v.value, where);
    case Verdict::undetermined:
      return fmt::format("{} stays closed, but the matrix A of tableau {} is singular and does not determine its force",
                         contact, elements_.tableau.name);
    case Verdict::cone_left:
      return fmt::format("{} would stick with {:.3g} N more than its friction cone has {}", contact, -v.value, where);
    case Verdict::slip_reversed:
      return fmt::format("{} would slip back with {:.3g} m/s {}", contact, -v.value, where);
    case Verdict::slip_turned:
      return fmt::format("{} would slip with {:.3g} m/s past an edge of its friction polygon {}", contact, -v.value,
                         where);
    case Verdict::edge_left:
      return fmt::format("{} would slip with {:.3g} N beyond an edge of its friction polygon {}", contact, -v.value,
                         where);
    case Verdict::accumulates:
      return fmt::format(
          "the impacts of {} accumulate, it bounces no higher than its gap is known; tableau {} has no stage at the "
          "right "
          "end that could stop it",
          contact, elements_.tableau.name);
    case Verdict::impacts_accumulate:
      return fmt::format("impacts of {} and its neighbours follow each other at one instant without an end", contact);
    case Verdict::no_right_stage:
      return fmt::format(
          "{} comes to rest, but tableau {} has no stage at the right end where both components of its slip velocity "
          "could vanish: slip in space that stops needs a stiffly accurate tableau",
          contact, elements_.tableau.name);
    case Verdict::newton_failed:
      return fmt::format("Newton's method on the stage equations did not converge {}", where);
    case Verdict::no_impulse:
      return fmt::format(
          "the impact law at {} has no solution: M(q) is not positive definite or the contact problem is degenerate",
          contact);
    case Verdict::no_forces:
      return fmt::format(
          "the contact forces at {} are inconsistent: no active set of the touching contacts fulfils the contact laws "
          "(Painleve)",
          contact);
    case Verdict::indeterminate:
      return fmt::format(
          "the contact forces at {} are indeterminate: it may open, and as well press itself against the surface it "
          "slides on (Painleve)",
          contact);
    case Verdict::fulfilled:
      break;
  }
  return "";
}

bool PivotingSolver::depends_on_length() const {
  switch (first_failure_.violation.verdict) {
    case Verdict::no_impulse:
    case Verdict::no_forces:
    case Verdict::indeterminate:
    case Verdict::accumulates:
    case Verdict::impacts_accumulate:
      return false;
    case Verdict::fulfilled:
    case Verdict::gap_negative:
    case Verdict::force_negative:
    case Verdict::cone_left:
    case Verdict::slip_reversed:
    case Verdict::slip_turned:
    case Verdict::edge_left:
    case Verdict::drifts:
    case Verdict::undetermined:
    case Verdict::no_right_stage:
    case Verdict::newton_failed:
      return true;
  }
  return true;
}

bool PivotingSolver::more_elements_may_help() const {
  return !options_.as_needed && is_switch(first_failure_.violation.verdict);
}

std::string PivotingSolver::failure_message() const {
  if (!depends_on_length()) return describe(first_failure_);
  std::string message = fmt::format(
      "no solution with {}: {}",
      options_.as_needed ? fmt::format("up to {} elements", capacity_) : fmt::format("N_FE = {}", options_.n_fe),
      describe(first_failure_));
  const Violation &first = first_failure_.violation, &deepest = deepest_failure_.violation;
  if (deepest.element != first.element || deepest.verdict != first.verdict) {
    message += fmt::format("; with a switch before it, {}", describe(deepest_failure_));
  }
  if (first.verdict == Verdict::cone_left) {
    const Element& stages = step_->elements[static_cast<std::size_t>(first.element)];
    const auto open = contacts_of_open_motion(problem_, stages.q0, stages.v0, stages.modes);
    if (!open.empty())
      message += fmt::format(
          "; Coulomb's law leaves the motion open there, contacts '{}' may share their forces in ways "
          "that move the bodies differently",
          fmt::join(open, "', '"));
  }
  return message + fmt::format(" ({} predictions)", trials_);
}

}  // namespace ricochet
