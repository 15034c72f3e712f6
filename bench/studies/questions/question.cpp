#include "bench/studies/questions/question.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "bench/experiment/study.h"
#include "bench/rows/progress.h"
#include "methods/method_spec.h"
#include "methods/registry.h"
#include "problems/input_error.h"

namespace ricochet {
namespace {

using nlohmann::json;

constexpr double kPatience = 20;  // [s] of a run, where the experiment says nothing

constexpr const char* kFieldsOfQuestions = R"~({
  "methods": {"type": "array", "minItems": 1, "items": {"$ref": "#/$defs/method"}, "description": "Methods; one that is not built is listed as such.", "examples": [["moreau_jean"]]},
  "step_lengths": {"type": "array", "minItems": 1, "items": {"type": "number", "exclusiveMinimum": 0}, "description": "Step lengths of fixed-step methods [s].", "examples": [[0.01, 0.001]]},
  "tolerance": {"type": "number", "minimum": 1e-15, "exclusiveMaximum": 1, "description": "Tolerance of error-controlled methods.", "examples": [1e-8]},
  "threads": {"type": "array", "items": {"type": "object", "additionalProperties": false, "required": ["of", "url", "asks"], "properties": {
    "of": {"type": "string", "description": "Project and number of the discussion.", "examples": ["bullet3#4341"]},
    "url": {"type": "string", "description": "Address of the discussion.", "examples": ["https://github.com/bulletphysics/bullet3/issues/4341"]},
    "asks": {"type": "string", "description": "The question in a few words.", "examples": ["restitution fails for small steps"]}}},
    "description": "Discussions that ask the question.", "examples": [[{"of": "bullet3#4341", "url": "https://github.com/bulletphysics/bullet3/issues/4341", "asks": "restitution fails for small steps"}]]}
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
  return table_of("Runs without an answer", columns, failures);
}

/// The look of a method, the same in all questions: a colour for each engine, dashed and open with its default settings.
CurveLook look_of(const std::string& method) {
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

/// A sentence and a few numbers for each method.
Table answer_table(const Question& question, const std::vector<Answer>& answers) {
  std::vector<Column<MethodAnswers>> columns = {{"method", &MethodAnswers::method},
                                                {question.summary, question.sentence}};
  for (const AnswerColumn& c : question.columns) {
    if (c.text)
      columns.push_back({c.header, [c](const MethodAnswers& m) { return c.text(c.number(m)); }});
    else
      columns.push_back({c.header, c.unit, c.format, c.number});
  }
  return table_of("The answer", columns, by_method(answers), question.note);
}

double number_of(const Answer& a, const std::string& name) {
  if (name == "error") return a.error;
  const auto condition = a.conditions.find(name);
  return condition == a.conditions.end() ? a.value(name) : condition->second;
}

Table run_table(const Question& question, const std::vector<Answer>& answers) {
  std::vector<Column<Answer>> columns = {{"method", &Answer::method}, {"h", "s", "{:.4g}", &Answer::h}};
  if (std::ranges::any_of(answers, [](const Answer& a) { return !a.scene.empty(); }))
    columns.push_back({"scene", &Answer::scene});
  for (const RunColumn& c : question.details)
    columns.push_back({c.header, c.unit, c.format, [c](const Answer& a) { return number_of(a, c.name); }});
  columns.push_back({"status", &Answer::status});
  columns.push_back({"why", &Answer::message});
  columns.push_back({"command", &Answer::command});
  return table_of("Every run", columns, answers);
}

/// Panels beside each other, with the curve of each method.
Chart figure_of(const Question& question, const std::string& name, const std::vector<Answer>& answers) {
  constexpr int kWidth = 1140, kBeside = 106;  // [px]
  std::vector<Chart::Panel> panels;
  for (const QuestionPanel& stated : question.panels(answers)) {
    Chart::Panel& panel = panels.emplace_back(stated.panel);
    std::ranges::replace(panel.title, '_', ' ');
    for (const MethodAnswers& m : by_method(answers)) {
      Chart::Points curve;
      for (const Answer& a : m.answers) {
        if (!a.succeeded()) continue;
        for (auto [x, y] : stated.points(a, m)) {
          if (std::isfinite(panel.y.from)) y = std::max(y, panel.y.from);
          if (std::isfinite(panel.y.to)) y = std::min(y, panel.y.to);
          curve.emplace_back(x, y);
        }
      }
      std::ranges::sort(curve);
      panel.add(m.method, look_of(m.method), Chart::Drawn::both, curve);
    }
    if (stated.reference) stated.reference(panel);
  }
  const int columns = std::max(1, static_cast<int>(panels.size()));
  const std::string looks =
      " Values beyond an axis are drawn at its end. Dashed: an engine with default settings; solid: tuned.";
  return {.name = name,
          .file = name,
          .title = question.figure,
          .caption = question.caption + looks,
          .panels = panels,
          .columns = columns,
          .width = kWidth / columns - kBeside};
}

void show_question(const Question& question, const Results& results, Section& section) {
  const auto answers = results.all<Answer>();
  if (question.sentence) section.result("answer", answer_table(question, answers));
  if (question.before) question.before(results, answers, section);
  if (question.panels) section.chart(figure_of(question, results.experiment(), answers));
  if (question.after) question.after(results, answers, section);
  section.details("runs", run_table(question, answers));
  section.failures("failures", failures_table(answers));
  if (const Table threads = threads_table(results); !threads.rows.empty()) section.result("threads", threads);
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
       .show = [question](const Results& results, Section& section) { show_question(question, results, section); },
       // A failure of an engine is an answer.
       .unexpected_failures = {}});
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
    const auto after =
        std::find_if(s.samples.begin() + 1, s.samples.end(), [&](const Sample& sample) { return sample.t >= t; });
    const auto before = after - 1;
    q = before->q + (t - before->t) / (after->t - before->t) * (after->q - before->q);
  }
  return q;
}

double MethodAnswers::largest(const Number& number, double h) const {
  double largest = std::numeric_limits<double>::quiet_NaN();
  for (const Answer& a : answers) {
    if (a.succeeded() && a.h == h) largest = std::fmax(largest, number(a));
  }
  return largest;
}

double MethodAnswers::first(const Number& number, double h) const {
  for (const Answer& a : answers) {
    if (a.succeeded() && a.h == h && std::isfinite(number(a))) return number(a);
  }
  return std::numeric_limits<double>::quiet_NaN();
}

std::vector<MethodAnswers> by_method(const std::vector<Answer>& answers) {
  std::vector<MethodAnswers> list;
  for (const Answer& answer : answers) {
    auto known = std::ranges::find(list, answer.method, &MethodAnswers::method);
    if (known == list.end()) known = list.insert(known, {answer.method, {}, answer.h, answer.h});
    known->answers.push_back(answer);
    known->shortest = std::min(known->shortest, answer.h);
    known->longest = std::max(known->longest, answer.h);
  }
  return list;
}

std::vector<Answer> answers_for(const std::vector<std::pair<std::string, std::vector<double>>>& conditions) {
  std::vector<Answer> list(1);
  for (const auto& [name, values] : conditions) {
    std::vector<Answer> longer;
    for (const Answer& answer : list) {
      for (const double value : values) longer.emplace_back(answer).conditions[name] = value;
    }
    list = std::move(longer);
  }
  return list;
}

Chart::Axis step_axis() {
  return {.label = "step length [s]", .is_log = true, .is_reversed = true};
}

}  // namespace ricochet
