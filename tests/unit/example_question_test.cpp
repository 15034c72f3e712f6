// A question of the reader's own: this file is all there is of it.
#include <gtest/gtest.h>

#include <cmath>

#include "bench/experiment/study.h"
#include "bench/studies/questions/question.h"
#include "tests/small_experiment.h"

namespace ricochet {
namespace {

// How far does a block slide? With friction mu it stops after v^2 / (2 mu g).                                    (1)

void measure_slide(const nlohmann::json&, const Method& method, Answer& answer) {
  const double mu = answer.condition("mu"), v = 2, g = 9.81;
  const ProblemChoice block{.problem = "sliding_block", .parameters = {{"mu", mu}, {"v_x0", v}, {"duration", 2}}};
  const Solution s = run_for(method, block, *block.make_problem(), Recording::final_state, answer);
  if (s.succeeded()) answer.values = {{"way", s.q[0]}, {"exact", v * v / (2 * mu * g)}};  // (1)
}

double deviation(const Answer& a) {
  return std::abs(a.value("way") / a.value("exact") - 1);
}

const bool slide_is_registered = register_question(
    {.kind = "slide",
     .summary = "how far does a block slide?",
     .fields =
         R"({"mu": {"type": "array", "items": {"type": "number"}, "description": "Friction.", "examples": [[0.5]]}})",
     .conditions =
         [](const nlohmann::json& experiment) {
           return answers_for({{"mu", experiment.at("mu")}});
         },
     .measure = measure_slide,
     .sentence = [](const MethodAnswers& m) { return m.largest(deviation, m.shortest) < 0.01 ? "right" : "wrong"; },
     .columns = {{"largest deviation", "", "{:.1e}",
                  [](const MethodAnswers& m) { return m.largest(deviation, m.shortest); }}},
     .details = {{"mu", "mu", "", "{:g}"}, {"way", "way", "m", "{:.4g}"}, {"exact", "exact", "m", "{:.4g}"}}});

TEST(ExampleQuestion, IsAnsweredForEveryMethod) {
  const Results results = run_small_experiment(R"({"id": "slide", "kind": "slide", "title": "t", "description": "d.",
    "mu": [0.3, 0.5], "step_lengths": [0.01, 0.001], "methods": ["moreau_jean", "event_driven"]})");
  EXPECT_EQ(results.all<Answer>().size(), 6u) << "two step lengths and a tolerance, with two coefficients";
  Section section;
  study_of(results).show(results, section);
  const Table& answer = section.tables().front()->table;
  ASSERT_EQ(answer.rows.size(), 2u);
  EXPECT_EQ(answer.rows[0][1], "right") << answer.text();
  EXPECT_EQ(answer.rows[1][1], "right") << answer.text();
}

}  // namespace
}  // namespace ricochet
