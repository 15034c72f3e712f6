#include "bench/studies/google_benchmark/benchmark_file.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <filesystem>
#include <string_view>

#include "bench/studies/google_benchmark/benchmark_rows.h"
#include "problems/input_text.h"

namespace ricochet {
namespace {

using nlohmann::json;

/// Fields of Google Benchmark; all other numbers of a benchmark are its counters.
constexpr std::array kFields = {"name",
                                "family_index",
                                "per_family_instance_index",
                                "run_name",
                                "run_type",
                                "repetitions",
                                "repetition_index",
                                "threads",
                                "aggregate_name",
                                "aggregate_unit",
                                "iterations",
                                "real_time",
                                "cpu_time",
                                "time_unit",
                                "cpu_coefficient",
                                "real_coefficient",
                                "big_o",
                                "rms",
                                "label",
                                "error_occurred",
                                "error_message",
                                "skipped",
                                "skip_message",
                                "items_per_second"};

bool is_benchmark_json(const std::string& text) {
  const auto begin = text.find_first_not_of(" \t\r\n");
  if (begin == std::string::npos || text[begin] != '{') return false;
  const json first_line = json::parse(text.substr(0, text.find('\n')), nullptr, false);
  if (first_line.is_object() && first_line.contains("kind")) return false;
  return text.find("\"benchmarks\"") != std::string::npos || text.find("\"context\"") != std::string::npos;
}

/// NaN and Infinity outside of texts as null.
std::string with_null_for_nan(std::string_view text) {
  std::string json_text;
  bool is_in_text = false;
  while (!text.empty()) {
    std::size_t length = 1;
    if (is_in_text && text.front() == '\\' && text.size() > 1) {
      length = 2;
    } else if (text.front() == '"') {
      is_in_text = !is_in_text;
    } else if (!is_in_text) {
      for (const std::string_view word : {"-NaN", "NaN", "-Infinity", "Infinity"}) {
        if (!text.starts_with(word)) continue;
        json_text += "null";
        text.remove_prefix(word.size());
        length = 0;
        break;
      }
    }
    json_text += text.substr(0, length);
    text.remove_prefix(length);
  }
  return json_text;
}

/// An entry of "benchmarks" whose fields have their types where they are asked for.
class BenchmarkEntry {
 public:
  BenchmarkEntry(const json& entry, std::string place) : entry_(entry), place_(std::move(place)) {
    if (!entry.is_object()) throw InputError(place_, entry.dump(), "an object is required");
    text("name");
  }

  std::string text(const char* field) const {
    const json& value = at(field);
    if (!value.is_string()) throw InputError(place_ + "." + field, value.dump(), "a text is required");
    return value;
  }
  std::string text(const char* field, const std::string& otherwise) const {
    return entry_.contains(field) ? text(field) : otherwise;
  }
  /// NaN where the field is null.
  double number(const char* field) const {
    const json& value = at(field);
    if (value.is_null()) return BenchmarkRow::kNone;
    if (!value.is_number()) throw InputError(place_ + "." + field, value.dump(), "a number is required");
    return value;
  }
  double number(const char* field, double otherwise) const {
    return entry_.contains(field) ? number(field) : otherwise;
  }
  /// A time or a coefficient [s].
  double seconds(const char* field) const {
    const std::string unit = text("time_unit", "ns");
    for (const auto& [name, length] : {std::pair("ns", 1e-9), {"us", 1e-6}, {"ms", 1e-3}, {"s", 1.0}}) {
      if (unit == name) return length * number(field);
    }
    throw InputError(place_ + ".time_unit", unit, "ns, us, ms or s is required");
  }

  /// Counters of all repetitions.
  std::string run_name() const { return text("run_name", text("name")); }
  /// Two benchmarks may have the same name.
  std::string key() const {
    return fmt::format("{} {} {}", run_name(), number("family_index", 0), number("per_family_instance_index", 0));
  }
  /// "median", "BigO"; empty for a measurement
  std::string aggregate() const { return text("run_type", "iteration") == "aggregate" ? text("aggregate_name") : ""; }
  std::string error() const {
    for (const auto& [occurred, message] :
         {std::pair("error_occurred", "error_message"), {"skipped", "skip_message"}}) {
      if (entry_.value(occurred, json(false)) == json(true)) return text(message, "skipped");
    }
    return "";
  }
  std::map<std::string, double> counters() const {
    std::map<std::string, double> counters;
    for (const auto& [name, value] : entry_.items()) {
      if (std::ranges::find(kFields, name) != kFields.end() || !(value.is_number() || value.is_null())) continue;
      counters[name] = number(name.c_str());
    }
    return counters;
  }

 private:
  const json& at(const char* field) const {
    const auto found = entry_.find(field);
    if (found == entry_.end()) throw InputError(place_ + "." + field, "(missing)", "this field is required");
    return *found;
  }

  const json& entry_;
  std::string place_;
};

/// Rows of one benchmark in a file: its repetitions and their aggregates.
struct Measurements {
  std::vector<BenchmarkEntry> runs;
  std::map<std::string, BenchmarkEntry> aggregates;

