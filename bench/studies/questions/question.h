#pragma once

#include <functional>
#include <map>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "bench/measure/measure_run.h"
#include "methods/method.h"
#include "reports/chart.h"
#include "reports/results.h"
#include "reports/run.h"
#include "reports/section.h"

/// @file
/// What all question pages have in common. A question that people ask of engines in threads is measured for every method
/// of its experiment with every step length, under some conditions; the page has the answer first, then a figure, then
/// all numbers and the threads.

namespace ricochet {

/// Status of an answer that is left out because it would take too long.
inline constexpr const char* kNotRun = "not_run";

/// What one method with one step length does under one condition. Its conditions are those of the question, "e" or "mu";
/// its values are what was measured, and what is exact.
struct Answer : Run {
  static constexpr const char* kKind = "answer";

  double h = 0;  ///< step length [s]; 0 for methods with a tolerance
};
void to_json(nlohmann::json& j, const Answer& answer);
void from_json(const nlohmann::json& j, Answer& answer);

/// A question.
struct Question {
  /// One measurement: what of an answer is known before it is made.
  using Plan = std::function<std::vector<Answer>(const nlohmann::json& experiment)>;
  using Measure = std::function<void(const nlohmann::json& experiment, const Method& method, Answer& answer)>;
  using Show = std::function<void(const Results& results, const std::vector<Answer>& answers, Section& section)>;

  std::string kind, summary;
  std::string fields;  ///< of its experiments beside those of all questions: properties of a JSON schema
  Plan conditions;     ///< scene and conditions, for every method and step length
  Measure measure;     ///< fills in the result
  Show show;
};

/// Called once in the file of each question.
bool register_question(const Question& question);

/// The number of steps of h seconds in T, at least one.
int steps_of(double T, double h);
/// Runs the method of an answer on a problem and fills in its result.
/// @param problem  of `choice`, perhaps with another initial state
Solution run_for(const Method& method, const ProblemChoice& choice, const Problem& problem, Recording recording,
                 Answer& answer);
/// An answer that is not measured yet. @param conditions  {"mu", 0.5}  @param scene  empty where a question has one
Answer answer_under(const std::map<std::string, double>& conditions, const std::string& scene = "");

/// The position at a time of a run that was recorded: on a straight line between steps of a method that knows no motion.
Vector position_at(const Solution& s, double t);

/// Answers of one method, in the order of the results.
std::vector<std::pair<std::string, std::vector<Answer>>> by_method(const std::vector<Answer>& answers);
/// Shortest and longest of the step lengths of some answers; both are 0 for a method with a tolerance.
struct StepRange {
  double shortest = 0, longest = 0;  ///< [s]
};
StepRange step_range_of(const std::vector<Answer>& answers);
/// The look of a method, the same in all questions: a colour for each engine, dashed and open with its default settings.
CurveLook question_look(const std::string& method);

/// Panels beside each other. Every series needs question_look() of the method that it is named after.
Chart question_chart(const std::string& name, const std::string& title, const std::string& caption,
                     const std::vector<Chart::Panel>& panels);
/// Step lengths, shorter ones to the right.
Chart::Axis step_axis();

}  // namespace ricochet
