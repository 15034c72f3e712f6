#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "methods/contact_laws/force_spans.h"
#include "methods/elements/bilateral_support.h"
#include "methods/fesd/capture.h"
#include "methods/fesd/element_error.h"
#include "methods/fesd/fesd_run.h"
#include "methods/fesd/moving_contacts.h"
#include "methods/fesd/reused_solver.h"
#include "methods/modes/step_control.h"
#include "methods/progress_limit.h"
#include "methods/registry.h"
#include "methods/runge_kutta/embedded_tableau.h"
#include "methods/runge_kutta/tableau_argument.h"
#include "methods/runge_kutta/tableau_file.h"
#include "problems/input_error.h"

namespace ricochet {
namespace {

constexpr double kMaxGrowth = 4, kMaxShrinking = 0.2, kSafety = 0.8;  // of (4)
constexpr double kKeepFrom = 0.9, kKeepTo = 1.5;  // factors of (4) that are not worth another length
constexpr double kFirstStep = 0.05;               // of end_time; the first elements tell more
constexpr double kHopeless = 100;          // an error that an element which ends at a switch inside will hardly lose
constexpr double kShortest = 1e-13;        // of end_time; what time can resolve
constexpr double kShortestOnCurve = 1e-6;  // of end_time, where shorter steps would only drift a little less
constexpr double kFewRoundings = 1e-10;    // of end_time, of a step in which bodies that come to rest fly no higher
constexpr int kMaxRefusals = 6;            // of a closed bounce: by then its step is a ten thousandth
constexpr double kClosingErrors = 2;       // errors of an element that a closed bounce explains, by its velocity
constexpr int kMaxStandstills = 100;       // steps in a row too short to move t; a few switches may coincide
constexpr long kTriesPerMark = 20'000;     // steps tried between two looks at the progress
constexpr double kLeastOfTries = 1e-4;     // of end_time, the progress that they have to make

/// A run of FesdAdaptive.
class AdaptiveRun {
 public:
  /// Tableau and error estimate of a method. They must outlive the run.
  struct Formula {
    ButcherTableau tableau;
    std::optional<EmbeddedTableau> pair;  ///< of an explicit tableau
    std::optional<ElementError> error;    ///< of an implicit one
    double kappa;                         ///< of capture.h: bounces with tolerance / kappa are closed [1 / s]
  };

  AdaptiveRun(const Problem& problem, const Formula& formula, const Settings& settings, const FrictionConeOptions& cone,
              const CaptureHeight& capture_height, ReusedSolver& reused);

  Solution solve();

 private:
  /// Outcome of a tried step: it is accepted, or another one starts at the same time, or the run has failed.
  enum class Next : std::uint8_t { accept, repeat, stop };
  /// The length that is tried, and whether the run would end with it.
  struct Attempt {
    double H;
    bool is_last;
  };

  Attempt next_attempt();
  double time() const { return settings_.begin + t_; }  // of the whole, for messages
  double rest_speed() const { return may_close_ ? rest_speed_ : 0; }
  Next judge(const Attempt& attempt, const PivotingSolver::ClosedBounces& closed);
  Next judge_pair(const Attempt& attempt, const RunSolver::Trial& trial);
  Next after_failure(const Attempt& attempt, Status status);
  Next repeat_with(double h);
  void choose_length(double H, double wanted);
  bool accept(const Attempt& attempt);
  Next stop(Status status, const std::string& where, const std::string& message, FailureReason reason = {});

