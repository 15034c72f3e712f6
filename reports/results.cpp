#include "reports/results.h"

#include <filesystem>
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

namespace {

/// Fields that every reader of a header takes for granted.
void check_header(const json& header, const std::string& path, int line) {
  const auto refuse = [&](const char* field, const char* type) {
    throw InputError(fmt::format("{}:{}: {}", path, line, field), header[field].dump(), type);
  };
  for (const char* field : {"experiment", "title", "description", "study", "command"}) {
    if (header.contains(field) && !header[field].is_string()) refuse(field, "a text is required");
  }
  if (header.contains("quick") && !header["quick"].is_boolean()) refuse("quick", "true or false is required");
}

}  // namespace

Results read_results(const std::string& path) {
  if (std::filesystem::is_directory(path)) throw InputError("results file", path, "it is a folder");
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
        check_header(line, path, number);
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
