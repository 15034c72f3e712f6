#include "bench/studies/hard_cases/run_hard_cases.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <optional>
#include <span>
#include <stdexcept>

#include "bench/experiment/study.h"
#include "bench/measure/allocations.h"
#include "bench/measure/measure_run.h"
#include "bench/measure/penetration.h"
#include "bench/rows/progress.h"
#include "bench/studies/hard_cases/verdict_matrix.h"
#include "methods/isolated.h"
#include "methods/registry.h"
#include "problems/input_error.h"
#include "problems/vector_json.h"
#include "reports/performance_profile.h"

namespace ricochet {
namespace {

using nlohmann::json;

constexpr double kReferenceLimit = 120;      // wall time of the references of a case [s]
constexpr double kLookLimit = 60;            // and of looking at the motion of a run
constexpr std::size_t kMethodsOfPiece = 24;  // on a case; another process computes its references again

/// An energy may overflow though the state does not, and JSON has no infinity.
double bounded(double x) {
  constexpr double largest = std::numeric_limits<double>::max();
  return std::isnan(x) ? largest : std::clamp(x, -largest, largest);
}

double momentum(const Problem& problem, const Vector& q, const Vector& v) {
  return (problem.mass_matrix(q) * v).sum();
}

/// Adds the violations of conditions that hold for every motion, at grid points and in impacts; gaps also between them
/// if the method has a dense motion. Sets the status "not_finite" if a number is not finite.
void add_invariants(const Problem& problem, const Solution& s, Run& run) {
  const ProblemInfo& info = problem.info();
  const auto start = problem.energy(info.q0, info.v0);
  double deepest = 0, energy_gain = 0, cone = 0;
  bool is_finite = true;
  const auto add = [&](const Vector& q, const Vector& v_minus, const Vector& v_plus) {
    is_finite &= q.allFinite() && v_minus.allFinite() && v_plus.allFinite();
    deepest = std::max(deepest, bounded(penetration(problem, q)));
    if (start) energy_gain = std::max(energy_gain, bounded(*problem.energy(q, v_plus) - *start));
  };
  for (const auto& sample : s.samples) add(sample.q, sample.v_minus, sample.v_plus);
  add(s.q, s.v, s.v);
  for (const auto& event : s.events) {
    for (const int i : info.unilateral) {
      const auto& contact = info.contacts[i];
      if (contact.n_t == 0 || event.Lambda_t.size() == 0) continue;
      const double tangential = event.Lambda_t.segment(contact.tangent_index, contact.n_t).norm();
      cone = std::max(cone, bounded(tangential - contact.mu * event.Lambda_n[i]));
    }
  }
  run.values["penetration"] = std::max(deepest, bounded(penetration(problem, s.motion)));
  run.values["momentum"] = bounded(std::abs(momentum(problem, s.q, s.v) - momentum(problem, info.q0, info.v0)));
  run.values["cone"] = cone;
  if (start) {
    run.values["energy_gain"] = energy_gain;
    run.values["energy_change"] = bounded(*problem.energy(s.q, s.v) - *start);
  }
  if (is_finite) return;
  run.status = "not_finite";
  run.message = "success, with a number that is not finite";
}

/// Solves and measures, in the child process.
Run solve_and_measure(const Problem& problem, const std::vector<TrueMotion>& motions, double time_limit, Run run) {
  Solution s;
  const double seconds = seconds_of(
      [&] { return measure_run({.problem = problem, .recording = Recording::motion, .time_limit = time_limit}, run); },
      s);
  if (run.status == "declined") return run;
  run.timing = {seconds, seconds, seconds, seconds, 1};
  run.values["t"] = s.t;
  if (!s.succeeded()) return run;
  add_invariants(problem, s, run);
  for (const auto& motion : motions) run.error = std::fmin(run.error, bounded(motion.error_of(s)));
  return run;
}

/// Computed in a process of its own, too: a reference may find no end.
std::vector<TrueMotion> isolated_motions(const HardCase& hard_case, const Problem& problem) {
  const IsolatedResult result = run_isolated(
      [&] {
        json list = json::array();
        for (const auto& motion : hard_case.true_motions(problem))
          list.push_back({{"q", motion.q}, {"v", motion.v}, {"uncertainty", motion.uncertainty}});
        return list.dump();
      },
      kReferenceLimit);
  if (result.ending != IsolatedResult::Ending::returned)
    throw std::runtime_error(fmt::format("hard case {}: its reference {}", hard_case.id,
                                         result.ending == IsolatedResult::Ending::killed
                                             ? fmt::format("has no end within {} s", kReferenceLimit)
                                             : "has no solution: " + result.text));
  std::vector<TrueMotion> motions;
  for (const auto& j : json::parse(result.text))
    motions.push_back({j.at("q").get<Vector>(), j.at("v").get<Vector>(), j.at("uncertainty")});
  return motions;
}

/// Tried in a process of its own, for the same reason; the motion itself stays in memory.
ReferenceMotion isolated_reference_motion(const Problem& problem, const std::vector<TrueMotion>& motions) {
  if (motions.size() != 1)
    return {{}, motions.empty() ? "no motion is known to be the true one" : "more than one motion is a true one"};
  const reference::Reference end = motions[0].reference();
  const IsolatedResult trial = run_isolated([&] { return reference_motion(problem, end).reason; }, kReferenceLimit);
  switch (trial.ending) {
    case IsolatedResult::Ending::killed:
      return {{}, fmt::format("no event-located motion: it has no end within {} s", kReferenceLimit)};
    case IsolatedResult::Ending::crashed:
      return {{}, "no event-located motion: " + trial.text};
    case IsolatedResult::Ending::returned:
      break;
  }
  if (!trial.text.empty()) return {{}, trial.text};
  return reference_motion(problem, end);
}

}  // namespace

double step_factor(const std::string& method) {
  const std::string name = MethodSpec(method).name();
  for (const auto& entry : methods()) {
    if (entry.name == name) return static_cast<double>(entry.conformance_steps) / MethodEntry{}.conformance_steps;
  }
  return 1;
}

HardCell run_cell(const HardCase& hard_case, const Problem& problem, const std::vector<TrueMotion>& motions,
                  const std::string& method_spec, double time_limit) {
  const auto method = make_method(method_spec);
  const int n = method->info().order_impacts <= 1 ? hard_case.first_order_steps : hard_case.high_order_steps,
            steps = std::max(1, static_cast<int>(std::lround(n * step_factor(method_spec))));
  HardCell cell;
  cell.limits = hard_case.limits;
  Run& run = cell;
  run = planned_run({.problem = hard_case.problem, .parameters = hard_case.parameters}, method_spec,
                    setting_of(*method, steps, hard_case.tolerance));
  run.scene = hard_case.id;
  run.labels["title"] = hard_case.title;
  run.group = hard_case.group;
  run.options = fmt::format("--time-limit {}", time_limit);
  if (motions.size() == 1) {
    run.reference_error = motions[0].uncertainty;
    run.solution_size = motions[0].reference().size();
  }
  run = measured_in_child(run, 2 * time_limit,
                          [&](const Run& planned) { return solve_and_measure(problem, motions, time_limit, planned); });
  return cell;
}

void add_metrics(const Problem& problem, const ReferenceMotion& reference, bool with_memory, double time_limit,
                 HardCell& cell) {
  if (cell.status == "not_finite") cell.metrics.reason = "it has numbers that are not finite";
  if (!cell.succeeded()) return;
  const double limit = 3 * time_limit + kLookLimit;
  const Run measured = measured_in_child(cell, limit, [&](Run run) {
    const Measurement measurement{.problem = problem, .recording = Recording::final_state, .time_limit = time_limit};
    const auto method = make_method(run.method);
    run.metrics = metrics_of_run(*method, problem, measurement.settings(run), run.setting.steps, reference);
    if (with_memory) {
      Solution solution = method->solve(problem, measurement.settings(run));  // makes tables that are made once
      const double peak = peak_bytes_of([&] {
        solution = method->solve(problem, measurement.settings(run));
        return solution.own_seconds;
      });
      if (solution.succeeded()) run.peak_bytes = peak;
    }
    return run;
  });
  if (measured.succeeded())
    static_cast<Run&>(cell) = measured;
  else
    cell.metrics.reason = measured.status == "killed" ? fmt::format("measuring has no end within {} s", limit)
                                                      : "measuring it fails: " + measured.message;
}

namespace {

/// Removes what depends on how fast the machine is, and on what else it runs.
void leave_times_out(Run& run) {
  run.timing = {};
  if (run.status != to_string(Status::time_limit)) return;
  run.values.erase("t");
  run.message.clear();  // methods state in it how far they came
}

/// Every method on every case. A piece is a case with some of the methods: one case takes most of the time.
void run_matrix(const json& experiment, ResultsFile& file) {
  const HardCases cases = read_hard_cases(experiment);
  const std::size_t per_case = (cases.methods.size() + kMethodsOfPiece - 1) / kMethodsOfPiece,
                    n_pieces = cases.cases.size() * per_case;
  Progress progress(cases.id);
  std::optional<std::vector<TrueMotion>> motions;  // of the case at hand, where a cell is missing
  ReferenceMotion reference;                       // to the end of the only one of them
  std::size_t at_hand = 0;
  const auto run_piece = [&](std::size_t k, const ResultsFile::NextRow<HardCell>& next) {
    const HardCase& hard_case = cases.cases[k / per_case];
    if (k / per_case != at_hand) motions.reset();
    at_hand = k / per_case;
    const auto problem = hard_case.make_problem();
    const std::size_t first = k % per_case * kMethodsOfPiece;
    for (const auto& method :
         std::span(cases.methods).subspan(first).first(std::min(kMethodsOfPiece, cases.methods.size() - first))) {
      next([&] {
        if (!motions) {
          motions = isolated_motions(hard_case, *problem);
          reference = isolated_reference_motion(*problem, *motions);
        }
        HardCell cell = run_cell(hard_case, *problem, *motions, method, cases.time_limit);
        add_metrics(*problem, reference, cases.with_times, cases.time_limit, cell);
        if (!cases.with_times) leave_times_out(cell);
        return cell;
      });
    }
  };
  file.pieces<HardCell>(n_pieces, run_piece, [&](std::size_t k) {
    progress.update(static_cast<double>(k + 1) / static_cast<double>(n_pieces), cases.cases[k / per_case].id);
  });
}

/// Methods against each other on all cases, each with the fastest of its variants that is right, in one run; what is not
/// right takes infinitely long. The methods that get most right come first.
void add_profile(const std::vector<HardCell>& cells, const std::string& prefix, Section& section) {
  const HardMatrix matrix(cells);
  const std::size_t n_cases = matrix.cases().size();
  std::map<std::string, std::vector<double>> times;
  bool is_timed = false;
  for (std::size_t m = 0; m < matrix.methods().size(); ++m) {
    auto& of_method = times.try_emplace(MethodSpec(matrix.methods()[m]).name(), n_cases, HUGE_VAL).first->second;
    for (std::size_t c = 0; c < n_cases; ++c) {
      const HardCell* cell = matrix.cell(m, c);
      if (!cell || !cell->has_time()) continue;
      is_timed = true;
      if (is_right(*cell)) of_method[c] = std::min(of_method[c], cell->timing.median);
    }
  }
  if (!is_timed) return;
  const auto failures = [&](const std::string& name) { return std::ranges::count(times[name], HUGE_VAL); };
  std::vector<std::string> names;
  for (const auto& [name, _] : times) names.push_back(name);
  std::ranges::stable_sort(names, {}, failures);
  std::vector<std::vector<double>> costs;
  for (const auto& name : names) costs.push_back(times[name]);
  const PerformanceProfile profile(names, costs);
  profile.show(
      section, "profile", "Performance profiles over the hard cases",
      fmt::format("Share of {} cases that a method gets right in at most tau times the wall time of the fastest method "
                  "that does; what is not right takes infinitely long (Dolan, Moré 2002). One run each, with the step "
                  "length or tolerance that the case states for all.",
                  n_cases),
      prefix + "_profile");
}

void show_matrix(const Results& results, Section& section) {
  const auto cells = results.all<HardCell>();
  section.chart(
      {.name = "matrix", .title = "Verdicts on the hard cases", .caption = "Verdicts of all methods on all cases."},
      "verdicts", verdict_matrix(cells, results.experiment()));
  int group = 0;
  for (const Table& table : verdict_tables(cells)) section.summary(fmt::format("group_{}", ++group), table);
  section.result("verdicts", verdict_legend(cells));
  section.result("cases", case_table(cells));
  add_profile(cells, results.experiment(), section);
  if (const Table drift = energy_table(cells); !drift.rows.empty()) section.result("energy", drift);
  Table failures = hard_failures(cells);
  failures.is_list = true;
  section.details("failures", failures);
  section.details("cells", hard_details(cells, results.experiment()));
  show_metrics(measured_runs(cells), section);
}

/// A method may fail on a hard case; it must not hang, crash, or call a number that is not finite a success.
int matrix_unexpected_failures(const Results& results) {
  const auto cells = results.all<HardCell>();
  return static_cast<int>(std::ranges::count_if(cells, [](const HardCell& cell) {
    const CaseVerdict verdict = cell.verdict();
    return verdict == CaseVerdict::crashed || verdict == CaseVerdict::killed || verdict == CaseVerdict::not_finite;
  }));
}

constexpr const char* kHardCasesFields = R"~({
  "required": ["time_limit", "also", "defaults", "cases"],
  "properties": {
    "also": {"type": "array", "items": {"$ref": "#/$defs/method"}, "description": "Methods beside the examples of those that are built.", "examples": [["fesd:gauss:3"]]},
    "defaults": {"type": "object", "additionalProperties": false, "description": "Of every case.", "examples": [{"tolerance": 1e-9}], "properties": {
      "steps": {"type": "object", "additionalProperties": false, "description": "Of fixed-step methods.", "examples": [{"first_order": 2000}], "properties": {
        "first_order": {"type": "integer", "minimum": 1, "description": "Of methods of first order.", "examples": [2000]},
        "high_order": {"type": "integer", "minimum": 1, "description": "Of all others.", "examples": [200]}}},
      "tolerance": {"type": "number", "minimum": 1e-15, "exclusiveMaximum": 1, "description": "Tolerance of error-controlled methods.", "examples": [1e-9]},
      "limits": {"type": "object", "additionalProperties": {"type": "object", "additionalProperties": false, "required": ["limit", "reason"], "properties": {
        "limit": {"type": "number", "minimum": 0, "description": "The number.", "examples": [1e-9]},
        "reason": {"type": "string", "minLength": 1, "description": "Why this one.", "examples": ["rounding"]}}}, "description": "Limits of verdicts: exact, error, energy [J], penetration [m], momentum [N s], cone [N s].", "examples": [{"error": {"limit": 0.01, "reason": "one percent"}}]}}},
    "cases": {"type": "array", "description": "Problems.", "items": {"type": "object", "additionalProperties": false, "required": ["id", "group", "title", "problem"], "properties": {
      "id": {"type": "string", "minLength": 1, "description": "Its name.", "examples": ["wedge"]},
      "group": {"type": "string", "description": "Of cases that are shown together.", "examples": ["impacts"]},
      "title": {"type": "string", "description": "A line that says what it is.", "examples": ["ball in a wedge"]},
      "problem": {"type": "string", "description": "A scene of `ricochet list problems`.", "examples": ["disc_in_chute"]},
      "parameters": {"$ref": "#/$defs/parameters", "examples": [{"mu": 0}]},
      "motions": {"type": "array", "description": "True motions.", "items": {"type": "object", "additionalProperties": false, "properties": {
        "q": {"type": "array", "items": {"type": "string"}, "description": "Final coordinates, formulas in the parameters.", "examples": [["r"]]},
        "v": {"type": "array", "items": {"type": "string"}, "description": "Final velocities.", "examples": [["0"]]},
        "reference": {"$ref": "#/$defs/parameters", "description": "Instead of q and v: the motion is computed, with these parameters changed.", "examples": [{}]},
        "why": {"type": "string", "description": "A reason.", "examples": ["at rest on the ground"]}}}},
      "steps": {"type": "object", "additionalProperties": false, "description": "Of fixed-step methods.", "examples": [{"first_order": 2000}], "properties": {
        "first_order": {"type": "integer", "minimum": 1, "description": "Of methods of first order.", "examples": [2000]},
        "high_order": {"type": "integer", "minimum": 1, "description": "Of all others.", "examples": [200]}}},
      "tolerance": {"type": "number", "minimum": 1e-15, "exclusiveMaximum": 1, "description": "Tolerance of error-controlled methods.", "examples": [1e-9]},
      "limits": {"type": "object", "additionalProperties": {"type": "object", "additionalProperties": false, "required": ["limit", "reason"], "properties": {
        "limit": {"type": "number", "minimum": 0, "description": "The number.", "examples": [1e-9]},
        "reason": {"type": "string", "minLength": 1, "description": "Why this one.", "examples": ["rounding"]}}}, "description": "Limits of verdicts: exact, error, energy [J], penetration [m], momentum [N s], cone [N s].", "examples": [{"error": {"limit": 0.01, "reason": "one percent"}}]},
      "paradox": {"type": "string", "description": "Contact at which a method may refuse to go on.", "examples": ["tip"]},
      "conserves_energy": {"type": "boolean", "description": "The exact motion does.", "examples": [true]}}}},
    "only_case": {"anyOf": [{"type": "string"}, {"type": "array", "items": {"type": "string"}}], "description": "One or more of the cases.", "examples": ["wedge"]},
    "only_method": {"anyOf": [{"$ref": "#/$defs/method"}, {"type": "array", "items": {"$ref": "#/$defs/method"}}], "description": "One or more methods, instead of all.", "examples": ["moreau_jean"]}
  }
})~";

const bool hard_cases_are_registered =
    register_study({.kind = "hard_cases",
                    .summary = "every method on every problem that methods stumble over: a matrix of verdicts",
                    .fields = kHardCasesFields,
                    .rows = {HardCell::kKind},
                    .times = Times::in_rows,
                    .name_methods = [](json& j) { j["only_method"] = read_hard_cases(j).methods; },
                    .run = run_matrix,
                    .show = show_matrix,
                    .unexpected_failures = matrix_unexpected_failures});

}  // namespace
}  // namespace ricochet
