#include "problems/control/optimal_control_problem.h"

#include <cmath>

#include "problems/input_error.h"
#include "problems/names.h"
#include "problems/scene_file/control_file.h"

namespace ricochet {
namespace {

std::map<std::string, ControlEntry>& entries() {
  static std::map<std::string, ControlEntry> entries;
  return entries;
}

void check_bounds(const std::string& name, const OptimalControlProblem::Bounds& bounds, int size) {
  if (bounds.lower.size() != size || bounds.upper.size() != size)
    throw InputError("bounds of " + name, fmt::format("{} and {} numbers", bounds.lower.size(), bounds.upper.size()),
                     fmt::format("{} lower and upper ones are required", size));
  for (int k = 0; k < size; ++k) {
    if (!(bounds.lower[k] <= bounds.upper[k]))
      throw InputError(fmt::format("bounds of {}[{}]", name, k),
                       fmt::format("[{:g}, {:g}]", bounds.lower[k], bounds.upper[k]), "lower <= upper is required");
  }
}

void check_start(const std::string& name, const Vector& x, const OptimalControlProblem::Bounds& bounds) {
  for (Eigen::Index k = 0; k < x.size(); ++k) {
    if (x[k] < bounds.lower[k] || x[k] > bounds.upper[k])
      throw InputError(
          fmt::format("initial {}[{}]", name, k), x[k],
          fmt::format("a number in its bounds [{:g}, {:g}] is required", bounds.lower[k], bounds.upper[k]));
  }
}

void check_function(const std::string& name, const SmoothFunction& function, int n_inputs, int n_outputs) {
  if (function.n_outputs() == 0 && n_outputs != 1) return;
  const bool fits = function.n_inputs() == n_inputs && (n_outputs < 0 || function.n_outputs() == n_outputs);
  if (!fits)
    throw InputError(name, fmt::format("{} outputs of {} inputs", function.n_outputs(), function.n_inputs()),
                     fmt::format("{} inputs{} are required", n_inputs, n_outputs == 1 ? " and one output" : ""));
}

}  // namespace

bool add_control_problem(ControlEntry entry) {
  const std::string id = entry.id;
  if (!entries().emplace(id, std::move(entry)).second)
    throw std::logic_error("two optimal control problems are registered as " + id);
  return true;
}

std::vector<ControlEntry> control_problems() {
  std::vector<ControlEntry> list;
  for (const auto& [id, entry] : entries()) list.push_back(entry);
  return list;
}

std::unique_ptr<OptimalControlProblem> make_control_problem(const std::string& id, const ParameterChanges& changes) {
  if (id.find_first_of("./#") != std::string::npos) return read_control_file(id, changes);
  const auto entry = entries().find(id);
  if (entry == entries().end()) throw_unknown_name("optimal control problem", id, keys_of(entries()));
  auto problem = entry->second.make(changes);
  validate(*problem);
  return problem;
}

Matrix OptimalControlProblem::guess(int N) const {
  if (u_guess.size() == 0) return plant->info().u.replicate(1, N);
  Matrix resampled(u_guess.rows(), N);
  for (Eigen::Index k = 0; k < N; ++k) resampled.col(k) = u_guess.col((2 * k + 1) * u_guess.cols() / (2 * N));
  return resampled;
}

void validate(const OptimalControlProblem& problem) {
  validate(*problem.plant);
  const ProblemInfo& info = problem.plant->info();
  if (info.n_u == 0) throw InputError("optimal control problem", problem.id, "a plant with a control is required");
  check_bounds("q", problem.q, info.n_q);
  check_bounds("v", problem.v, info.n_q);
  check_bounds("u", problem.u, info.n_u);
  check_start("q", info.q0, problem.q);
  check_start("v", info.v0, problem.v);
  if (problem.u_guess.size() > 0 && problem.u_guess.rows() != info.n_u)
    throw InputError("guess of the controls", fmt::format("{} rows", problem.u_guess.rows()),
                     fmt::format("one for each of {} controls is required", info.n_u));
  const int n_x = 2 * info.n_q;
  check_function("running cost", problem.running_cost, n_x + info.n_u, 1);
  check_function("terminal cost", problem.terminal_cost, n_x, 1);
  check_function("running squares", problem.running_residuals, n_x + info.n_u, -1);
  check_function("terminal squares", problem.terminal_residuals, n_x, -1);
  check_function("path constraints", problem.path, n_x + info.n_u, -1);
  check_function("terminal constraints", problem.terminal, n_x, -1);
  const auto check_names = [](const char* what, const std::vector<std::string>& names, int count) {
    if (static_cast<int>(names.size()) != count)
      throw InputError(what, fmt::format("{} names", names.size()),
                       fmt::format("one for each of {} is required", count));
  };
  check_names("path constraints", problem.path_names, problem.path.n_outputs());
  check_names("terminal constraints", problem.terminal_names, problem.terminal.n_outputs());
  if (problem.n_intervals < 1) throw InputError("control intervals", problem.n_intervals, "at least one is required");
  if (problem.n_fe < 1) throw InputError("finite elements", problem.n_fe, "at least one is required");
  if (problem.is_time_free && !(0 < problem.T_lower && problem.T_lower <= problem.T_upper))
    throw InputError("bounds of T", fmt::format("[{:g}, {:g}]", problem.T_lower, problem.T_upper),
                     "0 < lower <= upper is required");
  const Vector path = problem.path.at(info.q0, info.v0, info.u);
  for (Eigen::Index k = 0; k < path.size(); ++k) {
    if (!(path[k] >= 0))
      throw InputError("path constraint '" + problem.path_names[k] + "' at the initial state", path[k],
                       "a value >= 0 is required");
  }
}

}  // namespace ricochet
