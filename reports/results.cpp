#include "reports/results.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <fstream>
#include <limits>
#include <sstream>

#include "problems/input_text.h"
#include "problems/json_schema.h"

namespace ricochet {

using nlohmann::json;

namespace {

void read_null_as_nan(json& value) {
  if (value.is_null()) value = std::numeric_limits<double>::quiet_NaN();
  if (!value.is_structured()) return;
  for (json& part : value) read_null_as_nan(part);
}

/// Schema of the fields of the header line that are read.
const JsonSchema& header_schema() {
  static const JsonSchema schema = JsonSchema::parse(R"~({
    "type": "object", "required": ["schema"],
    "properties": {
      "schema": {"type": "integer", "minimum": 1},
      "study": {"type": "string"},
      "experiment": {"type": "string"},
      "title": {"type": "string"},
      "description": {"type": "string"},
      "command": {"type": "string"},
      "key": {"type": "string"},
      "quick": {"type": "boolean"},
      "environment": {"type": "object"},
      "overhead_of": {"type": "object", "additionalProperties": {"type": "string"}}
    }})~");
  return schema;
}

}  // namespace

json parse_line(const std::string& text) {
  json line = parse_input_json(text, "line");
  read_null_as_nan(line);
  return line;
}

void require_integers(const json& example, const json& row) {
  if (!row.is_object()) return;
  for (const auto& [field, value] : example.items()) {
    const auto given = row.find(field);
    if (given == row.end()) continue;
    if (value.is_object()) require_integers(value, *given);
    if (value.is_number_integer() && given->is_number_float())
      throw InputError(field, given->dump(), "an integer is required");
  }
}

std::string to_string(TimesMark mark) {
  return mark == TimesMark::shared ? "shared" : mark == TimesMark::exclusive ? "exclusive" : "";
}

TimesMark times_mark_of(const std::string& word) {
  for (const TimesMark mark : {TimesMark::shared, TimesMark::exclusive}) {
    if (word == to_string(mark)) return mark;
  }
  return TimesMark::unspecified;
}

TimesMark times_mark(const nlohmann::json& header) {
  return times_mark_of(header.value("times", ""));
}

void set_times_mark(nlohmann::json& header, TimesMark mark) {
  if (mark == TimesMark::unspecified)
    header.erase("times");
  else
    header["times"] = to_string(mark);
}

std::vector<std::string> warnings(const Results& results) {
  std::vector<std::string> list;
  if (!results.is_complete) list.push_back("These results are not complete: the run was interrupted.");
  if (times_mark(results.header) == TimesMark::shared)
    list.push_back("Times of these results were measured while other programs ran on the machine and may be wrong.");
  const auto processors = results.header.value("processors", std::vector<std::string>());
  if (processors.size() > 1)
    list.push_back(
        fmt::format("Times of these results were taken on different processors: {}.", fmt::join(processors, "; ")));
  return list;
}

json read_header(const std::string& path) {
  std::ifstream file(path);
  std::string line;
  std::getline(file, line);
  json header = json::parse(line, nullptr, false);
  return header.is_object() ? header : json::object();
}

Results read_results(const std::string& path) {
  return parse_results(path, read_input_text(path, "results file"));
}

Results parse_results(const std::string& path, const std::string& all) {
  std::istringstream file(all);
  Results results;
  results.path = path;
  std::string text;
  for (int number = 1; std::getline(file, text); ++number) {
    const std::string place = fmt::format("{}:{}: ", path, number);
    json line;
    std::string kind;
    try {
      line = parse_line(text);
      line.at("kind").get_to(kind);
    } catch (const std::exception& error) {
      throw InputError(fmt::format("{}not a line of a results file: {}", place, error.what()));
    }
    if (kind == "header" && !results.header.is_null())
      throw InputError(place + "a second header: two runs have written to this file");
    if (results.is_complete) throw InputError(place + "a line after the end: two runs have written to this file");
    if (kind == "header") {
      header_schema().check(line, place);
      if (const int schema = line["schema"]; schema != kResultsSchema)
        throw InputError(place + "schema", schema, fmt::format("schema {} is required", kResultsSchema));
      results.header = std::move(line);
    } else if (kind == "end") {
      results.is_complete = true;
    } else {
      results.rows.push_back(std::move(line));
    }
  }
  if (results.header.is_null()) throw InputError("results file", path, "it has no header line");
  return results;
}

}  // namespace ricochet
