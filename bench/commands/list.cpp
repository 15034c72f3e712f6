#include <fmt/format.h>

#include <CLI/CLI.hpp>

#include "bench/commands.h"
#include "bench/experiment_file.h"
#include "bench/studies/study.h"
#include "methods/registry.h"
#include "problems/control/optimal_control_problem.h"
#include "problems/registry.h"

namespace ricochet {
namespace {

void list_problems() {
  fmt::print("problems (--problem ID)\n");
  for (const auto& scene : scenes()) {
    fmt::print("  {:<24} {}\n  {:<24}   hard: {}\n", scene.id, scene.title, "", scene.hard_feature);
  }
  fmt::print("  {:<24} any scene file, --scene FILE or --scene FILE#ID\n\n", "");
}

void list_control_problems() {
  fmt::print("optimal control problems (ricochet control ID)\n");
  for (const auto& problem : control_problems())
    fmt::print("  {:<24} {}\n  {:<24}   hard: {}\n", problem.id, problem.title, "", problem.hard_feature);
  fmt::print("\n");
}

void list_methods() {
  fmt::print("methods (--method SPEC)\n");
  for (const auto& method : methods()) {
    fmt::print("  {:<20} {}\n  {:<20}   {}\n", method.name, method.summary, "", method.usage);
    if (!method.make) fmt::print("  {:<20}   not built: {}\n", "", method.not_built);
  }
  fmt::print("\n");
}

void list_studies() {
  fmt::print("studies (\"kind\" of an experiment file)\n");
  for (const auto& study : studies()) fmt::print("  {:<20} {}\n", study.kind, study.summary);
  fmt::print("\n");
}

void list_experiments() {
  fmt::print("experiments (ricochet run-experiment NAME)\n");
  for (const auto& name : experiment_names()) fmt::print("  {:<20} {}\n", name, read_experiment_file(name).title());
}

}  // namespace

void add_list_command(CLI::App& app, int&) {
  static std::string what = "all";
  auto* command =
      app.add_subcommand("list", "what there is: problems, optimal control problems, methods, studies, experiments");
  command->add_option("what", what, "methods, problems, control, studies or experiments")
      ->check(CLI::IsMember({"all", "methods", "problems", "control", "studies", "experiments"}));
  command->callback([] {
    if (what == "all" || what == "problems") list_problems();
    if (what == "all" || what == "control") list_control_problems();
    if (what == "all" || what == "methods") list_methods();
    if (what == "all" || what == "studies") list_studies();
    if (what == "all" || what == "experiments") list_experiments();
  });
}

}  // namespace ricochet
