#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <map>
#include <nlohmann/json.hpp>

#include "bench/commands/commands.h"
#include "bench/studies/questions/gradient_cases.h"
#include "problems/input_error.h"
#include "problems/input_text.h"
#include "problems/names.h"
#include "reports/run.h"
#include "reports/table.h"

namespace ricochet {
namespace {

using nlohmann::json;

/// A derivative that somebody gave.
struct Scored {
  std::string scene, entry;
  double given = 0, exact = 0, error = 0;  ///< error relative to the largest exact entry of the case
};

/// A file to fill in: all cases with zeros.
json empty_file(const std::vector<GradientCase>& cases) {
  json file = {{"method", "mine"}};
  for (const GradientCase& c : cases) {
    for (const GradientEntry& entry : c.entries) file["cases"][c.name][entry.name] = 0;
  }
  return file;
}

std::vector<Scored> score(const json& file, const std::vector<GradientCase>& cases) {
  if (!file.is_object() || !file.contains("cases") || !file.at("cases").is_object())
    throw InputError("cases", file.dump().substr(0, 40),
                     "an object of cases is required, {\"cases\": {\"two_balls\": {...}}}");
  std::vector<std::string> names;
  for (const GradientCase& c : cases) names.push_back(c.name);
  std::vector<Scored> scored;
  for (const auto& [name, entries] : file.at("cases").items()) {
    const auto c = std::find_if(cases.begin(), cases.end(), [&](const GradientCase& x) { return x.name == name; });
    if (c == cases.end()) throw_unknown_name("case", name, names);
    if (!entries.is_object()) throw InputError("cases." + name, entries.dump(), "an object of derivatives is required");
    double largest = 0;
    std::vector<std::string> known;
    for (const GradientEntry& entry : c->entries) {
      largest = std::max(largest, std::abs(entry.exact));
      known.push_back(entry.name);
    }
    for (const auto& [entry_name, given] : entries.items()) {
      const auto entry = std::find_if(c->entries.begin(), c->entries.end(),
                                      [&](const GradientEntry& x) { return x.name == entry_name; });
      if (entry == c->entries.end()) throw_unknown_name("derivative of " + name, entry_name, known);
      if (!given.is_number())
        throw InputError("cases." + name + "." + entry_name, given.dump(), "a number is required");
      const double value = given;
      scored.push_back({name, entry_name, value, entry->exact, std::abs(value - entry->exact) / largest});
    }
  }
  return scored;
}

int check_gradient(const std::string& path, double limit) {
  auto cases = gradient_cases();
  if (path.empty()) {
    for (const GradientCase& c : cases)
      fmt::print("{} ({}): {}\n  ricochet run {}\n", c.name, c.of, c.title,
                 problem_options(c.choice.problem, c.choice.parameters));
    fmt::print("\nA file to fill in; remove the cases that you do not have:\n{}\n", empty_file(cases).dump(2));
    return 0;
  }
  const json file = read_input_json(path, "file of derivatives");
  const auto n_proven = std::ranges::count_if(cases, [](GradientCase& c) { return take_proven(c); });
  const auto scored = score(file, cases);
  const std::vector<Column<Scored>> columns = {
      {"case", &Scored::scene},
      {"derivative", &Scored::entry},
      {"given", "", "{:.10g}", &Scored::given},
      {"exact", "", "{:.10g}", &Scored::exact},
      {"error", "", "{:.1e}", &Scored::error},
      {"", [limit](const Scored& s) { return std::string(s.error <= limit ? "right" : "WRONG"); }}};
  const auto right = std::ranges::count_if(scored, [limit](const Scored& s) { return s.error <= limit; });
  fmt::print(
      "{}\n{} of {} derivatives are right to {:g} of the largest of their case; "
      "exact ones are proven to 20 digits in {} of {} cases, others are closed forms\n",
      table_of("Derivatives of " + file.value("method", path), columns, scored).text(), right, scored.size(), limit,
      n_proven, cases.size());
  return right == static_cast<std::ptrdiff_t>(scored.size()) ? 0 : 1;
}

}  // namespace

void add_check_gradient_command(CLI::App& app, int& exit_code) {
  static std::string path;
  static double limit = 1e-3;
  auto* command =
      app.add_subcommand("check-gradient", "score derivatives through impacts and stops that another program computed");
  command->add_option("file", path, "JSON file with derivatives; without it, print the cases and a file to fill in");
  command->add_option("--limit", limit, "largest correct error, relative to the largest exact derivative of a case")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
  command->footer("Examples:\n  ricochet check-gradient > mine.txt\n  ricochet check-gradient mine.json");
  command->callback([&exit_code] { exit_code = check_gradient(path, limit); });
}

}  // namespace ricochet