  const ProblemInfo& info_;
  const Settings& settings_;
  const Formula& formula_;
  std::optional<StepControl> control_;  // in the place of (3), (4): of an explicit pair
  const double exponent_;               // of (4)
  const double rest_speed_;             // normal velocity up to which a bounce is closed [m/s]
  const double T_;
  FesdRun run_;
  PivotingSolver& solver_;
  MovingContacts moving_;
  ForceSpans spans_;
  ProgressLimit progress_;
  long tries_ = 0;
  double t_ = 0, h_;  // where the next step begins, and how long it may be [s]
  int standstills_ = 0;
  bool may_close_ = true;  // bounces of the next step
  int refusals_ = 0;       // of the bounces closed at t
};

AdaptiveRun::AdaptiveRun(const Problem& problem, const Formula& formula, const Settings& settings,
                         const FrictionConeOptions& cone, const CaptureHeight& capture_height, ReusedSolver& reused)
    : info_(problem.info()),
      settings_(settings),
      formula_(formula),
      exponent_(-1.0 / (formula.tableau.order + 1)),
      rest_speed_(settings.tolerance / formula.kappa),
      T_(problem.info().end_time),
      run_(problem, formula.tableau, settings, StepCheck::kTolerances * settings.tolerance,
           FesdAudit::Claims{.cone = cone}, reused.counters()),
      solver_(reused.start(settings.inner_tolerance,
                           [&](PivotingSolver& solver) {
                             solver.set_motion_tolerance(settings.tolerance, capture_height);
                             solver.keep_stages(settings.audit);
                           })),
      moving_(problem),
      spans_(problem),
      progress_(problem.info(), kTriesPerMark, kLeastOfTries),
      h_(kFirstStep * T_) {
  if (!formula.pair) return;
  control_.emplace(formula.pair->error_order, 1);
  h_ = T_;  // explicit_run.h knows the first length
}

Solution AdaptiveRun::solve() {
  const std::function<bool(const Element&)> is_accurate = [&](const Element& element) {
    return control_ || (*formula_.error)(element, moving_, settings_.tolerance) <= kHopeless;
  };
  while (t_ < T_) {
    if (progress_.is_passed(tries_++, t_)) {
      stop(Status::step_limit, fmt::format("t = {:.12g} s: ", time()), progress_.message(run_.modes()));
      break;
    }
    const Attempt attempt = next_attempt();
    PivotingSolver::ElementStep step{.status = Status::time_limit, .closed = {}};
    if (!run_.time_is_over()) step = solver_.advance_to_switch(attempt.H, rest_speed(), is_accurate);
    const Next next =
        step.status == Status::success ? judge(attempt, step.closed) : after_failure(attempt, step.status);
    if (next == Next::stop || (next == Next::accept && !accept(attempt))) break;
  }
  return run_.finish();
}

/// The last two steps share what is left, so that none is tiny.
AdaptiveRun::Attempt AdaptiveRun::next_attempt() {
  const double rest = T_ - t_, h = std::min(h_, spans_.longest_step(t_, h_, run_.q(), run_.v()));
  const bool is_last = h >= rest * (1 - 1e-12);
  return {is_last ? rest : (2 * h > rest ? 0.5 * rest : h), is_last};
}

/// Decides whether the error of a solved step is accepted, and how long the next step may be.
AdaptiveRun::Next AdaptiveRun::judge(const Attempt& attempt, const PivotingSolver::ClosedBounces& closed) {
  if (control_) return judge_pair(attempt, *solver_.trial());
  const double H = attempt.H;
  const FesdStep& step = solver_.step();
  const ElementError& error_of = *formula_.error;
  double error = error_of(step.last(), moving_, settings_.tolerance);
  if (run_.has_no_derivative(step))
    return stop(Status::infeasible, fmt::format("t = {:.12g} s: ", time()), VariedProblem::kNoDerivative);
  if (Sensitivity* sensitivity = run_.sensitivity()) {
    sensitivity->add(step, attempt.is_last ? sensitivity->dt_final() : sensitivity->dt());
    error = std::max(error, error_of(step.last(), *sensitivity, settings_.tolerance));
  }
  const bool can_be_shorter = H > kShortest * T_;
  if (error > kHopeless && !can_be_shorter)
    return stop(Status::step_limit, fmt::format("t = {:.12g} s: ", time()),
                fmt::format("a step of {:.3g} s still has {:.3g} times the error allowed", H, error));
  const double wanted =
      std::clamp(kSafety * std::pow(std::max(error, 1e-300), exponent_), kMaxShrinking, kMaxGrowth);  // (4)
  if (error > 1 && can_be_shorter) {
    // A bounce that cannot be followed is closed. Its velocity is an error that a shorter step does not reduce. The
    // motion after it has to be as accurate as elsewhere.
    const bool was_refused = closed.throughout && rest_speed() == 0;
    const bool is_of_motion = error * settings_.tolerance > kClosingErrors * closed.speed;
    if (was_refused && is_of_motion && ++refusals_ <= kMaxRefusals) return repeat_with(0.2 * H);
    if (!was_refused) {
      // A shorter step does not change the effect of the forces that close a bounce: the contact has to bounce once
      // more.
      if (closed.throughout) may_close_ = false;
      return repeat_with(closed.throughout ? h_ : step.H * wanted);
    }
  }
  refusals_ = 0;
  may_close_ = true;
  choose_length(H, wanted);
  return Next::accept;
}

/// The same by the embedded estimate of the trial, before a switch cut it short: the length is kept after a switch.
AdaptiveRun::Next AdaptiveRun::judge_pair(const Attempt& attempt, const RunSolver::Trial& trial) {
  if (trial.h == 0) return Next::accept;
  if (!StepControl::accepts(trial.error)) {
    if (trial.h <= kShortest * T_)
      return stop(Status::step_limit, fmt::format("t = {:.12g} s: ", time()),
                  fmt::format("a step of {:.3g} s still has {:.3g} times the error allowed", trial.h, trial.error));
    control_->reject();
    return repeat_with(trial.h * control_->factor_of_rejected(trial.error));
  }
  const double next = control_->next(trial.h, trial.error);
  const bool is_cut = attempt.is_last && trial.h == attempt.H;  // by the end time, not by the error
  if (!is_cut || next > h_) h_ = std::min(next, T_);
  if (const double load = solver_.shortest_load(); load > 0) h_ = std::min(h_, std::max(load, 2 * kShortest * T_));
  return Next::accept;
}

/// An element that a switch has cut short says what its own length may become; if it is too short for that, the length
/// before it was good enough. Where a short pulse of a load has made the switch, the next element is no longer than that.
void AdaptiveRun::choose_length(double H, double wanted) {
  const double length = solver_.step().H;
  if (length < H)
    h_ = std::min(wanted < kMaxGrowth ? length * wanted : std::max(h_, length * wanted), T_);
  else if (wanted < kKeepFrom || wanted > kKeepTo)
    h_ = std::min(std::max(H, h_) * wanted, T_);
  if (const double load = solver_.shortest_load(); load > 0) h_ = std::min(h_, load);
}

/// Forgets the step, which has a solution.
AdaptiveRun::Next AdaptiveRun::repeat_with(double h) {
  solver_.reject();
  if (Sensitivity* sensitivity = run_.sensitivity()) sensitivity->reject();
  h_ = h;
  return Next::repeat;
}

/// A step without a solution is halved where that may help.
AdaptiveRun::Next AdaptiveRun::after_failure(const Attempt& attempt, Status status) {
  const StepFailure& failure = solver_.failure();
  const double shortest = failure.drifts() ? kShortestOnCurve : kShortest;
  if (status != Status::time_limit && failure.depends_on_length() && attempt.H > shortest * T_) {
    const double tried = control_ ? solver_.trial()->h : 0;
    h_ = 0.5 * (tried > 0 ? std::min(attempt.H, tried) : attempt.H);
    if (control_) control_->reject();
    if (attempt.H < kFewRoundings * T_ && solver_.settle()) h_ = kFirstStep * T_;
    return Next::repeat;
  }
  if (status != Status::time_limit && solver_.let_go()) {
    h_ = kFirstStep * T_;
    return Next::repeat;
  }
  return stop(status, fmt::format("from t = {:.12g} s, with a step of {:.3g} s: ", time(), attempt.H),
              solver_.failure_message(), solver_.failure_reason());
}

/// False when the step fails the last check, or the time stands still.
bool AdaptiveRun::accept(const Attempt& attempt) {
  const FesdStep& step = solver_.step();
  const double next = attempt.is_last && step.H == attempt.H ? T_ : t_ + step.H;
  if (!run_.accept(step, solver_.previous_step(), t_, next, solver_.groups())) return false;
  if (const int contact = solver_.sunk(); contact >= 0) {
    stop(Status::infeasible, fmt::format("from t = {:.12g} s: ", time()),
         fmt::format("bodies pass through each other at contact '{}'", info_.contacts[contact].name));
    return false;
  }
  standstills_ = next > t_ ? 0 : standstills_ + 1;
  t_ = next;
  if (standstills_ <= kMaxStandstills) return true;
  stop(Status::step_limit, fmt::format("t = {:.12g} s: ", time()),
       fmt::format("{} steps in a row too short to move the time", standstills_));
  return false;
}

AdaptiveRun::Next AdaptiveRun::stop(Status status, const std::string& where, const std::string& message,
                                    FailureReason reason) {
  run_.fail(status, where, message, std::move(reason));
  return Next::stop;
}

/// FESD-J with error control: every element is a step of its own. It ends where the tolerance or a switch says; the
/// lengths are free, so step equilibration has nothing to do. Its local error e is estimated by (1)-(3) of
/// element_error.h.
///
/// A step is accepted when e <= tol (1 + |x|) in every component. The next one has length
///
///   h min(4, max(1/5, 0.8 (tol (1 + |x|) / e)^(1 / (p + 1))))                                                (4)
///
/// at most end_time, but the same length as long as (4) asks for 0.9 to 1.5 of it: the Newton matrix of a length is
/// kept. Steps for which no solution was found are halved. A contact that bounces with less than tol / kappa stays
/// closed (capture.h): its stage forces stop it with accelerations of kappa v_n / h, and an accumulation of impacts
/// ends there, with an error of tol.
///
/// Sensitivities are derivatives of the solution at the lengths chosen, as usual for a method that chooses them: h does
/// not depend on theta where (4) gave it, follows from the switch equation where the element ends at a switch, and the
/// last element has what remains. A perturbation may oscillate where the solution does not; so the lengths have to hold
/// (3) for the derivatives of w, q and v as well, each within tol (1 + |dx|).
///
/// An explicit pair has its own estimate and the lengths of StepControl, and closes bounces at the left end of an element
/// (element_start.h). Its elements have no derivatives.
class FesdAdaptive final : public Method {
 public:
  explicit FesdAdaptive(const MethodSpec& spec)
      : id_(spec.text()), formula_(formula_argument(spec)), cone_(cone_argument(spec)), capture_height_(spec) {
    options_.n_fe = 1;
    options_.between_stages = true;
    options_.facets = cone_.facets;
    if (!formula_.pair) return;
    options_.pair = &*formula_.pair;
    if (cone_.facets > 0)
      throw InputError(fmt::format("{}: a polyhedral cone requires an implicit tableau, for example radau-iia:4", id_));
  }

