#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>

#include "bench/commands/commands.h"
#include "bench/commands/problem_options.h"
#include "problems/control/optimal_control_problem.h"
#include "problems/input_error.h"
#include "problems/scene_file/control_file.h"
#include "problems/scene_file/scene_writer.h"
#include "reports/text_file.h"

namespace ricochet {
namespace {

/// The optimal control problem that the options choose; null where they choose a scene without one.
std::unique_ptr<OptimalControlProblem> chosen_control_problem(const ProblemOptions& options) {
  const bool is_one =
      options.scene.empty()
          ? std::ranges::any_of(control_problems(), [&](const auto& entry) { return entry.id == options.problem; })
          : is_control_file(options.scene);
  if (!is_one) return nullptr;
  const auto refuse = [&](const char* option, const auto& value) {
    throw InputError(option, value, "no value is allowed for an optimal control problem");
  };
  if (!options.until.empty()) refuse("--until", options.until);
  if (!options.impact_law.empty()) refuse("--impact-law", options.impact_law);
  if (options.depth > 0) refuse("--allow-penetration", options.depth);
  if (options.kept_depth > 0) refuse("--keep-penetration", options.kept_depth);
  const ParameterChanges changes = parameter_changes(options.changes);
  return options.scene.empty() ? make_control_problem(options.problem, changes)
                               : read_control_file(options.scene, changes);
}

}  // namespace

void add_export_command(CLI::App& app, int&) {
  static ProblemOptions problem;
  static std::string path;
  auto* command = app.add_subcommand("export", "write a problem, or an optimal control problem, as a scene file");
  problem.add_problem(*command);
  command->add_option("-o,--out", path, "scene file to be written")->required();
  command->footer(
      "Examples:\n"
      "  ricochet export --problem box_3d --set mu=0.5 -o my_box.json\n"
      "  ricochet export --problem two_carts -o my_carts.json");
  command->callback([] {
    require_new_file("scene file", path);
    if (const auto control = chosen_control_problem(problem))
      write_text("scene file", path, control_text(*control));
    else
      write_scene_file(*problem.make_problem(), path);
    fmt::print("scene file: {}\n", path);
  });
}

}  // namespace ricochet
