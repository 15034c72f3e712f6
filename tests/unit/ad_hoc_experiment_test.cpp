// Experiments that the command line states.
#include "bench/commands/ad_hoc_experiment.h"

#include <gtest/gtest.h>

#include "bench/experiment/experiment_schema.h"
#include "bench/experiment/run_experiment.h"
#include "problems/input_error.h"
#include "tests/test_data.h"

namespace ricochet {
namespace {

using nlohmann::json;

std::string error_of(const AdHocStudy& study) {
  try {
    ad_hoc_experiment(study);
  } catch (const InputError& error) {
    return error.what();
  }
  return "no error";
}

TEST(AdHocExperiment, IsTheDocumentOfAFile) {
  const ExperimentFile experiment = ad_hoc_experiment({.problem = "bouncing_ball,e=0.9,duration=1",
                                                       .scene = {},
                                                       .methods = {"moreau_jean", "fesd:gauss:2", "cvode:adams"},
                                                       .steps = "10..1000:4",
                                                       .tolerances = "1e-3..1e-7"});
  EXPECT_EQ(experiment.document, json::parse(R"({
    "id": "bouncing_ball-e=0.9-duration=1_moreau_jean_fesd-gauss-2_cvode-adams_steps-10..1000-4_tolerance-1e-3..1e-7",
    "kind": "method_grid", "title": "Methods on bouncing_ball,e=0.9,duration=1",
    "description": "`ricochet run-experiment --problem bouncing_ball,e=0.9,duration=1 --method moreau_jean --method fesd:gauss:2 --method cvode:adams --steps 10..1000:4 --tolerance 1e-3..1e-7`",
    "problem": "bouncing_ball", "parameters": {"duration": 1.0, "e": 0.9},
    "methods": [{"method": "moreau_jean", "steps": {"from": 10.0, "to": 1000.0, "per_decade": 4.0}},
                {"method": "fesd:gauss:2", "steps": {"from": 10.0, "to": 1000.0, "per_decade": 4.0}},
                {"method": "cvode:adams", "tolerances": [1e-3, 1e-4, 1e-5, 1e-6, 1e-7]}]})"));
}

TEST(AdHocExperiment, HasDefaults) {
  const ExperimentFile experiment =
      ad_hoc_experiment({.problem = "two_balls_spring", .scene = {}, .methods = {}, .steps = {}, .tolerances = {}});
  EXPECT_NO_THROW(experiment_document(experiment, {}));
  EXPECT_EQ(experiment.document["methods"].size(), 4u);
  const ExperimentFile listed = ad_hoc_experiment({.problem = {},
                                                   .scene = test_data("press.json"),
                                                   .methods = {"moreau_jean"},
                                                   .steps = "10,20",
                                                   .tolerances = {}});
  EXPECT_EQ(listed.document["id"], "press_moreau_jean_steps-10-20");
  EXPECT_EQ(listed.document["methods"][0]["steps"], json::parse("[10, 20]"));
}

TEST(AdHocExperiment, MistakesNameTheirOption) {
  const auto error = [](const std::string& problem, const std::string& method, const std::string& steps,
                        const std::string& tolerances = "") {
    return error_of({.problem = problem, .scene = {}, .methods = {method}, .steps = steps, .tolerances = tolerances});
  };
  EXPECT_EQ(error("bouncing_ball", "moreau_jean", "10..20"), "no error");
  EXPECT_EQ(error("", "moreau_jean", "10"),
            "experiment = '': a name, or --problem or --scene for one without a file, is required");
  EXPECT_EQ(error("bouncing_ball", "moreau_jean", "ten"),
            "--steps = ten: FROM..TO, FROM..TO:PER_DECADE or A,B,... in numbers is required");
  EXPECT_EQ(error("bouncing_ball", "moreau_jean", "10.."),
            "--steps = 10..: FROM..TO, FROM..TO:PER_DECADE or A,B,... in numbers is required");
  EXPECT_EQ(error("bouncing_ball", "moreau_jean", "0.5"), "--steps = 0.5: whole numbers >= 1 are required");
  EXPECT_EQ(error("bouncing_ball", "moreau_jean", "-10..100"),
            "--steps = from -10 to 100, 8 per decade: finite numbers > 0 are required");
  EXPECT_EQ(error("bouncing_ball", "cvode:adams", "", "2"), "--tolerance = 2: numbers >= 1e-15 and < 1 are required");
  EXPECT_EQ(error("bouncing_ball", "moreau_jean", "10", "1e-6"),
            "--tolerance = 1e-6: none of the methods supports it: moreau_jean");
  EXPECT_EQ(error("bouncing_ball,e", "moreau_jean", "10"), "--set = e: NAME=VALUE is required");
  EXPECT_EQ(error("press.json", "moreau_jean", "10"), "--problem = press.json: scene files are for --scene");
  EXPECT_EQ(error_of({.problem = {}, .scene = "press", .methods = {}, .steps = {}, .tolerances = {}}),
            "--scene = press: a file FILE.json or FILE.json#ID is required");
}

}  // namespace
}  // namespace ricochet
