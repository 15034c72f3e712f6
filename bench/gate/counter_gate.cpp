#include "bench/gate/counter_gate.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <map>
#include <set>

#include "bench/experiment/study.h"
#include "problems/input_error.h"
#include "reports/text_file.h"

namespace ricochet {
namespace {

using nlohmann::json;

enum class CounterRule { exact, work, matrices };  // (1), (2), (3)

const std::map<std::string, CounterRule> kRules = {{"allocations", CounterRule::exact},
                                                   {"variables", CounterRule::exact},
                                                   {"constraints", CounterRule::exact},
                                                   {"pairs", CounterRule::exact},
                                                   {"nonzeros", CounterRule::exact},
                                                   {"contacts", CounterRule::exact},
                                                   {"steps", CounterRule::work},
                                                   {"elements", CounterRule::work},
                                                   {"events", CounterRule::work},
                                                   {"force_evaluations", CounterRule::work},
                                                   {"newton_iterations", CounterRule::work},
                                                   {"solver_iterations", CounterRule::work},
                                                   {"contact_problems", CounterRule::work},
                                                   {"pivots", CounterRule::work},
                                                   {"factorizations", CounterRule::matrices}};

bool is_more(CounterRule rule, double then, double now) {
  using R = GateRules;
  switch (rule) {
    case CounterRule::exact:
      return now > then;
    case CounterRule::work:
      return is_more_work(then, now, R::kCounterShare, R::kCounterLeast);
    case CounterRule::matrices:
      return is_more_work(then, now, R::kMatrixCounterShare, R::kMatrixCounterLeast);
  }
  return false;
}

void hold_counters(const BenchmarkRow& then, const BenchmarkRow& now, GateLine& line) {
  for (const auto& [name, rule] : kRules) {
    const auto c_then = then.counters.find(name), c_now = now.counters.find(name);
    const bool was_there = c_then != then.counters.end(), is_there = c_now != now.counters.end();
    if (was_there != is_there)
      line.add(GateVerdict::not_compared,
               fmt::format("{}: the {} not have this counter", name, was_there ? "results do" : "baseline does"));
    if (!was_there || !is_there) continue;
    const std::string finding =
        fmt::format("{} {:.0f} in the baseline, now {:.0f}", name, c_then->second, c_now->second);
    if (is_more(rule, c_then->second, c_now->second))
      line.add(GateVerdict::worse, finding);
    else if (is_more(rule, c_now->second, c_then->second))
      line.add(GateVerdict::better, finding);
  }
}

void hold_benchmark(const BenchmarkRow& then, const BenchmarkRow& now, GateLine& line) {
  if (then.succeeded() && now.succeeded()) return hold_counters(then, now, line);
  if (then.succeeded()) line.add(GateVerdict::worse, fmt::format("measured in the baseline, now: {}", now.error));
  if (now.succeeded()) line.add(GateVerdict::better, fmt::format("in the baseline: {}; now measured", then.error));
}

constexpr const char* kWhat = "counters";

GateLine not_compared(const std::string& name, int line, const char* reason) {
  return {name, kWhat, "", line, GateVerdict::not_compared, {reason}};
}

void check_is_baseline(const CounterResults& results) {
  if (results.benchmarks.empty())
    throw InputError("baseline", results.path,
                     "no benchmark has a counter that the gate compares, for example allocations");
  std::set<std::string> names;
  for (const auto& benchmark : results.benchmarks) {
    if (!names.insert(benchmark.row.name).second)
      throw InputError("baseline", results.path, fmt::format("{} occurs twice", benchmark.row.name));
  }
}

}  // namespace

CounterResults::CounterResults(const Results& results) : path(results.path), id(results.experiment()) {
  if (const std::string study = study_of(results).kind; study != kBenchmarkStudy)
    throw InputError(path + ": study", study, "counters of Google Benchmark are required");
  if (!results.is_complete) throw InputError("results file", path, "it is not complete");
  const auto rows = results.all<BenchmarkRow>();
  for (std::size_t k = 0; k < rows.size(); ++k) {
    BenchmarkRow row = rows[k];
    std::erase_if(row.counters, [](const auto& counter) { return !kRules.contains(counter.first); });
    for (const auto& [name, value] : row.counters) {
      if (!(value >= 0 && value == std::round(value) && std::isfinite(value)))
        throw InputError(fmt::format("{}: {}: {}", path, row.name, name), value, "a whole number >= 0 is required");
    }
    if (!row.counters.empty() || !row.succeeded())
      benchmarks.push_back({std::move(row), results.header.contains("environment") ? 0 : static_cast<int>(k) + 2});
  }
}

GateReport hold_against(const CounterResults& baseline, const CounterResults& results) {
  if (baseline.id != results.id)
    throw InputError(fmt::format("baseline: {}: experiment", baseline.path), baseline.id,
                     fmt::format("the results belong to {}", results.id));
  GateReport report{results.id, results.path, baseline.path, {}};
  std::map<std::string, const BenchmarkRow*> now;
  for (const auto& benchmark : results.benchmarks) {
    const bool is_new = now.emplace(benchmark.row.name, &benchmark.row).second;
    if (!is_new) report.lines.push_back(not_compared(benchmark.row.name, 0, "the results have this benchmark twice"));
  }
  std::set<std::string> held;
  for (const auto& [then, line_number] : baseline.benchmarks) {
    held.insert(then.name);
    const auto found = now.find(then.name);
    if (found == now.end()) {
      report.lines.push_back(not_compared(then.name, line_number, "the results do not have this benchmark"));
      continue;
    }
    GateLine line{then.name, kWhat, "", line_number};
    hold_benchmark(then, *found->second, line);
    report.lines.push_back(std::move(line));
  }
  for (const auto& [name, row] : now) {
    if (!held.contains(name))
      report.lines.push_back(not_compared(name, 0, "the baseline does not have this benchmark"));
  }
  return report;
}

CounterResults read_counter_baseline(const std::string& path) try {
  CounterResults baseline(read_any_results(path));
  check_is_baseline(baseline);
  return baseline;
} catch (const InputError& error) {
  throw InputError(fmt::format("baseline: {}", error.what()));
}

void write_baseline(const CounterResults& results, const std::string& path) {
  check_is_baseline(results);
  std::string text = json{{"kind", "header"},
                          {"schema", kResultsSchema},
                          {"study", kBenchmarkStudy},
                          {"experiment", results.id},
                          {"title", fmt::format("Counters of {}", results.id)}}
                         .dump() +
                     "\n";
  for (const auto& [row, line] : results.benchmarks) {
    json written = {{"kind", BenchmarkRow::kKind}, {"name", row.name}, {"counters", json::object()}};
    for (const auto& [name, value] : row.counters) written["counters"][name] = static_cast<std::int64_t>(value);
    if (!row.succeeded()) written["error"] = row.error;
    text += written.dump() + "\n";
  }
  text += json{{"kind", "end"}}.dump() + "\n";
  if (std::filesystem::exists(path)) throw InputError("baseline file", path, "the file exists; a new file is required");
  write_text("baseline file", path, text);
}

}  // namespace ricochet
