#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include "bench/studies/questions/question.h"
#include "problems/registry.h"

/// @file
/// Does a ball bounce as high as it should? A ball falls from 1 m above the floor. Behind its k-th impact it rises to
///
///     h_k = e^(2k) h_0,   h_0 = 0.9 m the way that it falls                                                          (1)
///
/// and the k-th impact is at t_k = t_0 (1 + 2 (e + ... + e^(k-1))), t_0 = sqrt(2 h_0 / g). Below which speed is there no
/// bounce? A ball without weight meets the floor at the speed v, and that v is found by bisection from which on it
/// leaves with e v / 2 at least.

namespace ricochet::bounce {
namespace {

using nlohmann::json;

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
constexpr double kGravity = 9.81, kRadius = 0.1, kFall = 0.9;
constexpr double kLowest = 1e-3;  // [m]; nobody sees bounces that are lower
constexpr int kMostSteps = 200000;
constexpr double kSlowest = 1e-6, kFastest = 10;  // [m/s], between which the bisection looks
constexpr int kBisections = 24;                   // to a factor of 1 + 1e-6
constexpr int kSpeedSteps = 100;                  // enough for a contact of 20 steps
constexpr double kSpeedRestitution = 0.5;

double height_after(double e, int bounces) {
  return kFall * std::pow(e, 2 * bounces);  // (1)
}
double time_of_impact(double e, int k) {
  double sum = 1;
  for (int i = 1; i < k; ++i) sum += 2 * std::pow(e, i);
  return std::sqrt(2 * kFall / kGravity) * sum;
}

/// The highest point behind the k-th impact of a motion that is known at steps; nothing where there are fewer impacts.
std::optional<double> height_in(const std::vector<Sample>& samples, int bounces) {
  int impacts = 0;
  double highest = -1;
  for (std::size_t i = 1; i < samples.size(); ++i) {
    if (samples[i - 1].v_plus[0] < 0 && samples[i].v_plus[0] > 0) ++impacts;
    if (impacts > bounces) break;
    if (impacts == bounces) highest = std::max(highest, samples[i].q[0] - kRadius);
  }
  return highest < 0 ? std::nullopt : std::optional(highest);
}

/// The same of a method that takes steps longer than flights, from its impacts.
std::optional<double> height_in(const std::vector<Event>& events, int bounces) {
  int impacts = 0;
  for (const Event& event : events) {
    if (event.kind == EventKind::impact && ++impacts == bounces)
      return event.v_plus[0] * event.v_plus[0] / (2 * kGravity);
  }
  return std::nullopt;
}

void measure_height(const Method& method, Answer& answer) {
  const double e = answer.condition("e");
  const int bounces = static_cast<int>(answer.condition("bounces"));
  // The flight behind the impact is over for three quarters: it was at its highest point, also of one that is higher.
  const double flight = 2 * std::pow(e, bounces) * std::sqrt(2 * kFall / kGravity);
  const double T = time_of_impact(e, bounces) + 0.75 * (e > 0 ? flight : 0.4);
  answer.values["exact"] = height_after(e, bounces);
  if (answer.h > 0 && T / answer.h > kMostSteps) {
    answer.status = kNotRun;
    answer.message = fmt::format("more than {} steps are left out", kMostSteps);
    return;
  }
  const ProblemChoice ball{.problem = "bouncing_ball", .parameters = {{"e", e}, {"duration", T}}};
  const Solution s = run_for(method, ball, *ball.make_problem(), Recording::grid, answer);
  if (!s.succeeded()) return;
  const auto height = answer.h > 0 ? height_in(s.samples, bounces) : height_in(s.events, bounces);
  answer.values["height"] = height.value_or(std::max(0.0, s.q[0] - kRadius));
}

/// A ball that meets the floor at the speed v leaves it.
bool leaves(const Method& method, const Answer& answer, double v) {
  const double T = kSpeedSteps * (answer.h > 0 ? answer.h : 1e-3);
  const auto ball = make_problem("bouncing_ball", {{"e", kSpeedRestitution}, {"g", 1e-12}, {"duration", T}});
  const double way = 2.5 * v * T / kSpeedSteps;  // met within the third step
  ball->set_initial_state(Vector::Constant(1, kRadius + way), Vector::Constant(1, -v));
  Settings settings;
  settings.recording = Recording::final_state;
  settings.steps = answer.h > 0 ? kSpeedSteps : 0;
  settings.tolerance = answer.setting.tolerance;
  const Solution s = method.solve(*ball, settings);
  return s.succeeded() && s.v[0] >= 0.5 * kSpeedRestitution * v;
}

void measure_threshold(const Method& method, Answer& answer) {
  const auto ball = make_problem("bouncing_ball", {{"e", kSpeedRestitution}});
  if (const Support support = method.can_run(ball->info()); !support.ok) {
    answer.status = "declined";
    answer.message = support.reason;
    return;
  }
  answer.status = "success";
  if (leaves(method, answer, kSlowest)) {
    answer.values["threshold"] = 0;
    return;
  }
  if (!leaves(method, answer, kFastest)) {
    answer.values["threshold"] = kFastest;
    answer.message = "no speed that was tried bounces";
    return;
  }
  double rests = kSlowest, bounces = kFastest;
  for (int k = 0; k < kBisections; ++k) {
    const double middle = std::sqrt(rests * bounces);
    (leaves(method, answer, middle) ? bounces : rests) = middle;
  }
  answer.values["threshold"] = bounces;
}

std::vector<Answer> bounce_conditions(const json& experiment) {
  std::vector<Answer> conditions;
  for (const double e : experiment.at("restitution").get<std::vector<double>>()) {
    for (const int bounces : experiment.at("bounces").get<std::vector<int>>()) {
      if (height_after(e, bounces) < kLowest && !(e == 0 && bounces == 1)) continue;
      Answer& answer = conditions.emplace_back();
      answer.conditions = {{"e", e}, {"bounces", bounces}};
    }
  }
  conditions.emplace_back().conditions = {{"slowest", 1}};
  return conditions;
}

void measure_bounce(const json&, const Method& method, Answer& answer) {
  if (answer.conditions.contains("slowest"))
    measure_threshold(method, answer);
  else
    measure_height(method, answer);
}

bool is(const Answer& answer, double e, int bounces) {
  return answer.conditions.contains("e") && answer.condition("e") == e && answer.condition("bounces") == bounces;
}

/// What is said of a method.
struct Verdict {
  std::string method;
  double at_60 = kNaN, finest = kNaN;  ///< height over what is right, e = 0.8 after a bounce
  double many = kNaN;                  ///< the same with e = 1 after the most bounces
  double worst = 0;                    ///< deviation at the shortest step, of all e
  double threshold = kNaN;
  std::string says;
};

std::string percent(double ratio) {
  return std::isfinite(ratio) ? fmt::format("{:.3g} %", 100 * ratio) : "-";
}

std::vector<Verdict> verdicts_of(const std::vector<Answer>& answers) {
  std::vector<Verdict> verdicts;
  for (const auto& [method, list] : by_method(answers)) {
    Verdict verdict{.method = method, .says = {}};
    const auto [shortest, longest] = step_range_of(list);
    int most = 0;
    double deviation_of_longest = 0;
    for (const Answer& a : list) {
      if (a.conditions.contains("slowest")) {
        if (a.h == shortest) verdict.threshold = a.value("threshold");
        continue;
      }
      if (!a.succeeded() || !(a.value("exact") > 0)) continue;
      const double ratio = a.value("height") / a.value("exact");
      if (is(a, 0.8, 1) && a.h == longest) verdict.at_60 = ratio;
      if (is(a, 0.8, 1) && a.h == shortest) verdict.finest = ratio;
      if (a.condition("e") == 1 && a.condition("bounces") >= most) {
        most = static_cast<int>(a.condition("bounces"));
        verdict.many = ratio;
      }
      if (a.h == shortest) verdict.worst = std::max(verdict.worst, std::abs(ratio - 1));
      if (a.h == longest) deviation_of_longest = std::max(deviation_of_longest, std::abs(ratio - 1));
    }
    if (std::isfinite(verdict.finest)) {
      verdict.says = verdict.worst < 0.01                         ? "right to a percent"
                     : verdict.worst > 0.5                        ? "wrong, however short the step"
                     : verdict.worst < 0.5 * deviation_of_longest ? "gets better with shorter steps"
                                                                  : "does not get better with shorter steps";
    }
    verdicts.push_back(verdict);
  }
  return verdicts;
}

Table verdict_table(const std::vector<Verdict>& verdicts) {
  static const std::vector<Column<Verdict>> columns = {
      {"method", &Verdict::method},
      {"does a ball bounce as high as it should?", &Verdict::says},
      {"e = 0.8, longest step", [](const Verdict& v) { return percent(v.at_60); }},
      {"shortest step", [](const Verdict& v) { return percent(v.finest); }},
      {"e = 1, most bounces", [](const Verdict& v) { return percent(v.many); }},
      {"no bounce below",
       [](const Verdict& v) {
         return !std::isfinite(v.threshold) ? "-"
                : v.threshold == 0          ? std::string("bounces always")
                : v.threshold >= kFastest   ? std::string("never bounces")
                                            : fmt::format("{:.2g} m/s", v.threshold);
       }},
  };
  return table_of(
      "The answer", columns, verdicts,
      "Heights in percent of the exact ones. The verdict uses the worst height with the shortest step, over all "
      "coefficients and numbers of bounces. No bounce below: impact speed above which the ball leaves with at least "
      "half of the exact speed, by bisection with the shortest step.");
}

Table bounce_details(const std::vector<Answer>& answers) {
  static const std::vector<Column<Answer>> columns = {
      {"method", &Answer::method},
      {"h", "s", "{:.4g}", &Answer::h},
      {"e", "", "{:g}",
       [](const Answer& a) {
         return when(a.conditions.contains("e"), a.conditions.contains("e") ? a.conditions.at("e") : 0);
       }},
      {"bounces", "", "{:g}",
       [](const Answer& a) {
         return when(a.conditions.contains("e"), a.conditions.contains("e") ? a.conditions.at("bounces") : 0);
       }},
      {"height", "m", "{:.6g}", [](const Answer& a) { return a.value("height"); }},
      {"exact", "m", "{:.6g}", [](const Answer& a) { return a.value("exact"); }},
      {"no bounce below", "m/s", "{:.3g}", [](const Answer& a) { return a.value("threshold"); }},
      {"status", &Answer::status},
      {"command", &Answer::command},
  };
  return table_of("Every run", columns, answers);
}

Chart::Panel panel_of(const std::vector<Answer>& answers, double e, int bounces) {
  constexpr double kHighest = 1.6;
  Chart::Panel panel{.title = fmt::format("e = {}, height after {} bounce{}", e, bounces, bounces > 1 ? "s" : ""),
                     .x = step_axis(),
                     .y = {.label = "height / exact height", .from = -0.05, .to = kHighest}};
  for (const auto& [method, list] : by_method(answers)) {
    Chart::Points points;
    for (const Answer& a : list) {
      if (a.h > 0 && is(a, e, bounces) && a.succeeded())
        points.emplace_back(a.h, std::min(kHighest, a.value("height") / a.value("exact")));
    }
    panel.add(method, question_look(method), Chart::Drawn::both, points);
  }
  panel.add_power("exact", 1, 0);
  return panel;
}

void show_bounce(const Results& results, const std::vector<Answer>& answers, Section& section) {
  section.result("answer", verdict_table(verdicts_of(answers)));
  section.chart(question_chart(
      results.experiment(), "How high a ball bounces, over the step length",
      "Height after an impact over the exact height e^(2k) h_0; shorter steps to the right. Dashed: an engine with default "
      "settings; solid: tuned, settings in methods/peers/engines/settings/. Ratios above 1.6 are drawn at 1.6.",
      {panel_of(answers, 0.8, 1), panel_of(answers, 0.9, 10), panel_of(answers, 1, 100)}));
  section.details("runs", bounce_details(answers));
}

constexpr const char* kFields = R"~({
  "restitution": {"type": "array", "minItems": 1, "items": {"type": "number", "minimum": 0, "maximum": 1}, "description": "Coefficients e.", "examples": [[0.8, 1]]},
  "bounces": {"type": "array", "minItems": 1, "items": {"type": "integer", "minimum": 1}, "description": "Impacts behind which the height is compared, where it is not too low.", "examples": [[1, 10, 100]]}
})~";

const bool registered = register_question({.kind = "bounce",
                                           .summary = "does a ball bounce as high as it should?",
                                           .fields = kFields,
                                           .conditions = bounce_conditions,
                                           .measure = measure_bounce,
                                           .show = show_bounce});

}  // namespace
}  // namespace ricochet::bounce
