#include "reports/results.h"

#include <fstream>
#include <limits>

namespace ricochet {

using nlohmann::json;

json parse_line(const std::string& text) {
  return json::parse(text, [](int, json::parse_event_t event, json& parsed) {
    if (event == json::parse_event_t::value && parsed.is_null()) parsed = std::numeric_limits<double>::quiet_NaN();
    return true;
  });
}

Results read_results(const std::string& path) {
  std::ifstream file(path);
  if (!file) throw InputError("results file", path, "cannot be opened");
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
    } catch (const json::exception& error) {
      throw InputError(fmt::format("{}:{}: not a line of a results file: {}", path, number, error.what()));
    }
  }
  if (results.header.is_null()) throw InputError("results file", path, "it has no header line");
  return results;
}

}  // namespace ricochet
