#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "bench/studies/questions/question.h"
#include "problems/registry.h"

/// @file
/// Does a sliding block lift off? A block slides on the floor at the speed v with friction mu. It should stay on it. A
/// convex relaxation of Coulomb's law couples the normal direction to slip, v_n >= mu v_t, so that the gap of a block
/// that slides is
///
///     h mu v                                                                                                        (1)
///
/// with steps of length h (M. Anitescu, Math. Program. 105 (2006), 113-143), and one that is set on the floor at the speed
/// v is thrown up: an impulse Lambda leaves v_n = Lambda / m = mu (v - mu Lambda / m), and it rises by
///
///     v_n^2 / (2 g),   v_n = mu v / (1 + mu^2),                                                                      (2)
///
/// however short the step.

namespace ricochet::lift {
namespace {

using nlohmann::json;

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
constexpr double kGravity = 9.81;
constexpr double kStays = 1e-9;  // [m]

std::vector<Answer> lift_conditions(const json& experiment) {
  std::vector<Answer> conditions;
  for (const double mu : experiment.at("friction").get<std::vector<double>>()) {
    for (const double v : experiment.at("speeds").get<std::vector<double>>())
      conditions.emplace_back().conditions = {{"mu", mu}, {"v", v}};
  }
  return conditions;
}

void measure_lift(const json&, const Method& method, Answer& answer) {
  const double mu = answer.condition("mu"), v = answer.condition("v");
  const double duration = 0.5 * v / (mu * kGravity);  // half of the time until it stops
  const ProblemChoice choice{.problem = "sliding_block",
                             .parameters = {{"mu", mu}, {"v_x0", v}, {"duration", duration}}};
  const auto block = choice.make_problem();
  const Solution s = run_for(method, choice, *block, Recording::grid, answer);
  if (!s.succeeded()) return;
  double lift = std::max(0.0, block->gap(s.q)[0]);
  for (const Sample& sample : s.samples) lift = std::max(lift, block->gap(sample.q)[0]);
  answer.values["lift"] = lift;
  answer.values["gap"] = std::max(0.0, block->gap(s.q)[0]);
  answer.values["h mu v"] = answer.h * mu * std::abs(s.v[0]);  // (1) at the end
  const double v_n = mu * v / (1 + mu * mu);
  answer.values["throw"] = v_n * v_n / (2 * kGravity);  // (2)
}

struct Verdict {
  std::string method, says;
  double lift_longest = kNaN, lift_shortest = kNaN;  ///< largest of all conditions [m]
};

std::vector<Verdict> verdicts_of(const std::vector<Answer>& answers) {
  std::vector<Verdict> verdicts;
  for (const auto& [method, list] : by_method(answers)) {
    Verdict verdict{.method = method, .says = {}};
    const auto [shortest, longest] = step_range_of(list);
    for (const Answer& a : list) {
      if (!a.succeeded()) continue;
      if (a.h == longest) verdict.lift_longest = std::fmax(verdict.lift_longest, a.value("lift"));
      if (a.h == shortest) verdict.lift_shortest = std::fmax(verdict.lift_shortest, a.value("lift"));
    }
    if (std::isfinite(verdict.lift_shortest)) {
      const double worst = std::fmax(verdict.lift_longest, verdict.lift_shortest);
      verdict.says = worst < kStays                                       ? "stays on the floor"
                     : verdict.lift_shortest > 0.3 * verdict.lift_longest ? "lifts off, however short the step"
                                                                          : "lifts off, less with shorter steps";
    }
    verdicts.push_back(verdict);
  }
  return verdicts;
}

Table verdict_table(const std::vector<Verdict>& verdicts) {
  static const std::vector<Column<Verdict>> columns = {
      {"method", &Verdict::method},
      {"does a sliding block lift off?", &Verdict::says},
      {"highest, longest step", "m", "{:.1e}", &Verdict::lift_longest},
      {"shortest step", "m", "{:.1e}", &Verdict::lift_shortest},
  };
  return table_of(
      "The answer", columns, verdicts,
      "Stays: no gap exceeds 1e-9 m at the end of a step. Highest: over all coefficients and speeds. With a convex "
      "relaxation a sliding block hovers at h mu v. A block that is set on the floor at speed v is thrown up by v_n^2 "
      "/ (2 g) with v_n = mu v / (1 + mu^2).");
}

Table lift_details(const std::vector<Answer>& answers) {
  static const std::vector<Column<Answer>> columns = {
      {"method", &Answer::method},
      {"h", "s", "{:.4g}", &Answer::h},
      {"mu", "", "{:g}", [](const Answer& a) { return a.condition("mu"); }},
      {"v", "m/s", "{:g}", [](const Answer& a) { return a.condition("v"); }},
      {"highest", "m", "{:.3e}", [](const Answer& a) { return a.value("lift"); }},
      {"thrown by", "m", "{:.3e}", [](const Answer& a) { return a.value("throw"); }},
      {"gap at the end", "m", "{:.3e}", [](const Answer& a) { return a.value("gap"); }},
      {"h mu v", "m", "{:.3e}", [](const Answer& a) { return a.value("h mu v"); }},
      {"status", &Answer::status},
      {"command", &Answer::command},
  };
  return table_of("Every run", columns, answers);
}

void show_lift(const Results& results, const std::vector<Answer>& answers, Section& section) {
  section.result("answer", verdict_table(verdicts_of(answers)));
  constexpr double kDrawnZero = 1e-17;
  Chart::Axis height{.label = "highest point [m]", .is_log = true, .from = 1e-18, .to = 10};
  Chart::Panel over_speed{
      .title = "shortest step", .x = {.label = "(μ v / (1 + μ²))² / (2 g) [m]", .is_log = true}, .y = height};
  Chart::Panel over_step{.title = "largest μ and v", .x = step_axis(), .y = height};
  for (const auto& [method, list] : by_method(answers)) {
    const double shortest = step_range_of(list).shortest;
    double most = 0;
    for (const Answer& a : list) {
      if (a.succeeded()) most = std::max(most, a.value("throw"));
    }
    Chart::Points speed, step;
    for (const Answer& a : list) {
      if (!a.succeeded()) continue;
      const double lift = std::max(kDrawnZero, a.value("lift"));
      if (a.h == shortest) speed.emplace_back(a.value("throw"), lift);
      if (a.h > 0 && a.value("throw") == most) step.emplace_back(a.h, lift);
    }
    std::ranges::sort(speed);
    over_speed.add(method, question_look(method), Chart::Drawn::both, speed);
    over_step.add(method, question_look(method), Chart::Drawn::both, step);
  }
  over_speed.add_power("thrown up by a convex relaxation", 1, 1);
  section.chart(question_chart(
      results.experiment(), "How high a block rises that should slide",
      "Left: over the height that a convex relaxation of Coulomb's law gives a block that is set on the floor. Right: "
      "over the step length, shorter to the right. It should stay on the floor: heights below 1e-17 m are drawn there. "
      "Dashed: an engine with default settings; solid: tuned.",
      {over_speed, over_step}));
  section.details("runs", lift_details(answers));
}

constexpr const char* kFields = R"~({
  "friction": {"type": "array", "minItems": 1, "items": {"type": "number", "exclusiveMinimum": 0}, "description": "Coefficients mu.", "examples": [[0.5]]},
  "speeds": {"type": "array", "minItems": 1, "items": {"type": "number", "exclusiveMinimum": 0}, "description": "At the start [m/s].", "examples": [[1, 6]]}
})~";

const bool registered = register_question({.kind = "lift",
                                           .summary = "does a sliding block lift off?",
                                           .fields = kFields,
                                           .conditions = lift_conditions,
                                           .measure = measure_lift,
                                           .show = show_lift});

}  // namespace
}  // namespace ricochet::lift
