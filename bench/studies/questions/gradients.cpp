#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "bench/studies/questions/gradient_cases.h"
#include "bench/studies/questions/question.h"

/// @file
/// Is the gradient through a contact right? The cases of gradient_cases.h, each method with the derivatives that it has,
/// or else by differences of its final state: over a millionth of the variable, which is the derivative of its steps, as
/// differentiable engines have it, and over some percent, which sees impacts move from step to step.

namespace ricochet::gradients {
namespace {

using nlohmann::json;

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
constexpr double kRight = 1e-3;  // relative to the largest entry of a case

std::vector<Answer> gradient_conditions(const json& experiment) {
  std::vector<Answer> conditions;
  for (const GradientCase& c : gradient_cases()) {
    for (const double change : experiment.at("changes").get<std::vector<double>>()) {
      Answer& answer = conditions.emplace_back();
      answer.scene = c.name;
      answer.conditions = {{"change", change}};
    }
  }
  return conditions;
}

const GradientCase& find_case(const std::vector<GradientCase>& cases, const std::string& name) {
  return *std::find_if(cases.begin(), cases.end(), [&](const GradientCase& c) { return c.name == name; });
}

void measure_gradient(const json& experiment, const Method& method, Answer& answer) {
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

struct Verdict {
  std::string method, says, how;
  std::vector<std::pair<std::string, double>> errors;  ///< relative, of each case, with the shortest step
};

/// Of the first of the changes: what the method, or the derivative of its steps, says.
std::vector<Verdict> verdicts_of(const std::vector<Answer>& answers, double change) {
  std::vector<Verdict> verdicts;
  for (const auto& [method, list] : by_method(answers)) {
    Verdict verdict{.method = method, .says = {}, .how = {}, .errors = {}};
    const double shortest = step_range_of(list).shortest;
    int right = 0, all = 0;
    for (const Answer& a : list) {
      if (a.h != shortest || a.condition("change") != change) continue;
      const double error = a.succeeded() ? a.error : kNaN;
      verdict.errors.emplace_back(a.scene, error);
      if (!a.succeeded()) continue;
      verdict.how = a.value("own") == 1 ? "its own" : fmt::format("differences of {:g}", change);
      ++all;
      right += error < kRight;
    }
    if (all > 0) verdict.says = right == all ? "right" : fmt::format("wrong in {} of {} cases", all - right, all);
    verdicts.push_back(verdict);
  }
  return verdicts;
}

Table verdict_table(const std::vector<Answer>& answers, double change, const std::string& title) {
  std::vector<Column<Verdict>> columns = {{"method", &Verdict::method},
                                          {"is the gradient through a contact right?", &Verdict::says},
                                          {"derivatives", &Verdict::how}};
  const auto cases = gradient_cases();
  for (std::size_t k = 0; k < cases.size(); ++k) {
    columns.push_back({cases[k].name, "", "{:.1e}",
                       [k](const Verdict& v) { return k < v.errors.size() ? v.errors[k].second : kNaN; }});
  }
  return table_of(
      title, columns, verdicts_of(answers, change),
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

Table gradient_details(const std::vector<Answer>& answers) {
  static const std::vector<Column<Answer>> columns = {
      {"method", &Answer::method},
      {"h", "s", "{:.4g}", &Answer::h},
      {"case", &Answer::scene},
      {"change", "", "{:g}", [](const Answer& a) { return a.condition("change"); }},
      {"error", "", "{:.3e}", [](const Answer& a) { return a.error; }},
      {"found",
       [](const Answer& a) {
         std::string text;
         for (const auto& [name, value] : a.values) {
           if (name.starts_with("d ")) text += fmt::format("{}{} = {:.6g}", text.empty() ? "" : ", ", name, value);
         }
         return text;
       }},
      {"status", &Answer::status},
  };
  return table_of("Every run", columns, answers);
}

void show_gradients(const Results& results, const std::vector<Answer>& answers, Section& section) {
  std::vector<double> changes;
  for (const Answer& a : answers) {
    if (std::find(changes.begin(), changes.end(), a.condition("change")) == changes.end())
      changes.push_back(a.condition("change"));
  }
  for (std::size_t k = 0; k < changes.size(); ++k) {
    if (k == 0)
      section.result("answer", verdict_table(answers, changes[k], "The answer"));
    else
      section.result(
          fmt::format("change_{}", k),
          verdict_table(answers, changes[k],
                        fmt::format("By differences over {:g} of a variable, for every method", changes[k])));
  }
  std::vector<Chart::Panel> panels;
  for (const GradientCase& c : gradient_cases()) {
    if (c.name != "ball_flies_down" && c.name != "ball_falls" && c.name != "block_stops") continue;
    const GradientEntry& entry = c.entries[0];
    const double around = 2.5 * std::max(1.0, std::abs(entry.exact));
    Chart::Panel panel{.title = c.name,
                       .x = step_axis(),
                       .y = {.label = entry.name, .from = entry.exact - around, .to = entry.exact + around}};
    std::ranges::replace(panel.title, '_', ' ');
    for (const auto& [method, list] : by_method(answers)) {
      Chart::Points points;
      for (const Answer& a : list) {
        if (a.succeeded() && a.h > 0 && a.scene == c.name && a.condition("change") == changes.front())
          points.emplace_back(a.h, std::clamp(a.value(entry.name), panel.y.from, panel.y.to));
      }
      panel.add(method, question_look(method), Chart::Drawn::both, points);
    }
    panel.add_power("exact", entry.exact, 0);
    panels.push_back(panel);
  }
  section.chart(question_chart(results.experiment(), "Derivatives of the final state",
                               "Grey: exact. The derivative of a time-stepping scheme does not contain that an impact "
                               "comes earlier or later. Values outside of the axes are drawn at the edge.",
                               panels));
  section.result("cases", cases_table());
  section.details("runs", gradient_details(answers));
}

constexpr const char* kFields = R"~({
  "changes": {"type": "array", "minItems": 1, "items": {"type": "number", "exclusiveMinimum": 0, "exclusiveMaximum": 0.5}, "description": "Of a variable, relative to its size, for differences; methods with derivatives of their own have them in place of the first.", "examples": [[1e-6, 0.01]]}
})~";

const bool registered = register_question({.kind = "gradients",
                                           .summary = "is the gradient through a contact right?",
                                           .fields = kFields,
                                           .conditions = gradient_conditions,
                                           .measure = measure_gradient,
                                           .show = show_gradients});

}  // namespace
}  // namespace ricochet::gradients
