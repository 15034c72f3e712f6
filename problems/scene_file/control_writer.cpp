#include <fmt/format.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "problems/derivatives/symbolic_problem.h"
#include "problems/geometry_equations.h"
#include "problems/scene_file/control_file.h"
#include "problems/scene_file/expression_text.h"
#include "problems/scene_file/geometry_fields.h"
#include "problems/scene_file/scene_writer.h"

namespace ricochet {
namespace {

using nlohmann::ordered_json;

/// The shortest text that reads back exactly; null for no bound.
ordered_json bound_json(double bound) {
  if (!std::isfinite(bound)) return nullptr;
  return fmt::format("{}", bound);
}

/// Those of the first `size` coordinates; others are no body's. Null if all are infinite.
ordered_json bounds_json(const OptimalControlProblem::Bounds& bounds, Eigen::Index size) {
  if (!bounds.lower.head(size).array().isFinite().any() && !bounds.upper.head(size).array().isFinite().any())
    return nullptr;
  ordered_json list = ordered_json::array();
  for (Eigen::Index k = 0; k < size; ++k)
    list.push_back(ordered_json::array({bound_json(bounds.lower[k]), bound_json(bounds.upper[k])}));
  return list;
}

ordered_json constraints_json(const SmoothFunction& function, const std::vector<std::string>& names) {
  ordered_json list = ordered_json::array();
  for (std::size_t k = 0; k < names.size(); ++k)
    list.push_back({{"name", names[k]}, {"value", expression_text(function.formulas()[k])}});
  return list;
}

/// The cost of a control problem in the two fields that state it: squares, and the rest.
void put_cost(const SmoothFunction& cost, const SmoothFunction& residuals, const std::string& name,
              ordered_json& control) {
  GiNaC::ex rest = cost.formulas()[0];
  ordered_json squares = ordered_json::array();
  for (const GiNaC::ex& residual : residuals.formulas()) {
    rest -= residual * residual;
    squares.push_back({{"value", expression_text(residual)}});
  }
  control[name + "_cost"] = expression_text(rest);
  if (!squares.empty()) control[name + "_squares"] = std::move(squares);
}

ordered_json control_json(const OptimalControlProblem& problem, Eigen::Index n_q) {
  ordered_json control = {{"N", problem.n_intervals}, {"elements", problem.n_fe}, {"tableau", problem.tableau}};
  put_cost(problem.running_cost, problem.running_residuals, "running", control);
  put_cost(problem.terminal_cost, problem.terminal_residuals, "terminal", control);
  for (const auto& [key, bounds, size] : {std::tuple("q", &problem.q, n_q), std::tuple("v", &problem.v, n_q),
                                          std::tuple("u", &problem.u, problem.u.lower.size())}) {
    if (ordered_json list = bounds_json(*bounds, size); !list.is_null()) control["bounds"][key] = std::move(list);
  }
  if (problem.is_time_free)
    control["bounds"]["T"] = ordered_json::array({bound_json(problem.T_lower), bound_json(problem.T_upper)});
  if (!problem.path_names.empty()) control["path"] = constraints_json(problem.path, problem.path_names);
  if (!problem.terminal_names.empty()) control["terminal"] = constraints_json(problem.terminal, problem.terminal_names);
  for (const auto& column : problem.u_guess.colwise()) {
    ordered_json row = ordered_json::array();
    for (const double u : column) row.push_back(fmt::format("{}", u));
    control["guess"].push_back(std::move(row));
  }
  if (problem.goal.size() > 0) {
    for (const double q : problem.goal.head(n_q)) control["goal"].push_back(fmt::format("{}", q));
  }
  return control;
}

}  // namespace

std::string control_text(const OptimalControlProblem& problem) {
  ordered_json document = ordered_json::parse(scene_text(*problem.plant));
  const SymbolicModel& model = *problem.plant->formulas();
  if (model.geometry) {
    for (const ShapePair& pair : model.geometry->pairs) {
      if (!difference_near_start(model, model.contacts[pair.contact].gap, contact_from_geometry(model, pair).gap, 0))
        continue;
      for (const char* field : {"shapes", "corner"}) document["problem"]["contacts"][pair.contact].erase(field);
    }
  }
  const auto n_q = static_cast<Eigen::Index>(model.q.size());
  document["problem"]["control"] = control_json(problem, n_q);
  return document.dump(2) + "\n";
}

}  // namespace ricochet
