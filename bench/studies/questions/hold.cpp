#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "bench/studies/questions/question.h"

/// @file
/// Does friction hold? A block rests on a ramp whose slope is a fraction f of the steepest that it stays on,
///
///     tan(slope) = f mu,   at rest for f <= 1;  a = g (sin(slope) - mu cos(slope)) for f > 1                         (1)
///
/// Its creep is its mean speed over the second half of the run.

namespace ricochet::hold {
namespace {

using nlohmann::json;

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
constexpr double kMu = 0.5, kGravity = 9.81, kDuration = 2;
constexpr double kHolds = 1e-9;  // [m/s], a tenth of a millimetre in a day

std::vector<Answer> hold_conditions(const json& experiment) {
  std::vector<Answer> conditions;
  for (const double f : experiment.at("fractions").get<std::vector<double>>())
    conditions.emplace_back().conditions = {{"fraction", f}};
  return conditions;
}

void measure_hold(const json&, const Method& method, Answer& answer) {
  const double f = answer.condition("fraction"), slope = std::atan(f * kMu);
  const ProblemChoice ramp{.problem = "block_on_ramp",
                           .parameters = {{"mu", kMu}, {"slope", slope}, {"v_x0", 0}, {"duration", kDuration}}};
  const Solution s = run_for(method, ramp, *ramp.make_problem(), Recording::motion, answer);
  if (!s.succeeded()) return;
  answer.values["creep"] = (s.q[0] - position_at(s, kDuration / 2)[0]) / (kDuration / 2);
  const double a = std::max(0.0, kGravity * (std::sin(slope) - kMu * std::cos(slope)));  // (1)
  answer.values["exact"] = 0.75 * a * kDuration;                                         // of x = a t^2 / 2
}

struct Verdict {
  std::string method, says;
  double half = kNaN, nine_tenths = kNaN, almost = kNaN, beyond = kNaN;
};

std::vector<Verdict> verdicts_of(const std::vector<Answer>& answers) {
  std::vector<Verdict> verdicts;
  for (const auto& [method, list] : by_method(answers)) {
    Verdict verdict{.method = method, .says = {}};
    const auto [shortest, longest] = step_range_of(list);
    double creep_longest = kNaN;
    for (const Answer& a : list) {
      if (!a.succeeded()) continue;
      const double f = a.condition("fraction"), creep = std::abs(a.value("creep"));
      if (a.h == longest && f == 0.9) creep_longest = creep;
      if (a.h != shortest) continue;
      if (f == 0.5) verdict.half = creep;
      if (f == 0.9) verdict.nine_tenths = creep;
      if (f == 0.99) verdict.almost = creep;
      if (f > 1 && !std::isfinite(verdict.beyond)) verdict.beyond = a.value("creep") / a.value("exact");
    }
    if (std::isfinite(verdict.nine_tenths)) {
      const bool shrinks = verdict.nine_tenths < 0.5 * creep_longest;
      verdict.says = verdict.nine_tenths < kHolds ? "holds"
                     : shrinks                    ? "creeps, less with shorter steps"
                                                  : "creeps, whatever the step";
      if (std::isfinite(verdict.beyond) && !(std::abs(verdict.beyond - 1) < 0.05))
        verdict.says += fmt::format("; beyond the limit it slides at {:.2g} of the right speed", verdict.beyond);
    }
    verdicts.push_back(verdict);
  }
  return verdicts;
}

Table verdict_table(const std::vector<Verdict>& verdicts) {
  static const std::vector<Column<Verdict>> columns = {
      {"method", &Verdict::method},
      {"does friction hold a block on a ramp?", &Verdict::says},
      {"creep at 0.5", "m/s", "{:.1e}", &Verdict::half},
      {"at 0.9", "m/s", "{:.1e}", &Verdict::nine_tenths},
      {"at 0.99 of the cone", "m/s", "{:.1e}", &Verdict::almost},
  };
  return table_of(
      "The answer", columns, verdicts,
      "Creep: mean speed over the second of two seconds, with the shortest step. Holds: creep below 1e-9 m/s at 0.9 of "
      "the steepest slope. The experiment friction_ramp maps correct and wrong decisions for all coefficients and "
      "slopes.");
}

Table hold_details(const std::vector<Answer>& answers) {
  static const std::vector<Column<Answer>> columns = {
      {"method", &Answer::method},
      {"h", "s", "{:.4g}", &Answer::h},
      {"tan(slope) / mu", "", "{:g}", [](const Answer& a) { return a.condition("fraction"); }},
      {"creep", "m/s", "{:.3e}", [](const Answer& a) { return a.value("creep"); }},
      {"exact", "m/s", "{:.3e}", [](const Answer& a) { return a.value("exact"); }},
      {"status", &Answer::status},
      {"command", &Answer::command},
  };
  return table_of("Every run", columns, answers);
}

constexpr double kDrawnZero = 1e-17;  // [m/s]; what is less is drawn there

void show_hold(const Results& results, const std::vector<Answer>& answers, Section& section) {
  section.result("answer", verdict_table(verdicts_of(answers)));
  const Chart::Axis creep_axis{.label = "creep [m/s]", .is_log = true, .from = 1e-18, .to = 10};
  Chart::Panel over_cone{
      .title = "shortest step", .x = {.label = "tan(slope) / μ, up to which it should rest: 1"}, .y = creep_axis};
  Chart::Panel over_step{.title = "at 0.9 of the steepest slope", .x = step_axis(), .y = creep_axis};
  for (const auto& [method, list] : by_method(answers)) {
    const double shortest = step_range_of(list).shortest;
    Chart::Points cone, step;
    for (const Answer& a : list) {
      if (!a.succeeded()) continue;
      const double creep = std::max(kDrawnZero, std::abs(a.value("creep")));
      if (a.h == shortest) cone.emplace_back(a.condition("fraction"), creep);
      if (a.condition("fraction") == 0.9 && a.h > 0) step.emplace_back(a.h, creep);
    }
    over_cone.add(method, question_look(method), Chart::Drawn::both, cone);
    over_step.add(method, question_look(method), Chart::Drawn::both, step);
  }
  over_cone.add("limit", {}, Chart::Drawn::reference, {{1, creep_axis.from}, {1, creep_axis.to}});
  section.chart(
      question_chart(results.experiment(), "How fast a block creeps that should rest",
                     "Left: over the load on friction; grey: the limit. Right: over the step length, shorter "
                     "to the right. Dashed: an engine with default settings; solid: tuned. Speeds below 1e-17 "
                     "m/s are drawn there.",
                     {over_cone, over_step}));
  section.details("runs", hold_details(answers));
}

constexpr const char* kFields = R"~({
  "fractions": {"type": "array", "minItems": 1, "items": {"type": "number", "exclusiveMinimum": 0}, "description": "Slopes, as tan(slope) / mu.", "examples": [[0.5, 0.9, 1.1]]}
})~";

const bool registered = register_question({.kind = "hold",
                                           .summary = "does friction hold, or does a block creep?",
                                           .fields = kFields,
                                           .conditions = hold_conditions,
                                           .measure = measure_hold,
                                           .show = show_hold});

}  // namespace
}  // namespace ricochet::hold
