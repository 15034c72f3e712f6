#include "reference/event_located.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <limits>
#include <memory>

#include "problems/input_error.h"
#include "problems/packed_column.h"
#include "reference/contact_dynamics.h"
#include "reference/cvode.h"
#include "reference/dipping_gaps.h"
#include "reference/slip_start.h"

namespace ricochet::reference {
namespace {

// Normal velocities and gaps below this part of their terms are rounding and integration error.
constexpr double kRest = 1e-9;
// The same where a velocity's own terms vanish with it, as of a contact that rests on its own [m/s, times the largest
// velocity above 1]: normal velocities of closed contacts, and slip velocities away from a root, where contacts that
// stop within rounding of each other stop together.
constexpr double kRestingSpeed = 1e-12;
// Flights shorter than this part of end_time could end within CVODE's own first step.
constexpr double kShortFlight = 1e-3;
// Longest first step of slip in space, as a part of end_time; start_slip() shortens it.
constexpr double kSlipStart = 1e-2;
// Slip velocity [m/s] that CVODE takes over: 1e11 tolerances, and a direction that settles within 1e-3 s at mu g = 1.
constexpr double kFastSlip = 1e-3;

/// Root functions, all watched for falling through zero:
///
///   every contact      gap while open; lambda_n while closed; 1 where bilateral          (1)
///   with friction      stick  mu lambda_n - |lambda_t|                                   (2)
///                      slip   d' v_t + offset, d the slip direction                      (3)
///
/// In the plane d is the sign of the slip. In space it follows the slip, step after step, and the offset is -v_stop:
/// the direction v_t / |v_t| has no limit that an integrator could cross, so the last v_stop of the velocity is left to
/// finish_slip(). A slip that has just begun has v_t = 0; until it is faster than 2 v_stop its offset is +v_stop, and a
/// root then says that the contact moves against its own direction.
///
/// With friction CVODE integrates the impulses of the contact forces besides q and v. Nothing reads them, but its error
/// control does: a body that sticks does not move, however its friction force varies, and steps across the whole of
/// that would pass a root of (2) twice.
class EventLocatedRun {
 public:
  EventLocatedRun(const Problem& problem, const EventLocatedSettings& settings)
      : problem_(problem),
        settings_(settings),
        n_q_(problem.n_q()),
        n_c_(problem.n_c()),
        dynamics_(problem),
        n_impulses_(problem.info().has_friction() ? n_c_ + problem.info().n_lambda_t : 0),
        cvode_(settings.integrator == Integrator::adams ? CV_ADAMS : CV_BDF, 2 * n_q_ + n_impulses_, this,
               right_hand_side, root_functions, number_of_roots(problem), settings.tolerance),
        dipping_gaps_(problem, cvode_, settings.tolerance),
        modes_(dynamics_.modes()),
        slip_(static_cast<std::size_t>(n_c_)),
        last_impact_(static_cast<std::size_t>(n_c_), -1),
        begin_(Clock::now()) {
    lambda_n_.setZero(n_c_);
    lambda_t_.setZero(problem.info().n_lambda_t);
    gap_.setZero(n_c_);
    packed_n_.setZero(problem.info().n_normal_entries);
    scratch_.setZero(n_q_);
    for (int i = 0, k = n_c_; i < n_c_; ++i) slip_[i].root = problem.info().contacts[i].n_t > 0 ? k++ : -1;
  }

  Solution run();

 private:
  using Clock = std::chrono::steady_clock;

  /// What (3) needs to know of a contact.
  struct Slip {
    int root = -1;        ///< index of (2), (3) among the root functions; -1 without friction
    Vector direction;     ///< d, of a contact that slips
    bool is_new = false;  ///< not yet faster than 2 v_stop
  };

  static int number_of_roots(const Problem& problem) {
    const auto& contacts = problem.info().contacts;
    return problem.n_c() + static_cast<int>(std::count_if(contacts.begin(), contacts.end(),
                                                          [](const auto& contact) { return contact.n_t > 0; }));
  }

