#include "methods/control/transcription.h"

#include <fmt/format.h>

#include <algorithm>

#include "methods/mpcc_equations/nlp_blocks.h"
#include "problems/control/replay_problem.h"
#include "problems/join.h"

namespace ricochet {
namespace {

/// Part of a bound that an interior-point method leaves between it and a variable on it.
constexpr double kAtBound = 1e-6;

}  // namespace

std::vector<std::vector<int>> Transcription::add_controls() {
  const ProblemInfo& info = problem_.plant->info();
  const Matrix guess = problem_.guess(problem_.n_intervals);
  std::vector<std::vector<int>> u(static_cast<std::size_t>(problem_.n_intervals));
  for (std::size_t k = 0; k < u.size(); ++k) {
    for (int c = 0; c < info.n_u; ++c)
      u[k].push_back(mpcc_.nlp.add_variable(problem_.u.lower[c], problem_.u.upper[c],
                                            guess(c, static_cast<Eigen::Index>(k)),
                                            fmt::format("interval {}, u[{}]", k + 1, c)));
  }
  return u;
}

int Transcription::add_time() {
  if (!problem_.is_time_free) return -1;
  return mpcc_.nlp.add_variable(problem_.T_lower, problem_.T_upper, problem_.plant->info().end_time, "T");
}

void Transcription::add_path(const std::vector<int>& q, const std::vector<int>& v, const std::vector<int>& u,
                             const std::string& name) {
  if (problem_.path.n_outputs() == 0) return;
  std::vector<int> rows;
  for (const auto& constraint : problem_.path_names)
    rows.push_back(mpcc_.nlp.add_row(0, kInfinity, name + ", " + constraint));
  mpcc_.nlp.add_block(std::make_unique<FunctionBlock>(problem_.path, join<int>({q, v, u}), rows));
}

void Transcription::add_terminal(const std::vector<int>& q, const std::vector<int>& v) {
  mpcc_.nlp.add_block(std::make_unique<FunctionBlock>(problem_.terminal_cost, join<int>({q, v}), std::vector<int>{}));
  if (problem_.terminal.n_outputs() == 0) return;
  std::vector<int> rows;
  for (const auto& constraint : problem_.terminal_names) rows.push_back(mpcc_.nlp.add_row(0, 0, "at T, " + constraint));
  mpcc_.nlp.add_block(std::make_unique<FunctionBlock>(problem_.terminal, join<int>({q, v}), rows));
}

std::string Transcription::stationarity(const MpccSolution& solved) const {
  std::string text = fmt::format("{}{}, {} biactive pairs", to_string(solved.stationarity),
                                 solved.is_b_stationary ? ", B" : "", solved.n_biactive);
  std::vector<int> shortest;
  for (const int h : lengths()) {
    if (solved.x[h] <= (1 + kAtBound) * mpcc_.nlp.variables[h].lower) shortest.push_back(h);
  }
  if (shortest.empty()) return text;
  return text + fmt::format("; unknown for the plant: {} at the least length, first {}",
                            shortest.size() == 1 ? "an element is" : fmt::format("{} elements are", shortest.size()),
                            mpcc_.nlp.variables[shortest.front()].name);
}

Status Transcription::guess_from_simulation(const Matrix& u) {
  ControlledPlant plant(problem_);
  const ProblemInfo& info = plant.info();
  Counters counters;
  PivotingSolver solver(plant, simulation_.tableau, simulation_.options, counters);
  Vector q = info.q0, v = info.v0;
  solver.start(q, v);
  for (int k = 0; k < problem_.n_intervals; ++k) {
    for (int c = 0; c < info.n_u; ++c) mpcc_.nlp.variables[u_[k][c]].guess = u(c, k);
    plant.set_control(u.col(k));
    const Status status = guess_interval(solver, info.end_time / problem_.n_intervals, k, q, v);
    if (status != Status::success) return status;
  }
  return Status::success;
}

Status Transcription::guess_from_simulation() {
  return guess_from_simulation(problem_.guess(problem_.n_intervals));
}

void Transcription::begin_sections() {
  next_variable_ = mpcc_.nlp.n_variables();
  next_row_ = mpcc_.nlp.n_rows();
}

void Transcription::end_section(const ContactEquations::Point& end) {
  sections_.push_back({next_variable_, next_row_, mpcc_.nlp.n_variables(), mpcc_.nlp.n_rows(), end});
  begin_sections();
}

void Transcription::start_at(int k, const Vector& x, const Vector& q, const Vector& v,
                             const std::vector<bool>& is_closed) {
  const auto fix = [&](int variable, double value) {
    auto& at = mpcc_.nlp.variables[static_cast<std::size_t>(variable)];
    at.lower = at.upper = at.guess = value;
  };
  std::vector<bool> is_paired(mpcc_.nlp.variables.size());
  for (const auto& pair : mpcc_.pairs) {
    for (const auto* side : {&pair.G, &pair.H})
      for (const int variable : *side) is_paired[static_cast<std::size_t>(variable)] = true;
  }
  for (int s = 0; s <= k; ++s) {
    const Section& section = sections_[static_cast<std::size_t>(s)];
    // Forces and parts of velocities that are past are in no row and no cost; zero is complementary to whatever the
    // state is.
    for (int i = section.first_variable; i < section.end_variable; ++i)
      fix(i, is_paired[static_cast<std::size_t>(i)] ? 0 : x[i]);
    for (int i = section.first_row; i < section.end_row; ++i) {
      auto& row = mpcc_.nlp.rows[static_cast<std::size_t>(i)];
      row.lower = -kInfinity;
      row.upper = kInfinity;
    }
    if (s == 0) continue;
    for (const int u : u_[static_cast<std::size_t>(s - 1)]) fix(u, x[u]);
  }
  const ContactEquations::Point& start = sections_[static_cast<std::size_t>(k)].end;
  const Vector gap = problem_.plant->gap(q), v_t = problem_.plant->tangent_jacobian(q).transpose() * v;
  for (std::size_t i = 0; i < start.q.size(); ++i) fix(start.q[i], q[static_cast<Eigen::Index>(i)]);
  for (std::size_t i = 0; i < start.v.size(); ++i) fix(start.v[i], v[static_cast<Eigen::Index>(i)]);
  for (std::size_t i = 0; i < start.slip.size(); ++i) fix(start.slip[i], v_t[static_cast<Eigen::Index>(i)]);
  for (std::size_t i = 0; i < start.gap.size(); ++i)
    fix(start.gap[i], is_closed[i] ? 0 : std::max(gap[static_cast<Eigen::Index>(i)], 0.0));
}

Matrix Transcription::states(const Vector& x) const {
  Matrix states(2 * problem_.plant->n_q(), static_cast<Eigen::Index>(sections_.size()));
  for (std::size_t k = 0; k < sections_.size(); ++k) {
    const ContactEquations::Point& end = sections_[k].end;
    states.col(static_cast<Eigen::Index>(k)) << x(end.q), x(end.v);
  }
  return states;
}

Transcription::MeanForces Transcription::mean_forces(const FesdStep& step, const ButcherTableau& tableau) {
  MeanForces mean{Vector::Zero(step.Lambda_n.rows()), Vector::Zero(step.Lambda_t.rows())};
  double H = 0;
  for (int n = 0; n < step.n_elements; ++n) {
    const Element& element = step.elements[n];
    mean.lambda_n += step.Lambda_n.col(n) + element.h * element.lambda_n * tableau.b;
    mean.lambda_t += step.Lambda_t.col(n) + element.h * element.lambda_t * tableau.b;
    H += element.h;
  }
  mean.lambda_n /= H;
  mean.lambda_t /= H;
  return mean;
}

ControlTrajectory Transcription::read_controls(const Vector& x) const {
  ControlTrajectory trajectory;
  trajectory.u.resize(problem_.plant->info().n_u, problem_.n_intervals);
  for (std::size_t k = 0; k < u_.size(); ++k) {
    for (std::size_t c = 0; c < u_[k].size(); ++c) trajectory.u(c, k) = x[u_[k][c]];
  }
  trajectory.interval_cost = Vector::Zero(problem_.n_intervals);
  trajectory.T = T_ >= 0 ? x[T_] : problem_.plant->info().end_time;
  return trajectory;
}

}  // namespace ricochet
