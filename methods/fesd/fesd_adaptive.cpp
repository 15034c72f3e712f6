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
#include "methods/progress_limit.h"
#include "methods/registry.h"
#include "methods/runge_kutta/tableau_argument.h"

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
  /// @param rest_speed  normal velocity up to which a bounce is closed [m/s]
  AdaptiveRun(const Problem& problem, const ButcherTableau& tableau, const Settings& settings,
              const FrictionConeOptions& cone, const ElementError& error, double rest_speed,
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
  Next after_failure(const Attempt& attempt, Status status);
  Next repeat_with(double h);
  void choose_length(double H, double wanted);
  bool accept(const Attempt& attempt);
  Next stop(Status status, const std::string& where, const std::string& message, FailureReason reason = {});

  const ProblemInfo& info_;
  const Settings& settings_;
  const ElementError& error_;
  const double exponent_;  // of (4)
  const double rest_speed_;
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

AdaptiveRun::AdaptiveRun(const Problem& problem, const ButcherTableau& tableau, const Settings& settings,
                         const FrictionConeOptions& cone, const ElementError& error, double rest_speed,
                         const CaptureHeight& capture_height, ReusedSolver& reused)
    : info_(problem.info()),
      settings_(settings),
      error_(error),
      exponent_(-1.0 / (tableau.order + 1)),
      rest_speed_(rest_speed),
      T_(problem.info().end_time),
      run_(problem, tableau, settings, StepCheck::kTolerances * settings.tolerance, FesdAudit::Claims{.cone = cone},
           reused.counters()),
      solver_(reused.start(
          settings.inner_tolerance,
          [&](PivotingSolver& solver) { solver.set_motion_tolerance(settings.tolerance, capture_height); })),
      moving_(problem),
      spans_(problem),
      progress_(problem.info(), kTriesPerMark, kLeastOfTries),
      h_(kFirstStep * T_) {}

Solution AdaptiveRun::solve() {
  const std::function<bool(const Element&)> is_accurate = [&](const Element& element) {
    return error_(element, moving_, settings_.tolerance) <= kHopeless;
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
  const double H = attempt.H;
  const FesdStep& step = solver_.step();
  double error = error_(step.last(), moving_, settings_.tolerance);
  if (run_.has_no_derivative(step))
    return stop(Status::infeasible, fmt::format("t = {:.12g} s: ", time()), VariedProblem::kNoDerivative);
  if (Sensitivity* sensitivity = run_.sensitivity()) {
    sensitivity->add(step, attempt.is_last ? sensitivity->dt_final() : sensitivity->dt());
    error = std::max(error, error_(step.last(), *sensitivity, settings_.tolerance));
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
    h_ = 0.5 * attempt.H;
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
class FesdAdaptive final : public Method {
 public:
  explicit FesdAdaptive(const MethodSpec& spec)
      : id_(spec.text()),
        tableau_(tableau_argument(spec)),
        cone_(cone_argument(spec)),
        error_(tableau_),
        capture_height_(spec) {
    options_.n_fe = 1;
    options_.between_stages = true;
    options_.facets = cone_.facets;
    if (const Capture captured = capture(tableau_); tableau_.is_stiffly_accurate() && captured.absorbs())
      kappa_ = captured.kappa;
  }

  MethodInfo info() const override {
    return {.id = id_,
            .title = fmt::format("FESD-J, {}, error-controlled", tableau_.name),
            .source = "Nurkanovic, Frey, Pozharskiy, Diehl: FESD-J, section 3; error control of this project",
            .order_smooth = static_cast<double>(tableau_.order),
            .order_impacts = static_cast<double>(tableau_.order),
            .is_adaptive = true,
            .has_sensitivities = true,
            .is_audited = true,
            .impact_laws = all_impact_hypotheses(),
            .has_restitution_of_speed = true,
            .has_static_friction = true,
            .has_regions = true,
            .has_islands = !capture_height_.is_stated(),  // whose range follows from the whole
            .is_allocation_free = true};
  }

  Support supports(const ProblemInfo& problem) const override {
    // A body that rests on a surface which is accelerated would creep along in steps as short as rounding asks for.
    const auto rests_on_moving = [](const ContactInfo& contact) {
      return contact.is_moving && !contact.is_affine && contact.eps_r == 0;
    };
    const auto found = std::find_if(problem.contacts.begin(), problem.contacts.end(), rests_on_moving);
    if (!tableau_.is_stiffly_accurate() && found != problem.contacts.end()) {
      return Support::no(fmt::format(
          "tableau {} has no stage at the right end; what rests on '{}', a surface that is accelerated, needs one",
          tableau_.name, found->name));
    }
    return can_hold_bilateral(tableau_, problem);
  }

 protected:
  Solution do_solve(const Problem& problem, const Settings& settings) const override {
    ReusedSolver reused(problem, tableau_, options_);
    return run(problem, settings, reused);
  }

  std::unique_ptr<Solver> do_prepare(const Problem& problem) const override {
    return std::make_unique<PreparedFesd>(
        problem, tableau_, options_,
        [this, &problem](const Settings& settings, ReusedSolver& reused) { return run(problem, settings, reused); });
  }

 private:
  Solution run(const Problem& problem, const Settings& settings, ReusedSolver& reused) const {
    return AdaptiveRun(problem, tableau_, settings, cone_, error_, settings.tolerance / kappa_, capture_height_, reused)
        .solve();
  }

  std::string id_;
  ButcherTableau tableau_;
  FrictionConeOptions cone_;
  ElementError error_;
  CaptureHeight capture_height_;
  PivotingSolver::Options options_;
  // Nothing is closed without a stage at the right end that stops it.
  double kappa_ = std::numeric_limits<double>::infinity();
};

const bool is_registered = register_method<FesdAdaptive>({
    .name = "fesd_adaptive",
    .usage = "fesd_adaptive:TABLEAU:STAGES[,cone=exact|squared][,cone=polyhedral[,facets=8]]"
             "[,capture_height=m], or fesd_adaptive:@TABLEAU_FILE, with --tolerance",
    .max_arguments = 2,
    .summary = "FESD-J with steps that follow a tolerance",
    .examples = {"fesd_adaptive:radau-iia:3", "fesd_adaptive:radau-iia:4", "fesd_adaptive:gauss:4"},
});

}  // namespace
}  // namespace ricochet
