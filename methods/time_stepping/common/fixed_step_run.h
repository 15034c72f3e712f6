#pragma once

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "methods/method.h"
#include "methods/regions/until_run.h"
#include "methods/time_limit.h"
#include "methods/time_stepping/common/contact_step.h"
#include "methods/time_stepping/common/gap_rounding.h"

namespace ricochet {

/// When Newton's method for implicit forces ends: at its tolerance, or when corrections are small and hardly shrink, so
/// that they are rounding of the forces. Stiff springs reach their rounding long before the tolerance.
class NewtonEnd {
 public:
  /// @param size  of the corrected quantity; @param noise  least size of corrections due to rounding
  NewtonEnd(double tolerance, double size, double noise = 0)
      : tolerance_(tolerance * size), rounding_(std::max(kRounding * size, noise)) {}

  bool operator()(double correction) {
    const bool stagnates = correction <= rounding_ && correction >= 0.5 * last_;
    last_ = correction;
    return correction <= tolerance_ || stagnates;
  }

 private:
  static constexpr double kRounding = 1e-9;
  double tolerance_, rounding_, last_ = std::numeric_limits<double>::infinity();
};

/// Common part of all fixed-step time-stepping methods: the state, the contact problem, the active set,
/// the loop over the steps with its time limit, events and recording.
class FixedStepRun {
 public:
  FixedStepRun(const Problem& the_problem, const Settings& the_settings, const ContactSolverOptions& solver = {},
               ContactObserver* observer = nullptr, const ContactLaws& laws = {})
      : problem(the_problem),
        settings(the_settings),
        h(problem.info().end_time / settings.steps),
        contacts(problem, solver, laws, solution.counters, observer),
        q(solution.q),
        v(solution.v),
        touching_(gap_rounding(problem, h)) {
    q = problem.info().q0;
    v = problem.info().v0;
    gap_.setZero(problem.n_c());
    Lambda_n = Vector::Zero(problem.n_c());
    Lambda_t = Vector::Zero(problem.info().n_lambda_t);
    active.reserve(problem.n_c());
    was_pressed_.assign(problem.n_c(), false);
    rest_speed_.setZero(problem.n_c());
    drift_.setZero(problem.n_c());
    if (settings.audit) {
      solution.residuals = {{.name = "contact law",
                             .formula = "r, w = G r + b in the laws of unilateral contact and friction, each step"}};
    }
  }
  FixedStepRun(const FixedStepRun&) = delete;
  FixedStepRun& operator=(const FixedStepRun&) = delete;

  /// Finds the unilateral contacts with f_c(q) <= 0 up to rounding: that of the gap and, for a contact that is pressed,
  /// the drift of the gap by the rounding of its zero normal velocity since it closed.
  void find_active(const Vector& position) {
    find_active(position, [](int) { return false; });
  }
  /// The same, and those for which also(contact) holds.
  template <class Also>
  void find_active(const Vector& position, Also also) {
    active.clear();
    if (unilateral_.empty()) return;
    problem.gap(position.data(), gap_.data());
    for (const int i : unilateral_) {
      if (gap_[i] <= touching_[i] + drift_[i] || also(i)) active.push_back(i);
    }
  }
  /// Largest gap of a touching contact: the rounding error of its terms [m].
  double touching(int contact) const { return touching_[contact]; }
  /// The largest of them.
  double largest_touching() const { return touching_.size() > 0 ? touching_.maxCoeff() : 0; }
  /// The contact carried an impulse in the step before.
  bool was_pressed(int contact) const { return was_pressed_[contact] != 0; }
  /// J_n' v at the beginning of the step, as the law of impact takes it: a contact that was pressed in the step before
  /// and stayed closed rests, regardless of rounding in its velocity.
  double impact_velocity(int contact) const {
    const double speed = contacts.normal_velocity(contact, v);
    return std::abs(speed) <= rest_speed_[contact] ? 0 : speed;
  }
  /// Newton's eps_r J_n' v at the beginning of the step.
  double rebound(int contact) const {
    const double speed = impact_velocity(contact);
    return problem.info().contacts[static_cast<std::size_t>(contact)].restitution(speed) * speed;
  }
  bool has_contact_problem() const { return !active.empty() || has_bilateral_; }
  double largest_velocity() const { return v.head(problem.info().n_mechanical()).cwiseAbs().maxCoeff(); }

  /// Delassus operator of the active contacts at `position`.
  bool prepare_contacts(const Vector& position, const BlockInverse& W) {
    contacts.set_position(position);
    return prepare_contacts(W);
  }
  /// The same at the last position.
  bool prepare_contacts(const BlockInverse& W) {
    contacts.set_active(active);
    return note(contacts.set_inverse_mass(W));
  }

  /// ContactStep::solve, with its impulses added to those of the step.
  bool solve_contacts(Vector& velocity, const Vector& shift, const Vector& present, const Vector& slip_shift = {}) {
    if (!note(contacts.solve(velocity, shift, present, slip_shift))) return false;
    if (settings.audit) {
      Residual& worst = solution.residuals.front();
      const double value = contacts.residual(velocity, shift, slip_shift);
      if (value > worst.value) {
        worst.value = value;
        worst.t = solution.t;
      }
    }
    Lambda_n += contacts.Lambda_n();
    Lambda_t += contacts.Lambda_t();
    return true;
  }

