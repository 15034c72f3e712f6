#include "methods/event_driven/event_driven_run.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace ricochet {
namespace {

using Kind = Happening::Kind;

constexpr float kSafety = 0.8F, kBeta = 0.04F;  // of (1)
constexpr double kMinFactor = 1.0 / 3, kMaxFactor = 6;
constexpr float kLeastLogError = -13;      // of e_before, 1e-4
constexpr double kLanding = 0.01;          // of the tolerance, (2)
constexpr double kShortest = 1e-14;        // of the end time: what time can resolve
constexpr double kShortestRefined = 1e-6;  // of the end time: step that becomes shorter for a gap that it nearly closes
constexpr double kLastCheck = 1000;        // tolerances that a gap may have gathered when a step is accepted
constexpr int kMaxStandstills = 100;       // a few events may coincide
constexpr int kMaxLandings = 8;
constexpr long kMaxSteps = 10'000'000;
constexpr double kSlipStart = 0.05;  // of end_time and the cube root of the tolerance: first length of slip from rest
constexpr int kMaxTurns = 30;        // iterations for its direction

}  // namespace

EventDrivenRun::EventDrivenRun(const Problem& problem, const Settings& settings, const StepFormula& formula,
                               EventDrivenWorkspace& workspace, int n_samples)
    : problem_(problem),
      info_(problem.info()),
      settings_(settings),
      tolerance_(settings.tolerance),
      T_(problem.info().end_time),
      n_samples_(settings.recording >= Recording::grid ? n_samples : 0),
      time_limit_(settings.time_limit),
      counters_(workspace.counters),
      scales_(workspace.scales),
      dynamics_(workspace.dynamics),
      functions_(workspace.functions),
      mode_change_(workspace.mode_change),
      step_(*workspace.step),
      ends_(step_.ends),
      before_(info_.contacts.size(), ContactMode::open),
      v_minus_(info_.v0),
      check_(problem, kLastCheck * tolerance_) {
  workspace.start(tolerance_);
  if (settings.sensitivities.empty()) return;
  sensitivity_.emplace(problem, std::get<EmbeddedTableau>(formula), scales_, dynamics_, settings);
  mode_change_.keep_impacts(&impacts_);
}

bool EventDrivenRun::stop(Status status, const std::string& message) {
  solution_.status = status;
  solution_.message = fmt::format("at t = {:.6g} s: {}", t_, message);
  return false;
}

bool EventDrivenRun::stop_undetermined() {
  return stop(Status::inner_solver_failed, ModeDynamics::kUndetermined);
}

/// The acceleration at the left end, and the forces there.
bool EventDrivenRun::accelerate() {
  return dynamics_.accelerate(ends_.q0.data(), ends_.v0.data(), ends_.a0.data()) || stop_undetermined();
}

Solution EventDrivenRun::solve() {
  if (begin()) {
    while (t_ < T_ && take_step()) {
    }
  }
  if (solution_.succeeded() && info_.has_bilateral()) dynamics_.project(ends_.q0.data(), ends_.v0.data());
  solution_.t = t_;
  solution_.q = ends_.q0;
  solution_.v = ends_.v0;
  counters_.elements = counters_.steps;
  solution_.counters = counters_;
  if (sensitivity_) sensitivity_->finish(ends_.q0, ends_.v0, ends_.a0, solution_);
  return std::move(solution_);
}

bool EventDrivenRun::begin() {
  ends_.q0 = info_.q0;
  ends_.v0 = info_.v0;
  scales_.begin_step(ends_.q0.data(), ends_.v0.data(), T_ / 10, true);
  if (!change_modes({})) return false;
  choose_first_length();
  return true;
}

/// Hairer, Norsett, Wanner, Solving ODEs I, section II.4.
void EventDrivenRun::choose_first_length() {
  const double n = 2.0 * info_.n_q;
  const auto norm = [&](const Vector& x, const Vector& y) {  // of (x, y) as a state or as its rate
    double sum = 0;
    for (Eigen::Index k = 0; k < x.size(); ++k) {
      const double a = x[k] / (1 + std::abs(ends_.q0[k])), b = y[k] / (1 + std::abs(ends_.v0[k]));
      sum += a * a + b * b;
    }
    return std::sqrt(sum / n) / tolerance_;
  };
  const double d0 = norm(ends_.q0, ends_.v0), d1 = norm(ends_.v0, ends_.a0);
  double h = d0 * tolerance_ < 1e-5 || d1 * tolerance_ < 1e-5 ? 1e-6 * T_ : 0.01 * d0 / d1;
  h = std::min(h, T_);
  ends_.q1 = ends_.q0 + h * ends_.v0;
  ends_.v1 = ends_.v0 + h * ends_.a0;
  h_ = h;
  if (!dynamics_.accelerate(ends_.q1.data(), ends_.v1.data(), ends_.a1.data())) return;
  const double d2 = norm(ends_.v1 - ends_.v0, ends_.a1 - ends_.a0) / h, d = std::max(d1, d2);
  const double power = std::pow(0.01 / d, 1.0 / (step_.order + 1));
  h_ = std::min({100 * h, d * tolerance_ <= 1e-15 ? 100 * h : power, T_});
}

