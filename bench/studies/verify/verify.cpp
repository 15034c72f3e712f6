#include "bench/studies/verify/verify.h"

#include "bench/experiment/study.h"
#include "bench/rows/progress.h"
#include "bench/studies/hard_cases/run_hard_cases.h"
#include "bench/studies/verify/public_report_checks.h"
#include "bench/studies/verify/scorecard.h"
#include "methods/registry.h"

namespace ricochet {

using nlohmann::json;

std::vector<Check> battery_of(const json& experiment) {
  std::vector<Check> battery;
  if (experiment.contains("orders")) add_order_checks(experiment, battery);
  if (experiment.contains("truth")) add_truth_checks(experiment, battery);
  if (experiment.contains("promises")) add_promise_checks(experiment, battery);
  if (experiment.contains("hard_cases")) add_hard_case_checks(experiment, battery);
  if (experiment.contains("public_reports")) add_public_report_checks(experiment, battery);
  return battery;
}

Subject subject_of(const std::string& method, double time_limit) {
  return {method, make_method(method)->info(), step_factor(method), time_limit};
}

namespace {

std::vector<std::string> methods_of(const json& experiment) {
  if (experiment.contains("methods")) return experiment["methods"];
  std::vector<std::string> specs;
  for (const auto& entry : methods()) {
    if (entry.make) specs.insert(specs.end(), entry.examples.begin(), entry.examples.end());
  }
  return specs;
}

void run_verify(const json& experiment, ResultsFile& file) {
  const auto battery = battery_of(experiment);
  const auto specs = methods_of(experiment);
  const double time_limit = experiment.at("time_limit");
  Progress progress(experiment.at("id").get<std::string>());
  const std::size_t n = battery.size();
  // A piece is one check of all methods: what is known of its problem is made once.
  const auto run = [&](std::size_t k, const ResultsFile::NextRow<CheckRow>& next) {
    for (const auto& spec : specs) next([&] { return run_check(battery[k], subject_of(spec, time_limit)); });
  };
  file.pieces<CheckRow>(n, run, [&](std::size_t k) {
    progress.update(static_cast<double>(k + 1) / static_cast<double>(n), battery[k].name);
  });
}

void show_verify(const Results& results, Section& section) {
  const auto rows = results.all<CheckRow>();
  if (const Table reports = public_report_table(rows); !reports.rows.empty()) section.result("public_reports", reports);
  section.result("scorecards", scorecard_table(rows));
  Table failures = check_table(rows, true);
  failures.is_list = true;
  section.details("failures", failures);
  section.details("checks", check_table(rows, false));
}

constexpr const char* kVerifyFields = R"~({
  "required": ["first_order_steps", "high_order_steps", "tolerances", "time_limit"],
  "properties": {
    "orders": {"type": "array", "items": {"type": "object", "additionalProperties": false, "required": ["check", "problem"], "properties": {
        "check": {"type": "string", "minLength": 1, "description": "Its name on the scorecard.", "examples": ["impacts"]},
        "problem": {"$ref": "#/$defs/problem", "examples": ["pendulum_wall"]},
        "parameters": {"$ref": "#/$defs/parameters", "examples": [{"e": 0.5}]},
        "is_smooth": {"type": "boolean", "description": "The order that is claimed is that on smooth motion, not that through impacts.", "examples": [true]},
        "sensitivities": {"type": "array", "minItems": 1, "items": {"type": "string"}, "description": "The error is that of derivatives by these, of the ground truth.", "examples": [["v0:0"]]}}},
      "description": "Problems on which the order is measured that a method claims.", "examples": [[{"check": "impacts", "problem": "pendulum_wall"}]]},
    "truth": {"type": "object", "additionalProperties": false, "required": ["except", "first_order_steps", "steps", "tolerance", "first_order_error", "error"], "properties": {
        "except": {"type": "array", "items": {"type": "string"}, "description": "Cases that are not checked.", "examples": [["P1d_ball_e05_through_zeno"]]},
        "first_order_steps": {"type": "integer", "minimum": 1, "description": "Of methods of first order.", "examples": [4000]},
        "steps": {"type": "integer", "minimum": 1, "description": "Of other fixed-step methods.", "examples": [400]},
        "tolerance": {"type": "number", "minimum": 1e-15, "exclusiveMaximum": 1, "description": "Tolerance of error-controlled methods.", "examples": [1e-9]},
        "first_order_error": {"type": "number", "exclusiveMinimum": 0, "description": "Allowed to methods of first order, relative to the solution where that is larger than 1.", "examples": [0.02]},
        "error": {"type": "number", "exclusiveMinimum": 0, "description": "Allowed to the others.", "examples": [1e-6]}},
      "description": "Errors and impacts against the solutions in reference/data/ground_truth.json.", "examples": [{"except": [], "first_order_steps": 4000, "steps": 400, "tolerance": 1e-9, "first_order_error": 0.02, "error": 1e-6}]},
    "promises": {"type": "array", "items": {"$ref": "#/$defs/problem"}, "description": "Scenes on which a method keeps what every method promises.", "examples": [["bouncing_ball"]]},
    "allocation": {"type": "array", "items": {"$ref": "#/$defs/problem"}, "description": "Scenes on which a step allocates nothing, where a method claims that.", "examples": [["bouncing_ball"]]},
    "hard_cases": {"type": "array", "items": {"type": "string"}, "description": "Cases of the experiment hard_cases.", "examples": [["zeno"]]},
    "public_reports": {"type": "object", "additionalProperties": false, "required": ["cases", "first_order_steps", "steps", "tolerance", "error", "factor", "multistep_factor"], "properties": {
        "cases": {"type": "string", "format": "path", "description": "File of scenes with their right answers beside the experiment.", "examples": ["../../reference/data/public_reports/cases.json"]},
        "only": {"type": "array", "items": {"type": "string"}, "description": "Names of the scenes; without it all.", "examples": [["post"]]},
        "first_order_steps": {"type": "integer", "minimum": 1, "description": "Of methods of first order.", "examples": [2000]},
        "steps": {"type": "integer", "minimum": 1, "description": "Of other fixed-step methods.", "examples": [100]},
        "tolerance": {"type": "number", "minimum": 1e-15, "exclusiveMaximum": 1, "description": "Tolerance of error-controlled methods.", "examples": [1e-10]},
        "error": {"type": "number", "exclusiveMinimum": 0, "description": "Allowed to fixed steps, relative to the answer where that is larger than 1.", "examples": [0.01]},
        "factor": {"type": "number", "minimum": 1, "description": "Error allowed to error-controlled methods, times the tolerance to which the answer is known, relative to the answer where that is larger than 1.", "examples": [100]},
        "multistep_factor": {"type": "number", "minimum": 1, "description": "The same for CVODE and IDA, whose tolerance is of one step of thousands.", "examples": [10000]}},
      "description": "Scenes made from public reports, each with its right answer.", "examples": [{"cases": "../../reference/data/public_reports/cases.json", "first_order_steps": 2000, "steps": 100, "tolerance": 1e-10, "error": 0.01, "factor": 100, "multistep_factor": 10000}]},
    "first_order_steps": {"$ref": "#/$defs/range", "description": "Steps for the order of methods of first order.", "examples": [{"from": 100, "to": 10000, "per_decade": 5}]},
    "high_order_steps": {"$ref": "#/$defs/range", "description": "Steps for the order of the others.", "examples": [{"from": 10, "to": 640, "per_decade": 6}]},
    "tolerances": {"$ref": "#/$defs/range", "description": "Tolerance of error-controlled methods.", "examples": [{"from": 1e-3, "to": 1e-10, "per_decade": 1}]},
    "methods": {"type": "array", "items": {"$ref": "#/$defs/method"}, "description": "Methods; without it the examples of all that are built.", "examples": [["moreau_jean"]]}
  }
})~";

const bool verify_is_registered =
    register_study({.kind = "verify",
                    .summary = "a scorecard for each method: orders, truth, promises, hard cases, public reports",
                    .fields = kVerifyFields,
                    .rows = {CheckRow::kKind},
                    .times = Times::none,
                    .name_methods = [](json& experiment) { experiment["methods"] = methods_of(experiment); },
                    .run = run_verify,
                    .show = show_verify,
                    .unexpected_failures = {}});

}  // namespace

}  // namespace ricochet
