#include "methods/fesd/element_run.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "problems/dense_solve.h"
#include "problems/packed_column.h"

namespace ricochet {
namespace {

// Switches that may be found before the one announced, in turn.
constexpr int kMaxSwitchesInTurn = 4;
// Shortest guesses of a run, as part of the time that remains: interpolated from the left end, a first violation may
// seem to be there; a refuted root says more.
constexpr double kShortestGuess = 1e-3, kShortestRefutation = 1e-12;
// Lengths at which a switch function is sampled when Newton's method misses its root.
constexpr int kBracketSamples = 16;
// Steps of the regula falsi after them, and the relative width at which it ends.
constexpr int kMaxBracketSteps = 60;
constexpr double kBracketWidth = 1e-12;
// Lengths of the element before that its stage polynomials are continued over.
constexpr double kLongestContinuation = 2;
// A gap that closes with a rate above this part of its terms opens: more than rounding, and than a graze.
constexpr double kOpening = 1e-6;
// Maps that are kept: of a few mode sets, with two lengths each.
constexpr std::size_t kMaxMaps = 12;
// Making a map takes as long as so many elements per column of it.
constexpr std::int64_t kWorthAColumn = 8;

}  // namespace

ElementRunSolver::ElementRunSolver(const Problem& problem, const ButcherTableau& tableau, const Options& options,
                                   ContactScales& scales, ElementStartSolver& start_solver, StepBuffers& buffers,
                                   Counters& counters)
    : problem_(problem),
      tableau_(tableau),
      polygon_(options.polygon),
      scales_(scales),
      buffers_(buffers),
      start_solver_(start_solver),
      elements_(problem, tableau, counters, polygon_),
      element_solver_(elements_, options.tolerance),
      switch_solver_(elements_, options.tolerance),
      sign_conditions_(problem, tableau, polygon_, scales, options.gap_tolerance),
      force_division_(problem),
      regular_A_(is_invertible(tableau.A)) {
  gap_.setZero(problem.n_c());
  scratch_.resize(problem.info(), tableau.n_s);
  for (Vector* state : {&x_, &group_start_, &largest_}) state->setZero(2 * problem.n_q());
  J_n_.resize(problem.info().n_normal_entries);
  J_t_.resize(problem.info().n_tangent_entries);
  if (!options.between_stages) return;
  gaps_between_.emplace(problem, tableau, scales);
  loads_between_.emplace(problem, tableau, scales);
}

std::span<Element> ElementRunSolver::run(int first, int count) {
  return {&buffers_.element(first), static_cast<std::size_t>(count)};
}

void ElementRunSolver::first_guess(int element, double h) {
  Element& stages = buffers_.element(element);
  const Element* left = buffers_.left_of(element);
  const ElementStart& start = buffers_.start_of(element);
  stages.h = h;
  elements_.set_active(stages);
  if (elements_.affine()) return;  // the closed form needs none
  const bool has_impulse = !start.touching.empty() && !buffers_.step().Lambda_n.col(element).isZero(0);
  const bool goes_on = left && left->modes == stages.modes && left->facets == stages.facets && !has_impulse;
  if (goes_on && h <= kLongestContinuation * left->h) {
    if (left->h == h) {
      elements_.tableau.extrapolate(*left, stages);
    } else {
      elements_.tableau.continue_stages(*left, 1, h / left->h, stages);
      const auto& right_end = elements_.tableau.right_end;
      if (start.has_forces && right_end.size() > 0) {  // more accurate than what the stages say of this instant
        const auto begin_with = [&](Matrix& values, const Vector& at_start, const Matrix& before, Vector& change) {
          change.noalias() = at_start - before.lazyProduct(right_end);
          values.colwise() += change;
        };
        begin_with(stages.a, start.acceleration, left->a, scratch_.v1);
        begin_with(stages.lambda_n, start.lambda_n, left->lambda_n, scratch_.end_lambda_n);
        begin_with(stages.lambda_t, start.lambda_t, left->lambda_t, scratch_.end_lambda_t);
      }
    }
  } else if (start.has_forces) {
    stages.a.colwise() = start.acceleration;
    stages.lambda_n.colwise() = start.lambda_n;
    stages.lambda_t.colwise() = start.lambda_t;
  } else {
    // Accelerations are continuous where a contact opens, and rarely change their size where one bounces.
    if (left && elements_.tableau.right_end.size() > 0)
      scratch_.v1.noalias() = left->a.lazyProduct(elements_.tableau.right_end);
    else
      scratch_.v1.setZero();
    stages.a.colwise() = scratch_.v1;
    stages.lambda_n.setZero();
    stages.lambda_t.setZero();
  }
}

/// First guesses for `count` elements of another length, from those that a run of length `before` was solved with up to
/// `solved` of them.
void ElementRunSolver::stretch(int first, int count, int solved, double before, double h) {
  elements_.set_active(buffers_.element(first));
  if (elements_.affine()) return;
  for (int k = count - 1; k >= 0; --k) {
    const int from = std::min(k, solved - 1);
    const Element& source = buffers_.element(first + from);
    scratch_.a = source.a;
    scratch_.lambda_n = source.lambda_n;
    scratch_.lambda_t = source.lambda_t;
    elements_.tableau.continue_stages(scratch_, k * h / before - from, h / before, buffers_.element(first + k));
  }
}

/// Contact whose force vanished at the left end of the element, or -1.
int ElementRunSolver::just_broken(int element) const {
  const Switch end = buffers_.switch_before(element);
  return end.kind == SwitchKind::force_vanishes ? end.contact : -1;
}

/// @param is_first  of a run: a contact may just have broken
Violation ElementRunSolver::check_element(int element, bool is_first) {
  Element& stages = buffers_.element(element);
  const int broken = is_first ? just_broken(element) : -1;
  const std::span<const int> unloaded = is_first ? buffers_.start_of(element).unloaded : std::span<const int>();
  const std::span<const char> sinks = is_first ? buffers_.start_of(element).sinks : std::span<const char>();
  Violation violation = sign_conditions_.check(stages, broken, unloaded, sinks);
  const bool is_of_forces =
      violation.is_past(SwitchKind::force_vanishes) || violation.is_past(SwitchKind::cone_reached);
  // For redundant contacts these were the smallest forces; others may be admissible.
  if (is_of_forces && elements_.is_redundant() && force_division_.into_cones(stages))
    violation = sign_conditions_.check(stages, broken, unloaded, sinks);
  if (violation || !gaps_between_) return violation;
  violation = gaps_between_->check(stages, unloaded, sinks);
  const Violation of_load = loads_between_->check(stages);
  return of_load && (!violation || of_load.time < violation.time) ? of_load : violation;
}

/// Slip in space that would have to turn back leaves Newton's method without a solution: the contact comes to rest
/// before.
Violation ElementRunSolver::after_failed_newton(int element) {
  const Element& stages = buffers_.element(element);
  const bool slips_in_space =
      std::find(stages.modes.begin(), stages.modes.end(), ContactMode::slip) != stages.modes.end();
  double time = 0;
  const int contact = slips_in_space ? start_solver_.first_to_stop(stages, time) : -1;
  if (contact < 0) return {};
  first_guess(element, stages.h);  // the failed iteration left none
  return {.kind = Violation::Kind::past_switch, .passed = SwitchKind::slip_stops, .contact = contact, .time = time};
}

/// One element of given length; what the failure says of the run is left to equal_elements().
StepFailure ElementRunSolver::solve_element(int element) {
  using Kind = StepFailure::Kind;
  const Element& stages = buffers_.element(element);
  const bool is_solved = element_solver_.solve(buffers_.element(element)) == ElementSolver::Result::converged;
  const Violation violation = is_solved ? check_element(element, true) : after_failed_newton(element);
  if (!violation) return {.kind = is_solved ? Kind::none : Kind::newton_failed, .violation = {}};
  const bool stops_in_space =
      violation.is_past(SwitchKind::slip_stops) && stages.modes[violation.contact] == ContactMode::slip;
  if (stops_in_space && !tableau_.is_stiffly_accurate())
    return {.kind = Kind::no_right_stage, .violation = {.contact = violation.contact}};
  return {.kind = Kind::sign_condition, .violation = violation};
}

StepFailure ElementRunSolver::equal_elements(int first, int count, double h) {
  const auto of_run = [&](StepFailure failure, int k) {
    failure.violation.time += k * h;
    failure.element = first + k;
    failure.h = h;
    failure.count = count;
    return failure;
  };
  if (!regular_A_) {
    const auto& modes = buffers_.element(first).modes;
    const auto closed = std::find_if(modes.begin(), modes.end(), is_closed);
    const auto contact = static_cast<int>(closed - modes.begin());
    if (closed != modes.end())
      return of_run({.kind = StepFailure::Kind::undetermined, .violation = {.contact = contact}}, 0);
  }
  FesdStep& step = buffers_.step();
  for (int k = 0; k < count; ++k) {
    const int element = first + k;
    if (k > 0 && !start_solver_.continue_modes(step, element, buffers_.start_of(element)))
      return of_run({.kind = StepFailure::Kind::no_impulse, .violation = {}}, k);
    first_guess(element, h);
    step.ends[element].contact = -1;
    if (const StepFailure failure = solve_element(element)) return of_run(failure, k);
  }
  return {};
}

/// One active set in all elements.
void ElementRunSolver::prepare(int first, int count) {
  const Element& front = buffers_.element(first);
  for (int k = 0; k < count; ++k) {
    buffers_.step().ends[first + k].contact = -1;
    if (k == 0) continue;
    Element& element = buffers_.element(first + k);
    element.modes = front.modes;
    element.facets = front.facets;
    element.closes_bounce = false;
    element.slip_start.setZero();
  }
}

Violation ElementRunSolver::check_run(int first, int count) {
  FesdStep& step = buffers_.step();
  for (int k = 0; k < count; ++k) {
    const Element& stages = buffers_.element(first + k);
    if (k > 0) {
      step.v_minus.col(first + k) = stages.v0;
      step.Lambda_n.col(first + k).setZero();
      step.Lambda_t.col(first + k).setZero();
    }
    Violation violation = check_element(first + k, k == 0);
    violation.time += k * stages.h;
    if (violation) return violation;
  }
  return {};
}

/// The switch that a violation in the run from `first` on announces.
Switch ElementRunSolver::switch_for(int first, const Violation& violation) {
  Switch end{violation.passed, violation.contact};
  const ElementStart& start = buffers_.start_of(first);
  const Element& stages = buffers_.element(first);
  const auto has = [&](const std::vector<int>& contacts) {
    return std::find(contacts.begin(), contacts.end(), violation.contact) != contacts.end();
  };
  if (end.kind == SwitchKind::gap_closes && (violation.level > 0 || has(start.touching))) {
    problem_.gap(stages.q0.data(), gap_.data());
    const bool starts_there = gap_[end.contact] + violation.level <= scales_.touching(end.contact);
    end.zeros_at_start = violation.level == 0 || starts_there ? 1 : 0;
    end.left_gap = end.zeros_at_start == 1 ? gap_[end.contact] : -violation.level;
  }
  if (violation.facet_condition >= 0)
    end.condition =
        polygon_.condition(stages.modes[end.contact], stages.facets[end.contact], violation.facet_condition);
  const bool on_its_edge = end.kind == SwitchKind::slip_turns &&
                           std::any_of(start.on_edge.begin(), start.on_edge.end(), [&](const auto& on) {
                             return on.contact == end.contact && on.edge == end.condition.facet;
                           });
  if (on_its_edge || (properties(end.kind).is_of_slip && has(start.from_rest))) {
    const Switch before = buffers_.switch_before(first);
    const bool by_force =
        before.is(SwitchKind::cone_reached, end.contact) || before.is(SwitchKind::edge_left, end.contact);
    end.zeros_at_start = by_force ? 2 : 1;  // the acceleration is zero, too
  }
  return end;
}

bool ElementRunSolver::run_to_switch(int first, int count, Violation violation, double remaining,
                                     SearchBudget& budget) {
  prepare(first, count);
  for (int attempt = 0; attempt < kMaxSwitchesInTurn; ++attempt) {
    if (!budget.spend()) return false;
    Switch end = switch_for(first, violation);
    const double shortest = attempt == 0 ? kShortestGuess : kShortestRefutation;
    const double before = buffers_.element(first).h;
    const double h = std::clamp(violation.time, shortest * remaining, remaining) / count;
    const int solved = static_cast<int>(std::clamp(violation.time / before, 0.0, count - 1.0)) + 1;
    stretch(first, count, solved, before, h);
    buffers_.element(first).h = h;

    if (!solve_run(first, count, end, remaining)) return false;
    violation = check_run(first, count);
    if (!violation) {
      if (ends_at_tip(first + count - 1, end)) end.kind = SwitchKind::force_vanishes;
      buffers_.step().ends[first + count - 1] = end;
      return true;
    }
    if (violation.kind != Violation::Kind::past_switch) return false;
  }
  return false;
}

/// Whether a cone is reached at its tip: without a tangential force, the cone and a force of zero are the same switch,
/// and rounding says which of them a violation names. The contact opens.
bool ElementRunSolver::ends_at_tip(int element, const Switch& end) const {
  if (end.kind != SwitchKind::cone_reached || end.on_polygon() || elements_.tableau.right_end.size() == 0) return false;
  return buffers_.element(element).end_lambda_n[end.contact] <= scales_.no_force(end.contact);
}

/// SwitchSolver::solve, from other guesses when it fails.
bool ElementRunSolver::solve_run(int first, int count, Switch& end, double remaining) {
  const Element& front = buffers_.element(first);
  const double max_h = remaining / count, guess = front.h;
  const auto converges = [&] {
    return switch_solver_.solve(run(first, count), end, max_h) == SwitchSolver::Result::converged;
  };
  const auto slides_beside = [&](int i) {
    const auto& contacts = problem_.info().contacts;
    return i != end.contact && front.modes[i] == ContactMode::slip &&
           contacts[i].support == contacts[end.contact].support;
  };
  if (end.kind == SwitchKind::slip_stops && front.modes[end.contact] == ContactMode::slip &&
      std::ranges::any_of(problem_.info().unilateral, slides_beside)) {
    end.together = true;
    if (converges()) return true;
    end.together = false;
    for (int k = 0; k < count; ++k) first_guess(first + k, guess);
  }
  if (converges() && !opens(first + count - 1, end)) return true;
  return bracket_switch(first, count, end, remaining) && converges() && !opens(first + count - 1, end);
}

/// Whether the gap that closes at the end of an element is opening there: bodies that have gone through each other come
/// apart at this root, and the impact is an earlier one.
bool ElementRunSolver::opens(int element, const Switch& end) {
  if (end.kind != SwitchKind::gap_closes) return false;
  const Element& stages = buffers_.element(element);
  const auto& contact = problem_.info().contacts[end.contact];
  problem_.normal_jacobian(stages.q1.data(), J_n_.data());
  const double* J = J_n_.data() + contact.normal_begin;
  double rate = 0, size = 0;
  for (const int k : contact.support) {
    const double term = *J++ * stages.v1[k];
    rate += term;
    size += std::abs(term);
  }
  return rate > kOpening * size;
}

bool ElementRunSolver::run_to_time(int first, int count, double h, SwitchKind kind, int contact, SearchBudget& budget) {
  if (!budget.spend() || equal_elements(first, count, h)) return false;
  buffers_.step().ends[first + count - 1] = {.kind = kind, .contact = contact};
  return true;
}

/// Null where there is none.
ElementMap* ElementRunSolver::map_for(Element& element, double h) {
  for (auto map = maps_.begin(); map != maps_.end(); ++map) {
    if (map->h() != h || map->modes() != element.modes) continue;
    maps_.splice(maps_.begin(), maps_, map);
    return map->is_complete() ? &*map : nullptr;
  }
  elements_.set_active(element);
  if (!elements_.affine()) return nullptr;
  if (maps_.size() == kMaxMaps) maps_.pop_back();
  const ElementMap& made = maps_.emplace_front(elements_, h);
  return made.is_complete() ? &maps_.front() : nullptr;
}

/// Records in the scales the largest of each coordinate among the states that skip_elements() has gone through.
void ElementRunSolver::record_states(const Element& element, double H) {
  const int n = problem_.n_q();
  const double *q = largest_.data(), *v = q + n;
  scales_.begin_step(q, v, H, false);
  problem_.normal_jacobian(element.q0.data(), J_n_.data());
  if (problem_.info().has_friction()) problem_.tangent_jacobian(element.q0.data(), J_t_.data());
  for (const int i : problem_.info().unilateral) {
    if (!is_closed(element.modes[i])) continue;
    const auto& contact = problem_.info().contacts[i];
    scales_.record_approach(i, packed_terms(contact, J_n_.data() + contact.normal_begin, v));
    if (contact.n_t == 0) continue;
    scales_.record_slip(i, packed_terms(contact, J_t_.data() + contact.tangent_begin, v));
  }
}

std::int64_t ElementRunSolver::skip_elements(Element& from, double h, std::int64_t n, int group) {
  if (n < kWorthAColumn * (2 * problem_.n_q() + 1)) return 0;
  ElementMap* map = map_for(from, h);
  if (!map) return 0;
  const int n_q = problem_.n_q();
  x_.head(n_q) = from.q1;
  x_.tail(n_q) = from.v1;
  map->set_bounds(scales_);
  if (!map->starts_from(x_)) return 0;
  largest_.setZero();
  std::int64_t gone = 0;
  for (bool holds = true; gone < n;) {
    group_start_ = x_;
    largest_ = largest_.cwiseMax(x_.cwiseAbs());
    for (int k = 0; k < group && holds; ++k) holds = map->advance(x_);
    if (!holds) break;
    gone += group;
  }
  if (gone == 0) return 0;
  if (gone < n) x_ = group_start_;
  from.q1 = x_.head(n_q);
  from.v1 = x_.tail(n_q);
  record_states(from, group * h);
  return gone;
}

/// Switch function, without its zeros at the start, at the end of `count` elements of length h; NaN where they have no
/// solution.
double ElementRunSolver::switch_value(int first, int count, const Switch& end, double h) {
  for (int element = first; element < first + count; ++element) {
    if (element > first && !start_solver_.continue_modes(buffers_.step(), element, buffers_.start_of(element)))
      return std::numeric_limits<double>::quiet_NaN();
    first_guess(element, h);
    if (element_solver_.solve(buffers_.element(element)) != ElementSolver::Result::converged)
      return std::numeric_limits<double>::quiet_NaN();
  }
  return switch_solver_.function().value(buffers_.element(first + count - 1), end) / std::pow(h, end.zeros_at_start);
}

/// First guess for a switch that Newton's method did not find: the first sign change of the switch function over the
/// lengths of the run, then regula falsi (Illinois variant). Leaves the run solved for that length.
bool ElementRunSolver::bracket_switch(int first, int count, const Switch& end, double remaining) {
  if (properties(end.kind).needs_force && tableau_.right_end.size() == 0) return false;
  // Slip in space has no solution after the switch that could bracket it.
  if (buffers_.element(first).modes[end.contact] == ContactMode::slip) return false;

  double low = 0, high = 0, at_low = 0, at_high = 0;
  bool found = false;
  for (int part = 1; part <= kBracketSamples && !found; ++part) {
    low = high;
    at_low = at_high;
    high = remaining / count * part / kBracketSamples;
    at_high = switch_value(first, count, end, high);
    found = part > 1 ? at_low > 0 && at_high <= 0 : at_high <= 0 && end.kind == SwitchKind::gap_closes;
    if (part == 1 && found) {  // the gap at length zero is the one at the left end; deflated, some positive number
      problem_.gap(buffers_.element(first).q0.data(), gap_.data());
      at_low = end.zeros_at_start > 0 ? std::abs(at_high) : gap_[end.contact] - end.left_gap;
    }
  }
  if (!found) return false;
  for (int step = 0; step < kMaxBracketSteps && high - low > kBracketWidth * high; ++step) {
    const double h = at_low > 0 ? (low * at_high - high * at_low) / (at_high - at_low) : 0.5 * (low + high);
    const double at_h = switch_value(first, count, end, h);
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
  return !std::isnan(switch_value(first, count, end, high));
}

}  // namespace ricochet