  MethodInfo info() const override {
    return {.id = id_,
            .title = fmt::format("FESD-J, {}, error-controlled", formula_.tableau.name),
            .source = "Nurkanovic, Frey, Pozharskiy, Diehl: FESD-J, section 3; error control of this project",
            .order_smooth = static_cast<double>(formula_.tableau.order),
            .order_impacts = static_cast<double>(formula_.tableau.order),
            .is_adaptive = true,
            .has_sensitivities = !formula_.pair,
            .is_audited = true,
            .impact_laws = all_impact_hypotheses(),
            .has_restitution_of_speed = true,
            .has_static_friction = true,
            .has_regions = true,
            .has_islands = !formula_.pair && !capture_height_.is_stated(),  // whose range follows from the whole
            .is_allocation_free = true};
  }

  Support supports(const ProblemInfo& problem) const override {
    if (formula_.pair) return Support::yes();
    // A body that rests on a surface which is accelerated would creep along in steps as short as rounding asks for.
    const auto rests_on_moving = [](const ContactInfo& contact) {
      return contact.is_moving && !contact.is_affine && contact.eps_r == 0;
    };
    const auto found = std::find_if(problem.contacts.begin(), problem.contacts.end(), rests_on_moving);
    if (!formula_.tableau.is_stiffly_accurate() && found != problem.contacts.end()) {
      return Support::no(fmt::format(
          "tableau {} has no stage at the right end; what rests on '{}', a surface that is accelerated, needs one",
          formula_.tableau.name, found->name));
    }
    return can_hold_bilateral(formula_.tableau, problem);
  }

