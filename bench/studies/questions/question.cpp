#include "bench/studies/questions/question.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "bench/rows/progress.h"
#include "bench/studies/study.h"
#include "methods/method_spec.h"
#include "methods/registry.h"
#include "problems/input_error.h"

namespace ricochet {
namespace {

using nlohmann::json;

constexpr double kPatience = 20;  // [s] of a run, where the experiment says nothing

constexpr const char* kFieldsOfQuestions = R"~({
  "methods": {"type": "array", "minItems": 1, "items": {"$ref": "#/$defs/method"}, "description": "That are asked; one that is not built is listed as such.", "examples": [["moreau_jean"]]},
  "step_lengths": {"type": "array", "minItems": 1, "items": {"type": "number", "exclusiveMinimum": 0}, "description": "H of fixed-step methods [s].", "examples": [[0.01, 0.001]]},
  "tolerance": {"type": "number", "minimum": 1e-15, "exclusiveMaximum": 1, "description": "Of error-controlled methods.", "examples": [1e-8]},
  "threads": {"type": "array", "items": {"type": "object", "additionalProperties": false, "required": ["of", "url", "asks"], "properties": {
    "of": {"type": "string", "description": "Project and number.", "examples": ["bullet3#4341"]},
    "url": {"type": "string", "description": "Where it is.", "examples": ["https://github.com/bulletphysics/bullet3/issues/4341"]},
    "asks": {"type": "string", "description": "In a few words.", "examples": ["restitution fails for small steps"]}}},
    "description": "Where people ask.", "examples": [[{"of": "bullet3#4341", "url": "https://github.com/bulletphysics/bullet3/issues/4341", "asks": "restitution fails for small steps"}]]}
})~";

std::string fields_of(const Question& question) {
  json properties = json::parse(kFieldsOfQuestions);
  if (!question.fields.empty()) properties.update(json::parse(question.fields));
  return json{{"required", {"methods", "step_lengths"}}, {"properties", properties}}.dump();
}

/// The answers to be made, without what is measured.
std::vector<Answer> plan_of(const Question& question, const json& experiment) {
  const auto lengths = experiment.at("step_lengths").get<std::vector<double>>();
  const std::vector<Answer> conditions = question.conditions(experiment);
  std::vector<Answer> plan;
  const double tolerance = experiment.value("tolerance", 1e-8);
  for (const std::string name : experiment.at("methods")) {
    const std::string missing = reason_not_built(name);
    const bool has_steps = !missing.empty() || !setting_of(*make_method(name), 1, 1).is_tolerance();
    for (const double h : has_steps ? lengths : std::vector<double>{0}) {
      for (Answer answer : conditions) {
        answer.method = answer.title = name;
        answer.h = h;
        if (!has_steps) answer.setting.tolerance = tolerance;
        if (!missing.empty()) answer.status = "not_built";
        answer.message = missing;
        plan.push_back(std::move(answer));
      }
    }
  }
  return plan;
}

void run_question(const Question& question, const json& experiment, ResultsFile& file) {
  const std::vector<Answer> plan = plan_of(question, experiment);
  file.header()["asked_in"] = experiment.value("threads", json::array());
  Progress progress(experiment.at("id").get<std::string>());
  const auto make = [&](std::size_t k) {
    Answer answer = plan[k];
    if (answer.status.empty()) question.measure(experiment, *make_method(answer.method), answer);
    return answer;
  };
  file.each<Answer>(plan.size(), make, [&](std::size_t k) {
    progress.update(static_cast<double>(k + 1) / static_cast<double>(plan.size()), plan[k].method);
  });
}

struct Thread {
  std::string of, url, asks;
};

Table threads_table(const Results& results) {
  std::vector<Thread> threads;
  for (const json& j : results.header.value("asked_in", json::array()))
    threads.push_back({j.at("of"), j.at("url"), j.at("asks")});
  static const std::vector<Column<Thread>> columns = {
      {"thread", &Thread::of}, {"asks", &Thread::asks}, {"where", &Thread::url}};
  return table_of("Where people ask", columns, threads);
}

struct Failure {
  std::string method, why;
  int runs = 0;
};

/// Methods whose runs failed, each with its first reason.
Table failures_table(const std::vector<Answer>& answers) {
  std::vector<Failure> failures;
  for (const Answer& answer : answers) {
    if (answer.succeeded() || answer.status == kNotRun) continue;
    const auto known =
        std::find_if(failures.begin(), failures.end(), [&](const Failure& f) { return f.method == answer.method; });
    if (known != failures.end())
      ++known->runs;
    else
      failures.push_back({answer.method, fmt::format("{}: {}", answer.status, answer.message), 1});
  }
  static const std::vector<Column<Failure>> columns = {
      {"method", &Failure::method}, {"runs", "", "{}", &Failure::runs}, {"the first of them", &Failure::why}};
  return table_of("What has no answer", columns, failures);
}

}  // namespace

