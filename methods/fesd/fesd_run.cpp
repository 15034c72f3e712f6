#include "methods/fesd/fesd_run.h"

#include "methods/contact_laws/bernstein.h"
#include "methods/fesd/record_step.h"

namespace ricochet {

FesdRun::FesdRun(const Problem& problem, const ButcherTableau& tableau, const Settings& settings, double accuracy,
                 const std::optional<FesdAudit::Claims>& claims, Counters& counters)
    : problem_(problem),
      settings_(settings),
      counters_(counters),
      time_limit_(settings.time_limit),
      check_(problem, accuracy),
      border_(problem, settings),
      groups_(problem.info()) {
  if (settings.audit && claims) audit_.emplace(problem, tableau, *claims);
  if (settings.recording == Recording::motion || border_.is_watched()) motion_.emplace(tableau);
  if (settings.reached != nullptr) {
    path_.emplace(tableau);
    coefficients_.resize(problem.n_q(), path_->degree() + 1);
  }
  if (!settings.sensitivities.empty()) sensitivity_.emplace(problem, tableau, settings.sensitivities);
}

/// Whether an element of the step leaves the region, or begins outside of it after an impact.
bool FesdRun::leaves_region(const FesdStep& step) {
  if (!border_.is_watched()) return false;
  RegionExit& exit = solution_.exit;
  double begin = 0;
  for (int n = 0; n < step.n_elements; begin += step.elements[n++].h) {
    const Element& element = step.elements[n];
    exit = {};
    exit.function = border_.left_by_jump(element.q0, step.v_minus.col(n), element.v0);
    if (exit.function >= 0) {
      exit.inside = exit.outside = begin;
      return true;
    }
    Motion motion;
    motion_->add(0, element.h, element, motion);
    if (motion.empty()) continue;
    const auto state = [&](double s, Vector& q, Vector& v) { motion.within(0, s, q, v); };
    if (border_.is_left(element.h, state, exit)) {
      exit.inside += begin;
      exit.outside += begin;
      return true;
    }
  }
  exit = {};
  return false;
}

bool FesdRun::accept(const FesdStep& step, const FesdStep* previous, double t, double t_end,
                     const GroupInstant& groups) {
  for (int n = 0; n < step.n_elements; ++n) {
    const Element& element = step.elements[n];
    const Status status = check_(element.q0, element.q1, element.v1, element.modes);
    if (status == Status::success) continue;
    fail(status, fmt::format("from t = {:.12g} s: ", settings_.begin + t), check_.message());
    return false;
  }
  if (leaves_region(step)) {
    if (sensitivity_) sensitivity_->reject();
    return false;
  }
  record_step(problem_, settings_.recording, step, previous, t, sensitivity(), solution_);
  if (audit_) audit_->add(step, previous, t);
  double begin = t;
  for (int n = 0; settings_.recording == Recording::motion && n < step.n_elements; ++n) {
    const double end = n + 1 == step.n_elements ? t_end : begin + step.elements[n].h;
    motion_->add(begin, end, step.elements[n], solution_.motion);
    begin = end;
  }
  bound_motion(step);
  reached_ = &step.last();
  solution_.t = t_end;
  if (!groups_.add(t, groups, solution_)) {
    fail(Status::step_limit, fmt::format("t = {:.12g} s: ", settings_.begin + t), groups_.message(settings_.begin),
         groups_.reason());
    return false;
  }
  return !(settings_.ends && settings_.ends(solution_, reached_->modes));
}

/// Extends Settings::reached.
void FesdRun::bound_motion(const FesdStep& step) {
  if (!path_) return;
  for (int n = 0; n < step.n_elements; ++n) {
    for (int k = 0; k < problem_.n_q(); ++k) path_->set_position(step.elements[n], k, coefficients_);
    bernstein::extend(coefficients_, path_->degree(), *settings_.reached);
  }
}

void FesdRun::fail(Status status, const std::string& where, const std::string& message, FailureReason reason) {
  const bool is_late = status == Status::time_limit;
  solution_.status = status;
  solution_.message = where + (is_late ? time_limit_.message() : message);
  solution_.reason = is_late ? FailureReason() : std::move(reason);
}

Solution FesdRun::finish() {
  solution_.q = q();
  solution_.v = v();
  counters_.events = solution_.counters.events;
  solution_.counters = counters_;
  if (audit_) solution_.residuals = audit_->residuals();
  if (sensitivity_) {
    solution_.dq = sensitivity_->dq();
    solution_.dv = sensitivity_->dv();
  }
  return std::move(solution_);
}

}  // namespace ricochet
