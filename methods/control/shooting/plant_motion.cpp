#include "methods/control/shooting/plant_motion.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "problems/input_error.h"

namespace ricochet {
namespace {

/// Copies the elements in use.
void keep_step(const FesdStep& from, FesdStep& to) {
  const int n = from.n_elements;
  const auto size = static_cast<std::size_t>(n);
  to.H = from.H;
  to.n_elements = n;
  to.touches = from.touches;
  if (to.elements.size() < size) to.elements.resize(size);
  std::copy_n(from.elements.begin(), size, to.elements.begin());
  to.ends.assign(from.ends.begin(), from.ends.begin() + n);
  to.n_impacts.assign(from.n_impacts.begin(), from.n_impacts.begin() + n);
  to.v_minus = from.v_minus.leftCols(n);
  to.Lambda_n = from.Lambda_n.leftCols(n);
  to.Lambda_t = from.Lambda_t.leftCols(n);
}

const OptimalControlProblem& require_smooth_plant(const OptimalControlProblem& problem) {
  if (!problem.plant->info().switches.empty())
    throw InputError(
        "--method", "shooting",
        fmt::format("a plant without formulas that bend or jump is required; '{}' has them: use homotopy", problem.id));
  return problem;
}

}  // namespace

bool has_same_sequence(const FesdStep& a, const FesdStep& b) {
  if (a.n_elements != b.n_elements) return false;
  for (int n = 0; n < a.n_elements; ++n) {
    if (a.elements[n].modes != b.elements[n].modes || a.ends[n].contact != b.ends[n].contact) return false;
    if (a.ends[n].contact >= 0 && a.ends[n].kind != b.ends[n].kind) return false;
    if (a.touches != b.touches) return false;
    if (!a.touches) continue;
    for (Eigen::Index i = 0; i < a.Lambda_n.rows(); ++i) {
      if ((a.Lambda_n(i, n) > 0) != (b.Lambda_n(i, n) > 0)) return false;
    }
  }
  return true;
}

bool has_same_sequence(const PlantMotion& a, const PlantMotion& b) {
  if (a.n_solved != b.n_solved) return false;
  for (int k = 0; k < a.n_solved; ++k) {
    if (!has_same_sequence(a.steps[static_cast<std::size_t>(k)], b.steps[static_cast<std::size_t>(k)])) return false;
  }
  return true;
}

PlantRunner::PlantRunner(const OptimalControlProblem& problem, const ButcherTableau& tableau)
    : problem_(require_smooth_plant(problem)),
      tableau_(tableau),
      plant_(problem),
      constraints_(problem),
      solver_(plant_, tableau_, {.n_fe = problem.n_fe, .as_needed = true, .equal_runs = true}, counters_),
      stage_(2 * plant_.n_q() + plant_.info().n_u) {}

void PlantRunner::run(const Vector& q, const Vector& v, const Policy& policy, int N, double H, PlantMotion& motion) {
  ++rollouts_;
  motion.status = Status::success;
  motion.message.clear();
  motion.n_solved = 0;
  motion.u.resize(plant_.info().n_u, N);
  motion.H = H;
  motion.x.resize(2 * plant_.n_q(), N + 1);
  motion.x.col(0) << q, v;
  motion.steps.resize(static_cast<std::size_t>(N));
  motion.cost = motion.violation = motion.worst = 0;
  motion.worst_interval = motion.worst_row = -1;
  motion.terminal.resize(0);
  try {
    solver_.start(q, v);
    run_intervals(policy, N, motion);
  } catch (const InputError& error) {  // a formula of the scene outside of its range, as a coefficient above 1
    motion.status = Status::infeasible;
    motion.message = fmt::format("interval {} of {}: {}", motion.n_solved + 1, N, error.what());
  }
}

void PlantRunner::run(const Vector& q, const Vector& v, const Matrix& u, double H, PlantMotion& motion) {
  const auto given = [&](int k, const Eigen::Ref<const Vector>&, Eigen::Ref<Vector> u_k) { u_k = u.col(k); };
  run(q, v, given, static_cast<int>(u.cols()), H, motion);
}

void PlantRunner::run_intervals(const Policy& policy, int N, PlantMotion& motion) {
  const auto stop = [&](Status status, const std::string& reason) {
    motion.status = status;
    motion.message = fmt::format("interval {} of {}: {}", motion.n_solved + 1, N, reason);
  };
  for (int k = 0; k < N; ++k) {
    policy(k, motion.x.col(k), motion.u.col(k));
    if (!motion.u.col(k).allFinite()) return stop(Status::non_finite, "the control is not finite");
    plant_.set_control(motion.u.col(k));
    if (const Status status = solver_.advance(motion.H); status != Status::success)
      return stop(status, solver_.failure_message());
    keep_step(solver_.step(), motion.steps[static_cast<std::size_t>(k)]);
    const Element& last = solver_.step().last();
    motion.x.col(k + 1) << last.q1, last.v1;
    add_interval(k, motion);
    if (!std::isfinite(motion.cost) || !std::isfinite(motion.violation))
      return stop(Status::non_finite, "the cost or a constraint is not finite");
    ++motion.n_solved;
  }
  const Element& last = solver_.step().last();
  motion.cost += problem_.terminal_cost.at(last.q1, last.v1)[0];
  motion.terminal = problem_.terminal.at(last.q1, last.v1);
  if (std::isfinite(motion.cost) && motion.terminal.allFinite()) return;
  motion.status = Status::non_finite;
  motion.message = "the terminal cost or a terminal constraint is not finite";
}

void PlantRunner::add_interval(int k, PlantMotion& motion) {
  const FesdStep& step = solver_.step();
  const Eigen::Index n_q = plant_.n_q();
  stage_.tail(plant_.info().n_u) = motion.u.col(k);
  for (int n = 0; n < step.n_elements; ++n) {
    const Element& e = step.elements[n];
    for (int j = 0; j < tableau_.n_s; ++j) {
      stage_.head(n_q) = e.q.col(j);
      stage_.segment(n_q, n_q) = e.v.col(j);
      double L = 0;
      problem_.running_cost.evaluate(stage_.data(), &L);
      motion.cost += e.h * tableau_.b[j] * L;
      constraints_.values(stage_, c_);
      if (!c_.allFinite()) motion.violation = NAN;
      for (Eigen::Index i = 0; i < c_.size(); ++i) {
        if (!(c_[i] < 0)) continue;
        motion.violation -= c_[i];
        if (-c_[i] <= motion.worst) continue;
        motion.worst = -c_[i];
        motion.worst_interval = k;
        motion.worst_row = static_cast<int>(i);
      }
    }
  }
}

WorstConstraint PlantRunner::worst(const PlantMotion& motion) const {
  WorstConstraint worst;
  if (motion.worst_row >= 0)
    worst = {motion.worst,
             fmt::format("{} in interval {}", constraints_.name(motion.worst_row), motion.worst_interval + 1)};
  for (Eigen::Index k = 0; k < motion.terminal.size(); ++k) {
    if (std::abs(motion.terminal[k]) > worst.value)
      worst = {std::abs(motion.terminal[k]),
               fmt::format("terminal constraint '{}'", problem_.terminal_names[static_cast<std::size_t>(k)])};
  }
  return worst;
}

ControlTrajectory PlantRunner::trajectory(const PlantMotion& motion) const {
  ControlTrajectory trajectory;
  const auto N = static_cast<int>(motion.u.cols());
  trajectory.u = motion.u;
  trajectory.T = N * motion.H;
  trajectory.interval_cost = Vector::Zero(N);
  for (int k = 0; k < motion.n_solved; ++k)
    add_step(problem_, motion.steps[static_cast<std::size_t>(k)], tableau_, k, k * motion.H, trajectory);
  if (motion.n_solved == N) add_end(problem_, motion.steps.back(), trajectory.T, trajectory);
  return trajectory;
}

}  // namespace ricochet
