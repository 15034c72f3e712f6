#pragma once

#include <functional>
#include <map>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "methods/method.h"
#include "reports/results.h"
#include "reports/section.h"

/// @file
/// What all question pages have in common. A question that people ask of engines in threads is measured for every method
/// of its experiment with every step length, under some conditions; the page has the answer first, then a figure, then
/// all numbers and the threads.

namespace ricochet {

/// Status of an answer that would take too long, on purpose; of one whose method is not built, or cannot run it, it is
/// "not_built" or "declined".
inline constexpr const char* kNotAsked = "not_asked";

/// What one method with one step length does under one condition.
struct Answer {
  static constexpr const char* kKind = "answer";

  std::string method, command;
  double h = 0;                         ///< step length [s]; 0 for methods with a tolerance
  double tolerance = 0;                 ///< of these
  std::string scene;                    ///< or case; empty where a question has one scene
  std::map<std::string, double> of;     ///< the condition: "e", "mu"
  std::map<std::string, double> found;  ///< what was measured, and what is exact
  std::string status, message;

  bool succeeded() const { return status == "success"; }
  /// What was measured; NaN where that is missing.
  double value(const std::string& name) const;
  double condition(const std::string& name) const { return of.at(name); }
};
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE_WITH_DEFAULT(Answer, method, command, h, tolerance, scene, of, found, status,
                                                message)

/// A question.
struct Question {
  /// One measurement: what of an answer is known before it is made.
  using Plan = std::function<std::vector<Answer>(const nlohmann::json& experiment)>;
  using Measure = std::function<void(const nlohmann::json& experiment, const Method& method, Answer& answer)>;
  using Show = std::function<void(const Results& results, const std::vector<Answer>& answers, Section& section)>;

  std::string kind, summary;
  std::string fields;  ///< of its experiments beside those of all questions: properties of a JSON schema
  Plan conditions;     ///< scene and conditions, for every method and step length
  Measure measure;     ///< fills `found`, `status` and `message`
  Show show;
};

/// Called once in the file of each question.
bool register_question(const Question& question);

/// The number of steps of h seconds in T, at least one.
int steps_of(double T, double h);
/// A run of an answer's method, whose command is noted. A step length of zero is that of an adaptive method.
/// @param scene  "-p bouncing_ball --set e=0.5"
Solution run_for(const Method& method, const Problem& problem, Recording recording, const std::string& scene,
                 Answer& answer);

/// The position at a time of a run that was recorded: on a straight line between steps of a method that knows no motion.
Vector position_at(const Solution& s, double t);

/// Answers of one method, in the order of the results.
std::vector<std::pair<std::string, std::vector<Answer>>> by_method(const std::vector<Answer>& answers);
/// Shortest and longest of the step lengths of some answers; both are 0 for a method with a tolerance.
struct StepRange {
  double shortest = 0, longest = 0;  ///< [s]
};
StepRange step_range_of(const std::vector<Answer>& answers);
/// gnuplot's style of a method, the same in all questions: a colour for each engine, dashed as it comes.
std::string style_of(const std::string& method);

/// A curve for each method.
using Curves = std::vector<std::pair<std::string, std::vector<std::pair<double, double>>>>;
/// A panel of a figure.
struct QuestionPanel {
  std::string title, x_label, y_label;
  std::string settings;  ///< of gnuplot: ranges, logarithmic axes
  std::string line;      ///< a gnuplot formula of x to compare with; empty: none
  std::string line_is;   ///< what that is: "exact"
  Curves curves;
};
/// Panels beside each other with one key below them for all.
Figure draw_question(const FigureFolder& folder, const std::string& name, const std::string& title,
                     const std::string& caption, const std::vector<QuestionPanel>& panels);

}  // namespace ricochet
