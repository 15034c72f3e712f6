// Random scenes, the judge's rule, and the minimiser.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <optional>
#include <set>

#include "bench/fuzz/families.h"
#include "bench/fuzz/judge.h"
#include "bench/fuzz/minimise.h"
#include "bench/measure/environment.h"
#include "problems/scene_file/scene_file.h"

namespace ricochet {
namespace {

using nlohmann::ordered_json;

TEST(RandomScenes, AreTheSameOnEveryMachine) {
  const SceneFamily& drops = scene_families().front();
  const ordered_json scene = random_scene(drops, 1, 0);
  EXPECT_EQ(scene.dump(), random_scene(drops, 1, 0).dump());
  EXPECT_NE(scene.dump(), random_scene(drops, 1, 1).dump());
  EXPECT_NE(scene.dump(), random_scene(drops, 2, 0).dump());
  // The first words of std::mt19937_64 and their remainders are specified: so is this number.
  SceneDraw draw("a key");
  draw.number("x", -2, 2);
  EXPECT_EQ(draw.scene("id", "title")["params"]["x"], "-0.2474");
}

TEST(RandomScenes, StartWhereTheContactLawsHold) {
  for (const auto& family : scene_families()) {
    std::set<int> sizes;
    for (int number = 0; number < 30; ++number) {
      const auto problem = read_scene_text(random_scene(family, 3, number).dump(), "scene");
      const ProblemInfo& info = problem->info();
      sizes.insert(info.n_q);
      const Vector gap = problem->gap(info.q0);
      const Vector rate = problem->normal_jacobian(info.q0).transpose() * info.v0;
      for (const int i : info.unilateral)
        EXPECT_GE(gap[i], -1e-15 * std::max(1.0, info.q0.cwiseAbs().maxCoeff())) << family.name << " " << number;
      for (const int i : info.bilateral) {
        EXPECT_NEAR(gap[i], 0, 1e-15) << family.name << " " << number;   // lengths below one, some roundings
        EXPECT_NEAR(rate[i], 0, 1e-14) << family.name << " " << number;  // velocities up to ten
      }
    }
    const std::set<std::string> of_one_size = {"drops", "rod_drops", "turning"};
    EXPECT_GE(sizes.size(), of_one_size.contains(family.name) ? 1u : 2u) << family.name;
  }
}

// Methods that answer as a test wants: a ball that falls freely, and what each method makes of it.
struct Answers {
  double adaptive = 0, adaptive_disturbed = 0;
  std::optional<double> adaptive_tighter{};
  double fixed = 0, cvode = 0;
  std::optional<double> cvode_tighter{};
  double moreau_jean = 0;
  std::optional<FailureReason> cvode_failure{};
  double event_driven = 0;
  std::optional<FailureReason> event_driven_failure{};
};
Answers answers;

FuzzResult answer(const Problem& problem, const std::string& method, const Setting& setting, double) {
  const auto [steps, tolerance] = setting;
  FuzzResult result;
  result.method = method;
  result.setting = setting;
  result.status = "success";
  const bool is_disturbed = problem.force(problem.info().q0, problem.info().v0)[0] != -9.81;
  double x = answers.cvode;
  std::optional<FailureReason> failure;
  if (method == "event_driven") {
    x = answers.event_driven;
    failure = answers.event_driven_failure;
  } else if (method.starts_with("fesd_adaptive"))
    x = is_disturbed        ? answers.adaptive_disturbed
        : tolerance < 1e-11 ? answers.adaptive_tighter.value_or(answers.adaptive)
                            : answers.adaptive;
  else if (method.starts_with("fesd"))
    x = answers.fixed;
  else if (method.starts_with("moreau"))
    x = answers.moreau_jean + 1e-3 / steps;
  else if (answers.cvode_tighter && tolerance < 1e-10)
    x = *answers.cvode_tighter;
  else
    failure = answers.cvode_failure;
  if (failure) {
    result.status = "inner_solver_failed";
    result.reason = *failure;
  }
  result.q = {x};
  result.v = {0};
  return result;
}

FuzzScene judged(const Answers& given) {
  answers = given;
  JudgeOptions options;
  options.runner = answer;
  return judge(
      ordered_json::parse(R"({"q0": ["0"], "v0": ["0"], "T": "1", "M": [["1"]], "f": ["-9.81"], "contacts": []})"),
      options);
}

TEST(Judge, AllowsTolerancesAndTheErrorOfTheTimeStepping) {
  EXPECT_EQ(judged({}).verdict, FuzzVerdict::agree);
  EXPECT_EQ(judged({.cvode = 1e-6, .moreau_jean = 1e-7}).verdict, FuzzVerdict::agree);
}

TEST(Judge, SaysWhoDisagreesWithWhom) {
  const FuzzScene found = judged({.adaptive = 1e-4, .adaptive_disturbed = 1e-4});
  EXPECT_EQ(found.verdict, FuzzVerdict::disagree);
  EXPECT_EQ(found.parties, "fesd_adaptive:radau-iia:4 and fesd:radau-iia:3,elements=as_needed");
  EXPECT_NEAR(found.difference, 1e-4, 1e-6);
}

TEST(Judge, AMethodThatIsWrongNowAndThenIsNotItsOwnExcuse) {
  // The disturbed runs of fesd_adaptive find the motion of the others: its spread is as large as its error.
  EXPECT_EQ(judged({.adaptive = 1e-4, .adaptive_disturbed = 0}).verdict, FuzzVerdict::disagree);
  // Where no other method says how much the motion amplifies, the spread counts.
  EXPECT_EQ(judged({.adaptive = 1e-4,
                    .adaptive_disturbed = 0,
                    .cvode_failure = FailureReason(),
                    .event_driven_failure = FailureReason()})
                .verdict,
            FuzzVerdict::sensitive);
}

TEST(Judge, AllowsCvodeWhatItsToleranceChanges) {
  EXPECT_EQ(judged({.cvode = 1e-3, .cvode_tighter = 0}).verdict, FuzzVerdict::agree);
  EXPECT_EQ(judged({.cvode = 6e-6, .cvode_tighter = 6e-6}).verdict, FuzzVerdict::disagree);
}

TEST(Judge, AllowsAdaptiveFesdLittle) {
  EXPECT_EQ(judged({.adaptive = 6e-6, .adaptive_disturbed = 6e-6, .adaptive_tighter = 0}).verdict, FuzzVerdict::agree);
  EXPECT_EQ(judged({.adaptive = 1e-4, .adaptive_disturbed = 1e-4, .adaptive_tighter = 0}).verdict,
            FuzzVerdict::disagree);
}

TEST(Judge, TrustsTwoThatLocateEventsMoreThanTimeStepping) {
  EXPECT_EQ(judged({.moreau_jean = 0.3}).verdict, FuzzVerdict::outvoted);
  EXPECT_EQ(judged({.fixed = 0.1, .moreau_jean = 0.3}).verdict, FuzzVerdict::disagree);
  EXPECT_EQ(judged({.moreau_jean = 0.3, .cvode_failure = FailureReason()}).verdict, FuzzVerdict::disagree);
}

TEST(Judge, ExplainsTimeSteppingThroughACollapse) {
  const FailureReason collapse{FailureCode::impacts_accumulate, {"a", "b"}};
  EXPECT_EQ(judged({.moreau_jean = 0.3, .cvode_failure = collapse}).verdict, FuzzVerdict::collapse);
  const FailureReason bounces{FailureCode::impacts_accumulate, {"a"}};
  EXPECT_EQ(judged({.moreau_jean = 0.3, .cvode_failure = bounces}).verdict, FuzzVerdict::disagree);
  // It explains nothing of the others.
  EXPECT_EQ(judged({.fixed = 0.1, .moreau_jean = 0.3, .cvode_failure = collapse}).verdict, FuzzVerdict::disagree);
}

TEST(Judge, HearsTheEventDrivenMethod) {
  const FuzzScene found = judged({.event_driven = 1e-4});
  EXPECT_EQ(found.verdict, FuzzVerdict::disagree);
  EXPECT_TRUE(found.parties.ends_with("and event_driven")) << found.parties;
  EXPECT_EQ(judged({.event_driven = 1e-6}).verdict, FuzzVerdict::agree);
}

TEST(Judge, ComparesInTheUnitsOfTheScene) {
  // A ball of nanometres: an error of 1e-13 m is 1e-4 of the unit.
  answers = {.adaptive = 1e-13, .adaptive_disturbed = 1e-13};
  JudgeOptions options;
  options.runner = answer;
  const auto verdict = [&](const char* unit_length) {
    auto scene =
        ordered_json::parse(R"({"q0": ["0"], "v0": ["0"], "T": "1", "M": [["1"]], "f": ["-9.81"], "contacts": []})");
    scene["params"]["unit_length"] = unit_length;
    return judge(scene, options).verdict;
  };
  EXPECT_EQ(verdict("1"), FuzzVerdict::agree);
  EXPECT_NE(verdict("1e-9"), FuzzVerdict::agree);
}

TEST(Judge, ExplainsWhatIsNotUnique) {
  Answers given{
      .adaptive = 1e-4, .adaptive_disturbed = 1e-4, .cvode_failure = FailureReason{FailureCode::indeterminate, {"g"}}};
  EXPECT_EQ(judged(given).verdict, FuzzVerdict::open);
  given.cvode_failure->code = FailureCode::inconsistent;
  EXPECT_EQ(judged(given).verdict, FuzzVerdict::disagree);
}

TEST(Judge, CountsReasonsWithoutNumbersAndNames) {
  FuzzResult result;
  result.status = "infeasible";
  result.message =
      "from t = 0.58 s, with a step of 1.16e-13 s: contact 'bb0' would stick with 0.547 N more (4 predictions)";
  EXPECT_EQ(result.reason_class(), "infeasible: contact C would stick with # N more");
}

TEST(Minimiser, KeepsWhatTheTestNeeds) {
  const SceneFamily& columns = *std::ranges::find(scene_families(), std::string("columns"), &SceneFamily::name);
  ordered_json scene;
  for (int number = 0; scene.empty() || scene["q0"].size() != 3; ++number) scene = random_scene(columns, 1, number);
  // Needs a contact between two balls, and a spring.
  const auto test = [](const ordered_json& candidate) {
    const auto problem = read_scene_text(candidate.dump(), "candidate");
    bool has_pair = false;
    for (const auto& contact : problem->info().contacts) has_pair = has_pair || contact.support.size() == 2;
    return has_pair;
  };
  ASSERT_TRUE(test(scene));
  const ordered_json smallest = minimise(scene, test, 20);
  EXPECT_TRUE(test(smallest));
  EXPECT_EQ(smallest["q0"].size(), 2u);
  EXPECT_EQ(smallest["contacts"].size(), 1u);
  for (const auto& [name, value] : smallest["params"].items()) EXPECT_LE(value.get<std::string>().size(), 6u) << name;
}

}  // namespace
}  // namespace ricochet