void to_json(json& j, const Answer& answer) {
  to_json(j, static_cast<const Run&>(answer));
  j["h"] = answer.h;
}

void from_json(const json& j, Answer& answer) {
  from_json(j, static_cast<Run&>(answer));
  answer.h = j.value("h", 0.0);
}

Answer answer_under(const std::map<std::string, double>& conditions, const std::string& scene) {
  Answer answer;
  answer.conditions = conditions;
  answer.scene = scene;
  return answer;
}

bool register_question(const Question& question) {
  return register_study(
      {.kind = question.kind,
       .summary = question.summary,
       .fields = fields_of(question),
       .rows = {Answer::kKind},
       .times = Times::none,
       .run = [question](const json& experiment, ResultsFile& file) { run_question(question, experiment, file); },
       .show =
           [question](const Results& results, Section& section) {
             const auto answers = results.all<Answer>();
             question.show(results, answers, section);
             section.failures("failures", failures_table(answers));
             section.result("threads", threads_table(results));
           },
       // What an engine fails at is what is asked.
       .surprises = {}});
}

int steps_of(double T, double h) {
  return std::max(1, static_cast<int>(std::lround(T / h)));
}

Solution run_for(const Method& method, const ProblemChoice& choice, const Problem& problem, Recording recording,
                 Answer& answer) {
  answer.problem = choice.problem;
  answer.parameters = choice.parameters;
  if (answer.h > 0) answer.setting.steps = steps_of(problem.info().end_time, answer.h);
  return measure_run({.problem = problem, .recording = recording, .time_limit = kPatience}, method, answer);
}

Vector position_at(const Solution& s, double t) {
  Vector q = s.q;
  if (s.motion.n_pieces() > 0) {
    Vector v;
    s.motion.at(t, q, v);
  } else if (t < s.t) {
    const auto behind =
        std::find_if(s.samples.begin() + 1, s.samples.end(), [&](const Sample& sample) { return sample.t >= t; });
    const auto before = behind - 1;
    q = before->q + (t - before->t) / (behind->t - before->t) * (behind->q - before->q);
  }
  return q;
}

std::vector<std::pair<std::string, std::vector<Answer>>> by_method(const std::vector<Answer>& answers) {
  std::vector<std::pair<std::string, std::vector<Answer>>> list;
  for (const Answer& answer : answers) {
    const auto known =
        std::find_if(list.begin(), list.end(), [&](const auto& entry) { return entry.first == answer.method; });
    if (known != list.end())
      known->second.push_back(answer);
    else
      list.push_back({answer.method, {answer}});
  }
  return list;
}

StepRange step_range_of(const std::vector<Answer>& answers) {
  if (answers.empty()) return {};
  const auto [first, last] = std::ranges::minmax_element(answers, {}, &Answer::h);
  return {first->h, last->h};
}

CurveLook question_look(const std::string& method) {
  static const std::vector<std::string> engines = {"bullet", "ode", "mujoco", "box2d"},
                                        ours = {"fesd",      "event_driven", "moreau_jean",     "sap",
                                                "soft_step", "xpbd",         "anitescu_convex", "d1_minus"};
  constexpr int kEngineColours[] = {1, 3, 4, 2}, kColours[] = {0, 7, 6, 5};
  const MethodSpec spec(method);
  if (const auto engine = std::ranges::find(engines, spec.name()); engine != engines.end()) {
    const auto k = static_cast<int>(engine - engines.begin());
    const bool is_default = spec.arguments().empty();
    return {.colour = kEngineColours[k], .symbol = k, .dash = is_default ? 1 : 0, .is_open = is_default};
  }
  auto k = static_cast<std::size_t>(std::ranges::find(ours, spec.name()) - ours.begin());
  if (k == ours.size()) {  // one that the experiments here do not name: by its place among all
    const auto all = methods();
    k += static_cast<std::size_t>(std::ranges::find(all, spec.name(), &MethodEntry::name) - all.begin());
  }
  const int round = static_cast<int>(k / std::size(kColours));
  return {.colour = kColours[k % std::size(kColours)], .symbol = 5 - round % 2, .dash = round == 0 ? 0 : 2 + round % 2};
}

Chart question_chart(const std::string& name, const std::string& title, const std::string& caption,
                     const std::vector<Chart::Panel>& panels) {
  constexpr int kWidth = 1140, kBeside = 106;  // [px]
  const int columns = std::max(1, static_cast<int>(panels.size()));
  return {.name = name,
          .file = name,
          .title = title,
          .caption = caption,
          .panels = panels,
          .columns = columns,
          .width = kWidth / columns - kBeside};
}

Chart::Axis step_axis() {
  return {.label = "step length [s]", .is_log = true, .is_reversed = true};
}

}  // namespace ricochet
