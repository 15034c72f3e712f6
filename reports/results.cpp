#include "reports/results.h"

#include <limits>
#include <sstream>

#include "problems/input_text.h"

namespace ricochet {

using nlohmann::json;

namespace {

void read_null_as_nan(json& value) {
  if (value.is_null()) value = std::numeric_limits<double>::quiet_NaN();
  if (!value.is_structured()) return;
  for (json& part : value) read_null_as_nan(part);
}

}  // namespace

json parse_line(const std::string& text) {
  json line = parse_input_json(text, "line");
  read_null_as_nan(line);
  return line;
}

Results read_results(const std::string& path) {
  std::istringstream file(read_input_text(path, "results file"));
  Results results;
  results.path = path;
  std::string text;
  for (int number = 1; std::getline(file, text); ++number) {
    try {
      json line = parse_line(text);
      const std::string kind = line.at("kind");
      if (kind == "header") {
        results.header = line;
        const int schema = line.at("schema");
        if (schema != kResultsSchema)
          throw InputError(fmt::format("{}: schema", path), schema,
                           fmt::format("schema {} is required", kResultsSchema));
      } else if (kind == "end") {
        results.is_complete = true;
      } else {
        results.rows.push_back(std::move(line));
      }
    } catch (const std::exception& error) {
      throw InputError(fmt::format("{}:{}: not a line of a results file: {}", path, number, error.what()));
    }
  }
  if (results.header.is_null()) throw InputError("results file", path, "it has no header line");
  return results;
}

}  // namespace ricochet
