#include "bench/gate/baseline.h"

#include <fmt/format.h>

#include <cmath>
#include <filesystem>
#include <limits>
#include <set>

#include "bench/experiment/study.h"
#include "bench/gate/gate.h"
#include "problems/input_error.h"
#include "reports/order_fit.h"
#include "reports/text_file.h"

namespace ricochet {
namespace {

using nlohmann::json;

constexpr int kErrorDigits = 5, kResidualDigits = 2, kSizeDigits = 6;

// Larger ones would not fit into the fields of Run.
constexpr double kMostEvents = std::numeric_limits<int>::max(), kMostCounted = 0x1p53;

enum class FieldType { text, number, count };

struct GatedField {
  const char* name;
  FieldType type;
};

// NaN, null in the file, is a number: the error of a run that failed.
constexpr GatedField kGatedFields[] = {{"method", FieldType::text},
                                       {"status", FieldType::text},
                                       {"h_bar", FieldType::number},
                                       {"error", FieldType::number},
                                       {"reference_error", FieldType::number},
                                       {"solution_size", FieldType::number},
                                       {"max_residual", FieldType::number},
                                       {"detected_events", FieldType::count}};

bool is_count(const json& value, double most) {
  return value.is_number_integer() && value >= 0 && value.get<double>() <= most;
}

bool has_type(const json& value, FieldType type) {
  switch (type) {
    case FieldType::text:
      return value.is_string() && !value.get_ref<const std::string&>().empty();
    case FieldType::number:
      return value.is_number();
    case FieldType::count:
      return is_count(value, kMostEvents);
  }
  return false;
}

const char* words_of(FieldType type) {
  switch (type) {
    case FieldType::text:
      return "a text is required";
    case FieldType::number:
      return "a number or null is required";
    case FieldType::count:
      return "a whole number >= 0 is required";
  }
  return "";
}

/// "FILE:7: error", of a line of the file.
std::string place_of(const std::string& path, std::size_t line, const std::string& field) {
  return fmt::format("{}:{}: {}", path, line, field);
}

/// The setting, by which runs of a method differ: steps or a tolerance.
void check_setting(const json& row, const std::string& path, std::size_t line) {
  const json steps = row.value("steps", json(0)), tolerance = row.value("tolerance", json(0));
  if (!is_count(steps, kMostEvents))
    throw InputError(place_of(path, line, "steps"), steps.dump(), words_of(FieldType::count));
  if (!tolerance.is_number() || !(tolerance >= 0.0))
    throw InputError(place_of(path, line, "tolerance"), tolerance.dump(), "a number >= 0 is required");
  if ((steps > 0) == (tolerance > 0))
    throw InputError(place_of(path, line, "steps"), steps.dump(), "either steps or a tolerance > 0 is required");
  const json instead_of = row.value("instead_of", json(""));
  if (!instead_of.is_string())
    throw InputError(place_of(path, line, "instead_of"), instead_of.dump(), "a text is required");
}

void check_fields(const json& row, const std::string& path, std::size_t line) {
  for (const auto& [name, type] : kGatedFields) {
    const auto found = row.find(name);
    if (found == row.end()) throw InputError(place_of(path, line, name), "(missing)", words_of(type));
    if (!has_type(*found, type)) throw InputError(place_of(path, line, name), found->dump(), words_of(type));
  }
  check_setting(row, path, line);
  const auto counters = row.find("counters");
  if (counters == row.end() || !counters->is_object())
    throw InputError(place_of(path, line, "counters"), counters == row.end() ? "(missing)" : counters->dump(),
                     "an object of counters is required");
  const json known = Counters{};
  for (const auto& [name, value] : counters->items()) {
    if (!known.contains(name)) throw InputError(place_of(path, line, "counters." + name), value.dump(), "unknown");
    if (!is_count(value, kMostCounted))
      throw InputError(place_of(path, line, "counters." + name), value.dump(), words_of(FieldType::count));
  }
}

/// Rejects results that cannot serve as a baseline.
void check_is_baseline(const GridResults& results, const std::string& what) {
  const auto refuse = [&](const Run& record, const std::string& reason) {
    throw InputError(fmt::format("{}:{}: {} at {}: {}", what, results.line_of(record), record.method,
                                 record.setting.value(), reason));
  };
  for (const Run& record : results.records) {
    if (!is_known_status(record.status)) refuse(record, fmt::format("status '{}' is unknown", record.status));
    if (!record.succeeded()) continue;
    if (record.error < 0 || std::isinf(record.error))
      refuse(record, fmt::format("error = {}: a finite number >= 0 is required", record.error));
    if (!record.has_error() && results.has_errors())
      refuse(record, "error: a success has none, although other runs have one");
    if (!(record.h_bar > 0)) refuse(record, fmt::format("h_bar = {}: a length > 0 is required", record.h_bar));
    const double most = kAsymptoticError * record.solution_size;
    if (record.has_error() && !(record.reference_error >= 0 && record.reference_error < most && std::isfinite(most)))
      refuse(record, "a finite solution_size > 0 and a reference_error from 0 to 0.3 % of it are required");
  }
}

double rounded(double x, int digits) {
  return std::isfinite(x) ? std::stod(fmt::format("{:.{}e}", x, digits - 1)) : x;
}

json line_of_baseline(const Run& record) {
  const json all = record.counters;
  json counters = json::object();
  for (const auto& [name, value] : all.items()) {
    if (value != 0) counters[name] = value;
  }
  json line = {{"kind", Run::kKind},
               {"method", record.method},
               {"h_bar", rounded(record.h_bar, kSizeDigits)},
               {"status", record.status},
               {"error", rounded(record.error, kErrorDigits)},
               {"reference_error", rounded(record.reference_error, kResidualDigits)},
               {"solution_size", rounded(record.solution_size, kSizeDigits)},
               {"max_residual", rounded(record.max_residual, kResidualDigits)},
               {"detected_events", record.detected_events},
               {"counters", counters}};
  if (record.setting.steps > 0)
    line["steps"] = record.setting.steps;
  else
    line["tolerance"] = record.setting.tolerance;
  if (!record.instead_of.empty()) line["instead_of"] = record.instead_of;
  return line;
}

}  // namespace

GridResults read_gated_results(const std::string& path) {
  return gated_results(read_results(path));
}

GridResults gated_results(const Results& results) {
  const std::string& path = results.path;
  const std::string study =
      results.header.contains("study") ? results.header["study"].get<std::string>() : study_of(results).kind;
  if (study != kDefaultStudy)
    throw InputError(fmt::format("{}:1: study", path), study,
                     fmt::format("results of a {} are required", kDefaultStudy));
  if (!results.is_complete) throw InputError("results file", path, "it is not complete");
  for (std::size_t k = 0; k < results.rows.size(); ++k) {
    if (results.rows[k].at("kind") == Run::kKind) check_fields(results.rows[k], path, k + kFirstRowLine);
  }
  return GridResults(results);
}

GridResults read_baseline(const std::string& path) try {
  GridResults baseline = read_gated_results(path);
  check_is_baseline(baseline, path);
  return baseline;
} catch (const InputError& error) {
  throw InputError(fmt::format("baseline: {}", error.what()));
}

void write_baseline(const GridResults& results, const std::string& path) {
  if (results.records.empty()) throw InputError("baseline file", path, "the results contain no run to compare");
  check_is_baseline(results, results.path);
  std::string text = json{{"kind", "header"},         {"schema", kResultsSchema}, {"study", kDefaultStudy},
                          {"experiment", results.id}, {"title", results.title},   {"quick", results.is_quick}}
                         .dump() +
                     "\n";
  for (const Run& record : results.records) text += line_of_baseline(record).dump() + "\n";
  text += json{{"kind", "end"}}.dump() + "\n";
  if (std::filesystem::exists(path)) throw InputError("baseline file", path, "the file exists; a new file is required");
  write_text("baseline file", path, text);
}

}  // namespace ricochet