bool EventDrivenRun::take_step() {
  if (time_limit_.is_over()) return stop(Status::time_limit, time_limit_.message());
  if (counters_.steps >= kMaxSteps) return stop(Status::step_limit, fmt::format("{} steps", kMaxSteps));
  const double rest = T_ - t_;
  const bool is_last = 1.01 * h_ >= rest;
  const double h = is_last ? rest : h_;
  if (h < kShortest * T_ && !is_last) return stop(Status::inner_solver_failed, "the steps become too short");
  functions_.begin_step();
  EventFunctions* const watched = functions_.has_forces() ? &functions_ : nullptr;
  double e = step_.take(h, watched) ? step_.error(tolerance_) : std::numeric_limits<double>::infinity();
  if (sensitivity_ && e <= 1) e = std::max(e, sensitivity_->take(ends_, h));
  // (1), whose digits do not matter: logarithms of floats are fast.
  const float exponent = 1.0F / static_cast<float>(step_.error_order + 1) - 0.75F * kBeta;
  const float log_e = std::log2(static_cast<float>(e) + 1e-30F);
  if (!(e <= 1)) {
    h_ = h * (std::isfinite(e) ? std::max<double>(kMinFactor, kSafety * std::exp2(-exponent * log_e)) : 0.1);
    was_rejected_ = true;
    return true;
  }
  const double most = was_rejected_ ? 1 : kMaxFactor;
  const double factor = kSafety * std::exp2(kBeta * last_log_error_ - exponent * log_e);
  const bool keeps_length = factor >= 1 && factor <= step_.kept_growth;
  const double next = keeps_length ? h : h * std::clamp(factor, kMinFactor, most);
  if (!is_last || next > h_) h_ = next;
  last_log_error_ = std::max(log_e, kLeastLogError);
  was_rejected_ = false;
  if (!step_.finish()) return stop_undetermined();
  Happening event = info_.n_c() > 0 ? functions_.find(ends_) : Happening();
  if (event) {
    double until = event.theta * h;
    if (!reach(event, until)) {
      h_ = 0.5 * h;
      was_rejected_ = true;
      return true;
    }
    ++counters_.steps;
    return land(until) && (settle_slip(event) || change_modes(event));
  }
  if (info_.n_c() > 0 && h > kShortestRefined * T_ && !functions_.is_exact()) {
    h_ = 0.5 * h;
    was_rejected_ = true;
    return true;
  }
  ++counters_.steps;
  const double end = is_last ? T_ : t_ + h;
  record_motion(end);
  if (!sample_until(end)) return false;
  t_ = end;
  if (sensitivity_) sensitivity_->accept();
  ends_.advance();
  if (const Status status = check_(ends_.q0, ends_.v0, dynamics_.modes()); status != Status::success)
    return stop(status, check_.message());
  if (info_.n_c() > 0) functions_.advance(ends_.v0);
  if (settings_.recording >= Recording::grid && n_samples_ == 0)
    solution_.samples.push_back({t_, ends_.q0, ends_.v0, ends_.v0});
  return solution_.succeeded();
}

