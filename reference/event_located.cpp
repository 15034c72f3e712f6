#include "reference/event_located.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <memory>

#include "problems/input_error.h"
#include "problems/join.h"
#include "problems/packed_column.h"
#include "reference/contact_dynamics.h"
#include "reference/cvode.h"
#include "reference/dipping_gaps.h"
#include "reference/flights.h"
#include "reference/slips.h"

namespace ricochet::reference {
namespace {

// Longest first step of slip in space, as a part of end_time; start_slip() shortens it.
constexpr double kSlipStart = 1e-2;

// Impacts that follow each other at one instant: a few, unless they accumulate.
constexpr int kMaxImpacts = 1000;

/// Root functions, all watched for falling through zero:
///
///   open               gap, with the offset of Flights                                   (1)
///   closed             lambda_n; 1 where bilateral                                       (1)
///   with friction      stick  mu lambda_n - |lambda_t|                                   (2)
///                      slip   Slips::root                                                (3)
///
/// CVODE integrates more than q and v. Nothing reads the rest, but its error control does:
///
///   the gaps of open contacts that are curved    bodies in free fall are exact in steps of any length, that would pass
///                                                over the waves of a moving surface
///   with friction, impulses of the contacts      a body that sticks does not move, however its friction force varies,
///                                                and longer steps would pass a root of (2) twice
class EventLocatedRun {
 public:
  EventLocatedRun(const Problem& problem, const EventLocatedSettings& settings)
      : problem_(problem),
        settings_(settings),
        n_q_(problem.n_q()),
        n_c_(problem.n_c()),
        scales_(problem),
        dynamics_(problem, scales_),
        floor_(sizes(problem, scales_)),
        cvode_(settings.integrator == Integrator::adams ? CV_ADAMS : CV_BDF, static_cast<int>(floor_.size()), this,
               right_hand_side, root_functions, number_of_roots(problem), error_weights),
        dipping_gaps_(problem, scales_, cvode_, settings.tolerance),
        slips_(problem, scales_, dynamics_, settings.tolerance),
        flights_(problem, scales_, settings.tolerance, settings.zeno_interval * problem.info().end_time),
        modes_(dynamics_.modes()),
        friction_root_(static_cast<std::size_t>(n_c_), -1),
        force_size_(scales_.force()),
        begin_(Clock::now()),
        curved_(curved(problem.info())) {
    packed_n_.setZero(problem.info().n_normal_entries);
    lambda_n_.setZero(n_c_);
    lambda_t_.setZero(problem.info().n_lambda_t);
    scratch_.setZero(n_q_);
    for (int i = 0, k = n_c_; i < n_c_; ++i) friction_root_[i] = slips_.has_friction(i) ? k++ : -1;
  }

  Solution run();

 private:
  using Clock = std::chrono::steady_clock;

  static int number_of_roots(const Problem& problem) {
    const auto& contacts = problem.info().contacts;
    return problem.n_c() + static_cast<int>(std::count_if(contacts.begin(), contacts.end(),
                                                          [](const auto& contact) { return contact.n_t > 0; }));
  }

  /// Of CVODE's unknowns: q, v, the curved gaps, the normal and the tangential impulses.
  static Vector sizes(const Problem& problem, const Scales& scales) {
    const auto& info = problem.info();
    std::vector<double> sizes(scales.position().begin(), scales.position().end());
    sizes.insert(sizes.end(), scales.velocity().begin(), scales.velocity().end());
    const Vector gaps = scales.gap(problem.normal_jacobian(info.q0), info.q0);
    for (const int i : curved(info)) sizes.push_back(gaps[i]);
    if (info.has_friction()) {
      sizes.insert(sizes.end(), scales.impulse().begin(), scales.impulse().end());
      for (int i = 0; i < info.n_c(); ++i) sizes.insert(sizes.end(), info.contacts[i].n_t, scales.impulse()[i]);
    }
    return Eigen::Map<const Vector>(sizes.data(), std::ssize(sizes));
  }

  static std::vector<int> curved(const ProblemInfo& info) {
    std::vector<int> curved;
    for (const int i : info.unilateral) {
      if (!info.contacts[i].is_affine) curved.push_back(i);
    }
    return curved;
  }