 protected:
  Solution do_solve(const Problem& problem, const Settings& settings) const override {
    ReusedSolver reused(problem, formula_.tableau, options_);
    return run(problem, settings, reused);
  }

  std::unique_ptr<Solver> do_prepare(const Problem& problem) const override {
    return std::make_unique<PreparedFesd>(
        problem, formula_.tableau, options_,
        [this, &problem](const Settings& settings, ReusedSolver& reused) { return run(problem, settings, reused); });
  }

 private:
  Solution run(const Problem& problem, const Settings& settings, ReusedSolver& reused) const {
    return AdaptiveRun(problem, formula_, settings, cone_, capture_height_, reused).solve();
  }

  /// "radau-iia:4", "prince-dormand-8-7", "@tableau.json" or "@pair.json"
  static AdaptiveRun::Formula formula_argument(const MethodSpec& spec) {
    if (auto pair = pair_argument(spec)) {
      // The error of a capture at the left end is the velocity that it removes.
      return {.tableau = butcher_tableau(*pair), .pair = std::move(pair), .error = {}, .kappa = 1};
    }
    AdaptiveRun::Formula formula{.tableau = tableau_argument(spec), .pair = {}, .error = {}, .kappa = 0};
    formula.error.emplace(formula.tableau);
    // Nothing is closed without a stage at the right end that stops it.
    const Capture captured = capture(formula.tableau);
    formula.kappa = formula.tableau.is_stiffly_accurate() && captured.absorbs()
                        ? captured.kappa
                        : std::numeric_limits<double>::infinity();
    return formula;
  }