/// A step of length h [s] to the event. @return false where (2) does not come to hold
bool EventDrivenRun::reach(Happening& event, double& h) {
  if (!(h > 0)) return true;
  for (int k = 0; k < kMaxLandings; ++k) {
    if (!step_.take(h, nullptr) || !step_.finish()) return false;
    const double jerk = (ends_.a1 - ends_.a0).lpNorm<Eigen::Infinity>() / h;
    event.slope = functions_.slope(event, ends_.q1.data(), ends_.v1.data());
    const double dt = -functions_.value(event, ends_.q1.data(), ends_.v1.data()) / event.slope;
    const bool holds = dt * dt * (ends_.a1.lpNorm<Eigen::Infinity>() + jerk) <= kLanding * tolerance_;  // (2)
    if (!(std::abs(dt) < h)) return holds;
    if (!holds) {
      h += dt;
      continue;
    }
    double moved = dt;
    for (int taylor = 0; taylor < 3; ++taylor) {
      ends_.q1 += moved * ends_.v1 + 0.5 * moved * moved * ends_.a1;
      ends_.v1 += moved * ends_.a1;
      h += moved;
      const double left = functions_.value(event, ends_.q1.data(), ends_.v1.data());
      moved = -left / event.slope;
      if (std::abs(moved) <= 1e-16 * (t_ + h) || std::abs(moved) > std::abs(dt)) break;
    }
    return true;
  }
  return false;
}

/// The left end becomes the right one, at the event.
bool EventDrivenRun::land(double h) {
  if (h > 0) {
    if (sensitivity_) {
      if (!std::isfinite(sensitivity_->take(ends_, h))) return stop_undetermined();
      sensitivity_->accept();
    }
    ends_.h = h;
    record_motion(t_ + h);
    if (!sample_until(t_ + h)) return false;
    t_ += h;
    ends_.q0 = ends_.q1;
    ends_.v0 = ends_.v1;
  }
  if (info_.clock >= 0) ends_.q0[info_.clock] = t_;
  // Forces at the event, for the decision.
  return (dynamics_.closed().empty() && !sensitivity_) || accelerate();
}

/// The last v_stop of slip in space: up to where it stops, with the acceleration held. True where it only passes by, and
/// the step goes on.
bool EventDrivenRun::settle_slip(const Happening& event) {
  if (event.kind != Kind::slip_stops || info_.contacts[event.contact].n_t != 2) return false;
  double dt = 0;
  if (!functions_.stops(event.contact, ends_.q0, ends_.v0, ends_.a0, dt)) {
    functions_.pass(ends_.q0.data(), ends_.v0.data());
    return true;
  }
  dt = std::min(dt, T_ - t_);
  if (sensitivity_) sensitivity_->glide(ends_.q0, ends_.v0, ends_.a0, dt);
  const auto glide = [&](double h) {
    ends_.q1 = ends_.q0 + h * ends_.v0 + 0.5 * h * h * ends_.a0;
    ends_.v1 = ends_.v0 + h * ends_.a0;
    return true;
  };
  sample_until(t_ + dt, glide);
  glide(dt);
  ends_.h = dt;
  ends_.a1 = ends_.a0;
  ends_.collocation = nullptr;
  record_motion(t_ + dt);
  ends_.q0 = ends_.q1;
  ends_.v0 = ends_.v1;
  t_ += dt;
  return false;
}

bool EventDrivenRun::change_modes(const Happening& cause) {
  const bool is_first = last_event_ < 0;
  before_ = dynamics_.modes();
  v_minus_ = ends_.v0;
  scales_.begin_step(ends_.q0.data(), ends_.v0.data(), T_ / 10, false);
  impacts_.clear();
  if (sensitivity_) {
    if (const auto reason = sensitivity_->reach(cause, ends_.q0, ends_.v0, ends_.a0))
      return stop(Status::infeasible, *reason);
  }
  const auto outcome = mode_change_.decide(cause, is_first ? nullptr : &before_, ends_.q0, ends_.v0);
  if (outcome.status != Status::success) return stop(outcome.status, outcome.message);
  if (is_first) {
    for (auto& mode : before_) mode = ContactMode::open;
    solution_.initial_modes = dynamics_.modes();
  }
  standstills_ = t_ - last_event_ <= kShortest * T_ ? standstills_ + 1 : 0;
  last_event_ = t_;
  if (standstills_ > kMaxStandstills)
    return stop(Status::step_limit,
                fmt::format("events accumulate at contact '{}'", info_.contacts[cause.contact].name));
  record(cause, outcome.has_impact ? v_minus_ : ends_.v0);
  if (sensitivity_ && !vary_event()) return false;
  if (!mode_change_.beginning().empty() && t_ < T_ && !start_slip()) return false;
  if (!accelerate()) return false;
  if (info_.n_c() > 0) functions_.begin(ends_.q0.data(), ends_.v0.data());
  return true;
}

/// The derivatives go through what has happened.
bool EventDrivenRun::vary_event() {
  if (!accelerate()) return false;
  auto reason = sensitivity_->strike(impacts_, before_, ends_.q0);
  if (!reason) reason = sensitivity_->leave(before_, ends_.q0, ends_.v0, ends_.a0);
  return !reason || stop(Status::infeasible, *reason);
}

