#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>

#include "bench/studies/questions/question.h"
#include "problems/registry.h"

/// @file
/// Does a ball bounce as high as it should? A ball falls from 1 m above the floor. After its k-th impact it rises to
///
///     h_k = e^(2k) h_0,   h_0 = 0.9 m the way that it falls                                                          (1)
///
/// and the k-th impact is at t_k = t_0 (1 + 2 (e + ... + e^(k-1))), t_0 = sqrt(2 h_0 / g). Below which speed is there no
/// bounce? A ball without weight meets the floor at the speed v, and that v is found by bisection from which on it
/// leaves with e v / 2 at least.

namespace ricochet::bounce {
namespace {

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

/// The highest point after the k-th impact of a motion that is known at steps; nothing where there are fewer impacts.
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
  // Three quarters of the flight after the impact have passed, so the highest point was reached, even if the flight is
  // higher.
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

std::vector<Answer> conditions(const nlohmann::json& experiment) {
  std::vector<Answer> list = answers_for({{"e", experiment.at("restitution")}, {"bounces", experiment.at("bounces")}});
  std::erase_if(list, [](const Answer& a) {
    const double e = a.condition("e"), bounces = a.condition("bounces");
    return height_after(e, static_cast<int>(bounces)) < kLowest && !(e == 0 && bounces == 1);
  });
  list.push_back(answer_under({{"slowest", 1}}));
  return list;
}

void measure(const nlohmann::json&, const Method& method, Answer& answer) {
  if (answer.conditions.contains("slowest"))
    measure_threshold(method, answer);
  else
    measure_height(method, answer);
}

double ratio(const Answer& a) {
  return a.value("exact") > 0 ? a.value("height") / a.value("exact") : std::nan("");
}

bool is(const Answer& a, double e, double bounces) {
  return a.conditions.contains("e") && a.condition("e") == e && a.condition("bounces") == bounces;
}

MethodAnswers::Number ratio_at(double e, double bounces) {
  return [=](const Answer& a) { return is(a, e, bounces) ? ratio(a) : std::nan(""); };
}

/// With e = 1, after the most bounces.
double after_most_bounces(const MethodAnswers& m) {
  double most = 0, found = std::nan("");
  for (const Answer& a : m.answers) {
    if (!a.succeeded() || !a.conditions.contains("e") || a.condition("e") != 1 || a.condition("bounces") < most)
      continue;
    most = a.condition("bounces");
    found = ratio(a);
  }
  return found;
}

std::string sentence(const MethodAnswers& m) {
  const auto deviation = [](const Answer& a) { return std::abs(ratio(a) - 1); };
  const double worst = m.largest(deviation, m.shortest), longest = m.largest(deviation, m.longest);
  if (!std::isfinite(m.first(ratio_at(0.8, 1), m.shortest))) return "";
  return worst < 0.01            ? "right to a percent"
         : worst > 0.5           ? "wrong, however short the step"
         : worst < 0.5 * longest ? "gets better with shorter steps"
                                 : "does not get better with shorter steps";
}

std::string percent(double x) {
  return std::isfinite(x) ? fmt::format("{:.3g} %", 100 * x) : "-";
}

std::string threshold_text(double threshold) {
  return !std::isfinite(threshold) ? "-"
         : threshold == 0          ? "bounces always"
         : threshold >= kFastest   ? "never bounces"
                                   : fmt::format("{:.2g} m/s", threshold);
}

QuestionPanel panel_of(double e, int bounces) {
  return {{.title = fmt::format("e = {}, height after {} bounce{}", e, bounces, bounces > 1 ? "s" : ""),
           .x = step_axis(),
           .y = {.label = "height / exact height", .from = -0.05, .to = 1.6}},
          [=](const Answer& a, const MethodAnswers&) {
            return a.h > 0 && is(a, e, bounces) ? Chart::Points{{a.h, ratio(a)}} : Chart::Points{};
          },
          [](Chart::Panel& p) { p.add_power("exact", 1, 0); }};
}

std::vector<QuestionPanel> panels(const std::vector<Answer>&) {
  return {panel_of(0.8, 1), panel_of(0.9, 10), panel_of(1, 100)};
}

constexpr const char* kFields = R"~({
  "restitution": {"type": "array", "minItems": 1, "items": {"type": "number", "minimum": 0, "maximum": 1}, "description": "Coefficients e.", "examples": [[0.8, 1]]},
  "bounces": {"type": "array", "minItems": 1, "items": {"type": "integer", "minimum": 1}, "description": "Numbers of impacts after which the height is compared, unless it is too low.", "examples": [[1, 10, 100]]}
})~";

const bool registered = register_question(
    {.kind = "bounce",
     .summary = "does a ball bounce as high as it should?",
     .fields = kFields,
     .conditions = conditions,
     .measure = measure,
     .sentence = sentence,
     .columns = {{"e = 0.8, longest step", "", "",
                  [](const MethodAnswers& m) { return m.first(ratio_at(0.8, 1), m.longest); }, percent},
                 {"shortest step", "", "", [](const MethodAnswers& m) { return m.first(ratio_at(0.8, 1), m.shortest); },
                  percent},
                 {"e = 1, most bounces", "", "", after_most_bounces, percent},
                 {"no bounce below", "", "",
                  [](const MethodAnswers& m) {
                    return m.first([](const Answer& a) { return a.value("threshold"); }, m.shortest);
                  },
                  threshold_text}},
     .note =
         "Heights in percent of the exact ones. The verdict uses the worst height with the shortest step, over all "
         "coefficients and numbers of bounces. No bounce below: impact speed above which the ball leaves with at least "
         "half of the exact speed, by bisection with the shortest step.",
     .figure = "How high a ball bounces, over the step length",
     .caption =
         "Height after an impact over the exact height e^(2k) h_0; shorter steps to the right. Settings of tuned engines: "
         "methods/peers/engines/settings/.",
     .panels = panels,
     .details = {{"e", "e", "", "{:g}"},
                 {"bounces", "bounces", "", "{:g}"},
                 {"height", "height", "m", "{:.6g}"},
                 {"exact", "exact", "m", "{:.6g}"},
                 {"threshold", "no bounce below", "m/s", "{:.3g}"}}});

}  // namespace
}  // namespace ricochet::bounce
