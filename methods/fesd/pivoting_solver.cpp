#include "methods/fesd/pivoting_solver.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

namespace ricochet {
namespace {

constexpr double kEpsilon = std::numeric_limits<double>::epsilon();
// A gap is zero when rounding of q explains it: a few dozen additions of numbers of the size of q.
constexpr double kGapRounding = 64 * kEpsilon;
// A gap that its equation holds at zero may have gathered rounding over many steps (StageSolver removes it from 1e-13
// on).
constexpr double kClosedGapRounding = 2e-13;
constexpr double kVelocityRounding = 64 * kEpsilon;
// Forces carry the rounding of the stage equations.
constexpr double kForceRounding = 1e-12;
// Predictions tried in one step before the search gives up, per element.
constexpr int kMaxTrials = 100;
// Lengths at which a switch function is sampled when Newton's method misses its root.
constexpr int kBracketSamples = 16;

}  // namespace

void FesdStep::resize(const Problem& problem, int n_s, int max_elements) {
  elements.resize(static_cast<std::size_t>(max_elements));
  for (auto& stages : elements) stages.resize(problem.n_q(), problem.n_c(), n_s);
  v_minus.setZero(problem.n_q(), max_elements);
  Lambda_n.setZero(problem.n_c(), max_elements);
}

PivotingSolver::PivotingSolver(const Problem& problem, const ButcherTableau& tableau, const Options& options,
                               Counters& counters)
    : problem_(problem),
      options_(options),
      counters_(counters),
      stage_solver_(problem, tableau, options.tolerance, counters),
      impact_law_(problem, counters),
      n_q_(problem.n_q()),
      n_c_(problem.n_c()),
      n_s_(tableau.n_s),
      stiffly_accurate_(tableau.is_stiffly_accurate()),
      regular_A_(tableau.A.fullPivLu().isInvertible()) {
  const int capacity = options.as_needed ? std::max(options.n_fe, options.max_elements) : options.n_fe;
  step_->resize(problem, n_s_, capacity);
  previous_->resize(problem, n_s_, capacity);
  junctions_.resize(static_cast<std::size_t>(capacity));
  for (auto& junction : junctions_) {
    junction.touching.reserve(static_cast<std::size_t>(n_c_));
    junction.bounced.reserve(static_cast<std::size_t>(n_c_));
  }
  candidates_.reserve(static_cast<std::size_t>(n_c_));
  for (Vector* v : {&gap_, &left_gap_, &lambda_, &gap_acceleration_}) v->setZero(n_c_);
  normal_size_ = problem.normal_jacobian(problem.info().q0).cwiseAbs().colwise().sum().transpose();
  gap_size_.setZero(n_c_);
  force_size_.setZero(n_c_);
}

void PivotingSolver::start(const Vector& q, const Vector& v) {
  step_->n_elements = previous_->n_elements = 0;
  step_->elements[0].q0 = q;
  step_->v_minus.col(0) = v;
}

Status PivotingSolver::advance(double H) {
  if (step_->n_elements > 0) {
    std::swap(step_, previous_);
    step_->elements[0].q0 = previous_->last().q1;
    step_->v_minus.col(0) = previous_->last().v1;
  }
  step_->H = H;
  step_->touches = false;
  const Vector& q = step_->elements[0].q0;
  const double before = position_size_;
  for (int k = 0; k < n_q_; ++k) position_size_ = std::max(position_size_, std::abs(q[k]));
  if (position_size_ > before) gap_size_ = position_size_ * normal_size_;
  trials_ = 0;
  if (first_failure_.violation.verdict != Verdict::fulfilled) first_failure_ = deepest_failure_ = {};
  longest_ = 0;
  bool solved = search(0, H, options_.n_fe);
  if (!solved && options_.as_needed) {
    trials_ = 0;
    longest_ = H / options_.n_fe;
    solved = search(0, H, 0);
  }
  if (solved) {
    counters_.elements += step_->n_elements;
    ++counters_.steps;
    return Status::success;
  }
  step_->n_elements = 0;
  const Verdict verdict = first_failure_.violation.verdict;
  const bool solver_failed = verdict == Verdict::newton_failed || verdict == Verdict::impact_failed;
  return solver_failed ? Status::inner_solver_failed : Status::infeasible;
}

int PivotingSolver::max_trials() const {
  return kMaxTrials * (longest_ == 0 ? options_.n_fe : static_cast<int>(step_->elements.size()));
}

/// Number of equal elements for the remaining time: what is left of N_FE, or as many as longest_ asks for. 0 when the
/// storage ends.
int PivotingSolver::elements_for(int element, double remaining, int elements_left) const {
  if (longest_ == 0) return elements_left;
  const int wanted = std::max(1, static_cast<int>(std::ceil(remaining / longest_ * (1 - 1e-9))));
  return element + wanted <= static_cast<int>(step_->elements.size()) ? wanted : 0;
}

bool PivotingSolver::search(int element, double remaining, int elements_left) {
  const int count = elements_for(element, remaining, elements_left);
  if (count == 0 || !begin_element(element)) return false;
  // A switch may be preceded by all but one of the elements; by all of them when there may be more.
  const int most_before = longest_ == 0 ? count - 1 : count;
  const unsigned n_alternatives = 1U << std::min<std::size_t>(junctions_[element].bounced.size(), 4);
  for (unsigned trial = 0; trial < n_alternatives; ++trial) {
    if (++trials_ > max_trials()) return false;
    propose_modes(element, trial);
    const double h = remaining / count;
    const Violation violation = equal_elements(element, count, h);
    if (violation.verdict == Verdict::fulfilled) {
      step_->n_elements = element + count;
      return true;
    }
    note_failure(violation, h, count);
    if (violation.verdict != Verdict::gap_negative && violation.verdict != Verdict::force_negative) continue;

    // How many equal elements up to the switch: first the number that changes their length least, then its neighbours.
    const int nearest = std::clamp(static_cast<int>(std::lround(violation.time / h)), 1, std::max(1, most_before));
    const auto candidate = [&](int k) { return nearest + (k % 2 ? -(k + 1) / 2 : k / 2); };
    const auto is_possible = [&](int m) {
      return m >= 1 && m <= most_before && element + m < static_cast<int>(step_->elements.size());
    };
    for (int k = 0; k < 2 * count; ++k) {
      const int m = candidate(k);
      if (!is_possible(m)) continue;
      if (run_to_switch(element, m, violation, remaining) && continue_after(element, m, remaining, count)) return true;
    }
    if (options_.switches == Switches::pinned || violation.verdict != Verdict::force_negative) continue;
    for (int k = 0; k < 2 * count; ++k) {
      const int m = candidate(k);
      if (!is_possible(m)) continue;
      for (int part = kBracketSamples - 1; part > 0;
           --part) {  // the latest breaking time first: it is nearest to the truth
        const double length = remaining / m * part / kBracketSamples;
        if (run_to_time(element, m, length, violation.contact) && continue_after(element, m, remaining, count))
          return true;
      }
    }
  }
  return false;
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

const Stages* PivotingSolver::left_neighbour(int element) const {
  if (element > 0) return &step_->elements[element - 1];
  return has_previous_step() ? &previous_->last() : nullptr;
}

/// Impulse and predicted modes at the left end of an element: ImpactLaw (1)-(4).
bool PivotingSolver::begin_element(int element) {
  Stages& stages = step_->elements[element];
  Junction& junction = junctions_[element];
  const Stages* left = left_neighbour(element);
  auto v_minus = step_->v_minus.col(element);
  auto Lambda = step_->Lambda_n.col(element);
  junction.touching.clear();
  junction.bounced.clear();
  stages.v0 = v_minus;
  if (n_c_ == 0) return true;
  for (int i = 0; i < n_c_; ++i) {
    Lambda[i] = 0;
    stages.modes[i] = ContactMode::open;
  }

  const auto was_closed = [&](int i) { return left && left->modes[i] == ContactMode::closed; };
  problem_.gap(stages.q0.data(), gap_.data());
  for (int i = 0; i < n_c_; ++i) {
    if (gap_[i] > 0 && gap_[i] > (was_closed(i) ? kClosedGapRounding : kGapRounding) * gap_size_[i]) continue;
    junction.touching.push_back(i);
  }
  if (junction.touching.empty()) return true;
  step_->touches = true;
  if (!impact_law_.prepare(stages.q0, junction.touching)) {
    note_failure({Verdict::impact_failed, element, junction.touching.front(), 0, 0}, 0, 1);
    return false;
  }

  const auto rounding = [&](int i) { return kVelocityRounding * impact_law_.normal_velocity_scale(i, v_minus); };
  bool approaches = false;
  for (const int i : junction.touching)
    approaches = approaches || impact_law_.normal_velocity(i, v_minus) < -rounding(i);
  bool is_impact =
      false;  // a contact closes; the small impulses that keep a closed contact's velocity tangential are none
  if (approaches) {
    if (impact_law_.impact(stages.v0, Lambda) != LcpStatus::solved) {
      note_failure({Verdict::impact_failed, element, junction.touching.front(), 0, 0}, 0, 1);
      return false;
    }
    for (const int i : junction.touching) is_impact = is_impact || (Lambda[i] > 0 && !was_closed(i));
  }

  // A contact that rested goes on resting, within a step; a new step knows the state only, so there the load decides,
  // as it does after an impact for every contact that does not separate.
  candidates_.clear();
  for (const int i : junction.touching) {
    const bool rested = was_closed(i) && !is_impact;
    if (i == junction.broken) continue;
    if (rested && element > 0) {
      stages.modes[i] = ContactMode::closed;
    } else if (rested || impact_law_.normal_velocity(i, stages.v0) <= rounding(i)) {
      candidates_.push_back(i);
    } else {
      junction.bounced.push_back(i);
    }
  }
  if (candidates_.empty()) return true;
  if (impact_law_.contact_forces(stages.q0, stages.v0, candidates_, lambda_, gap_acceleration_) != LcpStatus::solved) {
    note_failure({Verdict::impact_failed, element, candidates_.front(), 0, 0}, 0, 1);
    return false;
  }
  for (const int i : candidates_) {
    if (lambda_[i] > 0) stages.modes[i] = ContactMode::closed;
  }
  return true;
}

/// Trial 0 is the prediction; bit k of a later trial closes the k-th contact that bounced.
void PivotingSolver::propose_modes(int element, unsigned trial) {
  const Junction& junction = junctions_[element];
  for (std::size_t k = 0; k < junction.bounced.size(); ++k) {
    const bool closes = k < 4 && (trial >> k & 1U);
    step_->elements[element].modes[junction.bounced[k]] = closes ? ContactMode::closed : ContactMode::open;
  }
}

void PivotingSolver::first_guess(int element, double h) {
  Stages& stages = step_->elements[element];
  const Stages* left = left_neighbour(element);
  stages.h = h;
  const bool has_impulse = !junctions_[element].touching.empty() && !step_->Lambda_n.col(element).isZero(0);
  if (left && left->h == h && left->modes == stages.modes && !has_impulse) {
    stage_solver_.extrapolate(*left, stages);
  } else {
    stages.a.setZero();
    stages.lambda_n.setZero();
  }
}

/// Hands the state and the modes of the element before over to `element`. False when a closed contact needs an impulse
/// that the impact law cannot give.
bool PivotingSolver::continue_without_switch(int element) {
  const Stages& before = step_->elements[element - 1];
  Stages& stages = step_->elements[element];
  stages.q0 = before.q1;
  stages.v0 = before.v1;
  step_->v_minus.col(element) = before.v1;
  Junction& junction = junctions_[element];
  junction.touching.clear();
  if (n_c_ == 0) return true;
  for (int i = 0; i < n_c_; ++i) {
    step_->Lambda_n(i, element) = 0;
    stages.modes[i] = before.modes[i];
  }
  if (!step_->touches) return true;
  for (int i = 0; i < n_c_; ++i) {
    if (stages.modes[i] == ContactMode::closed) junction.touching.push_back(i);
  }
  if (junction.touching.empty()) return true;
  if (!impact_law_.prepare(stages.q0, junction.touching)) return false;
  for (const int i : junction.touching) {
    if (impact_law_.normal_velocity(i, stages.v0) <
        -kVelocityRounding * impact_law_.normal_velocity_scale(i, stages.v0)) {
      return impact_law_.impact(stages.v0, step_->Lambda_n.col(element)) == LcpStatus::solved;
    }
  }
  return true;
}

PivotingSolver::Violation PivotingSolver::equal_elements(int first, int count, double h) {
  if (!regular_A_) {
    for (int i = 0; i < n_c_; ++i) {
      if (step_->elements[first].modes[i] == ContactMode::closed) return {Verdict::undetermined, first, i, 0, 0};
    }
  }
  for (int k = 0; k < count; ++k) {
    const int element = first + k;
    if (k > 0 && !continue_without_switch(element)) return {Verdict::impact_failed, element, -1, 0, 0};
    first_guess(element, h);
    Stages& stages = step_->elements[element];
    if (stage_solver_.solve(stages) != StageSolver::Result::converged)
      return {Verdict::newton_failed, element, -1, 0, 0};
    Violation violation = check(stages);
    if (violation.verdict != Verdict::fulfilled) {
      violation.element = element;
      violation.time += k * h;
      return violation;
    }
  }
  return {};
}

/// The common case: every contact is open and no gap is negative.
bool PivotingSolver::is_clear(const Stages& stages) {
  for (const auto mode : stages.modes) {
    if (mode != ContactMode::open) return false;
  }
  const int n_points = stiffly_accurate_ ? n_s_ : n_s_ + 1;
  for (int j = 0; j < n_points; ++j) {
    problem_.gap(j < n_s_ ? stages.q.data() + j * n_q_ : stages.q1.data(), gap_.data());
    for (int i = 0; i < n_c_; ++i) {
      if (!(gap_[i] >= 0)) return false;
    }
  }
  return true;
}

/// Sign conditions of one element: f_c >= 0 at the stages and at the right end of an open contact, lambda_n >= 0 there
/// of a closed one. Reports the condition that fails first in time.
PivotingSolver::Violation PivotingSolver::check(const Stages& stages) {
  Violation first;
  if (is_clear(stages)) return first;
  const Vector& c = stage_solver_.tableau().c;
  const auto report = [&](Verdict verdict, int contact, double time, double value) {
    if (first.verdict == Verdict::fulfilled || time < first.time) first = {verdict, 0, contact, time, value};
  };

  problem_.gap(stages.q0.data(), left_gap_.data());
  double left_time = 0;
  const int n_points = stiffly_accurate_ ? n_s_ : n_s_ + 1;
  for (int j = 0; j < n_points; ++j) {
    const bool is_stage = j < n_s_;
    const double time = is_stage ? c[j] * stages.h : stages.h;
    problem_.gap(is_stage ? stages.q.col(j).data() : stages.q1.data(), gap_.data());
    for (int i = 0; i < n_c_; ++i) {
      if (stages.modes[i] == ContactMode::closed) {
        if (!is_stage && std::abs(gap_[i]) > kClosedGapRounding * gap_size_[i]) {
          report(Verdict::drifts, i, time, gap_[i]);
        }
      } else if (gap_[i] < 0 && gap_[i] < -kGapRounding * gap_size_[i]) {
        const double left = std::max(left_gap_[i], 0.0);
        report(Verdict::gap_negative, i, left_time + (time - left_time) * left / (left - gap_[i]), gap_[i]);
      }
    }
    std::swap(gap_, left_gap_);
    left_time = time;
  }

  const Vector& to_right_end = stage_solver_.tableau().right_end;
  for (int i = 0; i < n_c_; ++i) {
    if (stages.modes[i] == ContactMode::open) continue;
    force_size_[i] = std::max(force_size_[i], stages.lambda_n.row(i).maxCoeff());
    double before = stages.lambda_n(i, 0), time_before = 0;
    for (int j = 0; j <= n_s_; ++j) {
      if (j == n_s_ && to_right_end.size() == 0) break;
      const double lambda = j < n_s_ ? stages.lambda_n(i, j) : stages.lambda_n.row(i).dot(to_right_end);
      const double time = j < n_s_ ? c[j] * stages.h : stages.h;
      if (lambda < -kForceRounding * force_size_[i]) {
        const double fraction = before > 0 ? before / (before - lambda) : 0.5;
        report(Verdict::force_negative, i, time_before + (time - time_before) * fraction, lambda);
        break;
      }
      before = lambda;
      time_before = time;
    }
  }
  return first;
}

/// Equal elements of one active set, before a switch. Jumps of v between them are left out of the square system, so
/// there must be none: closed contacts with curved gaps need them.
bool PivotingSolver::prepare_run(int first, int count) {
  for (int k = 1; k < count; ++k) {
    const auto& modes = step_->elements[first].modes;
    for (int i = 0; i < n_c_; ++i) {
      if (modes[i] == ContactMode::closed && !problem_.info().contacts[i].is_affine) return false;
    }
    step_->elements[first + k].modes = modes;
  }
  return true;
}

PivotingSolver::Violation PivotingSolver::check_run(int first, int count) {
  for (int k = 0; k < count; ++k) {
    const Stages& stages = step_->elements[first + k];
    if (k > 0) {
      step_->v_minus.col(first + k) = stages.v0;
      step_->Lambda_n.col(first + k).setZero();
    }
    Violation violation = check(stages);
    violation.time += k * stages.h;
    if (violation.verdict != Verdict::fulfilled) return violation;
  }
  return {};
}

/// Solves `count` equal elements up to the switch that the violation announces. When the solution shows another switch
/// before it, that one is taken instead.
bool PivotingSolver::run_to_switch(int first, int count, Violation violation, double remaining) {
  if (!prepare_run(first, count)) return false;
  const std::span<Stages> run(step_->elements.data() + first, static_cast<std::size_t>(count));
  for (int attempt = 0; attempt < 4; ++attempt) {
    if (++trials_ > max_trials()) return false;
    Switch end;
    end.kind = violation.verdict == Verdict::gap_negative ? Switch::Kind::gap_closes : Switch::Kind::force_vanishes;
    end.contact = violation.contact;
    const auto& touching = junctions_[first].touching;
    end.starts_at_zero = std::find(touching.begin(), touching.end(), violation.contact) != touching.end();
    run.front().h = std::clamp(violation.time, 1e-3 * remaining, remaining) / count;

    const double max_h = remaining / count;
    if (stage_solver_.solve_to_switch(run, end, max_h) != StageSolver::Result::converged &&
        !(bracket_switch(first, count, end, remaining) &&
          stage_solver_.solve_to_switch(run, end, max_h) == StageSolver::Result::converged)) {
      return false;
    }
    const Violation other = check_run(first, count);
    if (other.verdict == Verdict::fulfilled) {
      junctions_[first + count].broken = end.kind == Switch::Kind::force_vanishes ? end.contact : -1;
      return true;
    }
    if (other.verdict != Verdict::gap_negative && other.verdict != Verdict::force_negative) return false;
    violation = other;
  }
  return false;
}

/// Solves `count` equal elements of given length; the contact breaks at their end.
bool PivotingSolver::run_to_time(int first, int count, double h, int breaking_contact) {
  if (++trials_ > max_trials()) return false;
  if (equal_elements(first, count, h).verdict != Verdict::fulfilled) return false;
  junctions_[first + count].broken = breaking_contact;
  return true;
}

/// First guess for a switch that Newton's method did not find: the first sign change of the switch function over the
/// lengths of the run, then regula falsi (Illinois variant). Leaves the run solved for that length.
bool PivotingSolver::bracket_switch(int first, int count, const Switch& end, double remaining) {
  const Vector& to_right_end = stage_solver_.tableau().right_end;
  const auto value = [&](double h) {
    for (int k = 0; k < count; ++k) {
      if (k > 0 && !continue_without_switch(first + k)) return std::numeric_limits<double>::quiet_NaN();
      first_guess(first + k, h);
      if (stage_solver_.solve(step_->elements[first + k]) != StageSolver::Result::converged)
        return std::numeric_limits<double>::quiet_NaN();
    }
    const Stages& last = step_->elements[first + count - 1];
    if (end.kind == Switch::Kind::force_vanishes) return last.lambda_n.row(end.contact).dot(to_right_end);
    problem_.gap(last.q1.data(), gap_.data());
    return end.starts_at_zero ? gap_[end.contact] / h : gap_[end.contact];
  };
  if (end.kind == Switch::Kind::force_vanishes && to_right_end.size() == 0) return false;

  double low = 0, high = 0, at_low = 0, at_high = 0;
  bool found = false;
  for (int part = 1; part <= kBracketSamples && !found; ++part) {
    low = high;
    at_low = at_high;
    high = remaining / count * part / kBracketSamples;
    at_high = value(high);
    found = part > 1 ? at_low > 0 && at_high <= 0 : at_high <= 0 && end.kind == Switch::Kind::gap_closes;
    if (part == 1 && found) {  // the gap at length zero is the one at the left end, the deflated one its velocity
      problem_.gap(step_->elements[first].q0.data(), gap_.data());
      at_low =
          end.starts_at_zero ? impact_law_.normal_velocity(end.contact, step_->elements[first].v0) : gap_[end.contact];
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
          "{} stays closed, but tableau {} has no stage at the right end and the gap there is {:.3g} m {}: a curved "
          "persistent contact needs a stiffly accurate tableau",
          contact, stage_solver_.tableau().name, v.value, where);
    case Verdict::undetermined:
      return fmt::format("{} stays closed, but the matrix A of tableau {} is singular and does not determine its force",
                         contact, stage_solver_.tableau().name);
    case Verdict::newton_failed:
      return fmt::format("Newton's method on the stage equations did not converge {}", where);
    case Verdict::impact_failed:
      return fmt::format(
          "the impact law at {} has no solution: M(q) is not positive definite or the contact problem is degenerate",
          contact);
    case Verdict::fulfilled:
      break;
  }
  return "";
}

std::string PivotingSolver::failure_message() const {
  std::string message = fmt::format("no solution with {}: {}",
                                    options_.as_needed ? fmt::format("up to {} elements", step_->elements.size())
                                                       : fmt::format("N_FE = {}", options_.n_fe),
                                    describe(first_failure_));
  const Violation &first = first_failure_.violation, &deepest = deepest_failure_.violation;
  if (deepest.element != first.element || deepest.verdict != first.verdict) {
    message += fmt::format("; with a switch before it, {}", describe(deepest_failure_));
  }
  if (!options_.as_needed) message += "; elements=as_needed may solve it";
  return message + fmt::format(" ({} predictions)", trials_);
}

}  // namespace ricochet
