#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>

#include "bench/experiment/experiment_file.h"
#include "bench/measure/problem_choice.h"
#include "bench/studies/questions/question.h"
#include "methods/initial_state.h"
#include "problems/initial_state.h"
#include "problems/input_error.h"
#include "problems/scene_file/scene_file.h"

/// @file
/// What becomes of bodies that overlap at the start? At rest, by a depth d, they are in a state that the laws of contact
/// do not have: 0 <= f_c is violated, and no motion begins there. What is known of it is what a method can do:
///
///   - say so; this program does, `--allow-penetration` moves the bodies to the nearest state without overlap, in
///     the norm of M, and there they rest;
///   - keep it: laws of velocities, 0 <= J_n' v _|_ lambda_n >= 0, ask nothing of a depth                            (1)
///   - remove it in a step of h seconds. Where a velocity is a difference of positions, v = (q_{k+1} - q_k) / h, bodies
///     then part with
///
///         d / h,                                                                                                    (2)
///
///     the faster the shorter the step, or with that times the part of d that a step removes; a velocity of its own
///     for that, which ends with the step, leaves them at rest;
///   - push it out by a spring, or at a rate: slower than (2), and what remains of that speed parts them.

namespace ricochet::overlap {
namespace {

using nlohmann::json;

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
constexpr double kDuration = 1, kRadius = 0.1;
constexpr double kLittle = 0.01;  // of a depth
constexpr int kPlaces = 17;       // of a gap over time, eight for each factor of ten

struct Scene {
  const char *name, *problem;
};
constexpr Scene kScenes[] = {
    {"ball in the floor", "bouncing_ball"},
    {"two balls", "bench/experiments/scenes/overlapping_balls.json"},
    {"two boxes", "bench/experiments/scenes/overlapping_boxes.json"},
};

std::vector<Answer> overlap_conditions(const json& experiment) {
  std::vector<Answer> conditions;
  for (const Scene& scene : kScenes) {
    for (const double depth : experiment.at("depths").get<std::vector<double>>()) {
      Answer& answer = conditions.emplace_back();
      answer.scene = scene.name;
      answer.conditions = {{"depth", depth}};
    }
  }
  return conditions;
}

ProblemChoice choice_of(const std::string& scene, double depth) {
  ProblemChoice choice;
  choice.problem = std::ranges::find(kScenes, scene, &Scene::name)->problem;
  choice.parameters = {{"depth", depth}};
  if (!choice.is_scene_file()) choice.parameters = {{"e", 0}, {"duration", kDuration}, {"height", kRadius - depth}};
  return choice;
}

/// @param most  that it may overlap [m]
std::unique_ptr<Problem> made(const ProblemChoice& choice, double most) {
  return choice.is_scene_file() ? read_scene_file(find_project_file(choice.problem), choice.parameters, most)
                                : make_problem(choice.problem, choice.parameters, most);
}

double time_of_place(int k) {
  return kDuration * std::pow(10, (k - kPlaces + 1) / 8.0);
}
std::string name_of_place(int k) {
  return fmt::format("gap at {:.4f} s", time_of_place(k));
}

void measure_overlap(const json&, const Method& method, Answer& answer) {
  const double depth = answer.condition("depth"), most = 2 * depth;  // beyond any rounding of it
  const ProblemChoice choice = choice_of(answer.scene, depth);
  const auto problem = made(choice, most);
  answer.options = fmt::format("--keep-penetration {}", most);
  const Solution s = run_for(method, choice, *problem, Recording::motion, answer);
  if (!answer.succeeded()) return;
  const auto energy = [&](const Vector& q, const Vector& v) {
    return problem->energy(q, v).value_or(problem->kinetic_energy(q, v));
  };
  const auto touching = project_initial_state(made(choice, most)).problem;
  const double at_rest = energy(touching->info().q0, touching->info().v0);
  double apart = 0, speed = 0, gained = 0;
  const auto see = [&](const Vector& q, const Vector& v) {
    apart = std::max(apart, problem->gap(q)[0]);
    speed = std::max(speed, problem->normal_jacobian(q).col(0).dot(v));
    gained = std::max(gained, energy(q, v) - at_rest);
  };
  for (const Sample& sample : s.samples) see(sample.q, sample.v_plus);
  see(s.q, s.v);
  for (int k = 0; k < kPlaces; ++k) {
    const double gap = problem->gap(position_at(s, time_of_place(k)))[0];
    answer.values[name_of_place(k)] = gap;
    apart = std::max(apart, gap);  // of a method that tells no samples, but a motion
  }
  answer.values["left"] = std::max(0.0, -problem->gap(s.q)[0]);
  answer.values["apart"] = apart;
  answer.values["speed"] = speed;
  answer.values["gained"] = gained;
}

struct Verdict {
  std::string method, says;
  double left = kNaN;  ///< of the depth, largest of all runs
  double apart_longest = kNaN, apart_shortest = kNaN, speed_longest = kNaN, speed_shortest = kNaN;
};

/// What a method makes of a scene, the worst last.
enum class Ending { rests, rests_apart, partly_left, kept, thrown, failed };

Ending ending_of(const Answer& a) {
  if (!a.succeeded()) return Ending::failed;
  const double depth = a.condition("depth"), left = a.value("left") / depth;
  if (a.value("apart") > kLittle * depth)  // an engine may keep a distance, too
    return a.value("speed") > kLittle * depth / kDuration ? Ending::thrown : Ending::rests_apart;
  return left > 1 - kLittle ? Ending::kept : left > kLittle ? Ending::partly_left : Ending::rests;
}

std::string words_of(const Verdict& verdict, const std::vector<Answer>& list) {
  if (list.front().status == "not_built") return "not built";
  if (list.front().status == "declined") return "has no such scenes";
  const char* thrown =
      verdict.apart_shortest > 2 * verdict.apart_longest     ? "throws them apart, farther with shorter steps"
      : verdict.apart_shortest < 0.5 * verdict.apart_longest ? "throws them apart, less with shorter steps"
                                                             : "throws them apart";
  const std::pair<Ending, const char*> words[] = {{Ending::thrown, thrown},
                                                  {Ending::kept, "keeps the overlap"},
                                                  {Ending::partly_left, "moves them apart, but for a part"},
                                                  {Ending::rests_apart, "moves them apart, and farther"},
                                                  {Ending::rests, "moves them apart, to rest"},
                                                  {Ending::failed, "fails"}};
  std::map<std::string, Ending> worst;
  for (const Answer& a : list) {
    const auto [at, is_new] = worst.try_emplace(a.scene, ending_of(a));
    if (!is_new) at->second = std::max(at->second, ending_of(a));
  }
  std::vector<std::string> parts;
  for (const auto& [ending, what] : words) {
    std::vector<std::string> scenes;
    for (const Scene& scene : kScenes) {
      const auto known = worst.find(scene.name);  // none in results that are not complete
      if (known != worst.end() && known->second == ending) scenes.push_back(scene.name);
    }
    if (scenes.size() == std::size(kScenes)) return what;
    if (!scenes.empty()) parts.push_back(fmt::format("{} ({})", what, fmt::join(scenes, ", ")));
  }
  return fmt::format("{}", fmt::join(parts, "; "));
}

std::vector<Verdict> verdicts_of(const std::vector<Answer>& answers) {
  std::vector<Verdict> verdicts;
  for (const auto& [method, list] : by_method(answers)) {
    Verdict verdict{.method = method, .says = {}};
    const auto [shortest, longest] = step_range_of(list);
    for (const Answer& a : list) {
      if (!a.succeeded()) continue;
      verdict.left = std::fmax(verdict.left, a.value("left") / a.condition("depth"));
      if (a.h == longest) {
        verdict.apart_longest = std::fmax(verdict.apart_longest, a.value("apart"));
        verdict.speed_longest = std::fmax(verdict.speed_longest, a.value("speed"));
      }
      if (a.h == shortest) {
        verdict.apart_shortest = std::fmax(verdict.apart_shortest, a.value("apart"));
        verdict.speed_shortest = std::fmax(verdict.speed_shortest, a.value("speed"));
      }
    }
    verdict.says = words_of(verdict, list);
    verdicts.push_back(verdict);
  }
  return verdicts;
}

Table verdict_table(const std::vector<Verdict>& verdicts) {
  static const std::vector<Column<Verdict>> columns = {
      {"method", &Verdict::method},
      {"what becomes of bodies that overlap at the start?", &Verdict::says},
      {"left", "", "{:.2g}", &Verdict::left},
      {"apart, longest step", "m", "{:.1e}", &Verdict::apart_longest},
      {"shortest step", "m", "{:.1e}", &Verdict::apart_shortest},
      {"speed, longest step", "m/s", "{:.1e}", &Verdict::speed_longest},
      {"shortest step", "m/s", "{:.1e}", &Verdict::speed_shortest},
  };
  return table_of(
      "The answer", columns, verdicts,
      "They begin at rest, and where they touch they should be at rest: on the floor, or beside each other "
      "without weight. Left: of the depth, behind one second. Apart, speed: the widest gap and the fastest "
      "parting on the way; each is the largest of all scenes and depths. To rest: less than 1 % of the depth "
      "is left, and no gap was wider. Keeps: 99 % are left. Of a scene the worst of its depths and steps "
      "counts. What fails says why, below.");
}

Table overlap_details(const std::vector<Answer>& answers) {
  static const std::vector<Column<Answer>> columns = {
      {"method", &Answer::method},
      {"scene", &Answer::scene},
      {"h", "s", "{:.4g}", &Answer::h},
      {"depth", "m", "{:g}", [](const Answer& a) { return a.condition("depth"); }},
      {"left", "m", "{:.3e}", [](const Answer& a) { return a.value("left"); }},
      {"apart", "m", "{:.3e}", [](const Answer& a) { return a.value("apart"); }},
      {"speed", "m/s", "{:.3e}", [](const Answer& a) { return a.value("speed"); }},
      {"depth / h", "m/s", "{:.3e}", [](const Answer& a) { return a.h > 0 ? a.condition("depth") / a.h : kNaN; }},
      {"energy gained", "J", "{:.3e}", [](const Answer& a) { return a.value("gained"); }},
      {"status", &Answer::status},
      {"command", &Answer::command},
  };
  return table_of("Every run", columns, answers,
                  "Energy gained: the most that a run has above that of the nearest state without overlap, at rest.");
}

void show_overlap(const Results& results, const std::vector<Answer>& answers, Section& section) {
  section.result("answer", verdict_table(verdicts_of(answers)));
  constexpr double kDrawnZero = 1e-6;  // [m/s]
  // The depth in the middle is drawn.
  std::vector<double> depths;
  for (const Answer& a : answers) {
    if (std::ranges::find(depths, a.condition("depth")) == depths.end()) depths.push_back(a.condition("depth"));
  }
  std::ranges::sort(depths);
  const double depth = depths.empty() ? 0 : depths[depths.size() / 2];
  Chart::Panel over_time{.title = fmt::format("a ball {:g} mm in the floor, longest step", 1000 * depth),
                         .x = {.label = "time [s]", .is_log = true},
                         .y = {.label = "gap / depth", .from = -1.1, .to = 2}};
  Chart::Panel over_step{.title = "two balls, the same depth",
                         .x = step_axis(),
                         .y = {.label = "speed of parting [m/s]", .is_log = true, .from = 5e-7, .to = 1e3}};
  for (const auto& [method, list] : by_method(answers)) {
    const double longest = step_range_of(list).longest;
    Chart::Points time, step;
    for (const Answer& a : list) {
      const Ending ending = ending_of(a);
      if (a.condition("depth") != depth || ending == Ending::kept || ending == Ending::failed) continue;
      if (a.scene == kScenes[1].name && a.h > 0) step.emplace_back(a.h, std::max(kDrawnZero, a.value("speed")));
      if (a.scene != kScenes[0].name || a.h != longest) continue;
      for (int k = 0; k < kPlaces; ++k) time.emplace_back(time_of_place(k), a.value(name_of_place(k)) / depth);
    }
    std::ranges::sort(step);
    over_time.add(method, question_look(method), Chart::Drawn::both, time);
    over_step.add(method, question_look(method), Chart::Drawn::both, step);
  }
  over_time.add_power("touching at rest; depth / step", 0, 0);
  over_step.add_power("", depth, -1);
  section.chart(question_chart(
      results.experiment(), "How bodies that overlap at the start come apart",
      "Left: the gap over time, in depths; at 0 they touch. Right: the speed at which two balls without weight part, over "
      "the step length, shorter to the right; grey: depth / step; speeds below 1e-6 m/s are drawn there. Dashed: an "
      "engine with default settings; solid: tuned. A run that fails, or keeps the overlap, has no curve.",
      {over_time, over_step}));
  section.details("runs", overlap_details(answers));
}

constexpr const char* kFields = R"~({
  "depths": {"type": "array", "minItems": 1, "items": {"type": "number", "exclusiveMinimum": 0, "exclusiveMaximum": 0.1}, "description": "Of the overlap [m], less than a radius.", "examples": [[0.01]]}
})~";

const bool registered = register_question({.kind = "overlap",
                                           .summary = "what becomes of bodies that overlap at the start?",
                                           .fields = kFields,
                                           .conditions = overlap_conditions,
                                           .measure = measure_overlap,
                                           .show = show_overlap});

}  // namespace
}  // namespace ricochet::overlap
