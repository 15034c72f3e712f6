#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>

#include "bench/experiment/experiment_file.h"
#include "bench/measure/data_folder.h"
#include "bench/measure/problem_choice.h"
#include "bench/studies/questions/question.h"
#include "methods/initial_state.h"
#include "problems/initial_state.h"
#include "problems/input_error.h"
#include "problems/scene_file/scene_file.h"

/// @file
/// Question: what do methods do with bodies that overlap at the start? At rest, with a depth d, their state violates the
/// laws of contact: 0 <= f_c does not hold, and no motion begins there. A method can do one of the following:
///
///   - reject it; this program does, and `--allow-penetration` moves the bodies to the nearest state without overlap, in
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
  std::vector<Answer> list;
  for (const Scene& scene : kScenes) {
    for (const Answer& answer : answers_for({{"depth", experiment.at("depths")}}))
      list.push_back(answer_under(answer.conditions, scene.name));
  }
  return list;
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

/// Outcome of a method on a scene, the worst last.
enum class Ending { rests, rests_apart, partly_left, kept, thrown, failed };

Ending ending_of(const Answer& a) {
  if (!a.succeeded()) return Ending::failed;
  const double depth = a.condition("depth"), left = a.value("left") / depth;
  if (a.value("apart") > kLittle * depth)  // an engine may keep a distance, too
    return a.value("speed") > kLittle * depth / kDuration ? Ending::thrown : Ending::rests_apart;
  return left > 1 - kLittle ? Ending::kept : left > kLittle ? Ending::partly_left : Ending::rests;
}

double apart(const Answer& a) {
  return a.value("apart");
}
double speed(const Answer& a) {
  return a.value("speed");
}
double left_over(const Answer& a) {
  return a.value("left") / a.condition("depth");
}

std::string sentence(const MethodAnswers& m) {
  const std::vector<Answer>& list = m.answers;
  const double shortest = m.largest(apart, m.shortest), longest = m.largest(apart, m.longest);
  if (list.front().status == "not_built") return "not built";
  if (list.front().status == "declined") return "has no such scenes";
  const char* thrown = shortest > 2 * longest     ? "throws them apart, farther with shorter steps"
                       : shortest < 0.5 * longest ? "throws them apart, less with shorter steps"
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

/// Largest of all steps.
double largest_left(const MethodAnswers& m) {
  double left = kNaN;
  for (const Answer& a : m.answers) {
    if (a.succeeded()) left = std::fmax(left, left_over(a));
  }
  return left;
}

AnswerColumn largest(const char* header, const char* unit, double (*number)(const Answer&), bool with_shortest) {
  return {header, unit, "{:.1e}",
          [=](const MethodAnswers& m) { return m.largest(number, with_shortest ? m.shortest : m.longest); }};
}

/// The depth in the middle is drawn.
std::vector<QuestionPanel> panels(const std::vector<Answer>& answers) {
  auto depths = different(answers, [](const Answer& a) { return a.condition("depth"); });
  std::ranges::sort(depths);
  const double depth = depths.empty() ? 0 : depths[depths.size() / 2];
  const auto is_drawn = [=](const Answer& a, const Scene& scene) {
    const Ending ending = ending_of(a);
    return a.scene == scene.name && a.condition("depth") == depth && ending != Ending::kept && ending != Ending::failed;
  };
  return {{{.title = fmt::format("a ball {:g} mm in the floor, longest step", 1000 * depth),
            .x = {.label = "time [s]", .is_log = true},
            .y = {.label = "gap / depth", .from = -1.1, .to = 2}},
           [=](const Answer& a, const MethodAnswers& m) {
             Chart::Points points;
             for (int k = 0; k < kPlaces && a.h == m.longest && is_drawn(a, kScenes[0]); ++k)
               points.emplace_back(time_of_place(k), a.value(name_of_place(k)) / depth);
             return points;
           },
           [](Chart::Panel& p) { p.add_power("touching at rest; depth / step", 0, 0); }},
          {{.title = "two balls, the same depth",
            .x = step_axis(),
            .y = {.label = "speed of parting [m/s]", .is_log = true, .from = 1e-6, .to = 1e3}},
           [=](const Answer& a, const MethodAnswers&) {
             return a.h > 0 && is_drawn(a, kScenes[1]) ? Chart::Points{{a.h, speed(a)}} : Chart::Points{};
           },
           [=](Chart::Panel& p) { p.add_power("", depth, -1); }}};
}

constexpr const char* kNote =
    "They begin at rest, and where they touch they should be at rest: on the floor, or beside each other without weight. "
    "Left: part of the depth that is left after one second. Apart, speed: the widest gap and the fastest parting during "
    "the run; each is the largest over all scenes and depths. Moves them apart, to rest: less than 1 % of the depth is "
    "left, and no gap exceeded that. Keeps: 99 % are left. The worst depth and step of a scene count. Energy gained: the "
    "most above that of the nearest state without overlap, at rest.";

constexpr const char* kFields = R"~({
  "depths": {"type": "array", "minItems": 1, "items": {"type": "number", "exclusiveMinimum": 0, "exclusiveMaximum": 0.1}, "description": "Of the overlap [m], less than a radius.", "examples": [[0.01]]}
})~";

const bool registered = register_question(
    {.kind = "overlap",
     .summary = "what becomes of bodies that overlap at the start?",
     .fields = kFields,
     .conditions = overlap_conditions,
     .measure = measure_overlap,
     .sentence = sentence,
     .columns = {{"left", "", "{:.2g}", largest_left},
                 largest("apart, longest step", "m", apart, false),
                 largest("shortest step", "m", apart, true),
                 largest("speed, longest step", "m/s", speed, false),
                 largest("shortest step", "m/s", speed, true)},
     .note = kNote,
     .figure = "How bodies that overlap at the start come apart",
     .caption =
         "Left: the gap over time, in depths; at 0 they touch. Right: the speed at which two balls without weight part, "
         "over the step length, shorter to the right; grey: depth / step. A run that fails, or keeps the overlap, has no "
         "curve.",
     .panels = panels,
     .details = {{"depth", "depth", "m", "{:g}"},
                 {"left", "left", "m", "{:.3e}"},
                 {"apart", "apart", "m", "{:.3e}"},
                 {"speed", "speed", "m/s", "{:.3e}"},
                 {"gained", "energy gained", "J", "{:.3e}"}}});

}  // namespace
}  // namespace ricochet::overlap
