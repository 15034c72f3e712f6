#include <fmt/format.h>

#include <cmath>

#include "bench/studies/questions/question.h"

/// @file
/// Does friction hold? A block rests on a ramp whose slope is a fraction f of the steepest on which it stays at rest,
///
///     tan(slope) = f mu,   at rest for f <= 1;  a = g (sin(slope) - mu cos(slope)) for f > 1                         (1)
///
/// Its creep is its mean speed over the second half of the run.

namespace ricochet::hold {
namespace {

constexpr double kMu = 0.5, kGravity = 9.81, kDuration = 2;
constexpr double kHolds = 1e-9;  // [m/s], a tenth of a millimetre in a day

std::vector<Answer> conditions(const nlohmann::json& experiment) {
  return answers_for({{"fraction", experiment.at("fractions")}});
}

void measure(const nlohmann::json&, const Method& method, Answer& answer) {
  const double slope = std::atan(answer.condition("fraction") * kMu);
  const ProblemChoice ramp{.problem = "block_on_ramp",
                           .parameters = {{"mu", kMu}, {"slope", slope}, {"v_x0", 0}, {"duration", kDuration}}};
  const Solution s = run_for(method, ramp, *ramp.make_problem(), Recording::motion, answer);
  if (!s.succeeded()) return;
  answer.values["creep"] = (s.q[0] - position_at(s, kDuration / 2)[0]) / (kDuration / 2);
  const double a = std::max(0.0, kGravity * (std::sin(slope) - kMu * std::cos(slope)));  // (1)
  answer.values["exact"] = 0.75 * a * kDuration;                                         // of x = a t^2 / 2
}

double creep(const Answer& a) {
  return std::abs(a.value("creep"));
}

MethodAnswers::Number creep_at(double f) {
  return [f](const Answer& a) { return a.condition("fraction") == f ? creep(a) : std::nan(""); };
}

std::string sentence(const MethodAnswers& m) {
  const double finest = m.first(creep_at(0.9), m.shortest);
  const double beyond = m.first(
      [](const Answer& a) { return a.condition("fraction") > 1 ? a.value("creep") / a.value("exact") : std::nan(""); },
      m.shortest);
  if (!std::isfinite(finest)) return "";
  const bool shrinks = finest < 0.5 * m.first(creep_at(0.9), m.longest);
  std::string text = finest < kHolds ? "holds"
                     : shrinks       ? "creeps, less with shorter steps"
                                     : "creeps, whatever the step";
  if (std::isfinite(beyond) && !(std::abs(beyond - 1) < 0.05))
    text += fmt::format("; beyond the limit it slides at {:.2g} of the right speed", beyond);
  return text;
}

AnswerColumn column(const char* header, double f) {
  return {header, "m/s", "{:.1e}", [f](const MethodAnswers& m) { return m.first(creep_at(f), m.shortest); }};
}

std::vector<QuestionPanel> panels(const std::vector<Answer>&) {
  const Chart::Axis speed{.label = "creep [m/s]", .is_log = true, .from = 1e-18, .to = 10};
  return {{{.title = "shortest step", .x = {.label = "tan(slope) / μ, up to which it should rest: 1"}, .y = speed},
           [](const Answer& a, const MethodAnswers& m) {
             return a.h == m.shortest ? Chart::Points{{a.condition("fraction"), creep(a)}} : Chart::Points{};
           },
           [](Chart::Panel& p) {
             p.add("limit", {}, Chart::Drawn::reference, {{1, p.y.from}, {1, p.y.to}});
           }},
          {{.title = "at 0.9 of the steepest slope", .x = step_axis(), .y = speed},
           [](const Answer& a, const MethodAnswers&) {
             const bool is_drawn = a.condition("fraction") == 0.9 && a.h > 0;
             return is_drawn ? Chart::Points{{a.h, creep(a)}} : Chart::Points{};
           }}};
}

constexpr const char* kFields = R"~({
  "fractions": {"type": "array", "minItems": 1, "items": {"type": "number", "exclusiveMinimum": 0}, "description": "Slopes, as tan(slope) / mu.", "examples": [[0.5, 0.9, 1.1]]}
})~";

const bool registered = register_question(
    {.kind = "hold",
     .summary = "does friction hold, or does a block creep?",
     .fields = kFields,
     .conditions = conditions,
     .measure = measure,
     .sentence = sentence,
     .columns = {column("creep at 0.5", 0.5), column("at 0.9", 0.9), column("at 0.99 of the cone", 0.99)},
     .note =
         "Creep: mean speed over the second of two seconds, with the shortest step. Holds: creep below 1e-9 m/s at 0.9 of "
         "the steepest slope. The experiment friction_ramp maps correct and wrong decisions for all coefficients and "
         "slopes.",
     .figure = "How fast a block creeps that should rest",
     .caption = "Left: over the load on friction; grey: the limit. Right: over the step length, shorter to the right.",
     .panels = panels,
     .details = {{"fraction", "tan(slope) / mu", "", "{:g}"},
                 {"creep", "creep", "m/s", "{:.3e}"},
                 {"exact", "exact", "m/s", "{:.3e}"}}});

}  // namespace
}  // namespace ricochet::hold
