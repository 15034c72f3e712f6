#include "reference/event_located.h"

#include <cvode/cvode.h>
#include <fmt/format.h>
#include <nvector/nvector_serial.h>
#include <sundials/sundials_context.h>
#include <sunlinsol/sunlinsol_dense.h>
#include <sunmatrix/sunmatrix_dense.h>
#include <sunnonlinsol/sunnonlinsol_fixedpoint.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <memory>

#include "problems/input_error.h"
#include "reference/contact_dynamics.h"

namespace ricochet::reference {
namespace {

// Normal velocities and gaps below this part of their terms are rounding and integration error.
constexpr double kRest = 1e-9;
// Flights shorter than this part of end_time could end within CVODE's own first step.
constexpr double kShortFlight = 1e-3;

/// CVODE's objects, released in the right order.
class Cvode {
 public:
  Cvode(Integrator integrator, int n, void* user_data, CVRhsFn rhs, CVRootFn roots, int n_roots, double tolerance) {
    SUNContext_Create(nullptr, &context_);
    y_ = N_VNew_Serial(n, context_);
    memory_ = CVodeCreate(integrator == Integrator::adams ? CV_ADAMS : CV_BDF, context_);
    CVodeInit(memory_, rhs, 0, y_);
    CVodeSStolerances(memory_, tolerance, tolerance);
    CVodeSetUserData(memory_, user_data);
    CVodeSetMaxNumSteps(memory_, 10'000'000);
    CVodeSetMaxErrTestFails(memory_, 30);
    CVodeSetErrHandlerFn(
        memory_, [](int, const char*, const char*, char*, void*) {}, nullptr);  // statuses say it
    if (integrator == Integrator::adams) {
      nonlinear_ = SUNNonlinSol_FixedPoint(y_, 0, context_);
      CVodeSetNonlinearSolver(memory_, nonlinear_);
    } else {
      matrix_ = SUNDenseMatrix(n, n, context_);
      linear_ = SUNLinSol_Dense(y_, matrix_, context_);
      CVodeSetLinearSolver(memory_, linear_, matrix_);
    }
    if (n_roots > 0) {
      CVodeRootInit(memory_, n_roots, roots);
      CVodeSetNoInactiveRootWarn(memory_);
      std::vector<int> falling(static_cast<std::size_t>(n_roots), -1);
      CVodeSetRootDirection(memory_, falling.data());
    }
  }
  ~Cvode() {
    CVodeFree(&memory_);
    if (nonlinear_) SUNNonlinSolFree(nonlinear_);
    if (linear_) SUNLinSolFree(linear_);
    if (matrix_) SUNMatDestroy(matrix_);
    N_VDestroy(y_);
    SUNContext_Free(&context_);
  }
  Cvode(const Cvode&) = delete;
  Cvode& operator=(const Cvode&) = delete;

  void* memory() const { return memory_; }
  N_Vector y() const { return y_; }

 private:
  SUNContext context_ = nullptr;
  N_Vector y_ = nullptr;
  SUNMatrix matrix_ = nullptr;
  SUNLinearSolver linear_ = nullptr;
  SUNNonlinearSolver nonlinear_ = nullptr;
  void* memory_ = nullptr;
};

class EventLocatedRun {
 public:
  EventLocatedRun(const Problem& problem, const EventLocatedSettings& settings)
      : problem_(problem),
        settings_(settings),
        n_q_(problem.n_q()),
        n_c_(problem.n_c()),
        dynamics_(problem),
        cvode_(settings.integrator, 2 * n_q_, this, right_hand_side, root_functions, n_c_, settings.tolerance),
        is_closed_(static_cast<std::size_t>(n_c_), false),
        last_impact_(static_cast<std::size_t>(n_c_), -1),
        begin_(Clock::now()) {
    lambda_.setZero(n_c_);
    gap_.setZero(n_c_);
    scratch_.setZero(n_q_);
  }

  Solution run();

 private:
  using Clock = std::chrono::steady_clock;

  static int right_hand_side(double, N_Vector y, N_Vector y_dot, void* self) {
    auto& run = *static_cast<EventLocatedRun*>(self);
    const double* state = N_VGetArrayPointer(y);
    double* rate = N_VGetArrayPointer(y_dot);
    std::copy_n(state + run.n_q_, run.n_q_, rate);
    return run.dynamics_.acceleration(state, state + run.n_q_, rate + run.n_q_, run.lambda_.data()) ? 0 : -1;
  }

  /// Open contact: gap. Closed contact: normal force.
  static int root_functions(double, N_Vector y, double* values, void* self) {
    auto& run = *static_cast<EventLocatedRun*>(self);
    const double* q = N_VGetArrayPointer(y);
    run.problem_.gap(q, values);
    if (run.dynamics_.closed().empty()) return 0;
    if (!run.dynamics_.acceleration(q, q + run.n_q_, run.scratch_.data(), run.lambda_.data())) return -1;
    for (const int i : run.dynamics_.closed()) values[i] = run.lambda_[i];
    return 0;
  }

