#include "reports/results_page.h"

#include <fmt/format.h>

#include <filesystem>

#include "problems/input_error.h"
#include "reports/results_list.h"
#include "reports/text_file.h"

namespace ricochet {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kMostRows = 24;  // of a table: what is read without scrolling

/// Up to the first full stop that ends a sentence.
std::string first_sentence(const std::string& text) {
  const auto end = text.find(". ");
  return end == std::string::npos ? text : text.substr(0, end + 1);
}

/// "1 row", "2 rows".
std::string counted(std::size_t n, const std::string& noun) {
  return fmt::format("{} {}{}", n, noun, n == 1 ? "" : "s");
}

/// Command, program, machine and date of a results file.
std::string provenance(const Results& results) {
  const nlohmann::json environment = results.header.value("environment", nlohmann::json::object());
  return fmt::format("Made by `{}`{}; revision {}, {}, {}.", results.header.value("command", "unknown"),
                     results.header.value("quick", false) ? ", a quick run" : "",
                     environment.value("revision", "unknown"), environment.value("processor", "unknown processor"),
                     environment.value("date", "unknown date"));
}

/// Main results of a study, with links to the rest.
std::string markdown_of(const ShownResults& shown, const fs::path& page, const fs::path& tables) {
  const Results& results = shown.results;
  std::string text = fmt::format("## {}\n\n", results.title());
  if (const auto sentence = first_sentence(results.header.value("description", "")); !sentence.empty())
    text += sentence + "\n\n";
  for (const auto& sentence : warnings(results)) text += fmt::format("**{}**\n\n", sentence);
  std::string rest;
  for (const Section::NamedTable* table : shown.section.tables()) {
    const fs::path csv = tables / fmt::format("{}_{}.csv", results.experiment(), table->name);
    write_text("results page", csv, table->table.csv());
    const std::string link = csv.lexically_relative(page.parent_path().empty() ? "." : page.parent_path()).string();
    const bool is_shown = table->role == Section::Role::choice || table->role == Section::Role::result ||
                          table->role == Section::Role::summary;
    const std::size_t most = table->table.is_whole ? table->table.rows.size() : kMostRows;
    if (is_shown) text += table->table.markdown(most) + "\n";
    if (!is_shown || table->table.rows.size() > most)
      rest += fmt::format("{}[{}]({}) ({})", rest.empty() ? "" : ", ", table->table.title, link,
                          counted(table->table.rows.size(), "row"));
  }
  if (!rest.empty()) text += fmt::format("In full: {}.\n\n", rest);
  return text + provenance(results) + "\n\n";
}

}  // namespace

void write_results_page(const std::vector<ShownResults>& list, const std::string& path, const std::string& tables) {
  require_different(list);
  require_writable("results page", path);
  std::error_code error;
  fs::create_directories(tables, error);
  if (error) throw InputError("folder of the tables", tables, error.message());
  std::string text =
      "# Results\n\nWritten by `ricochet results` from results files; no number on this page was typed by hand.\n\n";
  for (const auto& shown : list) text += markdown_of(shown, path, tables);
  write_text("results page", path, text);
}

}  // namespace ricochet
