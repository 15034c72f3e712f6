#include <fmt/format.h>

#include <CLI/CLI.hpp>

#include "bench/commands/commands.h"
#include "bench/commands/problem_options.h"
#include "problems/scene_file/scene_writer.h"
#include "reports/text_file.h"

namespace ricochet {

void add_export_command(CLI::App& app, int&) {
  static ProblemOptions problem;
  static std::string path;
  auto* command = app.add_subcommand("export", "write a problem as a scene file");
  problem.add_problem(*command);
  command->add_option("-o,--out", path, "scene file to be written")->required();
  command->footer("Example:\n  ricochet export --problem box_3d --set mu=0.5 -o my_box.json");
  command->callback([] {
    require_new_file("scene file", path);
    write_scene_file(*problem.make_problem(), path);
    fmt::print("scene file: {}\n", path);
  });
}

}  // namespace ricochet
