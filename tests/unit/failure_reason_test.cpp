// FailureReason, on which verdicts depend: the methods that fail for a reason state it.
#include <gtest/gtest.h>

#include "methods/registry.h"
#include "problems/registry.h"
#include "problems/scene_file/scene_file.h"
#include "reports/run.h"
#include "tests/test_data.h"

namespace ricochet {
namespace {

void expect_reason(const Problem& problem, const std::string& method, FailureCode code,
                   const std::vector<std::string>& contacts) {
  Settings settings;
  settings.steps = 20;
  settings.tolerance = 1e-8;
  const Solution s = make_method(method)->solve(problem, settings);
  EXPECT_FALSE(s.succeeded()) << method;
  EXPECT_EQ(s.reason.code, code) << method << ": " << s.message;
  EXPECT_EQ(s.reason.contacts, contacts) << method << ": " << s.message;
}

TEST(FailureReason, OfPainlevesParadox) {
  const std::string file = test_data("friction_scenes.json") + "#rod";
  const auto none = read_scene_file(file), two = read_scene_file(file, {{"omega", 6}});
  for (const char* method : {"fesd:radau-iia:3", "fesd_adaptive:radau-iia:4", "cvode:adams", "ida"}) {
    expect_reason(*none, method, FailureCode::inconsistent, {"tip"});
    expect_reason(*two, method, FailureCode::indeterminate, {"tip"});
  }
  for (const auto* rod : {&none, &two}) expect_reason(**rod, "event_driven", FailureCode::painleve, {"tip"});
}

TEST(FailureReason, OfImpactsThatAccumulate) {
  expect_reason(*read_scene_file(test_data("reference_scenes.json") + "#two_balls_collapse"), "cvode:adams",
                FailureCode::impacts_accumulate, {"floor", "balls"});
  expect_reason(*make_problem("bouncing_ball", {{"e", 0.5}, {"duration", 2}}), "fesd_adaptive:gauss:4",
                FailureCode::impacts_accumulate, {"ground"});
}

TEST(FailureReason, IsNotStatedOfATimeLimit) {
  const auto ball = make_problem("bouncing_ball");
  Settings settings;
  settings.steps = 100000;
  settings.time_limit = 1e-9;
  settings.recording = Recording::grid;  // else the flight is one step
  const Solution s = make_method("fesd:gauss:2")->solve(*ball, settings);
  EXPECT_EQ(s.status, Status::time_limit);
  EXPECT_EQ(s.reason.code, FailureCode::not_stated);
}

TEST(FailureReason, IsKeptInARow) {
  ricochet::Run run;
  run.reason = {FailureCode::indeterminate, {"tip"}};
  nlohmann::json row = run;
  EXPECT_EQ(row["reason"].dump(), R"({"code":"indeterminate","contacts":["tip"]})");
  EXPECT_EQ(row.get<ricochet::Run>().reason.code, FailureCode::indeterminate);
  EXPECT_EQ(row.get<ricochet::Run>().reason.contacts, std::vector<std::string>{"tip"});
  row.erase("reason");
  EXPECT_EQ(row.get<ricochet::Run>().reason.code, FailureCode::not_stated) << "of an older file";
}

}  // namespace
}  // namespace ricochet
