#include <algorithm>
#include <cmath>

#include "bench/studies/questions/question.h"

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

constexpr double kGravity = 9.81;
constexpr double kStays = 1e-9;  // [m]

std::vector<Answer> conditions(const nlohmann::json& experiment) {
  return answers_for({{"mu", experiment.at("friction")}, {"v", experiment.at("speeds")}});
}

void measure(const nlohmann::json&, const Method& method, Answer& answer) {
  const double mu = answer.condition("mu"), v = answer.condition("v");
  const double duration = 0.5 * v / (mu * kGravity);  // half of the time until it stops
  const ProblemChoice choice{.problem = "sliding_block",
                             .parameters = {{"mu", mu}, {"v_x0", v}, {"duration", duration}}};
  const auto block = choice.make_problem();
  const Solution s = run_for(method, choice, *block, Recording::grid, answer);
  if (!s.succeeded()) return;
  double& lift = answer.values["lift"] = answer.values["gap"] = std::max(0.0, block->gap(s.q)[0]);
  for (const Sample& sample : s.samples) lift = std::max(lift, block->gap(sample.q)[0]);
  answer.values["h mu v"] = answer.h * mu * std::abs(s.v[0]);  // (1) at the end
  const double v_n = mu * v / (1 + mu * mu);
  answer.values["throw"] = v_n * v_n / (2 * kGravity);  // (2)
}

double lift_of(const Answer& a) {
  return a.value("lift");
}

std::string sentence(const MethodAnswers& m) {
  const double shortest = m.largest(lift_of, m.shortest), longest = m.largest(lift_of, m.longest);
  if (!std::isfinite(shortest)) return "";
  if (std::fmax(shortest, longest) < kStays) return "stays on the floor";
  return shortest > 0.3 * longest ? "lifts off, however short the step" : "lifts off, less with shorter steps";
}

std::vector<QuestionPanel> panels(const std::vector<Answer>&) {
  const Chart::Axis height{.label = "highest point [m]", .is_log = true, .from = 1e-18, .to = 10};
  const auto thrown = [](const Answer& a) { return a.value("throw"); };
  return {{{.title = "shortest step", .x = {.label = "(μ v / (1 + μ²))² / (2 g) [m]", .is_log = true}, .y = height},
           [=](const Answer& a, const MethodAnswers& m) {
             return a.h == m.shortest ? Chart::Points{{thrown(a), lift_of(a)}} : Chart::Points{};
           },
           [](Chart::Panel& p) { p.add_power("thrown up by a convex relaxation", 1, 1); }},
          {{.title = "largest μ and v", .x = step_axis(), .y = height}, [=](const Answer& a, const MethodAnswers& m) {
             const bool is_drawn = a.h > 0 && thrown(a) == std::fmax(m.largest(thrown, a.h), thrown(a));
             return is_drawn ? Chart::Points{{a.h, lift_of(a)}} : Chart::Points{};
           }}};
}

constexpr const char* kFields = R"~({
  "friction": {"type": "array", "minItems": 1, "items": {"type": "number", "exclusiveMinimum": 0}, "description": "Coefficients mu.", "examples": [[0.5]]},
  "speeds": {"type": "array", "minItems": 1, "items": {"type": "number", "exclusiveMinimum": 0}, "description": "At the start [m/s].", "examples": [[1, 6]]}
})~";

const bool registered = register_question(
    {.kind = "lift",
     .summary = "does a sliding block lift off?",
     .fields = kFields,
     .conditions = conditions,
     .measure = measure,
     .sentence = sentence,
     .columns = {{"highest, longest step", "m", "{:.1e}",
                  [](const MethodAnswers& m) { return m.largest(lift_of, m.longest); }},
                 {"shortest step", "m", "{:.1e}",
                  [](const MethodAnswers& m) { return m.largest(lift_of, m.shortest); }}},
     .note =
         "Stays: no gap exceeds 1e-9 m at the end of a step. Highest: over all coefficients and speeds. With a convex "
         "relaxation a sliding block hovers at h mu v. A block that is set on the floor at speed v is thrown up by v_n^2 "
         "/ (2 g) with v_n = mu v / (1 + mu^2).",
     .figure = "How high a block rises that should slide",
     .caption =
         "Left: over the height that a convex relaxation of Coulomb's law gives a block that is set on the floor. Right: "
         "over the step length, shorter to the right.",
     .panels = panels,
     .details = {{"mu", "mu", "", "{:g}"},
                 {"v", "v", "m/s", "{:g}"},
                 {"lift", "highest", "m", "{:.3e}"},
                 {"throw", "thrown by", "m", "{:.3e}"},
                 {"gap", "gap at the end", "m", "{:.3e}"},
                 {"h mu v", "h mu v", "m", "{:.3e}"}}});

}  // namespace
}  // namespace ricochet::lift
