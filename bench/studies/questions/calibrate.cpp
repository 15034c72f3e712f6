#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>

#include "bench/measure/problem_choice.h"
#include "bench/studies/questions/question.h"
#include "methods/method_spec.h"

/// @file
/// Which step does a method need? For each scene the longest step from which on all that were tried reach an error, and
/// the matrix of scenes by settings at one step.

namespace ricochet::calibrate {
namespace {

using nlohmann::json;

constexpr std::size_t kDrawnScenes = 3;
constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

const json& scene_of(const json& experiment, std::size_t k) {
  return experiment.at("scenes").at(k);
}

std::string name_of(const json& scene) {
  return scene.value("name", scene.at("problem").get<std::string>());
}

std::vector<Answer> calibrate_conditions(const json& experiment) {
  std::vector<Answer> conditions;
  for (std::size_t k = 0; k < experiment.at("scenes").size(); ++k) {
    Answer& answer = conditions.emplace_back();
    answer.scene = name_of(scene_of(experiment, k));
    answer.conditions = {{"scene", static_cast<double>(k)}};
  }
  return conditions;
}

/// Made once for a process: a reference takes longer than most runs.
struct Scene {
  ProblemChoice choice;
  std::unique_ptr<Problem> problem;
  reference::Reference reference;
};
const Scene& made(const json& experiment, std::size_t k) {
  static std::map<std::string, Scene> scenes;
  const std::string key = scene_of(experiment, k).dump();
  const auto known = scenes.find(key);
  if (known != scenes.end()) return known->second;
  Scene& scene = scenes[key];
  scene.choice = read_problem_choice(scene_of(experiment, k));
  scene.problem = scene.choice.make_problem();
  scene.reference = scene.choice.make_reference(*scene.problem);
  return scene;
}

void measure_step(const json& experiment, const Method& method, Answer& answer) {
  const Scene& scene = made(experiment, static_cast<std::size_t>(answer.condition("scene")));
  const Solution s = run_for(method, scene.choice, *scene.problem, Recording::final_state, answer);
  if (!s.succeeded()) return;
  answer.error = scene.reference.error_of(s);
  answer.reference_error = scene.reference.uncertainty;
  answer.solution_size = scene.reference.size();
}

/// A method on a scene.
struct Line {
  std::string scene, method;
  std::vector<double> steps;  ///< for each level, NaN where no step reaches it
};

std::vector<Line> lines_of(const std::vector<Answer>& answers, const std::vector<double>& levels) {
  std::vector<Line> lines;
  for (const std::string& scene : different(answers, &Answer::scene)) {
    for (const auto& [method, list, shortest_step, longest_step] : by_method(answers)) {
      std::vector<std::pair<double, double>> errors;  // from the shortest step on
      bool is_asked = false;
      for (const Answer& a : list) {
        if (a.scene != scene || a.h == 0 || a.status == "not_built" || a.status == "declined") continue;
        is_asked = true;
        errors.emplace_back(a.h, a.succeeded() ? a.error : HUGE_VAL);
      }
      if (!is_asked) continue;
      std::sort(errors.begin(), errors.end());
      Line line{scene, method, {}};
      for (const double level : levels) {
        double step = kNaN;
        for (const auto& [h, error] : errors) {
          if (!(error <= level)) break;
          step = h;
        }
        line.steps.push_back(step);
      }
      lines.push_back(line);
    }
  }
  return lines;
}

const std::vector<double> kLevels{1e-2, 1e-3, 1e-4};

Table step_table(const std::vector<Answer>& answers) {
  std::vector<Column<Line>> columns = {{"scene", &Line::scene}, {"method", &Line::method}};
  for (std::size_t k = 0; k < kLevels.size(); ++k)
    columns.push_back(
        {fmt::format("{:g}", kLevels[k]), "s", "{:.2g}", [k](const Line& line) { return line.steps[k]; }});
  return table_of(
      "Which step an error needs", columns, lines_of(answers, kLevels),
      "Longest step that reaches the error together with all shorter tested steps; error: largest of q and v at the "
      "end time. -: no step does.");
}

/// Number of scenes on which a method reaches an error, and the steps that it needs.
struct Summary {
  std::string method;
  int scenes = 0;
  std::vector<int> reached;
  std::vector<double> median;
};

std::vector<Summary> summaries_of(const std::vector<Answer>& answers) {
  std::vector<Summary> summaries;
  const auto lines = lines_of(answers, kLevels);
  for (const std::string& method : different(lines, &Line::method)) {
    Summary summary{method, 0, {}, {}};
    for (std::size_t k = 0; k < kLevels.size(); ++k) {
      std::vector<double> steps;
      int scenes = 0;
      for (const Line& line : lines) {
        if (line.method != method) continue;
        ++scenes;
        if (std::isfinite(line.steps[k])) steps.push_back(line.steps[k]);
      }
      summary.scenes = scenes;
      summary.reached.push_back(static_cast<int>(steps.size()));
      std::sort(steps.begin(), steps.end());
      summary.median.push_back(steps.empty() ? kNaN : steps[(steps.size() - 1) / 2]);
    }
    summaries.push_back(summary);
  }
  return summaries;
}

Table summary_table(const std::vector<Answer>& answers) {
  std::vector<Column<Summary>> columns = {{"method", &Summary::method}, {"scenes", "", "{}", &Summary::scenes}};
  for (std::size_t k = 0; k < kLevels.size(); ++k) {
    columns.push_back(
        {fmt::format("reach {:g}", kLevels[k]), "", "{}", [k](const Summary& s) { return s.reached[k]; }});
    columns.push_back({"step", "s", "{:.2g}", [k](const Summary& s) { return s.median[k]; }});
  }
  return table_of(
      "The answer", columns, summaries_of(answers),
      "Number of supported scenes on which the error is reached with a tested step and all shorter ones, and the "
      "median of the longest such steps.");
}

/// A row of the matrix: errors with the shortest step, infinite where there is none.
struct MatrixRow {
  std::string method;
  std::vector<std::string> cells;
  std::vector<double> errors;
};

/// Names, for each method with several settings, the row that is nearest to the best one in most columns.
std::string who_wins(const std::vector<MatrixRow>& rows) {
  constexpr double kAsGood = 1.5;  // times the least error
  std::map<std::string, std::vector<const MatrixRow*>> families;
  for (const MatrixRow& row : rows) families[MethodSpec(row.method).name()].push_back(&row);
  std::string text;
  for (const auto& [name, family] : families) {
    if (family.size() < 2) continue;
    const std::size_t n = family.front()->errors.size();
    const auto wins = [&, &members = family](const MatrixRow& row) {
      std::size_t count = 0;
      for (std::size_t k = 0; k < n; ++k) {
        double least = HUGE_VAL;
        for (const MatrixRow* other : members) least = std::min(least, other->errors[k]);
        count += std::isfinite(row.errors[k]) ? row.errors[k] <= kAsGood * least : !std::isfinite(least);
      }
      return count;
    };
    const MatrixRow& best = **std::ranges::max_element(family, {}, [&](const MatrixRow* row) { return wins(*row); });
    text += fmt::format(" {}: {} is within a factor of {} of the best setting in {} of {} columns.", name, best.method,
                        kAsGood, wins(best), n);
  }
  return text;
}

Table matrix_table(const std::vector<Answer>& answers) {
  const auto scenes = different(answers, &Answer::scene);
  std::vector<MatrixRow> rows;
  double shortest = HUGE_VAL;
  for (const Answer& a : answers) {
    if (a.h > 0) shortest = std::min(shortest, a.h);
  }
  for (const auto& [method, list, shortest_step, longest_step] : by_method(answers)) {
    MatrixRow row{method, std::vector<std::string>(scenes.size()), std::vector<double>(scenes.size(), HUGE_VAL)};
    bool has_runs = false;
    for (const Answer& a : list) {
      if (a.h != shortest) continue;
      has_runs = true;
      const auto k = static_cast<std::size_t>(std::ranges::find(scenes, a.scene) - scenes.begin());
      row.cells[k] = a.succeeded() ? scientific(a.error) : a.status == "inner_solver_failed" ? "failed" : a.status;
      if (a.succeeded()) row.errors[k] = a.error;
    }
    if (has_runs) rows.push_back(row);
  }
  std::vector<Column<MatrixRow>> columns = {{"method", &MatrixRow::method}};
  for (std::size_t k = 0; k < scenes.size(); ++k)
    columns.push_back({scenes[k], [k](const MatrixRow& row) { return row.cells[k]; }});
  return table_of(fmt::format("Errors with steps of {:g} s", shortest), columns, rows,
                  "Largest error of q and v at the end time." + who_wins(rows));
}

std::vector<QuestionPanel> panels(const std::vector<Answer>& answers) {
  std::vector<QuestionPanel> list;
  for (const std::string& scene : different(answers, &Answer::scene)) {
    if (list.size() == kDrawnScenes) break;
    list.push_back(
        {{.title = scene, .x = step_axis(), .y = {.label = "error", .is_log = true, .from = 1e-12, .to = 10}},
         [scene](const Answer& a, const MethodAnswers&) {
           return a.h > 0 && a.scene == scene ? Chart::Points{{a.h, a.error}} : Chart::Points{};
         },
         [](Chart::Panel& p) { p.add_power("order 1", 1, 1); }});
  }
  return list;
}

constexpr const char* kFields = R"~({
  "scenes": {"type": "array", "minItems": 1, "items": {"type": "object", "additionalProperties": false, "required": ["problem"], "properties": {
    "name": {"type": "string", "description": "In tables.", "examples": ["ball"]},
    "problem": {"$ref": "#/$defs/problem", "examples": ["bouncing_ball"]},
    "parameters": {"$ref": "#/$defs/parameters", "examples": [{"e": 0.5}]}}},
    "description": "Scenes.", "examples": [[{"problem": "bouncing_ball"}]]}
})~";

const bool registered =
    register_question({.kind = "calibrate",
                       .summary = "which step does a method need for an error?",
                       .fields = kFields,
                       .conditions = calibrate_conditions,
                       .measure = measure_step,
                       .figure = "Error at the end over the step length",
                       .caption = "The first scenes of the experiment; shorter steps to the right. Grey: first order.",
                       .panels = panels,
                       .details = {{"error", "error", "", "{:.3e}"}},
                       .before = [](const Results&, const std::vector<Answer>& answers,
                                    Section& section) { section.result("answer", summary_table(answers)); },
                       .after =
                           [](const Results&, const std::vector<Answer>& answers, Section& section) {
                             section.result("matrix", matrix_table(answers));
                             section.result("steps", step_table(answers));
                           }});

}  // namespace
}  // namespace ricochet::calibrate
