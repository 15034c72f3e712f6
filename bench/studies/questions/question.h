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
/// Framework of questions that people ask of engines in threads. Every method of an experiment is measured with every step
/// length under some conditions. The page has the answer of each method first, a sentence and a few numbers; then a figure,
/// all runs, and the threads. A question states these parts; hold.cpp is an example.

namespace ricochet {

/// Status of an answer that is left out because it would take too long.
inline constexpr const char* kNotRun = "not_run";

/// Answer of one method with one step length under one condition of the question, such as "e" or "mu". Its values are
/// the measured and the exact numbers.
struct Answer : Run {
  static constexpr const char* kKind = "answer";

  double h = 0;  ///< step length [s]; 0 for methods with a tolerance
};
void to_json(nlohmann::json& j, const Answer& answer);
void from_json(const nlohmann::json& j, Answer& answer);

/// The answers of one method.
struct MethodAnswers {
  /// A number of an answer; NaN for an answer that does not count.
  using Number = std::function<double(const Answer&)>;

  std::string method;
  std::vector<Answer> answers;       ///< in the order of the results, failed ones, too
  double shortest = 0, longest = 0;  ///< step lengths [s]; 0 for a method with a tolerance

  /// Largest number of the successes with step length h; NaN where none counts.
  double largest(const Number& number, double h) const;
  /// The first of these.
  double first(const Number& number, double h) const;
};

/// A number of the answer of a method, beside its sentence.
struct AnswerColumn {
  std::string header, unit, format;
  std::function<double(const MethodAnswers&)> number;
  std::function<std::string(double)> text = {};  ///< instead of the format
};

/// A condition or a value, as a column of the table of all runs.
struct RunColumn {
  std::string name, header, unit, format;  ///< name of Run::conditions or Run::values, or "error"
};

/// A panel of the figure: a curve per method.
struct QuestionPanel {
  Chart::Panel panel;                                                        ///< title and axes
  std::function<Chart::Points(const Answer&, const MethodAnswers&)> points;  ///< of a success
  std::function<void(Chart::Panel&)> reference = {};                         ///< adds what is exact
};

/// A question. What it does not state is not shown.
struct Question {
  /// The answers to be measured by every method with every step length: scene and conditions (answer_under()).
  using Plan = std::function<std::vector<Answer>(const nlohmann::json& experiment)>;
  /// Runs the method (run_for()) and adds values to the answer.
  using Measure = std::function<void(const nlohmann::json& experiment, const Method& method, Answer& answer)>;
  using Show = std::function<void(const Results& results, const std::vector<Answer>& answers, Section& section)>;

  std::string kind, summary;
  std::string fields;  ///< of its experiments beside those of all questions: properties of a JSON schema
  Plan conditions;
  Measure measure;

  std::function<std::string(const MethodAnswers&)> sentence = {};  ///< answers the summary; empty: no table of answers
  std::vector<AnswerColumn> columns = {};
  std::string note = {};  ///< what these numbers are

  std::string figure = {}, caption = {};  ///< title and caption
  std::function<std::vector<QuestionPanel>(const std::vector<Answer>&)> panels = {};

  std::vector<RunColumn> details = {};
  Show before = {}, after = {};  ///< tables of its own, before and after the figure
};

/// Called once in the file of each question.
bool register_question(const Question& question);

/// The answers of each method, in the order of the results.
std::vector<MethodAnswers> by_method(const std::vector<Answer>& answers);
/// Every combination of a value of each list as conditions, the last list fastest.
std::vector<Answer> answers_for(const std::vector<std::pair<std::string, std::vector<double>>>& conditions);

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

/// Step lengths, shorter ones to the right.
Chart::Axis step_axis();

}  // namespace ricochet