  static int error_weights(N_Vector y, N_Vector weights, void* self) {
    const auto& run = *static_cast<EventLocatedRun*>(self);
    const Eigen::Map<const Vector> state(N_VGetArrayPointer(y), run.floor_.size());
    Eigen::Map<Vector>(N_VGetArrayPointer(weights), run.floor_.size()) =
        (run.settings_.tolerance * (state.cwiseAbs() + run.floor_)).cwiseInverse();
    return 0;
  }

  static int right_hand_side(double, N_Vector y, N_Vector y_dot, void* self) {
    auto& run = *static_cast<EventLocatedRun*>(self);
    const double* state = N_VGetArrayPointer(y);
    double* rate = N_VGetArrayPointer(y_dot);
    std::copy_n(state + run.n_q_, run.n_q_, rate);
    if (!run.accelerate(state, state + run.n_q_, rate + run.n_q_)) return -1;
    std::fill(rate + 2 * run.n_q_, rate + run.floor_.size(), 0);
    const auto& info = run.problem_.info();
    double* gap_rate = rate + 2 * run.n_q_;
    if (!run.curved_.empty()) run.problem_.normal_jacobian(state, run.packed_n_.data());
    for (const int i : run.curved_) {
      const auto& contact = info.contacts[i];
      const double* J_n = run.packed_n_.data() + contact.normal_begin;
      *gap_rate++ = is_closed(run.modes_[i]) ? 0 : packed_dot(contact, J_n, state + run.n_q_);
    }
    if (!info.has_friction()) return 0;
    double* lambda = gap_rate;
    for (const int i : run.dynamics_.closed()) {
      const auto& contact = info.contacts[i];
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
    Eigen::Map<Vector>(values, n_c_) += flights_.offset();
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
  bool accelerate(const Solution& solution) {
    return accelerate(solution.q.data(), solution.v.data(), scratch_.data());
  }

  /// (2) and (3), with the forces of the last accelerate().
  void friction_roots(const double* y, double* values) const {
    const Matrix J_t = problem_.tangent_jacobian(Vector(Eigen::Map<const Vector>(y, n_q_)));
    const Vector v = Eigen::Map<const Vector>(y + n_q_, n_q_);
    for (const int i : dynamics_.closed()) {
      if (modes_[i] == ContactMode::stick)
        values[friction_root_[i]] = cone_slack(i);
      else if (is_slipping(modes_[i]))
        values[friction_root_[i]] = slips_.root(i, J_t, v);
    }
  }

  Eigen::VectorBlock<const Vector> tangential_force(int i) const {
    const auto& contact = problem_.info().contacts[i];
    return lambda_t_.segment(contact.tangent_index, contact.n_t);
  }
  double cone_slack(int i) const { return problem_.info().contacts[i].mu * lambda_n_[i] - tangential_force(i).norm(); }
  const std::string& name(int i) const { return problem_.info().contacts[i].name; }

  void load(Vector& q, Vector& v) const {
    const double* y = N_VGetArrayPointer(cvode_.y());
    q = Eigen::Map<const Vector>(y, n_q_);
    v = Eigen::Map<const Vector>(y + n_q_, n_q_);
  }

  struct Roots {
    std::vector<char> normal, friction;  // by contact
    bool any() const { return std::ranges::count(normal, true) + std::ranges::count(friction, true) > 0; }
  };
  Roots roots(bool at_root, const Solution& solution) const;

  Roots none() const { return {std::vector<char>(modes_.size(), false), std::vector<char>(modes_.size(), false)}; }

  /// What an event decides before the contact law is asked.
  struct Instant {
    std::vector<ContactMode> before;
    Vector v_minus;
    std::vector<char> stopped;                        ///< slip ended
    std::vector<char> leaves_cone;                    ///< stuck, and its force is at the edge
    std::vector<char> rests;                          ///< no slip velocity behind the impact
    std::vector<int> touching, released, candidates;  ///< gap zero; force became zero; touching and may stay
    bool approaches = false,
         is_ambiguous = false;  ///< an impact happens; its contacts close in an order that is rounding
    ContactDynamics::Decision impact;
  };

  void collect_counters(Counters& counters) const;
  bool check_gaps(double t, Solution& solution);
  bool check_friction(double t, const Roots& found, Solution& solution);
  bool check_limits(double t, Solution& solution) const;
  bool decide_modes(double& t, const Roots& found, Solution& solution);
  bool check_roots(double t, const Roots& found, Solution& solution) const;
  void finish_slip(double& t, const Roots& found, Instant& instant, Solution& solution);
  void find_touching(double t, const Roots& found, Instant& instant, const Solution& solution);
  std::vector<char> last_impacts(const Instant& instant, const Solution& solution);
  bool follow_impacts(double t, Instant& instant, Solution& solution);
  bool collide(double t, Instant& instant, Solution& solution);
  void find_stopped_along(Instant& instant, const Solution& solution) const;
  bool decide_candidates(double t, Instant& instant, Solution& solution);
  std::vector<Vector> known_directions(const Instant& instant, const Solution& solution) const;
  bool begin_slip(double& t, Solution& solution);
  bool record_events(double t, const Instant& instant, Solution& solution);
  void restart(double t, Solution& solution);
  bool stop(Solution& solution, Status status, double t, const std::string& reason) const;

  const Problem& problem_;
  const EventLocatedSettings& settings_;
  const int n_q_, n_c_;
  const Scales scales_;
  ContactDynamics dynamics_;
  const Vector floor_;  // of the absolute tolerances, by unknown of CVODE
  Cvode cvode_;
  DippingGaps dipping_gaps_;
  Slips slips_;
  Flights flights_;
  std::vector<ContactMode> modes_;
  std::vector<int> friction_root_;  // index of (2), (3) among the root functions, by contact; -1 without friction
  Vector force_size_;               // largest normal force so far, by contact [N]
  Clock::time_point begin_;
  const std::vector<int> curved_;  // contacts
  Vector packed_n_, lambda_n_, lambda_t_, scratch_;
};

bool EventLocatedRun::stop(Solution& solution, Status status, double t, const std::string& reason) const {
  solution.status = status;
  solution.message = fmt::format("t = {:.12g} s: {}", t, reason);
  return false;
}

/// Roots that CVODE found at the end of its step, and those that it lost. Flights lower than its errors may fall below
/// zero on their way up: a gap that grows does not close, and one that then is below zero and falls does.
EventLocatedRun::Roots EventLocatedRun::roots(bool at_root, const Solution& solution) const {
  std::vector<int> found(static_cast<std::size_t>(number_of_roots(problem_)), 0);
  if (at_root) CVodeGetRootInfo(cvode_.memory(), found.data());
  const Matrix J = problem_.normal_jacobian(solution.q);
  const Vector gap = problem_.gap(solution.q) + flights_.offset(), rate = J.transpose() * solution.v;
  const Vector error = settings_.tolerance * scales_.gap(J, solution.q);
  Roots roots = none();
  for (int i = 0; i < n_c_; ++i) {
    const bool is_lost = flights_.is_low(i) && gap[i] < 0 && gap[i] > -error[i];
    roots.normal[i] = is_closed(modes_[i]) ? found[i] != 0 : rate[i] <= 0 && (found[i] != 0 || is_lost);
    roots.friction[i] = friction_root_[i] >= 0 && found[friction_root_[i]] != 0;
  }
  return roots;
}

/// A root that CVODE's root finding missed shows as penetration.
bool EventLocatedRun::check_gaps(double t, Solution& solution) {
  const Matrix J = problem_.normal_jacobian(solution.q);
  const Vector gap = problem_.gap(solution.q);
  const Vector size = scales_.gap(J, solution.q) + problem_.info().end_time * scales_.speed(J, solution.v);
  const double part = std::max(kSame, 100 * settings_.tolerance);  // more than closed contacts drift
  for (int i = 0; i < n_c_; ++i) {
    if (problem_.info().contacts[i].is_bilateral && std::abs(gap[i]) > part * size[i])
      return stop(solution, Status::inner_solver_failed, t,
                  fmt::format("bilateral constraint '{}' has drifted to {:.3g} m", name(i), gap[i]));
    if (gap[i] < -part * size[i] && flights_.bounced(i, t))  // too low for its next impact to be seen
      return stop(solution, Status::step_limit, t, flights_.accumulating(t));
    if (gap[i] < -part * size[i])
      return stop(solution, Status::inner_solver_failed, t,
                  fmt::format("contact '{}' was passed unnoticed, its gap is {:.3g} m", name(i), gap[i]));
  }
  return true;
}

/// A root of (2) or (3) that was missed, and forces that grow without bound.
bool EventLocatedRun::check_friction(double t, const Roots& found, Solution& solution) {
  if (dynamics_.closed().empty()) return true;
  if (!accelerate(solution))
    return stop(solution, Status::inner_solver_failed, t,
                "the contact forces do not determine the motion, (5) is singular");
  const Matrix J_t = problem_.tangent_jacobian(solution.q);
  const double part = std::max(kSame, 100 * settings_.tolerance);  // as for gaps
  for (const int i : dynamics_.closed()) {
    force_size_[i] = std::max(force_size_[i], std::abs(lambda_n_[i]));
    if (!slips_.has_friction(i) || found.normal[i] || found.friction[i]) continue;
    double value = 0;
    if (modes_[i] == ContactMode::stick)
      value = cone_slack(i) / force_size_[i];
    else if (!slips_.is_new(i))  // a new slip has its own root below zero
      value = slips_.direction(i).dot(slips_.velocity(i, J_t, solution.v)) / slips_.size(i, J_t, solution.v);
    if (std::min(value, lambda_n_[i] / force_size_[i]) < -part) {
      return stop(
          solution, Status::inner_solver_failed, t,
          fmt::format("the end of mode {} of contact '{}' was passed unnoticed", to_string(modes_[i]), name(i)));
    }
  }
  return true;
}

bool EventLocatedRun::check_limits(double t, Solution& solution) const {
  if (settings_.time_limit > 0 && std::chrono::duration<double>(Clock::now() - begin_).count() > settings_.time_limit)
    return stop(solution, Status::time_limit, t,
                fmt::format("the time limit of {:.6g} s is over", settings_.time_limit));
  long steps = 0;  // since the last restart
  CVodeGetNumSteps(cvode_.memory(), &steps);
  if (solution.counters.steps + steps >= settings_.max_steps)
    return stop(solution, Status::step_limit, t, fmt::format("{} steps of CVODE", settings_.max_steps));
  if (std::ssize(solution.events) >= settings_.max_events)
    return stop(solution, Status::step_limit, t, fmt::format("{} events", settings_.max_events));
  return true;
}

/// Roots that no decision can follow.
bool EventLocatedRun::check_roots(double t, const Roots& found, Solution& solution) const {
  for (const int i : dynamics_.closed()) {
    if (found.friction[i] && is_slipping(modes_[i]) && slips_.is_new(i)) {
      return stop(
          solution, Status::inner_solver_failed, t,
          fmt::format("inconsistent: contact '{}' began to slip and moves against its slip direction", name(i)));
    }
    if (found.normal[i] && !dynamics_.determines_forces(i)) {
      return stop(
          solution, Status::inner_solver_failed, t,
          fmt::format("contact '{}' shares its force with redundant contacts, and no division among them goes on: "
                      "which of them ends mode {} is not determined",
                      name(i), to_string(modes_[i])));
    }
  }
  return true;
}

void EventLocatedRun::finish_slip(double& t, const Roots& found, Instant& instant, Solution& solution) {
  std::vector<int> at_root;
  for (const int i : dynamics_.closed()) {
    if (is_slipping(modes_[i]) && found.friction[i]) at_root.push_back(i);
  }
  instant.stopped.assign(modes_.size(), false);
  if (at_root.empty()) return;
  double duration = 0;
  for (const int i : slips_.finish(at_root, problem_.info().end_time - t, duration, solution.q, solution.v))
    instant.stopped[i] = true;
  t += duration;
}

/// Contacts whose gap is zero, and those of them that begin to close. Closed contacts without force open.
void EventLocatedRun::find_touching(double t, const Roots& found, Instant& instant, const Solution& solution) {
  const Matrix J = problem_.normal_jacobian(solution.q);
  const Vector gap = problem_.gap(solution.q);
  const Vector rate = J.transpose() * solution.v, rate_size = scales_.speed(J, solution.v);
  instant.leaves_cone.assign(modes_.size(), false);
  for (const int i : problem_.info().unilateral) {
    // Redundant contacts reach their cones together.
    const bool at_cone = modes_[i] == ContactMode::stick &&
                         (found.friction[i] ||
                          (found.any() && !dynamics_.determines_forces(i) && cone_slack(i) <= kSame * force_size_[i]));
    // Without a tangential force the tip of the cone is reached, and which of the two roots is found is rounding.
    if (is_closed(modes_[i]) && (found.normal[i] || (at_cone && lambda_n_[i] <= kSame * force_size_[i]))) {
      modes_[i] = ContactMode::open;  // its force vanishes
      instant.released.push_back(i);
      continue;
    }
    instant.leaves_cone[i] = at_cone;
    if (!is_closed(modes_[i]) && !found.normal[i] && !flights_.touches(i, gap[i])) continue;
    instant.is_ambiguous =
        instant.is_ambiguous || (!is_closed(modes_[i]) && !found.normal[i] && flights_.bounced(i, t));
    instant.touching.push_back(i);
    instant.approaches = instant.approaches || (!is_closed(modes_[i]) && rate[i] < -kSame * rate_size[i]);
  }
}

/// By contact, whether its impact ends an accumulation, see (3) of Flights.
std::vector<char> EventLocatedRun::last_impacts(const Instant& instant, const Solution& solution) {
  accelerate(solution);
  const Matrix J = problem_.normal_jacobian(solution.q);
  const Vector rate = J.transpose() * instant.v_minus,
               a = J.transpose() * scratch_ + problem_.gap_acceleration_bias(solution.q, instant.v_minus);
  std::vector<char> last(modes_.size(), false);
  for (const int i : instant.touching)
    last[i] = !is_closed(instant.before[i]) && rate[i] < 0 && flights_.is_last(i, rate[i], a[i]);
  return last;
}

/// Newton's law at the contacts that touch and do not part; and again, as long as an impact sends contacts that parted
/// back against each other. With those that part in the law, their restitution would send them into their surfaces.
bool EventLocatedRun::follow_impacts(double t, Instant& instant, Solution& solution) {
  const Matrix J = problem_.normal_jacobian(solution.q);
  const Vector rate_size = scales_.speed(J, instant.v_minus);
  const auto last = last_impacts(instant, solution);
  auto& total = instant.impact;
  total.modes.assign(instant.touching.size(), ContactMode::open);
  total.normal.setZero(n_c_);
  total.tangential.setZero(problem_.info().n_lambda_t);
  for (int k = 0; k < kMaxImpacts; ++k) {
    const Vector rate = J.transpose() * solution.v;
    std::vector<int> meeting;
    bool approaches = false;
    for (const int i : instant.touching) {
      if (rate[i] <= kSame * rate_size[i]) meeting.push_back(i);
      approaches = approaches || rate[i] < -kSame * rate_size[i];
    }
    if (!approaches) return true;
    const auto impact = dynamics_.impact(solution.q, solution.v, meeting, last);
    if (!impact.failure.empty()) return stop(solution, Status::inner_solver_failed, t, impact.failure);
    solution.v = impact.motion;
    total.normal += impact.normal;
    if (!problem_.info().has_friction()) continue;
    total.tangential += impact.tangential;
    for (std::size_t m = 0; m < meeting.size(); ++m) {
      const auto at = std::ranges::find(instant.touching, meeting[m]) - instant.touching.begin();
      total.modes[static_cast<std::size_t>(at)] = impact.modes[m];
    }
  }
  return stop(solution, Status::step_limit, t, flights_.accumulating(t));
}

/// The impacts, where a contact approaches; candidates for closed contacts and those that part; contacts without slip.
bool EventLocatedRun::collide(double t, Instant& instant, Solution& solution) {
  if (instant.approaches) {
    if (instant.is_ambiguous) return stop(solution, Status::step_limit, t, flights_.accumulating(t));
    if (!follow_impacts(t, instant, solution)) return false;
  }
  const Matrix J = problem_.normal_jacobian(solution.q), J_t = problem_.tangent_jacobian(solution.q);
  const Vector rate = J.transpose() * solution.v, rate_size = scales_.speed(J, instant.v_minus);
  instant.rests.assign(modes_.size(), false);
  for (std::size_t k = 0; k < instant.touching.size(); ++k) {
    const int i = instant.touching[k];
    const bool was_closed = is_closed(instant.before[i]);
    if (rate[i] > kSame * rate_size[i] &&
        !(was_closed && (!instant.approaches || rate[i] <= kResting * rate_size[i]))) {
      modes_[i] = ContactMode::open;
      continue;
    }
    instant.candidates.push_back(i);
    if (!slips_.has_friction(i)) continue;
    // What an impact leaves of a slip that it ends is the rounding of its law.
    const double size = slips_.size(i, J_t, instant.v_minus), zero = (instant.approaches ? kSame : kResting) * size;
    instant.rests[i] = slips_.velocity(i, J_t, solution.v).norm() <= zero;
    if (instant.approaches)
      instant.rests[i] = instant.rests[i] || instant.impact.modes[k] == ContactMode::stick;
    else if (was_closed)
      instant.rests[i] = instant.stopped[i] || instant.before[i] == ContactMode::stick;
  }
  return true;
}

/// Slip directions that are known before the accelerations: of contacts that move, and of those at the edge of their
/// friction cone, where the slip acceleration is zero at this instant and only the force tells where it will point.
std::vector<Vector> EventLocatedRun::known_directions(const Instant& instant, const Solution& solution) const {
  std::vector<Vector> directions(modes_.size());
  const Matrix J_t = problem_.tangent_jacobian(solution.q);
  for (const int i : instant.candidates) {
    if (!slips_.has_friction(i)) continue;
    const bool goes_on = is_slipping(instant.before[i]) && !instant.approaches;
    if (instant.rests[i]) {
      if (instant.leaves_cone[i] && !instant.approaches) directions[i] = -tangential_force(i).normalized();
    } else if (goes_on && slips_.is_new(i)) {
      directions[i] = slips_.direction(i);
    } else {
      directions[i] = slips_.velocity(i, J_t, solution.v).normalized();
    }
  }
  return directions;
}

/// Contacts whose slip the end of another one ended, as both ends of a rod that slides on the ground.
void EventLocatedRun::find_stopped_along(Instant& instant, const Solution& solution) const {
  const Matrix J_t = problem_.tangent_jacobian(solution.q);
  for (const int i : instant.candidates) {
    if (instant.rests[i] || !is_slipping(instant.before[i]) || slips_.is_new(i)) continue;
    instant.stopped[i] = instant.rests[i] =
        slips_.velocity(i, J_t, solution.v).norm() <= kResting * slips_.size(i, J_t, instant.v_minus);
  }
}

/// Modes of the candidates, in a state that keeps them closed.
bool EventLocatedRun::decide_candidates(double t, Instant& instant, Solution& solution) {
  // Located roots leave 1e-14 of slip and gap behind, impacts rounding, smooth phases a drift. At events, and at the
  // end for bilateral constraints: CVODE projects within a phase for BDF alone, and the drift of a phase stays below
  // its integration error.
  const auto touching = join({problem_.info().bilateral, instant.touching, instant.released});
  auto closed = join({problem_.info().bilateral, instant.candidates});
  if (!instant.approaches) closed.insert(closed.end(), instant.released.begin(), instant.released.end());
  if (!dynamics_.project(solution.q, solution.v, touching, closed, instant.rests))
    return stop(solution, Status::inner_solver_failed, t, "the state cannot be projected onto its contacts");
  if (instant.candidates.empty()) {
    dynamics_.set_modes(modes_);
    return true;
  }
  find_stopped_along(instant, solution);
  auto directions = known_directions(instant, solution);
  const auto decision = dynamics_.decide(solution.q, solution.v, instant.candidates, directions);
  if (!decision.failure.empty()) return stop(solution, Status::inner_solver_failed, t, decision.failure);
  std::vector<char> begins(modes_.size(), false);
  for (std::size_t k = 0; k < instant.candidates.size(); ++k) {
    const int i = instant.candidates[k];
    const auto& contact = problem_.info().contacts[i];
    const bool goes_on = modes_[i] == decision.modes[k] && !instant.approaches && !instant.stopped[i];
    modes_[i] = decision.modes[k];
    begins[i] = instant.rests[i] || (goes_on && slips_.is_new(i));
    if (modes_[i] == ContactMode::slip && directions[i].size() == 0)
      directions[i] = -decision.tangential.segment(contact.tangent_index, 2).normalized();
  }
  dynamics_.set_modes(modes_);
  slips_.renew(directions, begins, solution.q, solution.v);
  return true;
}

/// Impacts, closings, detachments, ends and begins of slip at an instant; solution.q, solution.v hold the state before,
/// and after on return. t moves on where a slip in space ends or begins.
bool EventLocatedRun::decide_modes(double& t, const Roots& found, Solution& solution) {
  if (n_c_ == 0) return true;
  if (!check_roots(t, found, solution)) return false;
  Instant instant;
  instant.before = modes_;
  finish_slip(t, found, instant, solution);
  if (problem_.info().has_friction()) accelerate(solution);  // forces for the decisions
  instant.v_minus = solution.v;
  find_touching(t, found, instant, solution);
  if (!collide(t, instant, solution)) return false;
  if (!decide_candidates(t, instant, solution)) return false;
  accelerate(solution);
  flights_.start(t, solution.q, solution.v, scratch_, modes_);
  return record_events(t, instant, solution) && begin_slip(t, solution);
}

/// Slip in space that begins from rest: its first moments belong to start_slip().
bool EventLocatedRun::begin_slip(double& t, Solution& solution) {
  const auto beginning = slips_.beginning(solution.q, solution.v);
  const double left = problem_.info().end_time - t;
  if (beginning.empty() || left <= 0) return true;

  Vector y(2 * n_q_), before(number_of_roots(problem_)), behind(before.size());
  y << solution.q, solution.v;
  evaluate_roots(y.data(), before.data());
  const auto keeps_modes = [&](const Vector& q, const Vector& v) {
    y << q, v;
    return evaluate_roots(y.data(), behind.data()) && ((before.array() <= 0) || (behind.array() > 0)).all();
  };
  const auto start = start_slip(problem_, scales_, dynamics_, solution.q, solution.v, beginning,
                                {.longest_step = std::min(kSlipStart * problem_.info().end_time, left),
                                 .end = left,
                                 .tolerance = settings_.tolerance,
                                 .keeps_modes = keeps_modes});
  if (!start) {
    return stop(solution, Status::inner_solver_failed, t,
                fmt::format("no motion follows the begin of slip at contact '{}'", name(beginning.back().contact)));
  }
  t += start->duration;
  solution.q = start->q;
  solution.v = start->v;
  slips_.follow(solution.q, solution.v);
  return true;
}

/// One event per contact whose mode changed or that received an impulse. False where impacts accumulate.
bool EventLocatedRun::record_events(double t, const Instant& instant, Solution& solution) {
  const Vector no_normal = Vector::Zero(n_c_), no_tangential = Vector::Zero(problem_.info().n_lambda_t);
  const auto& impact = instant.impact;
  bool accumulates = false;
  for (const int i : problem_.info().unilateral) {
    const auto record = [&](EventKind kind) {
      const bool is_impact = kind == EventKind::impact;
      solution.events.push_back({t,
                                 kind,
                                 i,
                                 solution.q,
                                 instant.approaches ? instant.v_minus : solution.v,
                                 solution.v,
                                 is_impact ? impact.normal : no_normal,
                                 is_impact && impact.tangential.size() > 0 ? impact.tangential : no_tangential,
                                 modes_,
                                 {}});
    };
    const ContactMode was = instant.before[i], is = modes_[i];
    if (!is_closed(was)) {
      if (impact.normal.size() == 0 || !(impact.normal[i] > 0)) continue;
      record(EventKind::impact);
      const bool is_soon = flights_.accumulates(i, t);
      accumulates = accumulates || (is_soon && !is_closed(is));
    } else if (!is_closed(is)) {
      record(EventKind::detach);
    } else if (is == ContactMode::stick && is_slipping(was)) {
      record(EventKind::slip_to_stick);
    } else if (is_slipping(is) && was == ContactMode::stick) {
      record(EventKind::stick_to_slip);
    } else if (is_slipping(is) && (is != was || instant.stopped[i])) {
      record(EventKind::slip_reversal);
    }
  }
  return !accumulates || stop(solution, Status::step_limit, t, flights_.accumulating(t));
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

void EventLocatedRun::restart(double t, Solution& solution) {
  collect_counters(solution.counters);
  double* y = N_VGetArrayPointer(cvode_.y());
  std::copy_n(solution.q.data(), n_q_, y);
  std::copy_n(solution.v.data(), n_q_, y + n_q_);
  // Where the rest starts is free, for the impulses. From zero CVODE would hold its first step to lambda h <=
  // tolerance, so short that a gap just left behind by an impact does not grow beyond rounding and is a root again.
  std::copy(floor_.begin() + 2 * n_q_, floor_.end(), y + 2 * n_q_);
  CVodeReInit(cvode_.memory(), t, cvode_.y());
  const double T = problem_.info().end_time;
  CVodeSetStopTime(cvode_.memory(), T);
  CVodeSetInitStep(cvode_.memory(), t + flights_.first_step() < T ? flights_.first_step() : 0);
}

Solution EventLocatedRun::run() {
  Solution solution;
  solution.q = problem_.info().q0;
  solution.v = problem_.info().v0;
  const double T = problem_.info().end_time;
  double t = 0;
  if (decide_modes(t, none(), solution)) {
    solution.initial_modes = modes_;
    restart(t, solution);
    bool passed_root = false;  // that roots() does not take for one
    while (t < T && check_limits(t, solution)) {
      const double from = t;
      CVodeSetMaxStep(cvode_.memory(), flights_.longest_step(t));
      const int flag = CVode(cvode_.memory(), T, cvode_.y(), &t, CV_ONE_STEP);
      if (flag == CV_ILL_INPUT && passed_root) {  // which is still zero: a gap that opens again
        passed_root = false;
        restart(t, solution);
        continue;
      }
      load(solution.q, solution.v);
      solution.t = t;
      if (flag < 0) {
        const std::unique_ptr<char, decltype(&std::free)> name(CVodeGetReturnFlagName(flag), &std::free);
        stop(solution, Status::inner_solver_failed, t, fmt::format("CVODE ended with {}", name.get()));
        break;
      }
      Roots found = roots(flag == CV_ROOT_RETURN, solution);
      if (const auto closing = dipping_gaps_.closing(from, t, modes_)) {
        found = none();
        found.normal[closing->contact] = true;
        solution.t = t = closing->t;
        CVodeGetDky(cvode_.memory(), t, 0, cvode_.y());
        load(solution.q, solution.v);
      }
      if (!check_gaps(t, solution)) break;
      if (problem_.info().has_friction() && !check_friction(t, found, solution)) break;
      if (found.any()) {
        if (!decide_modes(t, found, solution)) break;
        solution.t = t;
        restart(t, solution);
        passed_root = false;
      } else {
        slips_.follow(solution.q, solution.v);
        flights_.follow(solution.q);
        passed_root = flag == CV_ROOT_RETURN;
      }
    }
  }
  if (solution.succeeded() && problem_.info().has_bilateral()) {
    std::vector<char> rests(modes_.size(), false);
    for (const int i : dynamics_.closed()) rests[i] = modes_[i] == ContactMode::stick;
    dynamics_.project(solution.q, solution.v, dynamics_.closed(), dynamics_.closed(), rests);
  }
  collect_counters(solution.counters);
  solution.counters.events = static_cast<std::int64_t>(solution.events.size());
  return solution;
}

}  // namespace

Solution integrate_event_located(const Problem& problem, const EventLocatedSettings& settings) {
  return EventLocatedRun(problem, settings).run();
}

}  // namespace ricochet::reference
