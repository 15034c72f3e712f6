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
  double ida = 0;
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
  if (method == "ida") {
    x = answers.ida;
  } else if (method == "event_driven") {
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
  options.proof_limit = 0;
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

TEST(Judge, HearsFiveMoreWhereForcesBend) {
  const auto judged_scene = [](const char* force, const char* friction, double ida) {
    answers = {};
    answers.ida = ida;
    JudgeOptions options;
    options.runner = answer;
    options.proof_limit = 0;
    return judge(
        ordered_json::parse(fmt::format(
            R"({{"q0": ["0"], "v0": ["0"], "T": "1", "M": [["1"]], "f": ["{}"], "contacts": [], "friction": [{}]}})",
            force, friction)),
        options);
  };
  EXPECT_EQ(judged_scene("-9.81", "", 1e-4).results.size(), 5u);
  EXPECT_EQ(judged_scene("-9.81", R"({"Jt": [["1"]], "bound": "1"})", 0).results.size(), 10u);
  EXPECT_EQ(judged_scene("-9.81-v[0]*abs(v[0])", "", 0).verdict, FuzzVerdict::agree);
  const FuzzScene found = judged_scene("-9.81-v[0]*abs(v[0])", "", 1e-4);
  EXPECT_EQ(found.verdict, FuzzVerdict::disagree);
  EXPECT_TRUE(found.parties.find("ida") != std::string::npos) << found.parties;
}

TEST(Judge, ComparesInTheUnitsOfTheScene) {
  // A ball of nanometres: an error of 1e-13 m is 1e-4 of the unit.
  answers = {.adaptive = 1e-13, .adaptive_disturbed = 1e-13};
  JudgeOptions options;
  options.runner = answer;
  options.proof_limit = 0;
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

// Proofs that answer as a test wants.
struct Proof {
  const char* grade = "proven";
  double x = 0, x_rounded = 0;
  double seconds = 0;  // that it needs
};
Proof proof;

FuzzTruth planted_proof(const Problem&, const reference::certified::Options& options) {
  FuzzTruth truth;
  truth.grade = options.max_seconds >= proof.seconds ? proof.grade : "open";
  truth.decimals = 20;
  truth.q = {options.reading == reference::certified::Reading::decimal ? proof.x : proof.x_rounded};
  truth.v = {0};
  truth.error = 1e-20;
  return truth;
}

FuzzScene judged_with_proof(const Answers& given, const Proof& planted, decltype(&prove_scene) prover = planted_proof) {
  answers = given;
  proof = planted;
  JudgeOptions options;
  options.runner = answer;
  options.prover = prover;
  // thrown upwards, it is at its highest at the end
  return judge(
      ordered_json::parse(R"({"q0": ["0"], "v0": ["9.81"], "T": "1", "M": [["1"]], "f": ["-9.81"], "contacts": []})"),
      options);
}

Answers all(double x) {
  return {.adaptive = x, .adaptive_disturbed = x, .fixed = x, .cvode = x, .moreau_jean = x, .event_driven = x};
}

TEST(Judge, BelievesAProofBeforeAnyMajority) {
  EXPECT_EQ(judged_with_proof(all(0), {}).verdict, FuzzVerdict::agree);
  for (const char* grade : {"proven", "assumed"}) {
    const FuzzScene found = judged_with_proof(all(1e-3), {.grade = grade});
    EXPECT_EQ(found.verdict, FuzzVerdict::wrong) << "all methods agree, and are wrong";
    for (const char* method : {"fesd_adaptive", "fesd:", "cvode", "event_driven"})
      EXPECT_NE(found.detail.find(method), std::string::npos) << found.detail;
    EXPECT_TRUE(found.parties.ends_with(" and the truth")) << found.parties;
  }
  Answers one_is_right = all(1e-3);
  one_is_right.event_driven = 0;
  const FuzzScene found = judged_with_proof(one_is_right, {});
  EXPECT_EQ(found.verdict, FuzzVerdict::wrong);
  EXPECT_EQ(found.detail.find("event_driven"), std::string::npos) << found.detail;
  EXPECT_EQ(judged_with_proof(all(1e-3), {.grade = "open"}).verdict, FuzzVerdict::agree);
  EXPECT_EQ(judged_with_proof({.moreau_jean = 0.3}, {}).verdict, FuzzVerdict::outvoted);
  EXPECT_EQ(judged_with_proof(all(0), {.grade = "crashed"}).verdict, FuzzVerdict::hangs);
}

TEST(Judge, LetsNoMethodExcuseAnother) {
  // Two that differ by less than both are allowed; one of them differs from the truth by more than it is allowed.
  Answers far = all(0);
  far.event_driven = 1.7e-6;
  EXPECT_EQ(judged(far).verdict, FuzzVerdict::agree);
  EXPECT_EQ(judged_with_proof(far, {}).verdict, FuzzVerdict::wrong);
}

TEST(Judge, AsksTheProofOnceMore) {
  Answers far = all(0);
  far.event_driven = 1e-4;
  EXPECT_EQ(judged_with_proof(far, {.seconds = 1}).verdict, FuzzVerdict::wrong) << "with ten times as much time";
  EXPECT_EQ(judged_with_proof(far, {.seconds = 10}).verdict, FuzzVerdict::disagree);
  // Methods integrate the rounded scene, which moves elsewhere.
  EXPECT_EQ(judged_with_proof(all(1e-3), {.x_rounded = 1e-3}).verdict, FuzzVerdict::agree);
}

TEST(Judge, ProvesAThrow) {
  if (!reference::certified::can_certify()) GTEST_SKIP() << "Arb is not installed";
  const FuzzScene right = judged_with_proof(all(4.905), {}, prove_scene);
  EXPECT_EQ(right.verdict, FuzzVerdict::agree);
  EXPECT_EQ(right.truth.grade, "proven");
  EXPECT_GE(right.truth.decimals, 20);
  EXPECT_EQ(judged_with_proof(all(4.906), {}, prove_scene).verdict, FuzzVerdict::wrong);
}

TEST(Judge, ProvesADrivenScene) {
  if (!reference::certified::can_certify()) GTEST_SKIP() << "Arb is not installed";
  const SceneFamily& loads = *std::ranges::find(scene_families(), std::string("loads"), &SceneFamily::name);
  const FuzzScene judged = judge(random_scene(loads, 4301, 0), {.proof_limit = 5});
  EXPECT_EQ(judged.truth.grade, "proven") << judged.truth.reason;
  EXPECT_EQ(judged.verdict, FuzzVerdict::agree) << judged.detail;
  for (const FuzzResult& result : judged.results) EXPECT_EQ(result.q.size(), judged.truth.q.size()) << "with the clock";
}

TEST(Judge, CountsReasonsWithoutNumbersAndNames) {
  FuzzResult result;
  result.status = "infeasible";
  result.message =
      "from t = 0.58 s, with a step of 1.16e-13 s: contact 'bb0' would stick with 0.547 N more (4 predictions)";
  EXPECT_EQ(result.reason_class(), "infeasible: contact C would stick with # N more");
}

TEST(Minimiser, DropsFrictionElements) {
  const ordered_json scene = ordered_json::parse(R"({"params": {"T": "1", "F": "2", "G": "3"}, "q0": ["0", "1"],
      "v0": ["1", "0"], "T": "T", "M": [["1", "0"], ["0", "1"]], "f": ["0", "0"], "contacts": [],
      "friction": [{"name": "a", "Jt": [["1", "0"]], "bound": "F"}, {"name": "b", "Jt": [["0", "1"]], "bound": "G+q[1]"}]})");
  const ordered_json smallest = minimise(
      scene, [](const ordered_json& s) { return read_scene_text(s.dump(), "scene")->info().n_friction_elements > 0; },
      10);
  EXPECT_EQ(smallest["q0"].size(), 1u);
  ASSERT_EQ(smallest["friction"].size(), 1u);
  EXPECT_EQ(smallest["friction"][0]["Jt"], ordered_json::parse(R"([["1"]])"));
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
