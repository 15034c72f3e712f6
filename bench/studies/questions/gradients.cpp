#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "bench/studies/questions/gradient_cases.h"
#include "bench/studies/questions/question.h"

/// @file
/// Is the gradient through a contact right? The cases of gradient_cases.h, each method with the derivatives that it has,
/// or else by differences of its final state: over a millionth of the variable, which is the derivative of its steps, as
/// differentiable engines have it, and over some percent, which sees impacts move from step to step.

namespace ricochet::gradients {
namespace {

constexpr double kRight = 1e-3;  // relative to the largest entry of a case

std::vector<Answer> conditions(const nlohmann::json& experiment) {
  std::vector<Answer> list;
  for (const GradientCase& c : gradient_cases()) {
    for (Answer answer : answers_for({{"change", experiment.at("changes")}})) {
      answer.scene = c.name;
      list.push_back(std::move(answer));
    }
  }
  return list;
}

const GradientCase& find_case(const std::vector<GradientCase>& cases, const std::string& name) {
  return *std::find_if(cases.begin(), cases.end(), [&](const GradientCase& c) { return c.name == name; });
}

void measure(const nlohmann::json& experiment, const Method& method, Answer& answer) {
  const auto cases = gradient_cases();
  const GradientCase& c = find_case(cases, answer.scene);
  for (const GradientEntry& entry : c.entries) {
    if (std::ranges::find(answer.sensitivities, entry.with_respect) == answer.sensitivities.end())
      answer.sensitivities.push_back(entry.with_respect);
  }
  answer.problem = c.choice.problem;
  answer.parameters = c.choice.parameters;
  if (answer.h > 0) answer.setting.steps = steps_of(c.problem->info().end_time, answer.h);
  const double change = answer.condition("change");
  const bool is_own = method.info().has_sensitivities && change == experiment.at("changes").front().get<double>();
  answer.values["own"] = is_own;
  const Solution s = measure_run({.problem = *c.problem, .change = is_own ? 0 : change}, method, answer);
  if (!s.succeeded()) return;
  double error = 0, largest = 0;
  for (const GradientEntry& entry : c.entries) {
    const auto place = std::ranges::find(answer.sensitivities, entry.with_respect);
    const auto column = static_cast<Eigen::Index>(place - answer.sensitivities.begin());
    const int n_q = c.problem->n_q();
    const double found = entry.output < n_q ? s.dq(entry.output, column) : s.dv(entry.output - n_q, column);
    answer.values[entry.name] = found;
    error = std::max(error, std::abs(found - entry.exact));
    largest = std::max(largest, std::abs(entry.exact));
  }
  answer.error = error / largest;
}

MethodAnswers::Number error_in(const std::string& scene, double change) {
  return [=](const Answer& a) {
    return a.condition("change") == change && (scene.empty() || a.scene == scene) ? a.error : std::nan("");
  };
}

/// The answer by the derivatives of one change. @param change  the first one: those that the method has
Table verdict_table(const std::vector<Answer>& answers, double change, const std::string& title) {
  const auto sentence = [change](const MethodAnswers& m) {
    int right = 0, all = 0;
    for (const Answer& a : m.answers) {
      if (!a.succeeded() || a.h != m.shortest || a.condition("change") != change) continue;
      ++all;
      right += a.error < kRight;
    }
    return all == 0 ? "" : right == all ? "right" : fmt::format("wrong in {} of {} cases", all - right, all);
  };
  const auto how = [change](const MethodAnswers& m) -> std::string {
    const double own = m.first(
        [=](const Answer& a) { return a.condition("change") == change ? a.value("own") : std::nan(""); }, m.shortest);
    return std::isnan(own) ? "" : own == 1 ? "its own" : fmt::format("differences of {:g}", change);
  };
  std::vector<Column<MethodAnswers>> columns = {
      {"method", &MethodAnswers::method}, {"is the gradient through a contact right?", sentence}, {"derivatives", how}};
  for (const GradientCase& c : gradient_cases()) {
    columns.push_back({c.name, "", "{:.1e}", [change, name = c.name](const MethodAnswers& m) {
                         return m.first(error_in(name, change), m.shortest);
                       }});
  }
  return table_of(
      title, columns, by_method(answers),
      "Largest error of a case relative to its largest exact entry, with the shortest step. Right: below 1e-3 in every "
      "case that the method can run.");
}

struct Exact {
  std::string scene, of, title, entry;
  double value = 0;
};

Table cases_table() {
  std::vector<Exact> rows;
  for (const GradientCase& c : gradient_cases()) {
    for (const GradientEntry& entry : c.entries) rows.push_back({c.name, c.of, c.title, entry.name, entry.exact});
  }
  static const std::vector<Column<Exact>> columns = {{"case", &Exact::scene},
                                                     {"asked in", &Exact::of},
                                                     {"what happens", &Exact::title},
                                                     {"derivative", &Exact::entry},
                                                     {"exact", "", "{:.12g}", &Exact::value}};
  return table_of("The cases", columns, rows, "`ricochet check-gradient FILE` scores derivatives of other programs.");
}

std::vector<double> changes_of(const std::vector<Answer>& answers) {
  return different(answers, [](const Answer& a) { return a.condition("change"); });
}

void show_answers(const Results&, const std::vector<Answer>& answers, Section& section) {
  int k = 0;
  for (const double change : changes_of(answers)) {
    const bool is_first = k == 0;
    section.result(
        is_first ? "answer" : fmt::format("change_{}", k),
        verdict_table(
            answers, change,
            is_first ? "The answer" : fmt::format("By differences over {:g} of a variable, for every method", change)));
    ++k;
  }
}

std::vector<QuestionPanel> panels(const std::vector<Answer>& answers) {
  std::vector<QuestionPanel> list;
  const auto changes = changes_of(answers);
  for (const GradientCase& c : gradient_cases()) {
    if (c.name != "ball_flies_down" && c.name != "ball_falls" && c.name != "block_stops") continue;
    const GradientEntry entry = c.entries[0];
    const double around = 2.5 * std::max(1.0, std::abs(entry.exact));
    list.push_back({{.title = c.name,
                     .x = step_axis(),
                     .y = {.label = entry.name, .from = entry.exact - around, .to = entry.exact + around}},
                    [=, name = c.name](const Answer& a, const MethodAnswers&) {
                      const bool is_drawn = a.h > 0 && a.scene == name && a.condition("change") == changes.front();
                      return is_drawn ? Chart::Points{{a.h, a.value(entry.name)}} : Chart::Points{};
                    },
                    [=](Chart::Panel& p) { p.add_power("exact", entry.exact, 0); }});
  }
  return list;
}

constexpr const char* kFields = R"~({
  "changes": {"type": "array", "minItems": 1, "items": {"type": "number", "exclusiveMinimum": 0, "exclusiveMaximum": 0.5}, "description": "Of a variable, relative to its size, for differences; methods with derivatives of their own have them in place of the first.", "examples": [[1e-6, 0.01]]}
})~";

const bool registered = register_question(
    {.kind = "gradients",
     .summary = "is the gradient through a contact right?",
     .fields = kFields,
     .conditions = conditions,
     .measure = measure,
     .figure = "Derivatives of the final state",
     .caption =
         "Grey: exact. The derivative of a time-stepping scheme does not contain the change of the impact time.",
     .panels = panels,
     .details = {{"change", "change", "", "{:g}"}, {"error", "error", "", "{:.3e}"}},
     .before = show_answers,
     .after = [](const Results&, const std::vector<Answer>&, Section& section) {
       section.result("cases", cases_table());
     }});

}  // namespace
}  // namespace ricochet::gradients