  void load(Vector& q, Vector& v) const {
    const double* y = N_VGetArrayPointer(cvode_.y());
    q = Eigen::Map<const Vector>(y, n_q_);
    v = Eigen::Map<const Vector>(y + n_q_, n_q_);
  }

  void collect_counters(Counters& counters) const;
  bool check_gaps(double t, Solution& solution);
  bool decide_modes(double t, const std::vector<int>& at_root, Solution& solution);
  bool stop(Solution& solution, Status status, double t, const std::string& reason) const;
  void set_closed();

  const Problem& problem_;
  const EventLocatedSettings& settings_;
  const int n_q_, n_c_;
  ContactDynamics dynamics_;
  Cvode cvode_;
  std::vector<char> is_closed_;
  std::vector<double> last_impact_;
  double first_step_ = std::numeric_limits<double>::infinity();  // bound for CVODE's first step behind an impact
  Clock::time_point begin_;
  Vector lambda_, gap_, scratch_;
};

bool EventLocatedRun::stop(Solution& solution, Status status, double t, const std::string& reason) const {
  solution.status = status;
  solution.message = fmt::format("t = {:.12g} s: {}", t, reason);
  return false;
}

void EventLocatedRun::set_closed() {
  std::vector<int> closed;
  for (int i = 0; i < n_c_; ++i) {
    if (is_closed_[i]) closed.push_back(i);
  }
  dynamics_.set_closed(closed);
}

/// A root that CVODE's root finding missed shows as penetration.
bool EventLocatedRun::check_gaps(double t, Solution& solution) {
  const Matrix J = problem_.normal_jacobian(solution.q);
  gap_ = problem_.gap(solution.q);
  for (int i = 0; i < n_c_; ++i) {
    const double size =
        J.col(i).cwiseAbs().dot(solution.q.cwiseAbs() + problem_.info().end_time * solution.v.cwiseAbs());
    if (gap_[i] < -std::max(1e-9, 100 * settings_.tolerance) * size) {  // more than closed contacts drift
      return stop(solution, Status::inner_solver_failed, t,
                  fmt::format("contact '{}' was passed unnoticed, its gap is {:.3g} m",
                              problem_.info().contacts[i].name, gap_[i]));
    }
  }
  return true;
}

/// Impacts, closings and detachments at an instant; solution.q, solution.v hold the state before, and after on return.
bool EventLocatedRun::decide_modes(double t, const std::vector<int>& at_root, Solution& solution) {
  if (n_c_ == 0) return true;
  const Vector v_minus = solution.v;
  const std::vector<char> was_closed = is_closed_;
  const Matrix J = problem_.normal_jacobian(solution.q);
  const auto gap_size = [&](int i) { return J.col(i).cwiseAbs().dot(solution.q.cwiseAbs()); };
  const auto speed_size = [&](int i) { return J.col(i).cwiseAbs().dot(v_minus.cwiseAbs()); };

  gap_ = problem_.gap(solution.q);
  std::vector<int> touching;
  for (int i = 0; i < n_c_; ++i) {
    const bool found = std::find(at_root.begin(), at_root.end(), i) != at_root.end();
    if (is_closed_[i] && found) {  // its force vanishes
      is_closed_[i] = false;
      solution.events.push_back({t, EventKind::detach, i, solution.q, v_minus, v_minus, Vector::Zero(n_c_), Vector(), {}});
      continue;
    }
    if (is_closed_[i] || found || gap_[i] <= 1e-13 * gap_size(i)) touching.push_back(i);
  }
  if (touching.empty()) return true;

  bool approaches = false;
  for (const int i : touching)
    approaches = approaches || (!was_closed[i] && J.col(i).dot(v_minus) < -kRest * speed_size(i));
  Vector Lambda_n = Vector::Zero(n_c_);
  if (approaches) {
    const auto impact = dynamics_.impact(solution.q, v_minus, touching);
    if (!impact) return stop(solution, Status::inner_solver_failed, t, "the impact law has no solution");
    solution.v = impact->v_plus;
    Lambda_n = impact->Lambda_n;
  }
  std::vector<int> candidates;
  first_step_ = std::numeric_limits<double>::infinity();
  for (const int i : touching) {
    const double v_n = J.col(i).dot(solution.v);
    is_closed_[i] = false;
    if (v_n <= kRest * speed_size(i)) {
      candidates.push_back(i);
    } else {  // if it comes back soon, the first step must end before, or its root is never bracketed
      dynamics_.acceleration(solution.q.data(), solution.v.data(), scratch_.data(), lambda_.data());
      const double flight = v_n / (std::abs(J.col(i).dot(scratch_)) + std::numeric_limits<double>::min());
      if (flight < kShortFlight * problem_.info().end_time) first_step_ = std::min(first_step_, 0.1 * flight);
    }
  }
  if (!candidates.empty()) {
    const auto closed = dynamics_.closing(solution.q, solution.v, candidates);
    if (!closed) return stop(solution, Status::inner_solver_failed, t, "the contact force problem has no solution");
    for (const int i : *closed) is_closed_[i] = true;
  }
  for (int i = 0; i < n_c_; ++i) {
    const bool impact = Lambda_n[i] > 0 && !was_closed[i];
    if (impact) {
      solution.events.push_back({t, EventKind::impact, i, solution.q, v_minus, solution.v, Lambda_n, Vector(), {}});
      if (last_impact_[i] >= 0 && t - last_impact_[i] < settings_.zeno_interval * problem_.info().end_time) {
        return stop(solution, Status::step_limit, t,
                    fmt::format("the impacts of contact '{}' accumulate (Zeno); event location cannot pass",
                                problem_.info().contacts[i].name));
      }
      last_impact_[i] = t;
    }
  }
  return true;
}

/// Adds CVODE's counters since its last start.
void EventLocatedRun::collect_counters(Counters& counters) const {
  long steps = 0, iterations = 0, factorizations = 0;
  CVodeGetNumSteps(cvode_.memory(), &steps);
  CVodeGetNumNonlinSolvIters(cvode_.memory(), &iterations);
  if (settings_.integrator == Integrator::bdf) CVodeGetNumLinSolvSetups(cvode_.memory(), &factorizations);
  counters.steps += steps;
  counters.elements += steps;
  counters.inner_iterations += iterations;
  counters.matrix_factorizations += factorizations;
  counters.force_evaluations = dynamics_.force_evaluations;
  counters.mass_factorizations = dynamics_.mass_factorizations;
}

Solution EventLocatedRun::run() {
  Solution solution;
  solution.q = problem_.info().q0;
  solution.v = problem_.info().v0;
  const double T = problem_.info().end_time;
  const auto restart = [&](double t) {
    collect_counters(solution.counters);
    set_closed();
    double* y = N_VGetArrayPointer(cvode_.y());
    std::copy_n(solution.q.data(), n_q_, y);
    std::copy_n(solution.v.data(), n_q_, y + n_q_);
    CVodeReInit(cvode_.memory(), t, cvode_.y());
    CVodeSetStopTime(cvode_.memory(), T);
    if (first_step_ > 0 && t + first_step_ < T)
      CVodeSetInitStep(cvode_.memory(), first_step_);
    else
      CVodeSetInitStep(cvode_.memory(), 0);
  };
  if (decide_modes(0, {}, solution)) {
    restart(0);
    while (true) {
      double t = 0;
      const int flag = CVode(cvode_.memory(), T, cvode_.y(), &t, settings_.time_limit > 0 ? CV_ONE_STEP : CV_NORMAL);
      load(solution.q, solution.v);
      solution.t = t;
      if (flag < 0) {
        const std::unique_ptr<char, decltype(&std::free)> name(CVodeGetReturnFlagName(flag), &std::free);
        stop(solution, Status::inner_solver_failed, t, fmt::format("CVODE ended with {}", name.get()));
        break;
      }
      if (settings_.time_limit > 0 &&
          std::chrono::duration<double>(Clock::now() - begin_).count() > settings_.time_limit) {
        stop(solution, Status::time_limit, t, fmt::format("the time limit of {:.6g} s is over", settings_.time_limit));
        break;
      }
      if (!check_gaps(t, solution)) break;
      if (flag == CV_ROOT_RETURN) {
        std::vector<int> found(static_cast<std::size_t>(n_c_));
        CVodeGetRootInfo(cvode_.memory(), found.data());
        std::vector<int> at_root;
        for (int i = 0; i < n_c_; ++i) {
          if (found[i] != 0) at_root.push_back(i);
        }
        if (!decide_modes(t, at_root, solution)) break;
        if (static_cast<long>(solution.events.size()) >= settings_.max_events) {
          stop(solution, Status::step_limit, t, fmt::format("{} events", settings_.max_events));
          break;
        }
        restart(t);
        continue;
      }
      if (t >= T) break;
    }
  }
  collect_counters(solution.counters);
  solution.counters.events = static_cast<std::int64_t>(solution.events.size());
  return solution;
}

}  // namespace

Solution integrate_event_located(const Problem& problem, const EventLocatedSettings& settings) {
  if (problem.info().has_friction())
    throw InputError("reference", problem.info().id, "friction is not part of the reference yet");
  return EventLocatedRun(problem, settings).run();
}

}  // namespace ricochet::reference
