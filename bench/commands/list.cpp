#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <set>

#include "bench/commands.h"
#include "bench/experiment_file.h"
#include "bench/studies/study.h"
#include "methods/registry.h"
#include "problems/control/optimal_control_problem.h"
#include "problems/names.h"
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

/// One scene: what --set may change.
void describe_scene(const SceneEntry& scene) {
  const auto problem = make_problem(scene.id);
  const ProblemInfo& info = problem->info();
  fmt::print("problem {}: {}\n  hard: {}\n  {} coordinates, {} contacts, until t = {:g} s\n", scene.id, scene.title,
             scene.hard_feature, info.n_mechanical(), info.n_c(), info.end_time);
  for (const auto& contact : info.contacts)
    fmt::print(
        "  contact {:<20} {}\n", contact.name,
        contact.is_bilateral ? std::string("joint") : fmt::format("e = {:g}, mu = {:g}", contact.eps_r, contact.mu));
  for (const auto& parameter : info.parameters)
    fmt::print("  --set {:<20} {}\n", fmt::format("{}={:g}", parameter.name, parameter.value), parameter.unit);
}

void describe_method(const MethodEntry& method) {
  fmt::print("method {}: {}\n  {}\n", method.name, method.summary, method.usage);
  if (!method.make) return fmt::print("  not built: {}\n", method.not_built);
  for (const auto& example : method.examples) fmt::print("  {:<52} {}\n", example, make_method(example)->info().title);
}

/// A scene, a method or an experiment by its name. @throws InputError with near matches
void describe(const std::string& name) {
  std::vector<std::string> known = {"all", "methods", "problems", "control", "studies", "experiments"};
  for (const auto& scene : scenes()) {
    if (scene.id == name) return describe_scene(scene);
    known.push_back(scene.id);
  }
  for (const auto& method : methods()) {
    if (method.name == name) return describe_method(method);
    known.push_back(method.name);
  }
  for (const auto& experiment : experiment_names()) {
    known.push_back(experiment);
    if (experiment != name) continue;
    const ExperimentFile file = read_experiment_file(name);
    return fmt::print("experiment {}: {}\n  {}\n  file: {}\n", name, file.title(),
                      file.document.value("description", ""), file.path);
  }
  throw_unknown_name("name", name, known);
}

}  // namespace

void add_list_command(CLI::App& app, int&) {
  static std::string what = "all";
  auto* command =
      app.add_subcommand("list", "what there is: problems, optimal control problems, methods, studies, experiments");
  command->add_option("what", what,
                      "methods, problems, control, studies or experiments; or the name of one problem, with its "
                      "parameters, defaults and units, of one method or experiment");
  command->footer("Examples:\n  ricochet list problems\n  ricochet list two_balls_spring");
  command->callback([] {
    if (!std::set<std::string>{"all", "methods", "problems", "control", "studies", "experiments"}.contains(what))
      return describe(what);
    if (what == "all" || what == "problems") list_problems();
    if (what == "all" || what == "control") list_control_problems();
    if (what == "all" || what == "methods") list_methods();
    if (what == "all" || what == "studies") list_studies();
    if (what == "all" || what == "experiments") list_experiments();
  });
}

}  // namespace ricochet