  /// To be called before the contacts of the same step are solved again.
  void clear_impulses() {
    Lambda_n.setZero();
    Lambda_t.setZero();
  }

  /// Ends the run after this step. @return false
  bool fail(std::string why) {
    reason_ = std::move(why);
    return false;
  }

  /// Calls step(v_plus) for every step: it reads q, v and sets q and v_plus, or returns false when something in it
  /// failed.
  template <class Step>
  Solution take_steps(Step step) {
    const TimeLimit time_limit(settings.time_limit);
    Vector v_plus = v, v_minus = v, q_minus = q;
    for (int k = 0; k < settings.steps; ++k) {
      if (time_limit.is_over()) return stop(Status::time_limit, k, time_limit.message());
      clear_impulses();
      v_minus = v;
      q_minus = q;
      if (!step(v_plus)) return stop(Status::inner_solver_failed, k, reason_);
      v.swap(v_plus);
      ++solution.counters.steps;
      ++solution.counters.elements;
      if (!q.allFinite() || !v.allFinite()) return stop(Status::non_finite, k, "the state is not finite");
      solution.t = k + 1 == settings.steps ? problem.info().end_time : (k + 1) * h;
      const double t_impact = impact_place < 1 ? (k + impact_place) * h : solution.t;
      const bool has_impact = record_closings(t_impact, q_minus, v_minus);
      if (settings.recording >= Recording::grid) solution.samples.push_back({solution.t, q, v, v});
      if (settings.recording == Recording::motion) {
        if (has_impact)
          record_impact(k * h, t_impact, q_minus, v_minus);
        else
          record_motion(k * h, q_minus, v_minus);
      }
      if (ends_here(settings, solution.t, q, v)) break;
    }
    return std::move(solution);
  }

  const Problem& problem;
  const Settings& settings;
  const double h;
  Solution solution;
  ContactStep contacts;
  Vector &q, &v;
  std::vector<int> active;
  Vector Lambda_n, Lambda_t;  ///< impulses of the step so far
  /// sigma in [0, 1]: where in a step the impulses act that close contacts. Without forces
  ///     q_{k+1} = q_k + sigma h v_k + (1 - sigma) h v_{k+1}                                           (1)
  double impact_place = 0;

 private:
  bool note(ContactStatus status) { return status == ContactStatus::solved || fail(contacts.reason(status)); }

  Solution stop(Status status, int k, const std::string& reason) {
    solution.status = status;
    solution.message = fmt::format("step {} of {}, from t = {:.6g} s: {}", k + 1, settings.steps, k * h, reason);
    return std::move(solution);
  }

  /// Without an impact q and v go along straight lines.
  void record_motion(double t, const Vector& q_minus, const Vector& v_minus) {
    solution.motion.add(t, solution.t, 1, [&](double s, Vector& at_q, Vector& at_v) {
      at_q = (1 - s) * q_minus + s * q;
      at_v = (1 - s) * v_minus + s * v;
    });
  }

  /// q where the impulses act, (1).
  Vector at_impact(const Vector& q_minus, const Vector& v_minus) const {
    return impact_place < 1 ? Vector(q_minus + impact_place * h * v_minus) : q;
  }

  /// v is that of the left end before the impact, that of the right end after it.
  void record_impact(double t, double t_impact, const Vector& q_minus, const Vector& v_minus) {
    const Vector q_impact = at_impact(q_minus, v_minus);
    solution.motion.add(t, t_impact, 1, [&](double s, Vector& at_q, Vector& at_v) {
      at_q = (1 - s) * q_minus + s * q_impact;
      at_v = v_minus;
    });
    solution.motion.add(t_impact, solution.t, 1, [&](double s, Vector& at_q, Vector& at_v) {
      at_q = (1 - s) * q_impact + s * q;
      at_v = v;
    });
  }

  /// A contact that carries an impulse now and did not in the step before has closed, at the time `t`.
  /// @return whether one has
  bool record_closings(double t, const Vector& q_minus, const Vector& v_minus) {
    bool has_impact = false;
    for (const int i : unilateral_) {
      const bool is_pressed = Lambda_n[i] > 0;
      if (is_pressed && !was_pressed_[i]) {
        has_impact = true;
        ++solution.counters.events;
        if (settings.recording != Recording::final_state)
          solution.events.push_back(
              {t, EventKind::impact, i, at_impact(q_minus, v_minus), v_minus, v, Lambda_n, Lambda_t, {}, {}});
      }
      was_pressed_[i] = is_pressed;
      rest_speed_[i] = is_pressed ? contacts.velocity_rounding(i) : 0;
      drift_[i] = is_pressed ? drift_[i] + h * rest_speed_[i] : 0;
    }
    return has_impact;
  }

  const bool has_bilateral_ = problem.info().has_bilateral();
  const std::vector<int> unilateral_ = problem.info().unilateral;
  const Vector touching_;
  Vector gap_, rest_speed_, drift_;
  std::string reason_;
  std::vector<char> was_pressed_;
};

}  // namespace ricochet
