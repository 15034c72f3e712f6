#include "bench/commands/shell_completion.h"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <functional>
#include <map>

#include "bench/commands/program.h"
#include "bench/experiment/experiment_file.h"
#include "bench/fuzz/families.h"
#include "bench/studies/study.h"
#include "methods/registry.h"
#include "problems/control/optimal_control_problem.h"
#include "problems/input_error.h"
#include "problems/registry.h"
#include "problems/scene_file/scene_file.h"

namespace ricochet {
namespace {

using Words = std::vector<std::string>;

/// What stands on the line before the word that is completed.
struct Line {
  const CLI::App* command = nullptr;
  std::string option;                   ///< that waits for a value; empty for none
  std::map<std::string, Words> values;  ///< of the options, by their names, and of the arguments that have no option
  int n_arguments = 0;

  /// The last value of an option or argument; empty for none.
  std::string value(const std::string& name) const {
    const auto found = values.find(name);
    return found == values.end() ? "" : found->second.back();
  }
};

const CLI::App* find_command(const CLI::App& app, const std::string& name) {
  const auto found = app.get_subcommands([&](const CLI::App* command) { return command->get_name() == name; });
  return found.empty() || name.empty() ? nullptr : found.front();
}

bool takes_value(const CLI::Option& option) {
  return option.get_items_expected_max() > 0;
}

/// The k-th argument that is no option; the last one where it may be repeated.
const CLI::Option* argument(const CLI::App& command, int k) {
  for (const CLI::Option* option : command.get_options()) {
    if (option->get_positional() && (k-- == 0 || option->get_items_expected_max() > 1)) return option;
  }
  return nullptr;
}

Line read_line(const CLI::App& app, const Words& words) {
  Line line{&app, "", {}, 0};
  for (const auto& word : words) {
    if (!line.option.empty()) {
      line.values[line.option].push_back(word);
      line.option.clear();
    } else if (word.starts_with('-')) {
      const CLI::Option* option = line.command->get_option_no_throw(word);
      if (option && takes_value(*option)) line.option = option->get_name();
    } else if (const CLI::App* command = find_command(*line.command, word)) {
      line.command = command;
    } else if (const CLI::Option* option = argument(*line.command, line.n_arguments++)) {
      line.values[option->get_name()].push_back(word);
    }
  }
  return line;
}

template <class Entries, class Name>
Words names_of(const Entries& entries, Name name) {
  Words names;
  for (const auto& entry : entries) names.push_back(std::invoke(name, entry));
  return names;
}

Words with_equals(const std::vector<ParameterInfo>& parameters) {
  Words words;
  for (const auto& parameter : parameters) words.push_back(parameter.name + "=");
  return words;
}

/// Of the problem on the line.
Words parameters(const Line& line) {
  if (const std::string file = line.value("--scene"); !file.empty())
    return with_equals(read_scene_file(file)->info().parameters);
  if (const std::string name = line.value("problem"); !name.empty())
    return with_equals(make_control_problem(name)->plant->info().parameters);
  const std::string by_option = line.value("--problem"),
                    name = by_option.empty() ? line.value("problem_id") : by_option;
  for (const auto& scene : scenes()) {
    if (scene.id == name) return with_equals(parameters_of(scene));
  }
  return {};
}

/// Of the experiment on the line, or of the problem.
Words changes(const Line& line) {
  const std::string experiment = line.value("experiment");
  if (experiment.empty()) return parameters(line);
  Words words;
  const ExperimentFile file = read_experiment_file(experiment);
  for (const auto& [name, value] : file.document.items()) words.push_back(name + "=");
  return words;
}

/// Texts of methods that begin so: names, their examples, options behind a comma and what these choose between.
Words methods_of(const std::string& begun) {
  Words words;
  const auto comma = begun.rfind(',');
  for (const auto& method : methods()) {
    if (!method.make) continue;
    if (comma == std::string::npos) {
      words.push_back(method.name);
      for (const auto& example : method.examples) words.push_back(example.substr(0, example.find(',')));
    } else if (MethodSpec(begun.substr(0, begun.find(','))).name() == method.name) {
      for (const auto& option : options_of(method)) {
        const std::string head = begun.substr(0, comma + 1) + option.name + "=";
        if (!begun.starts_with(head)) words.push_back(head);
        for (const auto& choice : begun.starts_with(head) ? option.choices : Words()) words.push_back(head + choice);
      }
    }
  }
  return words;
}

/// What solver= of a method chooses between.
Words solvers() {
  for (const auto& method : methods()) {
    if (!method.make) continue;
    for (const auto& option : options_of(method)) {
      if (option.name == "solver") return option.choices;
    }
  }
  return {};
}

/// Tables of the results on the line.
Words views(const Line& line) {
  Words words;
  const auto results = line.values.find("results");
  if (results == line.values.end()) return words;
  for (const auto& path : results->second) {
    const ShownResults shown = shown_results(path);
    for (const auto* table : shown.section.tables()) words.push_back(table->name);
  }
  return words;
}

Words every_name() {
  Words words = {"all", "problems", "control", "methods", "studies", "experiments"};
  for (const auto& names :
       {names_of(scenes(), &SceneEntry::id), names_of(control_problems(), &ControlEntry::id),
        names_of(methods(), &MethodEntry::name), names_of(studies(), &Study::kind), experiment_names()})
    words.insert(words.end(), names.begin(), names.end());
  return words;
}

/// "{on,off}" of a type "TEXT:{on,off}", as CLI11 says what an option is checked for.
Words choices_of(const CLI::Option& option) {
  const std::string type = option.get_type_name();
  const auto open = type.find('{'), close = type.rfind('}');
  return open == std::string::npos ? Words() : CLI::detail::split(type.substr(open + 1, close - open - 1), ',');
}

/// What an option or argument takes, by its name, which means the same in every command.
Words values_of(const CLI::Option& option, const Line& line, const std::string& begun) {
  static const std::map<std::string, std::function<Words(const Line&, const std::string&)>> kinds = {
      {"--problem", [](auto&&...) { return names_of(scenes(), &SceneEntry::id); }},
      {"problem_id", [](auto&&...) { return names_of(scenes(), &SceneEntry::id); }},
      {"problem", [](auto&&...) { return names_of(control_problems(), &ControlEntry::id); }},
      {"--method", [](const Line&, const std::string& text) { return methods_of(text); }},
      {"experiment", [](auto&&...) { return experiment_names(); }},
      {"what", [](auto&&...) { return every_name(); }},
      {"--family", [](auto&&...) { return names_of(scene_families(), &SceneFamily::name); }},
      {"--solver", [](auto&&...) { return solvers(); }},
      {"--set", [](const Line& at, const std::string&) { return changes(at); }},
      {"--vary", [](const Line& at, const std::string&) { return parameters(at); }},
      {"--view", [](const Line& at, const std::string&) { return views(at); }},
  };
  if (Words choices = choices_of(option); !choices.empty()) return choices;
  const auto found = kinds.find(option.get_name());
  return found == kinds.end() ? Words() : found->second(line, begun);
}

Words candidates(const Line& line, const std::string& begun) {
  if (!line.option.empty()) return values_of(*line.command->get_option_no_throw(line.option), line, begun);
  if (begun.starts_with('-')) {
    const auto equals = begun.find('=');
    if (equals == std::string::npos) return option_names(*line.command);
    const std::string name = begun.substr(0, equals);
    const CLI::Option* option = line.command->get_option_no_throw(name);
    Words values = option ? values_of(*option, line, begun.substr(equals + 1)) : Words();
    for (auto& value : values) value = name + "=" + value;
    return values;
  }
  Words words = command_names(*line.command);
  if (const CLI::Option* option = argument(*line.command, line.n_arguments)) {
    const Words values = values_of(*option, line, begun);
    words.insert(words.end(), values.begin(), values.end());
  }
  return words;
}

}  // namespace

std::vector<std::string> completions(const CLI::App& app, const std::vector<std::string>& words) {
  if (words.empty()) return {};
  const std::string& begun = words.back();
  Words found;
  try {
    found = candidates(read_line(app, {words.begin(), words.end() - 1}), begun);
  } catch (const InputError&) {  // of what is on the line so far: the command itself will say it
  }
  std::erase_if(found, [&](const std::string& word) { return !word.starts_with(begun); });
  std::ranges::sort(found);
  found.erase(std::unique(found.begin(), found.end()), found.end());
  return found;
}

}  // namespace ricochet
