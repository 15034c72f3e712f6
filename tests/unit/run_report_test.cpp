// What `ricochet run` says of a run.
#include "bench/commands/run_report.h"

#include <gtest/gtest.h>

#include "bench/commands/schema_page.h"
#include "bench/measure/isolated_reference.h"
#include "bench/measure/sensitivities.h"
#include "methods/registry.h"
#include "problems/registry.h"
#include "tests/test_data.h"

namespace ricochet {
namespace {

using nlohmann::json;

RunReport report_of(const Problem& problem, const std::string& spec, const Settings& settings) {
  const auto method = make_method(spec);
  RunReport report{.problem = problem,
                   .method = spec,
                   .method_info = method->info(),
                   .settings = settings,
                   .solution = solve_with_sensitivities(*method, problem, settings),
                   .reference = {},
                   .without_reference = "of a test"};
  report.by_differences = !settings.sensitivities.empty() && !report.method_info.has_sensitivities;
  return report;
}

/// A row of discs as wide as its box leaves a wedge; the others come to rest as groups.
TEST(RunJson, HasCapturesAndNotes) {
  const auto problem = make_problem("balls_in_box", {{"n", 5.0}, {"e", 0.3}});
  Settings settings;
  settings.tolerance = 1e-8;
  const RunReport report = report_of(*problem, "event_driven", settings);
  const json document = json::parse(run_json(report).dump());
  ASSERT_NO_THROW(run_schema().check(document, ""));
  const Solution& s = report.solution;
  ASSERT_FALSE(s.captures.empty() || s.wedges.empty());
  const json& captures = document["captures"];
  EXPECT_EQ(captures["height"], s.captured_height());
  EXPECT_EQ(captures["speed"], s.captured_speed());
  ASSERT_EQ(captures["groups"].size(), s.captures.size());
  EXPECT_EQ(captures["groups"][0]["t"], s.captures[0].t);
  EXPECT_EQ(captures["groups"][0]["contacts"], s.captures[0].n_contacts);
  EXPECT_EQ(captures["groups"][0]["height"], s.captures[0].height);
  EXPECT_EQ(captures["groups"][0]["speed"], s.captures[0].speed);
  ASSERT_EQ(document["notes"].size(), s.wedges.size());
  const json& note = document["notes"][0];
  EXPECT_EQ(note["t"], s.wedges[0].t);
  EXPECT_EQ(note["contacts"].size(), s.wedges[0].contacts.size());
  EXPECT_NE(note["text"].get<std::string>().find("one limit"), std::string::npos);

  testing::internal::CaptureStdout();
  print_run(report, 0);
  const std::string text = testing::internal::GetCapturedStdout();
  EXPECT_NE(text.find("\ncaptures   "), std::string::npos) << text;
  EXPECT_NE(text.find("\nnote       at t = "), std::string::npos) << text;
}

/// Every digit, every event with all its fields, for kinds of scenes and methods.
TEST(RunJson, FitsItsSchemaAndKeepsEveryDigit) {
  for (const char* scene : {"bouncing_ball", "sliding_block", "pendulum_wall", "ball_3d", "shaken_table"}) {
    const auto problem = make_problem(scene);
    for (const char* spec : {"moreau_jean", "fesd:radau-iia:3,elements=as_needed", "cvode:adams"}) {
      Settings settings;
      (spec == std::string("cvode:adams") ? settings.tolerance : settings.inner_tolerance) = 1e-9;
      if (settings.tolerance == 0) settings.steps = 50;
      if (scene == std::string("bouncing_ball")) settings.sensitivities = {"param:e"};
      const RunReport report = report_of(*problem, spec, settings);
      const json document = json::parse(run_json(report).dump());
      ASSERT_NO_THROW(run_schema().check(document, "")) << scene << " " << spec;
      const Solution& s = report.solution;
      EXPECT_EQ(document["status"], to_string(s.status));
      EXPECT_EQ(document["t"], s.t);
      ASSERT_EQ(static_cast<int>(document["q"].size()), problem->info().n_mechanical()) << "no clock";
      for (std::size_t k = 0; k < document["q"].size(); ++k) {
        EXPECT_EQ(document["q"][k], s.q[static_cast<Eigen::Index>(k)]);
        EXPECT_EQ(document["v"][k], s.v[static_cast<Eigen::Index>(k)]);
      }
      ASSERT_EQ(document["events"].size(), s.events.size());
      for (std::size_t k = 0; k < s.events.size(); ++k) {
        EXPECT_EQ(document["events"][k]["t"], s.events[k].t);
        EXPECT_EQ(document["events"][k]["name"], problem->info().contacts[s.events[k].contact].name);
      }
      EXPECT_EQ(document["sensitivities"].size(), settings.sensitivities.size());
    }
  }
}

TEST(RunJson, AFailedRunIsADocument) {
  const auto problem = make_problem("two_balls_spring");
  Settings settings;
  settings.steps = 80;
  const json document = run_json(report_of(*problem, "fesd:gauss:1", settings));
  EXPECT_NO_THROW(run_schema().check(document, ""));
  EXPECT_EQ(document["status"], "infeasible");
  EXPECT_TRUE(document["error"].is_null());
  EXPECT_EQ(document["reference"]["how"], "of a test");
}

/// Events that repeat at the instant where a run fails are printed once and counted, and so is the message.
TEST(RunReport, AFailedRunPrintsRepeatedEventsOnce) {
  const auto problem = make_problem("bouncing_ball");
  Settings settings;
  settings.steps = 10;
  RunReport report = report_of(*problem, "moreau_jean", settings);
  report.solution.status = Status::step_limit;
  report.solution.message = "no progress";
  Event event;
  event.t = 0.5;
  event.kind = EventKind::slip_reversal;
  event.contact = 0;
  report.solution.events.assign(100, event);
  testing::internal::CaptureStdout();
  print_run(report, 1000);
  const std::string text = testing::internal::GetCapturedStdout();
  const auto count = [&](const std::string& word) {
    std::size_t n = 0;
    for (auto at = text.find(word); at != std::string::npos; at = text.find(word, at + 1)) ++n;
    return n;
  };
  EXPECT_EQ(count("slip_reversal"), 1U) << text;
  EXPECT_EQ(count("no progress"), 1U) << text;
  EXPECT_EQ(count("and 99 more events of these kinds at t = 0.5"), 1U) << text;
}

TEST(RunReport, WhoDiffersFromTheTruthIsWrong) {
  const auto problem = make_problem("bouncing_ball");
  Settings settings;
  settings.tolerance = 1e-9;
  RunReport report = report_of(*problem, "event_driven", settings);
  report.reference.emplace();
  report.reference->solution = report.solution;
  report.reference->how = "proven to 20 decimals by a test";
  const auto text_with_error = [&](double error, bool is_truth) {
    report.reference->solution.q[0] = report.solution.q[0] + error;
    report.reference->is_truth = is_truth;
    EXPECT_EQ(run_json(report)["error"].is_null(), report.disagrees());
    testing::internal::CaptureStdout();
    print_error(report);
    return testing::internal::GetCapturedStdout();
  };
  EXPECT_NE(text_with_error(0.5, true).find("error      0.5 in (q, v) at the end time: the method is wrong"),
            std::string::npos);
  EXPECT_NE(text_with_error(0.5, false).find("one of them is wrong"), std::string::npos);
  for (const bool is_truth : {true, false})
    EXPECT_EQ(text_with_error(1e-12, is_truth).find("wrong"), std::string::npos) << is_truth;
}

TEST(RunJson, EveryFieldIsOnThePage) {
  const std::string page = run_page();
  for (const auto& [field, schema] : run_schema().document()["properties"].items())
    EXPECT_NE(page.find("| `" + field + "` |"), std::string::npos) << field;
}

/// As the studies find it: to the last digit that of ProblemChoice, in this process or another.
TEST(IsolatedReference, IsThatOfTheStudies) {
  for (const char* id : {"two_balls_spring", "bouncing_ball"}) {
    ProblemChoice choice;
    choice.problem = id;
    const auto problem = choice.make_problem();
    const auto here = choice.make_reference(*problem), there = isolated_reference(choice, *problem, 60);
    EXPECT_EQ(here.solution.q, there.solution.q) << id;
    EXPECT_EQ(here.solution.v, there.solution.v) << id;
    EXPECT_EQ(here.uncertainty, there.uncertainty) << id;
    EXPECT_EQ(here.how, there.how) << id;
    EXPECT_EQ(here.is_truth, there.is_truth) << id;
  }
  ProblemChoice paradox;  // no force continues the slip
  paradox.problem = "falling_rod";
  paradox.parameters = {{"mu", 2}, {"theta0", 1.1}};
  const auto rod = paradox.make_problem();
  EXPECT_THROW(isolated_reference(paradox, *rod, 60), std::runtime_error);
}

/// Four runs resolve another number of the last impacts each, and end in the same motion.
TEST(IsolatedReference, GoesThroughAnAccumulation) {
  ProblemChoice bounces;
  bounces.problem = "P1d_ball_e05_through_zeno";
  bounces.is_changed = true;  // so that the reference is computed
  const auto ball = bounces.make_problem();
  const auto found = isolated_reference(bounces, *ball, 60);
  const auto truth = *reference::known_solution(bounces.problem, {});
  EXPECT_LE(found.error_of(truth.solution()), found.uncertainty);
  EXPECT_LE(found.uncertainty, 1e-8);  // the runs cut the accumulation at impacts of other sizes, 3e-9 apart
}

}  // namespace
}  // namespace ricochet
