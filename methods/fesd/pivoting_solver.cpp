#include "methods/fesd/pivoting_solver.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "methods/fesd/element_run.h"
#include "methods/fesd/explicit_run.h"

namespace ricochet {
namespace {

// Predictions tried in one step before the search gives up, per element.
constexpr int kMaxPredictions = 100;
// The search for the earliest switching time: samples from which on it bisects, to a relative 1e-12.
constexpr int kSwitchSamples = 16;
constexpr int kBisections = 40;

// Longest length, as a part of the end time, that rounding scales are based on: an explicit step may span the run.
constexpr double kLongestScaled = 0.1;

using Alternatives = std::vector<ElementStart::Alternative>;

bool takes(unsigned set, std::size_t k) {
  return (set >> k & 1U) != 0;
}

/// Numbers of the sets (kMaxCombined) that are tried.
unsigned combinations(const Alternatives& alternatives) {
  return 1U << std::min(alternatives.size(), kMaxCombined);
}

/// Whether a set of alternatives closes bounces and does nothing else.
bool only_closes(const Alternatives& alternatives, unsigned set) {
  for (std::size_t k = 0; k < std::min(alternatives.size(), kMaxAlternatives); ++k) {
    if (takes(set, k) && !alternatives[k].bounced()) return false;
  }
  return true;
}

/// The bounces without loss, which are not closed: the error of a capture has no bound there ((4) of capture.h).
unsigned elastic_bounces(const Alternatives& alternatives, const ProblemInfo& info) {
  unsigned set = 0;
  for (std::size_t k = 0; k < std::min(alternatives.size(), kMaxAlternatives); ++k) {
    const auto& alternative = alternatives[k];
    if (alternative.bounced() && alternative.is_struck && info.contacts[alternative.contact].is_elastic())
      set |= 1U << k;
  }
  return set;
}

/// The largest normal velocity after a bounce that the set closes.
double fastest_closed(const Alternatives& alternatives, unsigned set) {
  double speed = 0;
  for (std::size_t k = 0; k < std::min(alternatives.size(), kMaxAlternatives); ++k) {
    if (takes(set, k) && alternatives[k].bounced()) speed = std::max(speed, alternatives[k].v_n);
  }
  return speed;
}

StepFailure::Kind failure_of(ElementStartSolver::Result result) {
  switch (result) {
    case ElementStartSolver::Result::done:
      return StepFailure::Kind::none;
    case ElementStartSolver::Result::no_impulse:
      return StepFailure::Kind::no_impulse;
    case ElementStartSolver::Result::no_forces:
      return StepFailure::Kind::no_forces;
    case ElementStartSolver::Result::indeterminate:
      return StepFailure::Kind::indeterminate;
    case ElementStartSolver::Result::accumulates:
      return StepFailure::Kind::impacts_accumulate;
  }
  return StepFailure::Kind::none;
}

/// The k-th number of a sequence that moves away from a middle one: middle, middle - 1, middle + 1, ...
int kth_nearest(int middle, int k) {
  return middle + (k % 2 ? -(k + 1) / 2 : k / 2);
}

}  // namespace

PivotingSolver::PivotingSolver(const Problem& problem, const ButcherTableau& tableau, const Options& options,
                               Counters& counters)
    : problem_(problem),
      tableau_(tableau),
      options_(options),
      counters_(counters),
      closing_stops_(tableau.is_stiffly_accurate() || tableau.holds_accelerations),
      capacity_(options.as_needed ? std::max(options.n_fe, options.max_elements) : options.n_fe),
      scales_(problem),
      buffers_(problem, tableau.n_s, options.n_fe),
      start_solver_(problem, tableau_, FrictionPolygon(options.facets), scales_, counters),
      budget_(kMaxPredictions * options.n_fe) {
  if (options.pair) {
    runs_ = std::make_unique<ExplicitRunSolver>(problem, *options.pair, scales_, buffers_, counters);
    return;
  }
  const ElementRunSolver::Options of_runs{.tolerance = options.tolerance,
                                          .polygon = FrictionPolygon(options.facets),
                                          .gap_tolerance = options.gap_tolerance,
                                          .between_stages = options.between_stages};
  runs_ = std::make_unique<ElementRunSolver>(problem, tableau_, of_runs, scales_, start_solver_, buffers_, counters);
}

void PivotingSolver::start(const Vector& q, const Vector& v) {
  scales_.restart();
  runs_->restart();
  start_solver_.restart(captures_);
  buffers_.restart(q, v);
}

void PivotingSolver::begin_step(double H) {
  if (step().n_elements > 0) start_solver_.accept();
  buffers_.begin_step(H, options_.n_fe);
  runs_->begin_step();
  const FesdStep& step = buffers_.step();
  const double length = options_.pair ? std::min(H, kLongestScaled * problem_.info().end_time) : H;
  scales_.begin_step(step.elements[0].q0.data(), &step.v_minus(0, 0), length, !buffers_.previous());
  budget_ = SearchBudget(kMaxPredictions * options_.n_fe);
  longest_ = 0;
  if (failures_.first) failures_ = {};
}

Status PivotingSolver::finish_step(bool is_solved) {
  if (is_solved) {
    counters_.elements += step().n_elements;
    ++counters_.steps;
    return Status::success;
  }
  buffers_.drop();
  using Kind = StepFailure::Kind;
  const Kind kind = failure().kind;
  if (kind == Kind::accumulates || kind == Kind::impacts_accumulate) return Status::step_limit;
  return kind == Kind::newton_failed || kind == Kind::no_motion || !failure().depends_on_length()
             ? Status::inner_solver_failed
             : Status::infeasible;
}

Status PivotingSolver::advance(double H) {
  begin_step(H);
  bool is_solved = false;
  if (options_.equal_runs) {
    has_equal_runs_ = true;
    is_solved = search(0, H, options_.n_fe);
    has_equal_runs_ = false;
    if (!is_solved) budget_ = SearchBudget(kMaxPredictions * options_.n_fe);
  }
  if (!is_solved) is_solved = search(0, H, options_.n_fe);
  if (!is_solved && options_.as_needed) {
    budget_ = SearchBudget(kMaxPredictions * capacity_);
    longest_ = H / options_.n_fe;
    is_solved = search(0, H, 0);
  }
  return finish_step(is_solved);
}

int PivotingSolver::skip_steps(double H, int n) {
  FesdStep& step = buffers_.step();
  if (n <= 0 || step.n_elements == 0 || step.ends[step.n_elements - 1].contact >= 0) return 0;
  const std::int64_t elements = runs_->skip_elements(step.elements[step.n_elements - 1], H / options_.n_fe,
                                                     std::int64_t{n} * options_.n_fe, options_.n_fe);
  const auto steps = static_cast<int>(elements / options_.n_fe);
  counters_.elements += elements;
  counters_.inner_iterations += elements;
  counters_.linear_solves += elements;
  counters_.steps += steps;
  return steps;
}

PivotingSolver::ElementStep PivotingSolver::advance_to_switch(double H, double rest_speed,
                                                              const std::function<bool(const Element&)>& is_accurate) {
  begin_step(H);
  buffers_.make_room(2);  // for what is known of the next step
  const auto closed = solve_one_element(H, rest_speed, is_accurate);
  return {finish_step(closed.has_value()), closed.value_or(ClosedBounces{})};
}

void PivotingSolver::reject() {
  counters_.elements -= step().n_elements;
  --counters_.steps;
  buffers_.drop();
}

std::optional<PivotingSolver::ClosedBounces> PivotingSolver::solve_one_element(
    double H, double rest_speed, const std::function<bool(const Element&)>& is_accurate) {
  if (!begin_element(0)) return std::nullopt;
  FesdStep& step = buffers_.step();
  const auto& alternatives = buffers_.start_of(0).alternatives;
  unsigned slow = 0, too_fast = 0;  // bounces that are closed first, and those whose velocity would be an error
  unsigned together = 0;            // slow ones that the load presses only if others are closed, too
  for (std::size_t k = 0; k < std::min(alternatives.size(), captures_ ? kMaxAlternatives : kMaxCombined); ++k) {
    if (!alternatives[k].bounced()) continue;
    if (alternatives[k].v_n > rest_speed)
      too_fast |= 1U << k;
    else if (start_solver_.is_pressed(step.elements[0], alternatives[k].contact))
      slow |= 1U << k;
    else
      together |= 1U << k;
  }
  if (captures_ && together != 0) slow |= pressed_together(slow | together);
  bool is_unresolved = false;  // the flight predicted is lower than positions are known
  for (unsigned trial = 0; trial < combinations(alternatives); ++trial) {
    const unsigned set = trial ^ slow;
    if (!is_unresolved && (set & too_fast) != 0) continue;
    if (!propose_modes(0, set)) continue;
    const ClosedBounces closed{.throughout = (slow != 0 && trial == 0) || is_unresolved,
                               .speed = fastest_closed(alternatives, set)};
    const StepFailure failure = runs_->equal_elements(0, 1, H);
    step.n_elements = 1;
    if (!failure) {
      step.H = step.elements[0].h;
      return closed;
    }
    failures_.note(failure);
    if (closed.throughout || !failure.announces_switch()) continue;
    if (!is_accurate(step.elements[0])) return closed;
    if (options_.pair && is_flight_of_rounding(failure.violation)) {
      is_unresolved = true;
      continue;
    }
    if (!runs_->run_to_switch(0, 1, failure.violation, H, budget_)) continue;
    is_unresolved = first_unresolved_flight(0, 1) >= 0;
    if (!is_unresolved) {
      step.H = step.elements[0].h;
      return closed;
    }
    if (closing_stops_) continue;
    // Closing would not stop the bounces.
    const StepFailure accumulation{
        .kind = StepFailure::Kind::accumulates, .violation = {.contact = step.ends[0].contact}, .h = H, .count = 1};
    failures_ = {.first = accumulation, .deepest = accumulation};
    return std::nullopt;
  }
  return std::nullopt;
}

/// Whether a contact closes where the element begins, after a bounce: its flight is nowhere above rounding.
bool PivotingSolver::is_flight_of_rounding(const Violation& violation) const {
  const auto& alternatives = buffers_.start_of(0).alternatives;
  return violation.is_past(SwitchKind::gap_closes) && violation.time == 0 &&
         std::ranges::any_of(alternatives,
                             [&](const auto& a) { return a.bounced() && a.contact == violation.contact; });
}

/// The bounces of a set that the load presses when all of them are closed.
unsigned PivotingSolver::pressed_together(unsigned set) {
  if (start_solver_.close_instead(left_end(0), set) != ElementStartSolver::Result::done) return 0;
  const auto& alternatives = buffers_.start_of(0).alternatives;
  for (std::size_t k = 0; k < std::min(alternatives.size(), kMaxAlternatives); ++k) {
    if (takes(set, k) && !is_closed(buffers_.element(0).modes[alternatives[k].contact])) set &= ~(1U << k);
  }
  return set;
}

/// Number of equal elements for the remaining time: what is left of N_FE, or as many as longest_ asks for. 0 when there
/// would be too many.
int PivotingSolver::elements_for(int element, double remaining, int elements_left) const {
  if (has_equal_runs_) return element + options_.n_fe <= capacity_ ? options_.n_fe : 0;
  if (longest_ == 0) return elements_left;
  const int wanted = std::max(1, static_cast<int>(std::ceil(remaining / longest_ * (1 - 1e-9))));
  return element + wanted <= capacity_ ? wanted : 0;
}

/// Solves the step from an element on, whose q0 and column of v_minus are known.
bool PivotingSolver::search(int element, double remaining, int elements_left) {
  const int count = elements_for(element, remaining, elements_left);
  if (count == 0) return false;
  buffers_.make_room(std::min(element + count + 1, capacity_));
  if (!begin_element(element)) return false;  // (a)
  bool is_right = false;  // the prediction of the modes: where elements can be added, only bounces may still be closed
  unsigned trial = 0, n_counted = 0,
           not_closed = elastic_bounces(buffers_.start_of(element).alternatives, problem_.info());
  while (n_counted < combinations(buffers_.start_of(element).alternatives)) {
    Attempt attempt;
    if ((trial & not_closed) != 0) {
      attempt.outcome = Outcome::refuted;
    } else if (!is_right || !options_.as_needed || only_closes(buffers_.start_of(element).alternatives, trial)) {
      if (!budget_.spend()) return false;
      attempt = try_modes(element, trial, count, remaining);
    }
    if (attempt.outcome == Outcome::solved) return true;
    if (trial == 0 && attempt.outcome == Outcome::reached_the_switch) is_right = true;
    // A flight that cannot be seen is closed before other sets are counted.
    const auto k = static_cast<std::size_t>(attempt.alternative);
    if (attempt.outcome == Outcome::flight_unresolved && k < kMaxAlternatives) not_closed &= ~(1U << k);
    const bool closes = attempt.outcome == Outcome::flight_unresolved && k < kMaxAlternatives && !takes(trial, k);
    trial = closes ? trial | 1U << k : ++n_counted;  // (f)
  }
  return false;
}

/// (b)-(e) with `count` equal elements and a set of alternatives.
PivotingSolver::Attempt PivotingSolver::try_modes(int element, unsigned trial, int count, double remaining) {
  if (!propose_modes(element, trial)) return {Outcome::refuted};
  const StepFailure failure = runs_->equal_elements(element, count, remaining / count);
  if (!failure) {
    buffers_.step().n_elements = element + count;
    return {Outcome::solved};
  }
  failures_.note(failure);
  if (!failure.announces_switch()) return {Outcome::refuted};
  return split_at_switch(element, count, failure.violation, remaining);
}

/// (d), (e): lets a switch follow some of the `count` elements, and solves what remains.
PivotingSolver::Attempt PivotingSolver::split_at_switch(int element, int count, const Violation& violation,
                                                        double remaining) {
  // A switch may be preceded by all but one of the elements; by all of them when there may be more.
  const int most_before = longest_ == 0 && !has_equal_runs_ ? count - 1 : count;
  const int most = std::min(most_before, capacity_ - 1 - element);
  const double h = remaining / count;
  const int nearest = has_equal_runs_
                          ? count
                          : std::clamp(static_cast<int>(std::lround(violation.time / h)), 1, std::max(1, most_before));
  const bool is_of_forces =
      violation.is_past(SwitchKind::force_vanishes) || violation.is_past(SwitchKind::cone_reached);
  const bool may_float = options_.switches != Switches::pinned && is_of_forces;

  Attempt attempt;
  const bool may_be_pinned = !may_float || options_.switches == Switches::published;
  const int n_attempts = has_equal_runs_ ? 1 : 2 * count;
  for (int k = 0; k < n_attempts && may_be_pinned; ++k) {
    const int m = kth_nearest(nearest, k);
    if (m < 1 || m > most) continue;
    const Attempt with_m = run_and_continue(element, m, count, violation, remaining);
    if (with_m.outcome == Outcome::solved) return with_m;
    if (with_m.outcome != Outcome::refuted) attempt = with_m;
    if (with_m.outcome == Outcome::flight_unresolved) break;  // other m resolve it as little
  }
  for (int k = 0; k < 2 * count && may_float; ++k) {
    const int m = kth_nearest(nearest, k);
    if (m >= 1 && m <= most && split_unpinned(element, m, count, violation, remaining)) return {Outcome::solved};
  }
  return attempt;
}

/// (d), (e) with m elements before the switch.
PivotingSolver::Attempt PivotingSolver::run_and_continue(int element, int m, int count, const Violation& violation,
                                                         double remaining) {
  if (!runs_->run_to_switch(element, m, violation, remaining, budget_)) return {Outcome::refuted};
  // Closing stops a bounce that cannot be seen.
  int flight = closing_stops_ ? first_unresolved_flight(element, m) : -1;
  if (flight < 0 && options_.as_needed) flight = offer_to_stay(element, m);
  if (flight >= 0) return {Outcome::flight_unresolved, flight};
  return {continue_after(element, m, remaining, count) ? Outcome::solved : Outcome::reached_the_switch};
}

/// (d), (e) with a switch at some time that the published equations admit: the latest, which is nearest to the truth,
/// or the earliest.
bool PivotingSolver::split_unpinned(int element, int m, int count, const Violation& violation, double remaining) {
  const auto is_feasible = [&](double h) {
    return runs_->run_to_time(element, m, h, violation.passed, violation.contact, budget_) &&
           continue_after(element, m, remaining, count);
  };
  const double longest = remaining / m;
  double feasible = 0, infeasible = 0;
  if (options_.switches == Switches::published_earliest &&
      runs_->run_to_switch(element, m, violation, remaining, budget_) && continue_after(element, m, remaining, count)) {
    feasible = step().elements[element].h;  // the pinned one
  }
  for (int part = kSwitchSamples - 1; part > 0 && feasible == 0; --part) {
    if (is_feasible(longest * part / kSwitchSamples)) feasible = longest * part / kSwitchSamples;
  }
  if (feasible == 0) return false;
  if (options_.switches == Switches::published) return true;
  for (int halving = 0; halving < kBisections; ++halving) {
    budget_.renew();
    const double middle = 0.5 * (feasible + infeasible);
    (is_feasible(middle) ? feasible : infeasible) = middle;
  }
  return is_feasible(feasible);
}

/// (e): searches the rest of the step after m elements that are solved.
bool PivotingSolver::continue_after(int element, int m, double remaining, int elements_left) {
  FesdStep& step = buffers_.step();
  const double rest = remaining - m * step.elements[element].h;
  if (rest <= 0) return false;
  const int next = element + m;
  step.elements[next].q0 = step.elements[next - 1].q1;
  step.v_minus.col(next) = step.elements[next - 1].v1;
  return search(next, rest, elements_left - m);
}

LeftEnd PivotingSolver::left_end(int element) {
  const Switch end = buffers_.switch_before(element);
  const bool within_step = element > 0 || end.contact >= 0;
  return {buffers_.step(), element, buffers_.left_of(element), end, within_step, buffers_.start_of(element)};
}

/// (a): impulse, modes and alternatives.
bool PivotingSolver::begin_element(int element) {
  const LeftEnd at = left_end(element);
  const auto result = start_solver_.begin(at);
  if (result == ElementStartSolver::Result::done) return true;
  const StepFailure failure{.kind = failure_of(result),
                            .violation = {.contact = at.start.failed_contact},
                            .element = element,
                            .h = 0,
                            .count = 1};
  failures_.note(failure);
  // Thousands of impacts, and no other division of the step changes what happens at this instant.
  if (failure.kind == StepFailure::Kind::impacts_accumulate) budget_.exhaust();
  return false;
}

/// The prediction with a set of alternatives instead. False when the contact laws have no solution with them.
bool PivotingSolver::propose_modes(int element, unsigned trial) {
  ElementStart& start = buffers_.start_of(element);
  Element& stages = buffers_.element(element);
  const auto n = std::min(start.alternatives.size(), kMaxAlternatives);
  unsigned closed_instead = 0;
  for (std::size_t k = 0; k < n; ++k)
    closed_instead |= start.alternatives[k].bounced() && !start.alternatives[k].is_pulled ? trial & 1U << k : 0;
  if ((closed_instead != 0 || start.closed_instead != 0) &&
      start_solver_.close_instead(left_end(element), closed_instead) != ElementStartSolver::Result::done)
    return false;
  for (std::size_t k = 0; k < n; ++k) {
    const auto& alternative = start.alternatives[k];
    const int i = alternative.contact;
    const bool differs = takes(trial, k);
    // A contact that is closed instead of bouncing may be one that the load would open.
    if (differs ? alternative.bounced() && is_closed(stages.modes[i]) : closed_instead != 0) continue;
    // The load opens it: nothing would take away the velocity of its bounce.
    if (differs && alternative.bounced() && tableau_.holds_accelerations) return false;
    stages.modes[i] = differs ? alternative.mode : alternative.predicted;
    if (!stages.facets.empty()) stages.facets[i] = differs ? alternative.facet : alternative.predicted_facet;
  }
  return true;
}

/// The `count` elements are the flight of a contact that bounced no higher than rounding of its gap: which of the
/// alternatives of their start, or -1.
int PivotingSolver::first_unresolved_flight(int first, int count) const {
  const Element& flight = buffers_.element(first);
  const auto& alternatives = buffers_.start_of(first).alternatives;
  const auto found = std::find_if(alternatives.begin(), alternatives.end(), [&](const auto& alternative) {
    const int i = alternative.contact;
    return alternative.bounced() && flight.modes[i] == ContactMode::open &&
           step().ends[first + count - 1].contact == i &&
           0.25 * alternative.v_n * count * flight.h <= scales_.touching(i);
  });
  return found == alternatives.end() ? -1 : static_cast<int>(found - alternatives.begin());
}

/// The `count` elements are the flight of a contact that the load opened, not a bounce, and that closes before its gap is
/// more than rounding: the load of an instant says open, and the stages of an element, which see what comes after it,
/// penetrate. That it stays closed becomes an alternative. @return its number, or -1
int PivotingSolver::offer_to_stay(int first, int count) {
  ElementStart& start = buffers_.start_of(first);
  const Switch& end = step().ends[first + count - 1];
  const int i = end.contact;
  const auto closed = std::ranges::find(start.closed, i, &ImpactSolver::ClosedContact::contact);
  if (end.kind != SwitchKind::gap_closes || closed == start.closed.end()) return -1;
  if (is_closed(buffers_.element(first).modes[i]) || start.alternatives.size() >= kMaxAlternatives) return -1;
  for (int k = first; k < first + count; ++k) {
    const Element& flight = buffers_.element(k);
    for (Eigen::Index j = 0; j < flight.q.cols(); ++j) {
      if (problem_.gap(flight.q.col(j))[i] > scales_.nearly_touching(i)) return -1;
    }
  }
  const auto offered = std::ranges::find_if(start.alternatives,
                                            [&](const auto& other) { return other.contact == i && other.is_pulled; });
  const auto number = static_cast<int>(offered - start.alternatives.begin());
  if (offered == start.alternatives.end())
    start.alternatives.push_back({.contact = i,
                                  .mode = start_solver_.continued_mode(*closed),
                                  .facet = closed->facet,
                                  .closed = *closed,
                                  .is_pulled = true});
  return number;
}

bool PivotingSolver::more_elements_may_help() const {
  return !options_.as_needed && failure().announces_switch();
}

std::string PivotingSolver::failure_message() const {
  const std::string elements =
      options_.as_needed ? fmt::format("up to {} elements", capacity_) : fmt::format("N_FE = {}", options_.n_fe);
  return describe(failures_, problem_, tableau_.name, step(), elements, budget_.spent());
}

}  // namespace ricochet