  static int right_hand_side(double, N_Vector y, N_Vector y_dot, void* self) {
    auto& run = *static_cast<EventLocatedRun*>(self);
    const double* state = N_VGetArrayPointer(y);
    double* rate = N_VGetArrayPointer(y_dot);
    std::copy_n(state + run.n_q_, run.n_q_, rate);
    if (!run.accelerate(state, state + run.n_q_, rate + run.n_q_)) return -1;
    if (run.n_impulses_ == 0) return 0;
    double* lambda = rate + 2 * run.n_q_;
    std::fill_n(lambda, run.n_impulses_, 0);
    for (const int i : run.dynamics_.closed()) {
      const auto& contact = run.problem_.info().contacts[i];
      lambda[i] = run.lambda_n_[i];
      std::copy_n(run.lambda_t_.data() + contact.tangent_index, contact.n_t, lambda + run.n_c_ + contact.tangent_index);
    }
    return 0;
  }

  static int root_functions(double, N_Vector y, double* values, void* self) {
    return static_cast<EventLocatedRun*>(self)->evaluate_roots(N_VGetArrayPointer(y), values) ? 0 : -1;
  }

  /// @param y  q, then v
  bool evaluate_roots(const double* y, double* values) {
    problem_.gap(y, values);  // (1)
    const bool has_friction = problem_.info().has_friction();
    if (has_friction) std::fill_n(values + n_c_, number_of_roots(problem_) - n_c_, 1);
    if (dynamics_.closed().empty()) return true;
    if (!accelerate(y, y + n_q_, scratch_.data())) return false;
    for (const int i : dynamics_.closed()) values[i] = lambda_n_[i];  // (1)
    for (const int i : problem_.info().bilateral) values[i] = 1;
    if (has_friction) friction_roots(y, values);
    return true;
  }

  bool accelerate(const double* q, const double* v, double* a) {
    return dynamics_.acceleration(q, v, a, lambda_n_.data(), lambda_t_.data());
  }

  /// (2) and (3), with the forces of the last accelerate().
  void friction_roots(const double* q, double* values) const {
    const Matrix J_t = problem_.tangent_jacobian(Vector(Eigen::Map<const Vector>(q, n_q_)));
    const Eigen::Map<const Vector> v(q + n_q_, n_q_);
    for (const int i : dynamics_.closed()) {
      const auto& contact = problem_.info().contacts[i];
      if (modes_[i] == ContactMode::stick)
        values[slip_[i].root] = contact.mu * lambda_n_[i] - tangential_force(i).norm();
      else if (is_slipping(modes_[i]))
        values[slip_[i].root] = slip_[i].direction.dot(tangents(J_t, i).transpose() * v) + offset(i);
    }
  }

  double offset(int i) const {
    if (slip_[i].is_new) return v_stop_;
    return modes_[i] == ContactMode::slip ? -v_stop_ : 0;
  }

  Eigen::Block<const Matrix, Eigen::Dynamic, Eigen::Dynamic, true> tangents(const Matrix& J_t, int i) const {
    const auto& contact = problem_.info().contacts[i];
    return J_t.middleCols(contact.tangent_index, contact.n_t);
  }
  Eigen::VectorBlock<const Vector> tangential_force(int i) const {
    const auto& contact = problem_.info().contacts[i];
    return lambda_t_.segment(contact.tangent_index, contact.n_t);
  }
  const std::string& name(int i) const { return problem_.info().contacts[i].name; }

  void load(Vector& q, Vector& v) const {
    const double* y = N_VGetArrayPointer(cvode_.y());
    q = Eigen::Map<const Vector>(y, n_q_);
    v = Eigen::Map<const Vector>(y + n_q_, n_q_);
  }

  struct Roots {
    std::vector<char> normal, friction;  // by contact
  };
  Roots roots() const;

  void collect_counters(Counters& counters) const;
  bool check_gaps(double t, Solution& solution);
  bool check_friction(double t, const Roots& found, Solution& solution);
  void follow_slip(const Solution& solution);
  bool decide_modes(double& t, const Roots& found, Solution& solution);
  std::vector<int> finish_slip(double& t, const Roots& found, Solution& solution);
  bool begin_slip(double& t, Solution& solution);
  std::vector<Vector> known_directions(const Vector& q, const Vector& v, const std::vector<int>& leaving_cone,
                                       const std::vector<int>& stopped, bool impact) const;
  void renew_slip(const std::vector<ContactMode>& before, const std::vector<int>& stopped, bool impact,
                  const std::vector<Vector>& directions, const Solution& solution);
  bool record_events(double t, const std::vector<ContactMode>& before, const std::vector<int>& stopped,
                     const Vector& v_minus, const ContactDynamics::Verdict& impact, Solution& solution);
  void limit_first_step(const std::vector<int>& leaving, const Solution& solution);
  bool stop(Solution& solution, Status status, double t, const std::string& reason) const;

