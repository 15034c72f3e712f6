// Which problems have a solution that is known to many digits.
#include "reference/truths.h"

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "methods/registry.h"
#include "tests/test_data.h"

namespace ricochet {
namespace {

std::string id_of_truth(const std::string& problem, const ParameterChanges& parameters = {}) {
  const auto truth = reference::known_solution(problem, parameters);
  return truth ? truth->id : "";
}

TEST(KnownSolution, BelongsToTheDefaultParametersOfAScene) {
  EXPECT_EQ(id_of_truth("P1a_ball_e09"), "P1a_ball_e09");
  EXPECT_EQ(id_of_truth("P1a_ball_e09", {{"e", 0.9}}), "P1a_ball_e09") << "the default value";
  EXPECT_EQ(id_of_truth("P1a_ball_e09", {{"e", 0.8}}), "");
  EXPECT_EQ(id_of_truth("P1a_ball_e09", {{"no parameter", 1}}), "");
  EXPECT_EQ(id_of_truth("bouncing_ball"), "");
}

TEST(KnownSolution, BelongsToEveryCaseOfAFileWithASolution) {
  EXPECT_EQ(id_of_truth(reference_data("moving_scenes.json") + "#belt_of_varying_speed"), "belt_of_varying_speed");
  EXPECT_EQ(id_of_truth(reference_data("moving_scenes.json") + "#belt_of_varying_speed", {{"mu", 0.5}}), "");
  EXPECT_EQ(id_of_truth(test_data("friction_scenes.json") + "#rod"), "") << "a file of scenes alone";
  EXPECT_EQ(id_of_truth(test_data("press.json")), "");
  EXPECT_THROW(id_of_truth("no_such_file.json#a"), InputError);
}

/// The same motion, as a certified case claims: compared by a run of each scene.
TEST(KnownSolution, BelongsToScenesWithTheSameMotion) {
  EXPECT_EQ(id_of_truth("two_balls_spring"), "P2_two_balls_spring");
  EXPECT_EQ(id_of_truth("two_balls_spring", {{"k", 1e5}}), "");
  Settings settings;
  settings.tolerance = 1e-10;
  const Solution run = make_method("event_driven")->solve(*make_problem("two_balls_spring"), settings);
  ASSERT_TRUE(run.succeeded()) << run.message;
  EXPECT_LE(state_error(run, *reference::known_solution("two_balls_spring", {})), 1e-8);  // a hundred tolerances
}

TEST(CertifiedCases, AreScenesOfTheProgram) {
  for (const auto& truth : reference::certified_cases()) {
    const auto problem = make_problem(truth.id);
    EXPECT_EQ(problem->info().title, truth.title);
    EXPECT_EQ(truth.q.size(), problem->info().q0.size()) << truth.id;
    EXPECT_FALSE(reference::picture_of(truth.id).empty()) << truth.id;
  }
  EXPECT_EQ(reference::picture_of("bouncing_ball"), "");
}

}  // namespace
}  // namespace ricochet
