#pragma once

#include <algorithm>

#include "problems/control/optimal_control_problem.h"
#include "problems/join.h"
#include "problems/scene.h"

namespace ricochet {

// An optimal control problem is a scene (problems/scene.h) with a control that also states
//
//   ControlGrid grid() const;                          // N, N_FE, tableau
//   ControlBounds<n_q, n_u> bounds() const;            // of q, v, u
//   T running_cost(q, v, u) const;   T terminal_cost(q, v) const;
//
// and optionally
//
//   std::array<T, n> path(q, v, u) const;              // >= 0 at every stage
//   std::array<const char*, n> path_names() const;
//   std::array<T, n> terminal(q, v) const;             // = 0 at T
//   std::array<const char*, n> terminal_names() const;
//   std::array<double, 2> time_bounds() const;         // T is an unknown between these; end_time() is its guess
//   std::array<T, n_q> goal() const;                   // q where the bodies have to go: drawings show it
//
//   const bool registered = register_control_problem<Discs>();

struct ControlGrid {
  int n_intervals, n_fe;
  const char* tableau;
};

template <std::size_t n_q, std::size_t n_u>
struct ControlBounds {
  std::array<double, n_q> q_lower, q_upper, v_lower, v_upper;
  std::array<double, n_u> u_lower, u_upper;
};

template <std::size_t n>
std::array<double, n> every(double value) {
  std::array<double, n> values;
  values.fill(value);
  return values;
}

namespace scene_detail {

template <class Scene>
concept HasPath = requires(const Scene s) {
  s.path(s.q0(), s.v0(), s.control());
};
template <class Scene>
concept HasTerminal = requires(const Scene s) {
  s.terminal(s.q0(), s.v0());
};
template <class Scene>
concept HasFreeTime = requires(const Scene s) {
  s.time_bounds();
};
template <class Scene>
concept HasGoal = requires(const Scene s) {
  s.goal();
};

/// The first `size` numbers; `none` for coordinates that are no body's.
template <std::size_t n>
Vector to_vector(const std::array<double, n>& values, std::size_t size, double none) {
  Vector bounds = Vector::Constant(static_cast<Eigen::Index>(size), none);
  std::ranges::copy(values, bounds.begin());
  return bounds;
}

template <template <class> class Scene>
std::unique_ptr<OptimalControlProblem> make_control(const Scene<double>& numeric) {
  using GiNaC::ex;
  auto problem = std::make_unique<OptimalControlProblem>();
  auto plant = std::make_unique<CompiledProblem<Scene>>(numeric);
  const SymbolicModel& model = plant->equations();
  problem->id = model.id;
  problem->title = model.title;
  problem->source = model.source;
  problem->hard_feature = model.hard_feature;

  const ControlGrid grid = numeric.grid();
  problem->n_intervals = grid.n_intervals;
  problem->n_fe = grid.n_fe;
  problem->tableau = grid.tableau;
  const auto bounds = numeric.bounds();
  const auto to_bounds = [](const auto& lower, const auto& upper, std::size_t size) {
    constexpr double infinity = std::numeric_limits<double>::infinity();
    return OptimalControlProblem::Bounds{to_vector(lower, size, -infinity), to_vector(upper, size, infinity)};
  };
  problem->q = to_bounds(bounds.q_lower, bounds.q_upper, model.q.size());
  problem->v = to_bounds(bounds.v_lower, bounds.v_upper, model.v.size());
  problem->u = to_bounds(bounds.u_lower, bounds.u_upper, bounds.u_lower.size());

  Scene<ex> scene;
  std::size_t next = 0;
  scene.parameters([&](const char*, ex& value, const char*) { value = model.parameter_symbols[next++]; });
  constexpr std::size_t n = n_q<Scene<ex>>, n_u = std::tuple_size_v<decltype(scene.control())>;
  Vec<ex, n> q, v;
  Vec<ex, n_u> u;
  std::copy_n(model.q.begin(), n, q.begin());
  std::copy_n(model.v.begin(), n, v.begin());
  std::copy(model.u.begin(), model.u.end(), u.begin());
  const auto state = join<GiNaC::symbol>({model.q, model.v});
  const auto state_and_control = join<GiNaC::symbol>({model.q, model.v, model.u});
  const auto constants = model.constants();
  problem->running_cost = {{scene.running_cost(q, v, u)}, state_and_control, constants};
  problem->terminal_cost = {{scene.terminal_cost(q, v)}, state, constants};
  if constexpr (HasPath<Scene<ex>>) {
    const auto path = scene.path(q, v, u);
    problem->path = {{path.begin(), path.end()}, state_and_control, constants};
    for (const char* name : scene.path_names()) problem->path_names.emplace_back(name);
  }
  if constexpr (HasTerminal<Scene<ex>>) {
    const auto terminal = scene.terminal(q, v);
    problem->terminal = {{terminal.begin(), terminal.end()}, state, constants};
    for (const char* name : scene.terminal_names()) problem->terminal_names.emplace_back(name);
  }
  if constexpr (HasFreeTime<Scene<double>>) {
    problem->is_time_free = true;
    problem->T_lower = numeric.time_bounds()[0];
    problem->T_upper = numeric.time_bounds()[1];
  }
  if constexpr (HasGoal<Scene<double>>) problem->goal = to_vector(numeric.goal(), model.q.size(), 0);
  problem->plant = std::move(plant);
  return problem;
}

}  // namespace scene_detail

/// Registers the optimal control problem under its id. Call once, in the file of the problem.
template <template <class> class Scene>
bool register_control_problem() {
  const auto text = Scene<double>::text;
  return add_control_problem({text.id, text.title, text.source, text.hard_feature, [](const ParameterChanges& changes) {
                                return scene_detail::make_control<Scene>(scene_with<Scene>(changes));
                              }});
}

}  // namespace ricochet
