#include "reports/record.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <functional>
#include <map>

#include "problems/input_error.h"
#include "reports/json_number.h"

namespace ricochet {
namespace {

using nlohmann::json;

json counters_to_json(const Counters& c) {
  return {{"steps", c.steps},
          {"elements", c.elements},
          {"force_evaluations", c.force_evaluations},
          {"jacobian_evaluations", c.jacobian_evaluations},
          {"mass_factorizations", c.mass_factorizations},
          {"matrix_factorizations", c.matrix_factorizations},
          {"linear_solves", c.linear_solves},
          {"complementarity_solves", c.complementarity_solves},
          {"inner_iterations", c.inner_iterations},
          {"pivots", c.pivots},
          {"events", c.events}};
}

Counters counters_from_json(const json& j) {
  Counters c;
  c.steps = j.at("steps");
  c.elements = j.at("elements");
  c.force_evaluations = j.at("force_evaluations");
  c.jacobian_evaluations = j.at("jacobian_evaluations");
  c.mass_factorizations = j.at("mass_factorizations");
  c.matrix_factorizations = j.at("matrix_factorizations");
  c.linear_solves = j.at("linear_solves");
  c.complementarity_solves = j.at("complementarity_solves");
  c.inner_iterations = j.at("inner_iterations");
  c.pivots = j.at("pivots");
  c.events = j.at("events");
  return c;
}

Record record_from_json(const json& j) {
  Record r;
  r.experiment = j.at("experiment");
  r.problem = j.at("problem");
  r.method = j.at("method");
  r.title = j.at("title");
  r.steps = j.at("steps");
  r.tolerance = j.at("tolerance");
  r.h_bar = number_or_nan(j.at("h_bar"));
  r.nominal_order = j.at("nominal_order");
  r.status = j.at("status");
  r.message = j.at("message");
  r.error = number_or_nan(j.at("error"));
  r.reference_error = j.at("reference_error");
  r.solution_size = j.at("solution_size");
  r.max_residual = number_or_nan(j.at("max_residual"));
  r.detected_events = j.at("detected_events");
  r.counters = counters_from_json(j.at("counters"));
  r.sensitivities = j.value("sensitivities", r.sensitivities);
  r.instead_of = j.at("instead_of");
  r.command = j.at("command");
  return r;
}

/// Reads a line of a study into the rows of its kind.
using RowReader = std::function<void(Results&, const json&)>;

template <class Row>
RowReader append_to(std::vector<Row> Results::*rows, Row (*from_json)(const json&)) {
  return [=](Results& results, const json& j) { (results.*rows).push_back(from_json(j)); };
}

const std::map<std::string, RowReader>& row_readers() {
  static const std::map<std::string, RowReader> readers = {
      {"control_run", append_to(&Results::control_runs, control_run_from_json)},
      {"control_gradient", append_to(&Results::gradients, control_gradient_from_json)},
      {"control_growth", append_to(&Results::growth, control_growth_from_json)},
      {"seed_run", append_to(&Results::seed_runs, seed_run_from_json)},
      {"scale_run", append_to(&Results::scale_runs, scale_run_from_json)},
      {"zeno_capture", append_to(&Results::zeno_captures, zeno_capture_from_json)},
      {"zeno_run", append_to(&Results::zeno_runs, zeno_run_from_json)},
      {"ramp_grid", append_to(&Results::ramps, ramp_grid_from_json)},
      {"ramp_facets", append_to(&Results::ramp_facets, ramp_facets_from_json)},
      {"hard_cell", append_to(&Results::hard_cells, hard_cell_from_json)},
      {"fuzz_scene", append_to(&Results::fuzz_scenes, fuzz_scene_from_json)},
  };
  return readers;
}

}  // namespace

std::string Record::setting() const {
  return steps > 0 ? fmt::format("{}", steps) : fmt::format("{:.0e}", tolerance);
}

bool Record::has_error() const {
  return succeeded() && std::isfinite(error);
}

bool Results::has_errors() const {
  return std::any_of(records.begin(), records.end(), [](const Record& r) { return r.has_error(); });
}

bool Results::has_timings() const {
  return std::any_of(records.begin(), records.end(), [](const Record& r) { return r.timing.has_value(); });
}

ErrorMeasure Results::error_measure() const {
  if (records.empty() || records.front().sensitivities.empty())
    return {"error E(T)", "Error: max-norm of the difference of the final (q, v) to the reference."};
  return {
      "relative error of d(q, v)/dθ at T",
      fmt::format("Error: that of d(q, v)/dθ at the end time, the largest over θ = {}; max-norm, relative to 1 or the "
                  "size of the derivative, whichever is larger.",
                  fmt::join(records.front().sensitivities, ", "))};
}

std::vector<std::string> Results::methods() const {
  std::vector<std::string> names;
  for (const auto& record : records) {
    if (record.instead_of.empty() && std::find(names.begin(), names.end(), record.method) == names.end()) {
      names.push_back(record.method);
    }
  }
  return names;
}

std::vector<const Record*> Results::of(const std::string& method) const {
  std::vector<const Record*> list;
  for (const auto& record : records) {
    if (record.method == method && record.instead_of.empty()) list.push_back(&record);
  }
  std::stable_sort(list.begin(), list.end(), [](const Record* a, const Record* b) {
    return a->steps != b->steps ? a->steps < b->steps : a->tolerance > b->tolerance;
  });
  return list;
}

json to_json(const Record& r) {
  return {{"kind", "row"},
          {"experiment", r.experiment},
          {"problem", r.problem},
          {"method", r.method},
          {"title", r.title},
          {"steps", r.steps},
          {"tolerance", r.tolerance},
          {"h_bar", number_or_null(r.h_bar)},
          {"nominal_order", r.nominal_order},
          {"status", r.status},
          {"message", r.message},
          {"error", number_or_null(r.error)},
          {"reference_error", r.reference_error},
          {"solution_size", r.solution_size},
          {"max_residual", number_or_null(r.max_residual)},
          {"detected_events", r.detected_events},
          {"counters", counters_to_json(r.counters)},
          {"sensitivities", r.sensitivities},
          {"instead_of", r.instead_of},
          {"command", r.command}};
}

json to_json(const Timing& t) {
  return {{"median", t.median},
          {"minimum", t.minimum},
          {"lower_quartile", t.lower_quartile},
          {"upper_quartile", t.upper_quartile},
          {"repetitions", t.repetitions}};
}

json to_json(const Trajectory& t) {
  return {{"kind", "trajectory"}, {"problem", t.problem}, {"method", t.method}, {"t", t.t}, {"q", t.q}, {"v", t.v}};
}

Results read_results(const std::string& path) {
  std::ifstream file(path);
  if (!file) throw InputError("results file", path, "cannot be opened");
  Results results;
  std::string text;
  for (int line = 1; std::getline(file, text); ++line) {
    try {
      const json j = json::parse(text);
      const std::string kind = j.at("kind");
      if (kind == "header") {
        results.header = j;
        const int schema = j.at("schema");
        if (schema != kResultsSchema) {
          throw InputError(fmt::format("{}: schema", path), schema,
                           fmt::format("schema {} is required", kResultsSchema));
        }
      } else if (kind == "row") {
        results.records.push_back(record_from_json(j));
      } else if (kind == "timing") {
        const auto row = j.at("row").get<std::size_t>();
        if (row >= results.records.size())
          throw InputError(fmt::format("{}:{}: timing of row", path, line), row, "no such row");
        const json& t = j.at("timing");
        results.records[row].timing = Timing{t.at("median"), t.at("minimum"), t.at("lower_quartile"),
                                             t.at("upper_quartile"), t.at("repetitions")};
      } else if (kind == "trajectory") {
        results.trajectories.push_back({j.at("problem"), j.at("method"), j.at("t"), j.at("q"), j.at("v")});
      } else if (const auto reader = row_readers().find(kind); reader != row_readers().end()) {
        reader->second(results, j);
      } else if (kind == "end") {
        results.is_complete = true;
      }
    } catch (const json::exception& error) {
      throw InputError(fmt::format("{}:{}: not a line of a results file: {}", path, line, error.what()));
    }
  }
  if (results.header.is_null()) throw InputError("results file", path, "it has no header line");
  return results;
}

}  // namespace ricochet
