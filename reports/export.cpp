#include "reports/export.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <map>

#include "problems/input_error.h"

namespace ricochet {
namespace {

using nlohmann::json;

std::string snake_case(const std::string& name) {
  std::string snake;
  for (const char c : name) {
    const auto byte = static_cast<unsigned char>(c);
    if (std::isupper(byte) && !snake.empty() && snake.back() != '_') snake += '_';
    snake += std::isalnum(byte) ? static_cast<char>(std::tolower(byte)) : '_';
  }
  return snake;
}

using Fields = std::vector<std::pair<std::string, std::string>>;  // name, cell

void flatten(const std::string& name, const json& value, Fields& fields) {
  if (value.is_object()) {
    for (const auto& [key, part] : value.items())
      flatten((name.empty() ? "" : name + "_") + snake_case(key), part, fields);
  } else if (value.is_array()) {
    std::string joined;
    for (const auto& part : value) {
      if (!part.is_string()) return;
      joined += (joined.empty() ? "" : ";") + part.get<std::string>();
    }
    fields.emplace_back(name, csv_cell(joined));
  } else if (value.is_number_float()) {
    const double number = value;
    fields.emplace_back(name, std::isnan(number) ? "NaN" : fmt::format("{}", number));
  } else {
    fields.emplace_back(
        name, value.is_null() ? "NaN" : csv_cell(value.is_string() ? value.get<std::string>() : value.dump()));
  }
}

Fields fields_of(json row, const char* left_out) {
  row.erase("kind");
  row.erase(left_out);
  Fields fields;
  flatten("", row, fields);
  return fields;
}

/// A row that adds to the run of this number.
bool is_part_of_a_run(const nlohmann::json& row) {
  const auto number = row.find("row");
  return number != row.end() && number->is_number_unsigned();
}

/// The kind that most rows have, of those that stand for themselves.
std::string kind_of_runs(const Results& results) {
  std::map<std::string, int> counts;
  for (const auto& row : results.rows) {
    if (!is_part_of_a_run(row)) ++counts[row.at("kind")];
  }
  if (counts.empty()) throw InputError("results", results.path, "at least one run is required");
  return std::ranges::max_element(counts, {}, [](const auto& count) { return count.second; })->first;
}

}  // namespace

std::string tidy_csv(const Results& results) {
  const std::string kind = kind_of_runs(results);
  std::vector<Fields> runs;
  for (const auto& row : results.rows) {
    if (row.at("kind") == kind) runs.push_back(fields_of(row, ""));
  }
  for (const auto& row : results.rows) {
    if (row.at("kind") == kind || !is_part_of_a_run(row) || row["row"] >= runs.size()) continue;
    for (auto& field : fields_of(row, "row")) runs[row["row"].get<std::size_t>()].push_back(std::move(field));
  }
  std::vector<std::string> names;
  for (const auto& run : runs) {
    for (const auto& [name, cell] : run) {
      if (std::ranges::find(names, name) == names.end()) names.push_back(name);
    }
  }
  std::string text;
  for (std::size_t c = 0; c < names.size(); ++c) text += (c ? "," : "") + names[c];
  text += "\n";
  for (const auto& run : runs) {
    const std::map<std::string, std::string> cells(run.begin(), run.end());
    for (std::size_t c = 0; c < names.size(); ++c) {
      const auto cell = cells.find(names[c]);
      text += (c ? "," : "") + (cell == cells.end() ? "NaN" : cell->second);
    }
    text += "\n";
  }
  return text;
}

}  // namespace ricochet
