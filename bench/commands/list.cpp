#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <functional>
#include <set>

#include "bench/commands/commands.h"
#include "bench/experiment/experiment_file.h"
#include "bench/experiment/experiment_schema.h"
#include "bench/experiment/study.h"
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

void print_parameters(const std::vector<ParameterInfo>& parameters) {
  for (const auto& parameter : parameters)
    fmt::print("  --set {:<20} {}\n", fmt::format("{}={:g}", parameter.name, parameter.value), parameter.unit);
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
  print_parameters(parameters_of(scene));
}

void describe_control_problem(const ControlEntry& entry) {
  const auto problem = make_control_problem(entry.id);
  const ProblemInfo& plant = problem->plant->info();
  fmt::print("optimal control problem {}: {}\n  hard: {}\n", entry.id, entry.title, entry.hard_feature);
  fmt::print("  {} coordinates, {} controls, {} contacts, until t = {:g} s{}\n", plant.n_mechanical(), plant.n_u,
             plant.n_c(), plant.end_time, problem->is_time_free ? ", which is free" : "");
  fmt::print("  {} intervals of {} elements, {}\n", problem->n_intervals, problem->n_fe, problem->tableau);
  print_parameters(plant.parameters);
}

void describe_method(const MethodEntry& method) {
  fmt::print("method {}: {}\n  {}\n", method.name, method.summary, method.usage);
  if (!method.make) return fmt::print("  not built: {}\n", method.not_built);
  for (const auto& option : options_of(method))
    fmt::print("  {:<28} {}\n", fmt::format("{}={}", option.name, option.fallback), option.allowed);
  for (const auto& example : method.examples)
    fmt::print("  for example {:<40} {}\n", example, make_method(example)->info().title);
}

void describe_study(const Study& study) {
  fmt::print("study {}: {}\n", study.kind, study.summary);
  const JsonSchema& schema = experiment_schema(study);
  for (const auto& [name, field] : schema.document().at("properties").items()) {
    const std::string own = field.value("description", "");
    fmt::print("  {:<20} {}\n", name, own.empty() ? schema.resolved(field).value("description", "") : own);
  }
}

void describe_experiment(const std::string& name) {
  const ExperimentFile file = read_experiment_file(name);
  fmt::print("experiment {}: {}\n  {}\n  file: {}\n", name, file.title(), file.document.value("description", ""),
             file.path);
}

/// Everything of this name: an experiment may be called as its kind. @throws InputError with near matches
void describe(const std::string& name) {
  std::vector<std::string> known = {"all", "methods", "problems", "control", "studies", "experiments"};
  bool is_known = false;
  const auto look_in = [&](const auto& entries, auto id, auto describe_entry) {
    for (const auto& entry : entries) {
      known.push_back(std::invoke(id, entry));
      if (known.back() != name) continue;
      describe_entry(entry);
      is_known = true;
    }
  };
  look_in(scenes(), &SceneEntry::id, describe_scene);
  look_in(control_problems(), &ControlEntry::id, describe_control_problem);
  look_in(methods(), &MethodEntry::name, describe_method);
  look_in(studies(), &Study::kind, describe_study);
  look_in(experiment_names(), std::identity(), describe_experiment);
  if (!is_known) throw_unknown_name("name", name, known);
}

}  // namespace

void add_list_command(CLI::App& app, int&) {
  static std::string what = "all";
  auto* command =
      app.add_subcommand("list", "list problems, optimal control problems, methods, studies and experiments");
  command->add_option(
      "what", what,
      "methods, problems, control, studies or experiments; or a name: the parameters of a problem with defaults and "
      "units, the options of a method, the fields of a study, an experiment");
  command->footer("Examples:\n  ricochet list problems\n  ricochet list two_balls_spring\n  ricochet list fesd");
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