/// The first moments of slip in space from rest. Its direction d = v_t / |v_t| has a limit there, but returns to it at a
/// rate without bound, which no explicit step follows. With the direction that slip has in the middle of a short step,
/// held over the whole of it, the error is of second order where the direction turns from the start on.
bool EventDrivenRun::start_slip() {
  const auto& contacts = mode_change_.beginning();
  double h = std::min(kSlipStart * std::cbrt(tolerance_) * T_, T_ - t_);
  if (!accelerate()) return false;
  for (const int i : contacts) {
    double angle = 0, last_angle = 0, last_sine = 0;
    for (int k = 0; k < kMaxTurns; ++k) {
      double d[2], v_t[2];
      dynamics_.direction(i, d);
      if (k == 0) angle = std::atan2(d[1], d[0]);
      if (!step_.take(0.5 * h, nullptr))
        return stop(Status::inner_solver_failed, "no motion follows the begin of slip");
      functions_.slip_velocity(i, ends_.q1.data(), ends_.v1.data(), v_t);
      const double sine = (d[0] * v_t[1] - d[1] * v_t[0]) / std::hypot(v_t[0], v_t[1]);
      const double turn = k == 0 || sine == last_sine ? sine : -sine * (angle - last_angle) / (sine - last_sine);
      last_angle = angle;
      last_sine = sine;
      angle += std::clamp(turn, -0.5, 0.5);
      const double turned[2]{std::cos(angle), std::sin(angle)};
      dynamics_.hold_direction(i, turned);
      if (std::abs(sine) < 1e-12 || std::abs(turn) < 1e-12) break;
    }
  }
  if (!step_.take(h, nullptr)) return stop(Status::inner_solver_failed, "no motion follows the begin of slip");
  if (sensitivity_ && !sensitivity_->take_slip_start(ends_, h, contacts)) return stop_undetermined();
  if (!sample_until(t_ + h)) return false;
  ends_.q0 = ends_.q1;
  ends_.v0 = ends_.v1;
  for (const int i : contacts) dynamics_.hold_direction(i, nullptr);
  t_ += h;
  h_ = std::min(h_, h);
  ++counters_.steps;
  return true;
}

/// Dense samples up to a time, whose states lie `reach(h)` from the left end of the step at hand; its right end is kept.
bool EventDrivenRun::sample_until(double end, const auto& reach) {
  const auto time = [&] { return T_ * next_sample_ / n_samples_; };
  if (next_sample_ > n_samples_ || time() > end) return true;
  const Vector q1 = ends_.q1, v1 = ends_.v1, a1 = ends_.a1;
  for (; next_sample_ <= n_samples_ && time() <= end; ++next_sample_) {
    if (!reach(time() - t_)) return stop_undetermined();
    solution_.samples.push_back({time(), ends_.q1, ends_.v1, ends_.v1});
  }
  ends_.q1 = q1;
  ends_.v1 = v1;
  ends_.a1 = a1;
  return true;
}

bool EventDrivenRun::sample_until(double end) {
  return sample_until(end, [&](double h) { return step_.take(h, nullptr); });
}

/// The interpolation of the step at hand, which ends at a time [s].
void EventDrivenRun::record_motion(double end) {
  if (settings_.recording != Recording::motion) return;
  solution_.motion.add(t_, end, ends_.degree(), [&](double s, Vector& q, Vector& v) {
    q.resize(info_.n_q);
    v.resize(info_.n_q);
    ends_.interpolate(s, q, v);
  });
}

void EventDrivenRun::record(const Happening& cause, const Vector& v_minus) {
  const auto& modes = dynamics_.modes();
  const Vector& Lambda_n = mode_change_.Lambda_n();
  for (const int i : info_.unilateral) {
    const auto kind = event_kind(before_[i], modes[i], Lambda_n[i] > 0, cause.is(Kind::slip_stops, i));
    if (!kind) continue;
    ++counters_.events;
    if (settings_.recording == Recording::final_state) continue;
    solution_.events.push_back({t_, *kind, i, ends_.q0, v_minus, ends_.v0, Lambda_n, mode_change_.Lambda_t(), modes,
                                sensitivity_ ? sensitivity_->dt() : Vector()});
  }
  if (settings_.recording >= Recording::grid) solution_.samples.push_back({t_, ends_.q0, v_minus, ends_.v0});
}

}  // namespace ricochet
