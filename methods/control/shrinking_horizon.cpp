#include "methods/control/shrinking_horizon.h"

#include <Eigen/QR>

#include "problems/input_error.h"

namespace ricochet {
namespace {

// A gap up to here is closed [m]: to this the pivoting solver keeps contacts.
constexpr double kTouching = 1e-9;
// Newton steps that bring a moved state back to its closed contacts, from 1e-2 to rounding.
constexpr int kNewtonSteps = 5;

std::vector<bool> closed_contacts(const Vector& gap) {
  std::vector<bool> is_closed(static_cast<std::size_t>(gap.size()));
  for (std::size_t i = 0; i < is_closed.size(); ++i) is_closed[i] = gap[static_cast<Eigen::Index>(i)] <= kTouching;
  return is_closed;
}

std::vector<int> numbers(const std::vector<bool>& is_member) {
  std::vector<int> result;
  for (std::size_t i = 0; i < is_member.size(); ++i) {
    if (is_member[i]) result.push_back(static_cast<int>(i));
  }
  return result;
}

/// The shortest x with J' x = b.
Vector shortest(const Matrix& J, const Vector& b) {
  return J.transpose().completeOrthogonalDecomposition().solve(b);
}

}  // namespace

ShrinkingHorizon::ShrinkingHorizon(const OptimalControlProblem& problem, ControlSolver& solver)
    : problem_(problem),
      solver_(solver),
      simulation_(solver.simulation()),
      plant_(problem),
      pivoting_(plant_, simulation_.tableau, simulation_.options, counters_),
      q_(plant_.info().q0),
      v_(plant_.info().v0) {
  if (!plant_.info().switches.empty())
    throw InputError("plant", problem.id,
                     "one without abs, sign, min, max and if is required: the steps of the plant locate no switches");
  pivoting_.start(q_, v_);
}

ControlSolution ShrinkingHorizon::take(ControlSolution solution) {
  if (solution.has_plan()) plan_ = solution.trajectory;
  return solution;
}

ControlSolution ShrinkingHorizon::solve() {
  return take(solver_.solve());
}

Status ShrinkingHorizon::advance() {
  const Vector u = plan_.u.col(k_);
  plant_.set_control(u);
  const Status status = pivoting_.advance(plan_.T / problem_.n_intervals);
  if (status != Status::success) return status;
  add_step(problem_, pivoting_.step(), simulation_.tableau, u, past_);
  q_ = pivoting_.step().last().q1;
  v_ = pivoting_.step().last().v1;
  ++k_;
  return Status::success;
}

void ShrinkingHorizon::disturb(double size, std::mt19937& random) {
  std::uniform_real_distribution<double> uniform(-1, 1);
  const auto direction = [&] { return Vector::NullaryExpr(q_.size(), [&] { return uniform(random); }).eval(); };
  const Vector dq = problem_.plant->force_directions(direction()),  // the clock goes on
      dv = problem_.plant->force_directions(direction().cwiseProduct(v_));
  const std::vector<bool> is_closed = closed_contacts(problem_.plant->gap(q_));
  const std::vector<int> closed = numbers(is_closed);
  const auto directions = [&](const Vector& q) -> Matrix {
    return problem_.plant->force_directions(problem_.plant->normal_jacobian(q)(Eigen::all, closed));
  };
  const auto moved = [&](double by) {
    Vector q = q_ + by * dq;
    for (int i = 0; i < kNewtonSteps && !closed.empty(); ++i)
      q -= shortest(directions(q), problem_.plant->gap(q)(closed));
    return q;
  };
  Vector q = moved(size);
  while (closed_contacts(problem_.plant->gap(q)) != is_closed) q = moved(size /= 2);
  v_ += size * dv;
  if (!closed.empty()) {
    const Matrix J = problem_.plant->normal_jacobian(q)(Eigen::all, closed);
    v_ -= shortest(directions(q), J.transpose() * v_);
  }
  q_ = q;
  pivoting_.start(q_, v_);
}

ControlSolution ShrinkingHorizon::resolve() {
  return take(solver_.resolve(k_, q_, v_, closed_contacts(problem_.plant->gap(q_))));
}

double ShrinkingHorizon::cost_to_go() const {
  return plan_.objective - plan_.interval_cost.head(k_).sum();
}

double ShrinkingHorizon::terminal_cost() const {
  return problem_.terminal_cost.at(q_, v_)[0];
}

}  // namespace ricochet
