#pragma once

#include <fmt/format.h>

#include <algorithm>
#include <optional>
#include <span>
#include <string>

#include "methods/contact_laws/group_record.h"
#include "methods/elements/element_motion.h"
#include "methods/fesd/element_path.h"
#include "methods/fesd/fesd_audit.h"
#include "methods/fesd/sensitivity.h"
#include "methods/method.h"
#include "methods/regions/region_border.h"
#include "methods/step_check.h"
#include "methods/time_limit.h"

namespace ricochet {

/// Handles the accepted steps of all FESD methods. It checks a step for the last time, records its events and
/// grid points, audits and differentiates it, keeps the state reached, and ends the run.
class FesdRun {
 public:
  /// Problem and settings have to outlive the run. @param accuracy  of the gaps at the ends of elements, see StepCheck
  /// @param claims  claims for the audit; without them there is no audit
  /// @param counters  of the solver of the steps
  FesdRun(const Problem& problem, const ButcherTableau& tableau, const Settings& settings, double accuracy,
          const std::optional<FesdAudit::Claims>& claims, Counters& counters);

  bool time_is_over() const { return time_limit_.is_over(); }
  /// Null if no derivatives are requested.
  Sensitivity* sensitivity() { return sensitivity_ ? &*sensitivity_ : nullptr; }
  /// Whether derivatives are requested and this step has none: VariedProblem::kNoDerivative.
  bool has_no_derivative(const FesdStep& step) const { return sensitivity_ && step.has_impact_sequence(); }

  /// State at the end of the last accepted element.
  const Vector& q() const { return reached_ ? reached_->q1 : problem_.info().q0; }
  const Vector& v() const { return reached_ ? reached_->v1 : problem_.info().v0; }
  /// Contact modes of the last accepted element; empty before the first one.
  std::span<const ContactMode> modes() const {
    return reached_ ? std::span<const ContactMode>(reached_->modes) : std::span<const ContactMode>();
  }
  /// Accepts the next step, which has been added to sensitivity(). It must not move until the following one is
  /// accepted.
  /// @return false where the step fails the last check, or refused groups end the run: it has ended with the reason; or
  /// where Settings::ends holds
  /// @param previous  the one before it, or null; @param t, t_end  from and to [s]
  /// @param groups  events of groups of contacts where the step begins
  bool accept(const FesdStep& step, const FesdStep* previous, double t, double t_end, const GroupInstant& groups = {});
  /// The run ends here. @param message, reason  why; not read after a time limit, which has its own message
  void fail(Status status, const std::string& where, const std::string& message, FailureReason reason = {});

  /// Takes Settings::steps steps of equal length H. @param solver  has step() and previous_step()
  /// @param advance  solves the next one: Status(double H); @param fail_step  calls fail(): void(Status, std::string where)
  /// @param skip_steps  takes up to n steps that are not recorded: int(double H, int n)
  template <class Solver, class Advance, class FailStep, class SkipSteps>
  void take_equal_steps(const Solver& solver, const Advance& advance, const FailStep& fail_step,
                        const SkipSteps& skip_steps);
  template <class Solver, class Advance, class FailStep>
  void take_equal_steps(const Solver& solver, const Advance& advance, const FailStep& fail_step) {
    take_equal_steps(solver, advance, fail_step, [](double, int) { return 0; });
  }

  /// The run so far, at its end.
  Solution finish();

 private:
  bool leaves_region(const FesdStep& step);
  void bound_motion(const FesdStep& step);

  static constexpr int kMaxSkipped = 1 << 16;  // steps between two checks of the time limit

  const Problem& problem_;
  const Settings& settings_;
  Counters& counters_;
  const TimeLimit time_limit_;
  Solution solution_;
  StepCheck check_;
  std::optional<FesdAudit> audit_;
  std::optional<Sensitivity> sensitivity_;
  std::optional<ElementMotion> motion_;  // of Recording::motion, or to watch the region
  std::optional<ElementPath> path_;      // if Settings::reached is requested
  Matrix coefficients_;                  // of path_
  RegionBorder border_;
  GroupRecord groups_;
  const Element* reached_ = nullptr;  // the last element that was accepted
};

template <class Solver, class Advance, class FailStep, class SkipSteps>
void FesdRun::take_equal_steps(const Solver& solver, const Advance& advance, const FailStep& fail_step,
                               const SkipSteps& skip_steps) {
  const int n = settings_.steps;
  const double T = problem_.info().end_time, H = T / n;
  const bool looks_at_every_step =
      border_.is_watched() || settings_.ends || audit_ || sensitivity_ || settings_.recording >= Recording::grid;
  for (int k = 0; k < n; ++k) {
    if (k > 0 && !looks_at_every_step) {
      k += skip_steps(H, std::min(n - k, kMaxSkipped));
      solution_.t = k < n ? k * H : T;
      if (k == n) return;
    }
    const auto where = [&] { return fmt::format("step {} of {}, from t = {:.6g} s: ", k + 1, n, k * H); };
    const Status status = advance(H);
    if (status != Status::success) return fail_step(status, where());
    if (has_no_derivative(solver.step())) return fail(Status::infeasible, where(), VariedProblem::kNoDerivative);
    if (sensitivity_) sensitivity_->add(solver.step(), (k + 1.0) / n * sensitivity_->dt_final());
    if (!accept(solver.step(), solver.previous_step(), k * H, k + 1 == n ? T : (k + 1) * H)) return;
  }
}

}  // namespace ricochet
