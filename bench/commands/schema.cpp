#include <fmt/format.h>

#include <CLI/CLI.hpp>

#include "bench/commands/commands.h"
#include "bench/commands/run_report.h"
#include "bench/commands/schema_page.h"
#include "bench/experiment/experiment_schema.h"
#include "problems/scene_file/scene_schema.h"

namespace ricochet {

void add_schema_command(CLI::App& app, int& /*exit_code*/) {
  static std::string what;
  static bool as_page = false;
  auto* command = app.add_subcommand(
      "schema", "print the JSON Schema of scene files, of experiment files or of `ricochet run --json`");
  command->add_option("what", what, "scene, experiment or run")
      ->required()
      ->check(CLI::IsMember({"scene", "experiment", "run"}));
  command->add_flag("--page", as_page, "print a Markdown page with units and examples instead");
  command->footer("Example:\n  ricochet schema experiment > experiment.schema.json");
  command->callback([] {
    if (as_page)
      fmt::print("{}", what == "scene" ? scene_file_page() : what == "run" ? run_page() : experiment_file_page());
    else
      fmt::print("{}\n", what == "scene" ? scene_schema().document().dump(2)
                         : what == "run" ? run_schema().document().dump(2)
                                         : all_experiments_schema().dump(2));
  });
}

}  // namespace ricochet
