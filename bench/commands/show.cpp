#include "bench/commands/show.h"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>

#include "problems/names.h"

namespace ricochet {

void add_print_options(CLI::App& command, PrintOptions& options) {
  command.add_option("--view", options.views, "print only this table: orders, failures, runs, ...")
      ->delimiter(',')
      ->allow_extra_args(false);
  command.add_flag("--all", options.all, "also print every run");
}

void print_results(const ShownResults& shown, const PrintOptions& options) {
  const auto tables = shown.section.tables();
  for (const auto& view : options.views) {
    std::vector<std::string> names;
    for (const auto* table : tables) names.push_back(table->name);
    if (std::ranges::find(names, view) == names.end())
      throw_unknown_name("view of " + shown.results.path, view, names);  // which is kept
  }
  fmt::print("{}\nresults: {}\n\n", shown.results.title(), shown.results.path);
  for (const auto& sentence : warnings(shown.results)) fmt::print("{}\n\n", sentence);
  for (const auto* table : tables) {
    const bool is_chosen = options.views.empty() ? options.all || table->role != Section::Role::details
                                                 : std::ranges::find(options.views, table->name) != options.views.end();
    if (is_chosen) fmt::print("{}\n", table->table.terminal());
  }
}

void print_summary(const ShownResults& shown) {
  std::size_t failures = 0;
  for (const auto* table : shown.section.tables())
    if (table->role == Section::Role::failures) failures += table->table.rows.size();
  fmt::print("{}: {} rows{}; {}\n", shown.results.title(), shown.results.rows.size(),
             failures > 0 ? fmt::format(", {} entries in its list of failures", failures) : "", shown.results.path);
}

}  // namespace ricochet