  const BenchmarkEntry* aggregate(const std::string& name) const {
    const auto found = aggregates.find(name);
    return found == aggregates.end() ? nullptr : &found->second;
  }
  BenchmarkRow row() const;
  ComplexityRow complexity() const;
};

BenchmarkRow Measurements::row() const {
  BenchmarkRow row;
  for (const BenchmarkEntry& run : runs) {
    row.name = run.run_name();
    row.error = run.error();
    if (!row.succeeded()) return row;
  }
  const BenchmarkEntry* source = nullptr;
  for (const char* name : {"median", "mean"}) {
    if (source || !aggregate(name)) continue;
    source = aggregate(name);
    row.aggregate = name;
  }
  if (!source) source = runs.empty() ? &aggregates.begin()->second : &runs.front();
  if (runs.empty() && row.aggregate.empty()) row.aggregate = source->aggregate();
  row.name = source->run_name();
  row.error = source->error();
  if (!row.succeeded()) return row;
  row.real_seconds = source->seconds("real_time");
  row.cpu_seconds = source->seconds("cpu_time");
  row.items_per_second = source->number("items_per_second", BenchmarkRow::kNone);
  if (const double n = source->number("repetitions", 1); n >= 1 && n < 1e9) row.repetitions = static_cast<int>(n);
  row.counters = source->counters();
  if (const BenchmarkEntry* mean = aggregate("mean"), *deviation = aggregate("stddev"); mean && deviation)
    row.spread = deviation->seconds("cpu_time") / mean->seconds("cpu_time");
  return row;
}

ComplexityRow Measurements::complexity() const {
  const BenchmarkEntry& big_o = *aggregate("BigO");
  ComplexityRow row;
  row.name = big_o.run_name();
  row.big_o = big_o.text("big_o");
  row.cpu_seconds = big_o.seconds("cpu_coefficient");
  row.real_seconds = big_o.seconds("real_coefficient");
  if (const BenchmarkEntry* rms = aggregate("RMS")) row.rms = rms->number("rms");
  return row;
}

/// A text for each field of the context.
json environment_of(const json& context) {
  json environment = json::object();
  for (const auto& [name, value] : context.items()) environment[name] = value.is_string() ? value : json(value.dump());
  if (!environment.contains("processor"))
    environment["processor"] = fmt::format("{} processors of {} MHz", environment.value("num_cpus", "?"),
                                           environment.value("mhz_per_cpu", "?"));
  return environment;
}

/// Name of the program, without characters that a file name should not have.
std::string experiment_of(const json& environment, const std::string& path) {
  const std::filesystem::path program = environment.value("executable", "");
  std::string name = program.filename().empty() ? std::filesystem::path(path).stem() : program.filename();
  std::ranges::replace_if(
      name, [](unsigned char c) { return !std::isalnum(c) && c != '_' && c != '-' && c != '.'; }, '_');
  return name;
}

}  // namespace

std::optional<Results> read_benchmarks(const std::string& path, const std::string& text) {
  if (!is_benchmark_json(text)) return std::nullopt;
  const json file = parse_input_json(with_null_for_nan(text), path);
  const json context = file.value("context", json());
  if (!context.is_object())
    throw InputError(path + ": context", context.is_null() ? "(missing)" : context.dump(),
                     "an object is required, as Google Benchmark writes it");
  const json list = file.value("benchmarks", json());
  if (!list.is_array() || list.empty())
    throw InputError(path + ": benchmarks", list.is_null() ? "(missing)" : list.dump(),
                     "a list of at least one benchmark is required");

  std::vector<std::string> keys;  // in the order of the file
  std::map<std::string, Measurements> measured;
  for (std::size_t k = 0; k < list.size(); ++k) {
    const BenchmarkEntry entry(list[k], fmt::format("{}: benchmarks[{}]", path, k));
    const std::string key = entry.key();
    if (!measured.contains(key)) keys.push_back(key);
    Measurements& all = measured[key];
    if (const std::string aggregate = entry.aggregate(); aggregate.empty())
      all.runs.push_back(entry);
    else
      all.aggregates.emplace(aggregate, entry);
  }

  Results results;
  results.path = path;
  results.is_complete = true;
  const json environment = environment_of(context);
  const std::string experiment = experiment_of(environment, path);
  results.header = {{"kind", "header"},
                    {"schema", kResultsSchema},
                    {"study", kBenchmarkStudy},
                    {"experiment", experiment},
                    {"title", fmt::format("Benchmarks of {}", experiment)},
                    {"description", "Times and counters by Google Benchmark."},
                    {"command", environment.value("executable", "unknown")},
                    {"environment", environment}};
  for (const auto& key : keys) {
    const Measurements& all = measured.at(key);
    if (all.aggregate("BigO"))
      results.rows.push_back(line_of(all.complexity()));
    else if (!all.aggregate("RMS"))
      results.rows.push_back(line_of(all.row()));
  }
  return results;
}

}  // namespace ricochet
