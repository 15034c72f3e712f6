#include "bench/ensemble/ensemble.h"

#include <fmt/format.h>

#include <algorithm>
#include <limits>

#include "bench/ensemble/counter_random.h"
#include "bench/experiment/experiment_file.h"
#include "bench/measure/measure_run.h"
#include "methods/method_spec.h"
#include "methods/registry.h"
#include "problems/input_error.h"
#include "reports/table.h"

namespace ricochet {
namespace {

using nlohmann::json;

constexpr std::int64_t kMostRuns = 1'000'000'000'000;

/// Methods whose libraries keep state that threads share: GiNaC and Ipopt's linear solver, Siconos' registries.
bool runs_in_one_thread(const std::string& method) {
  const std::string name = MethodSpec(method).name();
  return name == "fesd_homotopy" || name.starts_with("siconos_");
}

}  // namespace

std::int64_t Ensemble::n_runs() const {
  std::int64_t n = draws;
  for (const auto& quantity : varied) {
    const auto points = quantity.is_drawn() ? 1 : static_cast<std::int64_t>(quantity.grid().size());
    if (n > kMostRuns / points) throw InputError("vary", quantity.text(), "the grids have more than 1e12 points");
    n *= points;
  }
  return n;
}

std::vector<double> Ensemble::values(std::int64_t run) const {
  std::vector<double> list(varied.size());
  std::int64_t point = run / draws;
  for (std::size_t k = varied.size(); k-- > 0;) {
    if (varied[k].is_drawn()) continue;
    const auto points = static_cast<std::int64_t>(varied[k].grid().size());
    list[k] = varied[k].grid()[static_cast<std::size_t>(point % points)];
    point /= points;
  }
  std::uint64_t number = 0;
  for (std::size_t k = 0; k < varied.size(); ++k) {
    if (varied[k].is_drawn())
      list[k] = varied[k].drawn(uniform_number(seed, static_cast<std::uint64_t>(run), number++));
  }
  return list;
}

std::vector<std::string> Ensemble::names() const {
  std::vector<std::string> list;
  for (const auto& quantity : varied) list.push_back(quantity.name());
  return list;
}

json Ensemble::document() const {
  json text = json::array();
  for (const auto& quantity : varied) text.push_back(quantity.text());
  return {{"problem", problem.problem},
          {"parameters", problem.parameters},
          {"vary", text},
          {"runs", draws},
          {"seed", seed},
          {"method", method},
          {"steps", settings.steps},
          {"tolerance", settings.tolerance},
          {"time_limit", settings.time_limit}};
}

const JsonSchema& ensemble_schema() {
  static const JsonSchema schema = JsonSchema::parse(R"~({
    "type": "object", "additionalProperties": false, "required": ["problem", "vary", "method"],
    "properties": {
      "title": {"type": "string"},
      "problem": {"type": "string", "minLength": 1, "format": "scene"},
      "parameters": {"type": "object", "additionalProperties": {"type": "number"}},
      "vary": {"type": "array", "items": {"type": "string"}},
      "runs": {"type": "integer"},
      "seed": {"type": "number"},
      "method": {"type": "string", "minLength": 1, "format": "method"},
      "steps": {"type": "integer", "minimum": 0},
      "tolerance": {"type": "number", "minimum": 0},
      "time_limit": {"type": "number", "minimum": 0}
    }})~");
  return schema;
}

Ensemble read_ensemble(const json& document) {
  ensemble_schema().check(document, "ensemble: ");
  Ensemble ensemble;
  ensemble.problem = read_problem_choice(document);
  for (const std::string text : document.at("vary")) {
    ensemble.varied.emplace_back(text);
    const auto is_it = [&](const auto& other) { return other.name() == ensemble.varied.back().name(); };
    if (std::ranges::count_if(ensemble.varied, is_it) > 1)
      throw InputError("vary", text, "this quantity is given twice");
  }
  if (ensemble.varied.empty()) throw InputError("vary", "[]", "at least one NAME=DISTRIBUTION is required");
  ensemble.draws = document.value("runs", ensemble.draws);
  if (ensemble.draws < 1 || ensemble.draws > kMostRuns)
    throw InputError("runs", ensemble.draws, "a number from 1 to 1e12 is required");
  if (const auto seed = document.find("seed"); seed != document.end()) {
    const bool is_allowed = seed->is_number_unsigned() || (seed->is_number_integer() && seed->get<std::int64_t>() >= 0);
    if (!is_allowed) throw InputError("seed", seed->dump(), "a whole number from 0 to 2^64 - 1 is required");
    seed->get_to(ensemble.seed);
  }
  ensemble.method = document.at("method");
  ensemble.settings.steps = document.value("steps", 0);
  ensemble.settings.tolerance = document.value("tolerance", 0.0);
  ensemble.settings.time_limit = document.value("time_limit", 0.0);
  ensemble.settings.recording = Recording::final_state;
  ensemble.n_runs();
  return ensemble;
}