  static std::optional<EmbeddedTableau> pair_argument(const MethodSpec& spec) {
    if (spec.arguments().size() != 1) return {};
    const std::string& name = spec.arguments()[0];
    if (name.starts_with('@'))
      return is_pair_file(name.substr(1)) ? std::optional(read_embedded_tableau(name.substr(1))) : std::nullopt;
    const auto names = embedded_tableau_names();
    return std::ranges::count(names, name) > 0 ? std::optional(embedded_tableau(name)) : std::nullopt;
  }

  std::string id_;
  AdaptiveRun::Formula formula_;
  FrictionConeOptions cone_;
  CaptureHeight capture_height_;
  PivotingSolver::Options options_;
};

const bool is_registered = register_method<FesdAdaptive>({
    .name = "fesd_adaptive",
    .usage = "fesd_adaptive:TABLEAU:STAGES or fesd_adaptive:PAIR[,cone=exact|squared][,cone=polyhedral[,facets=8]]"
             "[,capture_height=m], or fesd_adaptive:@TABLEAU_FILE, with --tolerance",
    .max_arguments = 2,
    .summary = "FESD-J with steps that follow a tolerance",
    .examples = {"fesd_adaptive:radau-iia:3", "fesd_adaptive:radau-iia:4", "fesd_adaptive:gauss:4",
                 "fesd_adaptive:prince-dormand-8-7"},
});

}  // namespace
}  // namespace ricochet