  const Problem& problem_;
  const EventLocatedSettings& settings_;
  const int n_q_, n_c_;
  ContactDynamics dynamics_;
  const int n_impulses_;
  Cvode cvode_;
  DippingGaps dipping_gaps_;
  std::vector<ContactMode> modes_;
  std::vector<Slip> slip_;
  double v_stop_ = 0;      // [m/s]
  double force_size_ = 0;  // largest contact force so far [N]
  std::vector<double> last_impact_;
  double first_step_ = std::numeric_limits<double>::infinity();  // bound for CVODE's first step behind an impact
  Clock::time_point begin_;
  Vector lambda_n_, lambda_t_, gap_, packed_n_, scratch_;
};

bool EventLocatedRun::stop(Solution& solution, Status status, double t, const std::string& reason) const {
  solution.status = status;
  solution.message = fmt::format("t = {:.12g} s: {}", t, reason);
  return false;
}

EventLocatedRun::Roots EventLocatedRun::roots() const {
  std::vector<int> found(static_cast<std::size_t>(number_of_roots(problem_)));
  CVodeGetRootInfo(cvode_.memory(), found.data());
  Roots roots{std::vector<char>(modes_.size(), false), std::vector<char>(modes_.size(), false)};
  for (int i = 0; i < n_c_; ++i) {
    roots.normal[i] = found[i] != 0;
    roots.friction[i] = slip_[i].root >= 0 && found[slip_[i].root] != 0;
  }
  return roots;
}

/// A root that CVODE's root finding missed shows as penetration.
bool EventLocatedRun::check_gaps(double t, Solution& solution) {
  problem_.normal_jacobian(solution.q.data(), packed_n_.data());
  problem_.gap(solution.q.data(), gap_.data());
  for (int i = 0; i < n_c_; ++i) {
    const auto& contact = problem_.info().contacts[i];
    const double* J_n = packed_n_.data() + contact.normal_begin;
    const double size =
        packed_terms(contact, J_n, solution.q) + problem_.info().end_time * packed_terms(contact, J_n, solution.v);
    // More than closed contacts drift; tolerances are absolute in SI units too, for gaps whose terms all vanish.
    const double most = std::max(1e-9, 100 * settings_.tolerance) * size + 100 * settings_.tolerance;
    if (contact.is_bilateral && std::abs(gap_[i]) > most)
      return stop(solution, Status::inner_solver_failed, t,
                  fmt::format("bilateral constraint '{}' has drifted to {:.3g} m", name(i), gap_[i]));
    if (gap_[i] < -most) {
      return stop(solution, Status::inner_solver_failed, t,
                  fmt::format("contact '{}' was passed unnoticed, its gap is {:.3g} m", name(i), gap_[i]));
    }
  }
  return true;
}

/// A root of (2) or (3) that was missed, and forces that grow without bound.
bool EventLocatedRun::check_friction(double t, const Roots& found, Solution& solution) {
  if (dynamics_.closed().empty()) return true;
  if (!accelerate(solution.q.data(), solution.v.data(), scratch_.data()))
    return stop(solution, Status::inner_solver_failed, t, "the contact forces are not unique, (5) is singular");
  const Matrix J_t = problem_.tangent_jacobian(solution.q);
  for (const int i : dynamics_.closed()) force_size_ = std::max(force_size_, std::abs(lambda_n_[i]));
  const double part = std::max(1e-9, 100 * settings_.tolerance);  // as for gaps
  for (const int i : dynamics_.closed()) {
    if (slip_[i].root < 0 || found.normal[i] || found.friction[i]) continue;
    double value = 0, size = force_size_;
    if (modes_[i] == ContactMode::stick) {
      value = problem_.info().contacts[i].mu * lambda_n_[i] - tangential_force(i).norm();
    } else {
      value = slip_[i].direction.dot(tangents(J_t, i).transpose() * solution.v);
      size = std::max(1.0, solution.v.cwiseAbs().maxCoeff());
    }
    if (std::min(value / size, lambda_n_[i] / force_size_) < -part) {
      return stop(
          solution, Status::inner_solver_failed, t,
          fmt::format("the end of mode {} of contact '{}' was passed unnoticed", to_string(modes_[i]), name(i)));
    }
  }
  return true;
}

/// Directions of slip in space behind a step, and slips that are no longer new.
void EventLocatedRun::follow_slip(const Solution& solution) {
  const Matrix J_t = problem_.tangent_jacobian(solution.q);
  for (const int i : dynamics_.closed()) {
    if (!is_slipping(modes_[i])) continue;
    const Vector v_t = tangents(J_t, i).transpose() * solution.v;
    if (slip_[i].direction.dot(v_t) > 2 * v_stop_) slip_[i].is_new = false;
    if (modes_[i] == ContactMode::slip && !slip_[i].is_new) slip_[i].direction = v_t.normalized();
  }
}

/// Contacts at a root of (3), whose slip ends. In space there is v_stop left: the state advances by the time that takes
/// with the acceleration held. The direction is fixed up to what it still turns, so time and velocity are wrong by
/// v_stop times that angle and by v_stop^2 over the deceleration. A slip that only passes close to zero goes on.
std::vector<int> EventLocatedRun::finish_slip(double& t, const Roots& found, Solution& solution) {
  std::vector<int> stopped, in_space;
  for (const int i : dynamics_.closed()) {
    if (!is_slipping(modes_[i]) || !found.friction[i]) continue;
    (modes_[i] == ContactMode::slip ? in_space : stopped).push_back(i);
  }
  if (in_space.empty()) return stopped;

  accelerate(solution.q.data(), solution.v.data(), scratch_.data());
  const Matrix J_t = problem_.tangent_jacobian(solution.q);
  const Vector bias = problem_.slip_acceleration_bias(solution.q, solution.v);
  double duration = 0;
  for (const int i : in_space) {
    const Vector v_t = tangents(J_t, i).transpose() * solution.v;
    const Vector a_t =
        tangents(J_t, i).transpose() * scratch_ + bias.segment(problem_.info().contacts[i].tangent_index, 2);
    const double until = -v_t.dot(a_t) / a_t.squaredNorm();
    if (!(until > 0) || (v_t + until * a_t).norm() > 0.1 * v_t.norm()) continue;
    duration = std::max(duration, until);
    stopped.push_back(i);
  }
  duration = std::min(duration, problem_.info().end_time - t);
  t += duration;
  solution.q += duration * (solution.v + 0.5 * duration * scratch_);
  solution.v += duration * scratch_;
  return stopped;
}

/// Slip directions that are known before the accelerations: of contacts that move, and of those at the edge of their
/// friction cone, where the slip acceleration is zero at this instant and only the force tells where it will point.
std::vector<Vector> EventLocatedRun::known_directions(const Vector& q, const Vector& v,
                                                      const std::vector<int>& leaving_cone,
                                                      const std::vector<int>& stopped, bool impact) const {
  std::vector<Vector> directions(modes_.size());
  const Matrix J_t = problem_.tangent_jacobian(q);
  for (int i = 0; i < n_c_; ++i) {
    if (slip_[i].root < 0) continue;
    const Vector v_t = tangents(J_t, i).transpose() * v;
    if (!impact) {
      if (std::count(stopped.begin(), stopped.end(), i) > 0) continue;
      if (std::count(leaving_cone.begin(), leaving_cone.end(), i) > 0) {
        directions[i] = -tangential_force(i).normalized();
        continue;
      }
      if (modes_[i] == ContactMode::stick) continue;
      if (is_slipping(modes_[i]) && slip_[i].is_new) {
        directions[i] = slip_[i].direction;
        continue;
      }
    }
    if (v_t.norm() > kRestingSpeed * std::max(1.0, v.cwiseAbs().maxCoeff())) directions[i] = v_t.normalized();
  }
  return directions;
}

/// What (3) needs to know, after the modes changed.
void EventLocatedRun::renew_slip(const std::vector<ContactMode>& before, const std::vector<int>& stopped, bool impact,
                                 const std::vector<Vector>& directions, const Solution& solution) {
  const Matrix J_t = problem_.tangent_jacobian(solution.q);
  // A thousand local errors, so that their noise does not turn the direction; loose runs still follow slow slip.
  v_stop_ = std::min(1e3 * settings_.tolerance, 1e-6) * std::max(1.0, solution.v.cwiseAbs().maxCoeff());
  for (int i = 0; i < n_c_; ++i) {
    if (!is_slipping(modes_[i])) continue;
    const bool goes_on = modes_[i] == before[i] && !impact && std::count(stopped.begin(), stopped.end(), i) == 0;
    if (modes_[i] == ContactMode::slip)
      slip_[i].direction = directions[i];
    else
      slip_[i].direction = Vector::Constant(1, slip_sign(modes_[i]));
    if (!goes_on) slip_[i].is_new = slip_[i].direction.dot(tangents(J_t, i).transpose() * solution.v) <= 2 * v_stop_;
  }
}

/// Impacts, closings, detachments, ends and begins of slip at an instant; solution.q, solution.v hold the state before,
/// and after on return. t moves on where a slip in space ends or begins.
bool EventLocatedRun::decide_modes(double& t, const Roots& found, Solution& solution) {
  if (n_c_ == 0) return true;
  for (const int i : dynamics_.closed()) {
    if (found.friction[i] && is_slipping(modes_[i]) && slip_[i].is_new) {
      return stop(
          solution, Status::inner_solver_failed, t,
          fmt::format("inconsistent: contact '{}' began to slip and moves against its slip direction", name(i)));
    }
  }
  const std::vector<int> stopped = finish_slip(t, found, solution);
  if (problem_.info().has_friction())
    accelerate(solution.q.data(), solution.v.data(), scratch_.data());  // forces for the decisions

  const Vector v_minus = solution.v;
  const std::vector<ContactMode> before = modes_;
  const Matrix J = problem_.normal_jacobian(solution.q);
  const auto gap_size = [&](int i) { return J.col(i).cwiseAbs().dot(solution.q.cwiseAbs()); };
  const auto speed_size = [&](int i) { return J.col(i).cwiseAbs().dot(v_minus.cwiseAbs()); };

  gap_ = problem_.gap(solution.q);
  std::vector<int> touching, leaving_cone;
  for (const int i : problem_.info().unilateral) {
    const bool at_cone = found.friction[i] && modes_[i] == ContactMode::stick;
    // Without a tangential force the tip of the cone is reached, and which of the two roots is found is rounding.
    if (is_closed(modes_[i]) && (found.normal[i] || (at_cone && lambda_n_[i] <= kRest * force_size_))) {
      modes_[i] = ContactMode::open;  // its force vanishes
      continue;
    }
    if (at_cone) leaving_cone.push_back(i);
    if (is_closed(modes_[i]) || found.normal[i] || gap_[i] <= 1e-13 * gap_size(i)) touching.push_back(i);
  }

  bool approaches = false;
  for (const int i : touching)
    approaches = approaches || (!is_closed(before[i]) && J.col(i).dot(v_minus) < -kRest * speed_size(i));
  ContactDynamics::Verdict impact;
  if (approaches) {
    impact = dynamics_.impact(solution.q, v_minus, touching);
    if (!impact.failure.empty()) return stop(solution, Status::inner_solver_failed, t, impact.failure);
    solution.v = impact.motion;
  }
  std::vector<int> candidates, parting;
  const double resting = kRestingSpeed * std::max(1.0, solution.v.cwiseAbs().maxCoeff());
  for (const int i : touching) {
    const double v_n = J.col(i).dot(solution.v);
    const bool stays = v_n <= kRest * speed_size(i) || (is_closed(before[i]) && (!approaches || v_n <= resting));
    (stays ? candidates : parting).push_back(i);
  }
  for (const int i : parting) modes_[i] = ContactMode::open;
  if (!candidates.empty()) {
    auto directions = known_directions(solution.q, solution.v, leaving_cone, stopped, approaches);
    const auto verdict = dynamics_.decide(solution.q, solution.v, candidates, directions);
    if (!verdict.failure.empty()) return stop(solution, Status::inner_solver_failed, t, verdict.failure);
    for (std::size_t k = 0; k < candidates.size(); ++k) {
      const int i = candidates[k];
      const auto& contact = problem_.info().contacts[i];
      modes_[i] = verdict.modes[k];
      if (modes_[i] == ContactMode::slip && directions[i].size() == 0)
        directions[i] = -verdict.tangential.segment(contact.tangent_index, 2).normalized();
    }
    renew_slip(before, stopped, approaches, directions, solution);
  }
  dynamics_.set_modes(modes_);
  if (problem_.info().has_friction() || problem_.info().has_bilateral()) {
    // Located roots leave 1e-14 of slip and gap behind, smooth phases a drift. At events, and at the end for bilateral
    // constraints: CVODE projects within a phase for BDF alone, and the drift of a phase stays below its integration
    // error.
    std::vector<int> halted;
    if (!approaches) {
      halted = stopped;
      halted.insert(halted.end(), leaving_cone.begin(), leaving_cone.end());
    }
    if (!dynamics_.project(solution.q, solution.v, halted))
      return stop(solution, Status::inner_solver_failed, t, "the state cannot be projected onto its contacts");
  }
  if (!record_events(t, before, stopped, approaches ? v_minus : solution.v, impact, solution)) return false;
  limit_first_step(parting, solution);
  return begin_slip(t, solution);
}

/// Slip in space that begins from rest: its first moments belong to start_slip().
bool EventLocatedRun::begin_slip(double& t, Solution& solution) {
  std::vector<BeginningSlip> beginning;
  const Matrix J_t = problem_.tangent_jacobian(solution.q);
  std::string names;
  for (const int i : dynamics_.closed()) {
    if (modes_[i] != ContactMode::slip || !slip_[i].is_new) continue;
    if ((tangents(J_t, i).transpose() * solution.v).norm() > v_stop_) continue;  // CVODE follows it already
    beginning.push_back({i, slip_[i].direction});
    names = name(i);
  }
  const double left = problem_.info().end_time - t;
  if (beginning.empty() || left <= 0) return true;

  Vector y(2 * n_q_), before(number_of_roots(problem_)), behind(before.size());
  y << solution.q, solution.v;
  evaluate_roots(y.data(), before.data());
  const auto keeps_modes = [&](const Vector& q, const Vector& v) {
    y << q, v;
    return evaluate_roots(y.data(), behind.data()) && ((before.array() <= 0) || (behind.array() > 0)).all();
  };
  const auto start = start_slip(
      problem_, dynamics_, solution.q, solution.v, beginning,
      {.longest_step = std::min(kSlipStart * problem_.info().end_time, left),
       .end = left,
       .fast = std::max(kFastSlip, 100 * settings_.tolerance) * std::max(1.0, solution.v.cwiseAbs().maxCoeff()),
       .tolerance = settings_.tolerance,
       .keeps_modes = keeps_modes});
  if (!start) {
    return stop(solution, Status::inner_solver_failed, t,
                fmt::format("no motion follows the begin of slip at contact '{}'", names));
  }
  t += start->duration;
  solution.q = start->q;
  solution.v = start->v;
  follow_slip(solution);
  return true;
}

/// One event per contact whose mode changed or that received an impulse. False where impacts accumulate.
bool EventLocatedRun::record_events(double t, const std::vector<ContactMode>& before, const std::vector<int>& stopped,
                                    const Vector& v_minus, const ContactDynamics::Verdict& impact, Solution& solution) {
  const Vector no_normal = Vector::Zero(n_c_), no_tangential = Vector::Zero(problem_.info().n_lambda_t);
  for (const int i : problem_.info().unilateral) {
    const auto record = [&](EventKind kind) {
      const bool is_impact = kind == EventKind::impact;
      solution.events.push_back({t,
                                 kind,
                                 i,
                                 solution.q,
                                 v_minus,
                                 solution.v,
                                 is_impact ? impact.normal : no_normal,
                                 is_impact && impact.tangential.size() > 0 ? impact.tangential : no_tangential,
                                 modes_,
                                 {}});
    };
    const ContactMode was = before[i], is = modes_[i];
    if (!is_closed(was)) {
      if (impact.normal.size() == 0 || !(impact.normal[i] > 0)) continue;
      record(EventKind::impact);
      if (last_impact_[i] >= 0 && t - last_impact_[i] < settings_.zeno_interval * problem_.info().end_time) {
        return stop(solution, Status::step_limit, t,
                    fmt::format("the impacts of contact '{}' accumulate (Zeno); event location cannot pass", name(i)));
      }
      last_impact_[i] = t;
    } else if (!is_closed(is)) {
      record(EventKind::detach);
    } else if (is == ContactMode::stick && is_slipping(was)) {
      record(EventKind::slip_to_stick);
    } else if (is_slipping(is) && was == ContactMode::stick) {
      record(EventKind::stick_to_slip);
    } else if (is_slipping(is) && (is != was || std::count(stopped.begin(), stopped.end(), i) > 0)) {
      record(EventKind::slip_reversal);
    }
  }
  return true;
}

/// A contact that comes back soon: CVODE's first step must end before, or its root is never bracketed.
void EventLocatedRun::limit_first_step(const std::vector<int>& parting, const Solution& solution) {
  first_step_ = std::numeric_limits<double>::infinity();
  if (parting.empty()) return;
  const Matrix J = problem_.normal_jacobian(solution.q);
  accelerate(solution.q.data(), solution.v.data(), scratch_.data());
  for (const int i : parting) {
    const double flight =
        J.col(i).dot(solution.v) / (std::abs(J.col(i).dot(scratch_)) + std::numeric_limits<double>::min());
    if (flight < kShortFlight * problem_.info().end_time) first_step_ = std::min(first_step_, 0.1 * flight);
  }
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
  const bool has_friction = problem_.info().has_friction();
  const std::vector<char> none(modes_.size(), false);
  const auto restart = [&](double t) {
    collect_counters(solution.counters);
    double* y = N_VGetArrayPointer(cvode_.y());
    std::copy_n(solution.q.data(), n_q_, y);
    std::copy_n(solution.v.data(), n_q_, y + n_q_);
    // Where the impulses start is free. From zero CVODE would hold its first step to lambda h <= tolerance, so short
    // that a gap just left behind by an impact does not grow beyond rounding and is a root again.
    std::fill_n(y + 2 * n_q_, n_impulses_, 1);
    CVodeReInit(cvode_.memory(), t, cvode_.y());
    dipping_gaps_.start(solution.q, solution.v);
    CVodeSetStopTime(cvode_.memory(), T);
    if (first_step_ > 0 && t + first_step_ < T)
      CVodeSetInitStep(cvode_.memory(), first_step_);
    else
      CVodeSetInitStep(cvode_.memory(), 0);
  };
  double t = 0;
  if (decide_modes(t, {none, none}, solution)) {
    solution.initial_modes = modes_;
    restart(t);
    while (t < T) {
      const double from = t;
      const int flag = CVode(cvode_.memory(), T, cvode_.y(), &t, CV_ONE_STEP);
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
      bool at_root = flag == CV_ROOT_RETURN;
      Roots found = at_root ? roots() : Roots{none, none};
      if (const auto closing = dipping_gaps_.closing(from, t, solution.q, solution.v, modes_)) {
        at_root = true;
        found = {none, none};
        found.normal[closing->contact] = true;
        solution.t = t = closing->t;
        CVodeGetDky(cvode_.memory(), t, 0, cvode_.y());
        load(solution.q, solution.v);
      }
      if (!check_gaps(t, solution)) break;
      if (has_friction && !check_friction(t, found, solution)) break;
      if (at_root) {
        if (!decide_modes(t, found, solution)) break;
        solution.t = t;
        if (static_cast<long>(solution.events.size()) >= settings_.max_events) {
          stop(solution, Status::step_limit, t, fmt::format("{} events", settings_.max_events));
          break;
        }
        restart(t);
      } else if (has_friction) {
        follow_slip(solution);
      }
    }
  }
  if (solution.succeeded() && problem_.info().has_bilateral()) dynamics_.project(solution.q, solution.v, {});
  collect_counters(solution.counters);
  solution.counters.events = static_cast<std::int64_t>(solution.events.size());
  return solution;
}

}  // namespace

Solution integrate_event_located(const Problem& problem, const EventLocatedSettings& settings) {
  return EventLocatedRun(problem, settings).run();
}

}  // namespace ricochet::reference
