#include "methods/fesd/explicit_run.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "methods/modes/explicit_steps.h"
#include "methods/modes/step_control.h"

namespace ricochet {
namespace {

constexpr int kDegree = 5;              // of the polynomial between the ends
constexpr int kMaxEarlier = 4;          // switches that may be found before the one announced, in turn
constexpr int kMaxIterations = 12;      // of (4)
constexpr int kMaxShifts = 3;           // by (5), of a function that is not straight
constexpr int kMaxPasses = 30;          // of slow slip in turn, each at half of the speed before
constexpr double kOfTolerance = 0.1;    // of (6)
constexpr double kRounding = 1e-16;     // eps of (5)
constexpr double kStalls = 1e-11;       // of h: a change by no more that does not become smaller is rounding
constexpr double kEndRounding = 1e-13;  // of an element: a switch later by no more is at its end
constexpr double kLater = 1e-9;         // of an element: to where its event has been located
// Of the end time: the shortest element that is halved for a gap that it nearly closes.
constexpr double kShortestRefined = 1e-6;

}  // namespace

ExplicitRunSolver::ExplicitRunSolver(const Problem& problem, const EmbeddedTableau& pair, ContactScales& scales,
                                     StepBuffers& buffers, Counters& counters)
    : info_(problem.info()),
      pair_(pair),
      scales_(scales),
      buffers_(buffers),
      dynamics_(problem, counters),
      functions_(problem, scales, dynamics_, kDegree),
      step_(make_explicit_step(pair, problem.n_q(), dynamics_)) {
  from_rest_.reserve(info_.contacts.size());
  stopping_.reserve(info_.contacts.size());
  held_.setZero(info_.n_lambda_t);
}

void ExplicitRunSolver::restart() {
  dynamics_.start(scales_.redundant());
  functions_.start(tolerance_);
  step_->start(tolerance_);
  known_ = Known::nothing;
  is_first_ = true;
  slow_ = -1;
  n_passes_ = 0;
}

/// Whether the element starts where the last one has ended, in its modes.
bool ExplicitRunSolver::has_right_end_at(const Element& e) const {
  const StepEnds& ends = step_->ends;
  return known_ == Known::both_ends && ends.q1 == e.q0 && ends.v1 == e.v0;
}

/// The acceleration and the functions at the left end of an element.
bool ExplicitRunSolver::begin(Element& e, const ElementStart& start) {
  StepEnds& ends = step_->ends;
  const bool goes_on = known_ != Known::nothing && e.modes == dynamics_.modes() && start.from_rest.empty();
  if (goes_on && has_right_end_at(e)) {
    from_rest_.clear();
    ends.advance();
    functions_.advance(ends.v0);
    known_ = Known::left_end;
  } else if (!(goes_on && ends.q0 == e.q0 && ends.v0 == e.v0)) {
    const bool is_set = set_left_end(e, start);
    known_ = is_set ? Known::left_end : Known::nothing;
    if (!is_set) return false;
  }
  if (info_.n_c() > 0) functions_.set_sinking(start.sinks);
  return true;
}

bool ExplicitRunSolver::set_left_end(Element& e, const ElementStart& start) {
  StepEnds& ends = step_->ends;
  ends.q0 = e.q0;
  ends.v0 = e.v0;
  from_rest_.clear();
  if (known_ == Known::nothing || e.modes != dynamics_.modes()) {
    dynamics_.set_modes(e.modes, ends.q0.data(), ends.v0.data());
    is_curved_ = std::ranges::any_of(dynamics_.closed(), [&](int i) { return !info_.contacts[i].is_affine; });
  }
  if (start.has_forces) dynamics_.set_forces(start.lambda_n, start.lambda_t);
  // Slip in space has no direction where it begins; from the second stage on the velocity has one.
  for (const int i : start.from_rest) {
    if (e.modes[i] != ContactMode::slip) continue;
    from_rest_.push_back(i);
    dynamics_.hold_direction(i, e.slip_start.data() + info_.contacts[i].tangent_index);
  }
  if (!dynamics_.accelerate(ends.q0.data(), ends.v0.data(), ends.a0.data())) return false;
  if (info_.n_c() > 0) functions_.begin(ends.q0.data(), ends.v0.data());
  for (const int i : from_rest_) dynamics_.hold_direction(i, nullptr);
  return true;
}

/// (1)-(3), and the acceleration at the right end.
bool ExplicitRunSolver::take(double h) {
  functions_.begin_step();
  EventFunctions* const watched = functions_.has_forces() ? &functions_ : nullptr;
  StepEnds& ends = step_->ends;
  is_shifted_ = false;
  if (!step_->take(h, watched)) return false;
  is_projected_ = is_curved_;
  if (!is_projected_) return step_->finish();
  return dynamics_.project(ends.q1.data(), ends.v1.data(), ModeDynamics::Order::position_first) &&
         dynamics_.accelerate(ends.q1.data(), ends.v1.data(), ends.a1.data());
}

StepFailure ExplicitRunSolver::equal_elements(int first, int, double h) {
  using Kind = StepFailure::Kind;
  Element& e = buffers_.element(first);
  const auto failed = [&](Kind kind, const Violation& violation) {
    return StepFailure{.kind = kind, .violation = violation, .element = first, .h = e.h, .count = 1};
  };
  buffers_.step().ends[static_cast<std::size_t>(first)].contact = -1;
  e.h = h;
  trial_ = {.h = h, .error = std::numeric_limits<double>::infinity()};
  stops_ = false;
  if (!begin(e, buffers_.start_of(first))) return failed(Kind::no_motion, {});
  if (double duration = 0; slow_ >= 0 && e.modes[slow_] == ContactMode::slip && may_stop(duration) && duration <= h)
    return stop_slip(first, duration);
  if (n_passes_ > kMaxPasses) return failed(Kind::no_right_stage, {.contact = slow_});
  if (is_first_) e.h = std::min(h, first_length(*step_, dynamics_, tolerance_, info_.end_time));
  trial_.h = e.h;
  if (!take(e.h)) return failed(Kind::no_motion, {});
  trial_.error = step_->error(tolerance_);
  if (!StepControl::accepts(trial_.error)) return {};
  record_forces(e);  // find() evaluates others
  event_ = info_.n_c() > 0 ? functions_.find(step_->ends, from_rest_) : DetectedEvent();
  if (event_) {
    const int i = event_.contact;
    return failed(Kind::sign_condition, {.kind = Violation::Kind::past_switch,
                                         .passed = event_.kind,
                                         .contact = i,
                                         .time = event_.theta * e.h,
                                         .value = event_.slope * (1 - event_.theta) * e.h,
                                         .level = event_.level});
  }
  if (info_.n_c() > 0 && !functions_.is_exact() && e.h > kShortestRefined * info_.end_time)
    return failed(Kind::sign_condition, {.kind = Violation::Kind::inexact,
                                         .passed = functions_.inexact().kind,
                                         .contact = functions_.inexact().contact});
  known_ = Known::both_ends;
  slow_ = -1;
  n_passes_ = 0;
  record(e);
  return {};
}

/// (6), of slow_ and all contacts that are as slow. @param duration  dt [s]
bool ExplicitRunSolver::may_stop(double& duration) {
  const StepEnds& ends = step_->ends;
  const double of_q = kOfTolerance * tolerance_ * (1 + ends.q0.lpNorm<Eigen::Infinity>()),
               of_v = kOfTolerance * tolerance_ * (1 + ends.v0.lpNorm<Eigen::Infinity>());
  const auto rest_of = [&](int i) { return functions_.rest(i, ends.q0, ends.v0, ends.a0); };
  const auto rest = rest_of(slow_);
  duration = rest.duration;
  functions_.find_slow(slow_, ends.q0, ends.v0, stopping_);
  if (!(duration > 0)) return false;
  is_straight_ = stopping_.size() > 1 || rest.distance <= of_v;
  if (stopping_.size() == 1) return is_straight_ || rest.speed * rest.turning_time <= of_q;
  return std::ranges::all_of(stopping_, [&](int i) {
    const auto other = rest_of(i);
    return std::hypot(other.distance, other.rate * (duration - other.duration)) <= of_v;
  });
}

/// Announces that the slip of slow_ stops in the element.
StepFailure ExplicitRunSolver::stop_slip(int first, double duration) {
  Element& e = buffers_.element(first);
  StepEnds& ends = step_->ends;
  double speed = 0;
  for (const int i : stopping_) {
    double* d = held_.data() + info_.contacts[i].tangent_index;
    functions_.slip_velocity(i, ends.q0.data(), ends.v0.data(), d);
    const double size = std::hypot(d[0], d[1]);
    if (i == slow_) speed = size;
    for (int k = 0; k < 2 && size > 0; ++k) d[k] /= size;
  }
  stops_ = true;
  e.h = duration;
  trial_ = {};
  event_ = {.kind = SwitchKind::slip_stops, .contact = slow_, .theta = 1, .slope = -speed / duration};
  const Violation violation{
      .kind = Violation::Kind::past_switch, .passed = SwitchKind::slip_stops, .contact = slow_, .time = duration};
  return {
      .kind = StepFailure::Kind::sign_condition, .violation = violation, .element = first, .h = duration, .count = 1};
}

void ExplicitRunSolver::hold_directions() {
  for (const int i : stopping_) dynamics_.hold_direction(i, held_.data() + info_.contacts[i].tangent_index);
}

/// Ends the element with zero slip velocity of the contacts that stop. False where a contact that turns would not stick.
bool ExplicitRunSolver::end_at_rest(const Element& e) {
  StepEnds& ends = step_->ends;
  law_ = dynamics_.law_forces();
  modes_ = e.modes;
  for (const int i : stopping_) modes_[i] = ContactMode::stick;
  dynamics_.set_modes(modes_, ends.q1.data(), ends.v1.data());
  if (!dynamics_.project(ends.q1.data(), ends.v1.data(), ModeDynamics::Order::position_first)) return false;
  is_projected_ = true;
  if (!is_straight_) {
    if (!dynamics_.accelerate(ends.q1.data(), ends.v1.data(), ends.a1.data())) return false;
    const auto sticks = [&](int i) { return dynamics_.normal_force(i) >= 0 && dynamics_.cone_margin(i) >= 0; };
    if (!std::ranges::all_of(stopping_, sticks)) return false;
  }
  dynamics_.set_modes(e.modes, ends.q1.data(), ends.v1.data());
  dynamics_.set_law_forces(law_);
  hold_directions();
  return dynamics_.accelerate(ends.q1.data(), ends.v1.data(), ends.a1.data());
}

/// The function of an event at the right end, with the forces there.
double ExplicitRunSolver::value_at_end(const DetectedEvent& event) {
  StepEnds& ends = step_->ends;
  if (!stops_) return functions_.value_with_forces(event, ends.q1.data(), ends.v1.data());
  double v_t[2];
  functions_.slip_velocity(event.contact, ends.q1.data(), ends.v1.data(), v_t);
  const double* d = held_.data() + info_.contacts[event.contact].tangent_index;
  return d[0] * v_t[0] + d[1] * v_t[1];
}

/// (4), from the zero of the polynomial of the trial on. @param h  in: of the trial; out: up to the event [s]
bool ExplicitRunSolver::reach(DetectedEvent& event, double& h) {
  StepEnds& ends = step_->ends;
  const double longest = h;
  h *= event.theta;
  if (!(h > 0)) return false;
  double h_before = 0, value_before = 0, last = std::numeric_limits<double>::infinity();
  for (int k = 0; k < kMaxIterations; ++k) {
    if (!take(h)) return false;
    if (event.level > 0 || passes_) return true;  // any place near that level does
    const double value = value_at_end(event);
    if (event.kind != SwitchKind::gap_closes && k > 0 && value != value_before && h != h_before)
      event.slope = (value - value_before) / (h - h_before);
    else
      event.slope = functions_.slope(event, ends.q1.data(), ends.v1.data());
    const double dh = -value / event.slope;
    if (!std::isfinite(dh)) return false;
    const bool stalls = std::abs(dh) <= kStalls * h && std::abs(dh) >= 0.5 * last;
    if (is_shift(dh, h) || stalls) return shift_to(event, dh, h);
    last = std::abs(dh);
    h_before = h;
    value_before = value;
    h += std::clamp(dh, -0.7 * h, 2 * h);
    if (h > 2 * longest) return false;
  }
  return false;
}

/// (5)
bool ExplicitRunSolver::is_shift(double dh, double h) const {
  const StepEnds& ends = step_->ends;
  const double jerk = (ends.a1 - ends.a0).lpNorm<Eigen::Infinity>() / h;
  return std::abs(dh) * std::max(step_->error(tolerance_) * tolerance_, kRounding) <= kRounding * h &&
         dh * dh * jerk <= kRounding * (1 + ends.v1.lpNorm<Eigen::Infinity>());
}

/// Moves the right end along the motion, to where the function of the event is rounding. The forces are those there.
bool ExplicitRunSolver::shift_to(const DetectedEvent& event, double dh, double& h) {
  StepEnds& ends = step_->ends;
  for (int k = 0; k < kMaxShifts && dh != 0; ++k) {
    is_shifted_ = true;
    ends.q1 += dh * ends.v1 + 0.5 * dh * dh * ends.a1;
    ends.v1 += dh * ends.a1;
    h += dh;
    if (!dynamics_.closed().empty() && !dynamics_.accelerate(ends.q1.data(), ends.v1.data(), ends.a1.data()))
      return false;
    const double left = -value_at_end(event) / event.slope;
    if (!(std::abs(left) < 0.5 * std::abs(dh)) || std::abs(left) <= kRounding * h) break;
    dh = left;
  }
  return h > 0;
}

/// The element in which slip of stopping_ ends, unless something else happens in it.
bool ExplicitRunSolver::run_to_stop(int first, double remaining) {
  Element& e = buffers_.element(first);
  StepEnds& ends = step_->ends;
  known_ = Known::nothing;
  hold_directions();
  if (!reach(event_, e.h) || e.h > remaining * (1 + kEndRounding)) return false;
  ends.h = e.h;
  if (!StepControl::accepts(step_->error(tolerance_)) || functions_.find(ends, stopping_) || !end_at_rest(e))
    return false;
  record_forces(e);
  record(e);
  end_with({.kind = event_.kind, .contact = slow_, .together = stopping_.size() > 1}, first);
  slow_ = -1;
  n_passes_ = 0;
  return true;
}

void ExplicitRunSolver::end_with(const Switch& end, int element) {
  buffers_.step().ends[static_cast<std::size_t>(element)] = end;
}

bool ExplicitRunSolver::run_to_switch(int first, int, Violation, double remaining, SearchBudget& budget) {
  if (!budget.spend()) return false;
  if (stops_) return run_to_stop(first, remaining);
  Element& e = buffers_.element(first);
  StepEnds& ends = step_->ends;
  for (int attempt = 0; attempt < kMaxEarlier; ++attempt) {
    passes_ = event_.kind == SwitchKind::slip_stops && e.modes[event_.contact] == ContactMode::slip;
    const double found = event_.theta * e.h;
    if (!reach(event_, e.h)) return false;
    ends.h = e.h;
    record_forces(e);
    // A switch that is met later than it has been found, as a grazing contact is, may come after another one.
    DetectedEvent other;
    if (e.h > (1 + kLater) * found && functions_.another_has_fallen(event_, ends))
      other = functions_.find(ends, from_rest_);
    if (other && other.theta < 1 - kLater) {
      event_ = other;
      continue;
    }
    if (e.h > remaining * (1 + kEndRounding)) return false;
    record(e);
    shortest_load_ = event_.duration;
    n_passes_ = !passes_ ? 0 : event_.contact == slow_ ? n_passes_ + 1 : 1;
    slow_ = passes_ ? event_.contact : -1;
    if (passes_) return true;  // no switch: slip goes on
    end_with({.kind = event_.kind, .contact = event_.contact, .left_gap = event_.level > 0 ? -event_.level : 0}, first);
    return true;
  }
  return false;
}

/// The forces that the dynamics has. @param lambda_n, lambda_t  out: n_c, n_lambda_t, zero before
void ExplicitRunSolver::copy_forces(double* lambda_n, double* lambda_t) const {
  for (const int i : dynamics_.closed()) {
    lambda_n[i] = dynamics_.normal_force(i);
    const auto& contact = info_.contacts[i];
    if (contact.n_t > 0) dynamics_.tangential_force(i, lambda_t + contact.tangent_index);
  }
}

/// Records them as those at the right end.
void ExplicitRunSolver::record_forces(Element& e) {
  e.end_lambda_n.setZero();
  e.end_lambda_t.setZero();
  copy_forces(e.end_lambda_n.data(), e.end_lambda_t.data());
}

/// The element from the ends of the step; its forces have been recorded.
void ExplicitRunSolver::record(Element& e) {
  const StepEnds& ends = step_->ends;
  is_first_ = false;
  e.q1 = ends.q1;
  e.v1 = ends.v1;
  e.a.col(0) = ends.a0;
  e.end_a = ends.a1;
  e.is_projected = is_projected_;
  e.has_end_forces = true;
  if (keeps_stages_) record_stages(e);
}

/// The values of (1), (2) at the stages; of an element that has been shifted, by a step of its length.
void ExplicitRunSolver::record_stages(Element& e) {
  if (is_shifted_) step_->take(e.h, nullptr);
  step_->copy_stages(e.v, e.a);
  for (int i = 0; i < pair_.n_s; ++i) {
    e.q.col(i) = e.q0;
    for (int j = 0; j < i; ++j) e.q.col(i) += e.h * pair_.A(i, j) * e.v.col(j);
  }
  e.lambda_n.setZero();
  e.lambda_t.setZero();
  if (dynamics_.closed().empty()) return;
  Vector a(info_.n_q);
  for (const int k : from_rest_) dynamics_.hold_direction(k, e.slip_start.data() + info_.contacts[k].tangent_index);
  for (int i = 0; i < pair_.n_s; ++i) {
    dynamics_.accelerate(e.q.col(i).data(), e.v.col(i).data(), a.data());
    for (const int k : from_rest_) dynamics_.hold_direction(k, nullptr);
    copy_forces(e.lambda_n.col(i).data(), e.lambda_t.col(i).data());
  }
}

}  // namespace ricochet
