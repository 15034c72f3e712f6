#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "bench/experiment/study.h"
#include "bench/measure/measure_run.h"
#include "bench/rows/progress.h"
#include "bench/studies/control/gradient.h"
#include "bench/studies/control/gradient_rows.h"
#include "methods/registry.h"
#include "problems/input_error.h"

namespace ricochet {
namespace {

using nlohmann::json;

constexpr double kGradientTolerance = 1e-12;  // of the event-located reference
// Changes of a control for differences: of the reference, whose error is about its tolerance; and of a discrete scheme,
// which is smooth up to the next change of its active sets.
constexpr double kReferenceChange = 1e-3;
constexpr double kSchemeChange = 1e-6;

/// Relative to the reference's largest derivative of each component. @param n_columns  the last of them
double largest_error(const Matrix& gradient, const Matrix& reference, Eigen::Index n_columns) {
  double worst = 0;
  for (Eigen::Index row = 0; n_columns > 0 && row < gradient.rows(); ++row) {
    const double error = (gradient - reference).row(row).tail(n_columns).cwiseAbs().maxCoeff();
    worst = std::max(worst, error / reference.row(row).cwiseAbs().maxCoeff());
  }
  return worst;
}

/// The controls of an experiment, one list per interval.
ControlTrajectory trajectory_of(const json& experiment, const ProblemInfo& info) {
  const auto control = experiment.at("control").get<std::vector<std::vector<double>>>();
  ControlTrajectory trajectory;
  trajectory.T = info.end_time;
  trajectory.u.resize(info.n_u, static_cast<Eigen::Index>(control.size()));
  for (std::size_t k = 0; k < control.size(); ++k) {
    if (static_cast<int>(control[k].size()) != info.n_u)
      throw InputError("control", json(control[k]).dump(), fmt::format("{} numbers are required", info.n_u));
    for (int c = 0; c < info.n_u; ++c) trajectory.u(c, static_cast<Eigen::Index>(k)) = control[k][c];
  }
  return trajectory;
}

/// Columns of a gradient that belong to intervals after the last impact of the motion.
Eigen::Index columns_after_impacts(const OptimalControlProblem& problem, const ControlTrajectory& trajectory) {
  double last_impact = 0;
  for (const auto& event : replay(problem, trajectory, reference_solver(kGradientTolerance)).events) {
    if (event.kind == EventKind::impact) last_impact = event.t;
  }
  const Eigen::Index n = trajectory.u.cols();
  const auto n_until = static_cast<Eigen::Index>(std::ceil(last_impact * static_cast<double>(n) / trajectory.T));
  return trajectory.u.rows() * (n - n_until);
}

ControlGradient row_of_gradient(const OptimalControlProblem& problem, const std::string& method, int steps,
                                const Matrix& gradient) {
  ControlGradient row;
  row.problem = problem.id;
  row.method = method;
  row.steps = steps;
  for (const char* name : {"q", "v"}) {
    for (int k = 0; k < problem.plant->info().n_mechanical(); ++k)
      row.components.push_back(fmt::format("{}_{}", name, k + 1));
  }
  for (const auto& derivatives : gradient.rowwise())
    row.derivatives.emplace_back(derivatives.begin(), derivatives.end());
  return row;
}

Matrix matrix_of(const ControlGradient& row) {
  Matrix gradient(row.derivatives.size(), row.derivatives.front().size());
  for (Eigen::Index i = 0; i < gradient.rows(); ++i) {
    for (Eigen::Index k = 0; k < gradient.cols(); ++k) gradient(i, k) = row.derivatives[i][k];
  }
  return gradient;
}

/// Derivatives of a terminal state with respect to the controls. "problem", "control": one list of controls per
/// interval, "methods": [{"method", "steps"}], steps per interval
void run_control_gradient(const json& experiment, ResultsFile& file) {
  const auto problem = make_control_problem(experiment.at("problem"));
  const ControlTrajectory trajectory = trajectory_of(experiment, problem->plant->info());
  for (const auto& entry : experiment.at("methods"))
    require_kind_of_setting(*make_method(entry.at("method")), "methods: steps", "");
  Progress progress(experiment.at("id").get<std::string>());
  const Matrix reference = matrix_of(file.row<ControlGradient>([&] {
    return row_of_gradient(
        *problem, "reference", 0,
        gradient_by_differences(*problem, trajectory, reference_solver(kGradientTolerance), kReferenceChange));
  }));
  const Eigen::Index n_after = columns_after_impacts(*problem, trajectory);
  std::vector<std::pair<std::string, int>> runs;
  for (const auto& entry : experiment.at("methods")) {
    for (const int steps : entry.at("steps").get<std::vector<int>>()) runs.emplace_back(entry.at("method"), steps);
  }
  const auto run = [&](std::size_t k) {
    const auto& [method, steps] = runs[k];
    const Matrix gradient =
        make_method(method)->info().has_sensitivities
            ? gradient_by_sensitivities(*problem, trajectory, method, steps)
            : gradient_by_differences(*problem, trajectory, fixed_step_solver(method, steps), kSchemeChange);
    ControlGradient row = row_of_gradient(*problem, method, steps, gradient);
    row.error = largest_error(gradient, reference, gradient.cols());
    row.error_after_impact = largest_error(gradient, reference, n_after);
    return row;
  };
  file.each<ControlGradient>(runs.size(), run, [&](std::size_t k) {
    progress.update(static_cast<double>(k + 1) / static_cast<double>(runs.size()), runs[k].first);
  });
}

void show_control_gradient(const Results& results, Section& section) {
  const auto gradients = results.all<ControlGradient>();
  section.result("errors", gradient_table(gradients));
  if (!gradients.empty()) section.chart(gradient_chart(gradients, results.experiment()));
  section.details("derivatives", gradient_details(gradients));
}

constexpr const char* kControlGradientFields = R"~({
  "required": ["problem", "control", "methods"],
  "properties": {
    "problem": {"type": "string", "description": "Of `ricochet control`.", "examples": ["two_carts"]},
    "control": {"type": "array", "minItems": 1, "items": {"type": "array", "items": {"type": "number"}}, "description": "One list of controls [N] per interval.", "examples": [[[4], [3]]]},
    "methods": {"type": "array", "description": "Fixed-step methods.", "items": {
      "type": "object", "additionalProperties": false, "required": ["method", "steps"], "properties": {
        "method": {"$ref": "#/$defs/method", "examples": ["fesd:radau-iia:3"]},
        "steps": {"type": "array", "items": {"type": "integer", "minimum": 1}, "description": "Numbers of steps per interval.", "examples": [[1, 2, 4]]}}}}
  }
})~";

const bool control_gradient_is_registered =
    register_study({.kind = "control_gradient",
                    .summary = "derivatives of a terminal state with respect to controls, through impacts",
                    .fields = kControlGradientFields,
                    .rows = {ControlGradient::kKind},
                    .times = Times::none,
                    .run = run_control_gradient,
                    .show = show_control_gradient,
                    .unexpected_failures = {}});

}  // namespace
}  // namespace ricochet