EnsembleWorker::EnsembleWorker(const Ensemble& ensemble)
    : ensemble_(ensemble),
      problem_(
          [choice = ensemble.problem](const ParameterChanges& changes) {
            ProblemChoice varied = choice;
            for (const auto& [name, value] : changes) varied.parameters[name] = value;
            return varied.make_problem();
          },
          ensemble.names()),
      method_(make_method(ensemble.method)) {
  if (const Support support = method_->can_run(base()); !support.ok)
    throw InputError("method", ensemble.method, fmt::format("it cannot run {}: {}", base().id, support.reason));
  const bool is_adaptive = method_->info().is_adaptive;
  require_kind_of_setting(*method_, ensemble.settings.steps != 0 ? "steps" : "",
                          ensemble.settings.tolerance != 0 ? "tolerance" : "");
  if (is_adaptive && !(ensemble.settings.tolerance >= 1e-15 && ensemble.settings.tolerance < 1))
    throw InputError("tolerance", ensemble.settings.tolerance,
                     fmt::format("a number from 1e-15 to 1 is required by {}", ensemble.method));
  if (!is_adaptive && ensemble.settings.steps < 1)
    throw InputError("steps", ensemble.settings.steps, fmt::format("at least 1 is required by {}", ensemble.method));
  if (problem_.only()) solver_ = method_->prepare(*problem_.only());
}

EnsembleRun EnsembleWorker::run(std::int64_t number) {
  EnsembleRun run{.number = number, .values = ensemble_.values(number), .status = {}, .message = {}, .q = {}, .v = {}};
  try {
    const Problem& problem = problem_.at(run.values);
    if (problem.n_q() != base().n_q)
      throw InputError("number of coordinates", problem.n_q(), fmt::format("{} is required in every run", base().n_q));
    const Solution solution =
        solver_ ? solver_->solve(ensemble_.settings) : method_->solve(problem, ensemble_.settings);
    run.status = to_string(solution.status);
    run.message = solution.message;
    run.t = solution.t;
    run.q = solution.q.head(base().n_mechanical());
    run.v = solution.v.head(base().n_mechanical());
    run.steps = solution.counters.steps;
    run.events = solution.counters.events;
  } catch (const InputError& error) {
    run.status = "bad_input";
    run.message = error.what();
  }
  return run;
}

std::string EnsembleWorker::csv_lines(std::int64_t begin, std::int64_t end) {
  std::string lines;
  for (std::int64_t k = begin; k < end; ++k) lines += csv_line(run(k), base());
  return lines;
}

std::vector<std::unique_ptr<EnsembleWorker>> make_workers(const Ensemble& ensemble, int threads) {
  if (threads < 1) throw InputError("threads", threads, "a number >= 1 is required");
  if (threads > 1 && runs_in_one_thread(ensemble.method))
    throw InputError("threads", threads,
                     fmt::format("1 is required: the library of {} has global state", ensemble.method));
  Eigen::initParallel();  // measures the caches now, not in the first threads that multiply
  std::vector<std::unique_ptr<EnsembleWorker>> workers;
  for (int k = 0; k < threads; ++k) workers.push_back(std::make_unique<EnsembleWorker>(ensemble));
  return workers;
}

std::string csv_header(const Ensemble& ensemble, const ProblemInfo& problem) {
  std::string line = "run";
  for (const auto& name : ensemble.names()) line += "," + csv_cell(name);
  line += ",status,t";
  for (const char* part : {"q", "v"}) {
    for (int k = 0; k < problem.n_mechanical(); ++k) line += fmt::format(",{}[{}]", part, k);
  }
  return line + ",steps,events,message\n";
}

std::string csv_line(const EnsembleRun& run, const ProblemInfo& problem) {
  fmt::memory_buffer line;
  const auto out = std::back_inserter(line);
  fmt::format_to(out, "{}", run.number);
  for (const double value : run.values) fmt::format_to(out, ",{}", value);
  fmt::format_to(out, ",{},{}", run.status, run.t);
  for (const Vector* x : {&run.q, &run.v}) {
    for (const double value : *x) fmt::format_to(out, ",{}", value);
    if (x->size() == 0) fmt::format_to(out, "{:,>{}}", "", problem.n_mechanical());
  }
  fmt::format_to(out, ",{},{},{}\n", run.steps, run.events, csv_cell(run.message));
  return fmt::to_string(line);
}

}  // namespace ricochet
