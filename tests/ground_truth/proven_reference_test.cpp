// References from proofs, against solutions of 42 decimals, and their uncertainty.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>

#include "problems/registry.h"
#include "reference/certified/certified_motion.h"
#include "reference/proven.h"
#include "reference/truths.h"
#include "tests/test_data.h"

namespace ricochet {
namespace {

using reference::proven_reference;

class ProvenReference : public testing::Test {
 protected:
  void SetUp() override {
    if (!reference::certified::can_certify()) GTEST_SKIP() << "Arb is not installed";
  }
};

TEST_F(ProvenReference, KeepsItsClaim) {
  int proven = 0;
  for (const auto& truth : reference::certified_cases()) {
    const auto problem = make_problem(truth.id);
    const auto found = proven_reference(*problem, 20);
    if (!found) continue;
    ++proven;
    const auto& s = found->solution;
    const Eigen::Index n = problem->info().n_mechanical();
    EXPECT_LE(reference::final_state_difference(s.q.head(n), s.v.head(n), truth.q.head(n), truth.v.head(n)),
              found->uncertainty)
        << truth.id;
    EXPECT_LE(found->uncertainty, 1e-11 * found->size()) << truth.id;  // rounded parameters times their effect
  }
  EXPECT_GE(proven, 14);  // of 16: slip in space ends in P7a
}

TEST_F(ProvenReference, ContainsTheEffectOfRoundedNumbers) {
  // e^2 of the ball moves by rounding 0.9; the motion of the rounded scene is another one.
  const auto problem = make_problem("P1a_ball_e09");
  const auto rounded = reference::certified::certified_motion(
      *problem, {.digits = 30, .reading = reference::certified::Reading::rounded});
  const auto decimal = reference::certified::certified_motion(*problem, {.digits = 30});
  ASSERT_FALSE(rounded.q.empty());
  EXPECT_NE(rounded.q[0].text, decimal.q[0].text);
  const auto found = proven_reference(*problem);
  ASSERT_TRUE(found);
  EXPECT_LE(std::abs(std::stod(rounded.q[0].text) - found->solution.q[0]), found->uncertainty);
}

TEST_F(ProvenReference, IsOfTheInitialStateThatWasSet) {
  const auto problem = make_problem("bouncing_ball");
  const auto before = proven_reference(*problem);
  problem->set_initial_state(2 * problem->info().q0, problem->info().v0);
  const auto after = proven_reference(*problem);
  ASSERT_TRUE(before && after);
  const auto exact = reference::make_reference(*problem);
  EXPECT_LE(reference::final_state_difference(after->solution.q, after->solution.v, exact.solution.q, exact.solution.v),
            after->uncertainty + exact.uncertainty);
  EXPECT_GT(std::abs(before->solution.q[0] - after->solution.q[0]), 1e-3);
}

TEST_F(ProvenReference, IsNotOfAnotherImpactLaw) {
  const auto problem = make_problem("kane_pendulum");
  ASSERT_TRUE(proven_reference(*problem));
  ImpactLaw law = problem->info().impact_law;
  law.hypothesis = ImpactHypothesis::poisson;
  problem->set_impact_law(law);
  EXPECT_FALSE(proven_reference(*problem));
}

TEST_F(ProvenReference, IsTakenBeforeCvodeWhereThereIsOne) {
  EXPECT_FALSE(proven_reference(*make_problem("newtons_cradle")));  // another impact law
  const auto proven = reference::truth_of(*make_problem("bouncing_ball"));
  EXPECT_TRUE(proven.is_truth);
  EXPECT_TRUE(proven.title().starts_with("truth proven to ") && proven.title().ends_with(" decimals"));
  EXPECT_FALSE(reference::make_reference(*make_problem("bouncing_ball")).is_truth);
}

nlohmann::json stored_proofs() {
  return nlohmann::json::parse(std::ifstream(reference_data("proofs.json"))).at("proofs");
}

std::unique_ptr<Problem> problem_of(const nlohmann::json& proof) {
  const std::string scene = proof.at("scene");
  const auto parameters = proof.at("parameters").get<ParameterChanges>();
  if (scene.find(".json") == std::string::npos) return make_problem(scene, parameters);
  const auto beside_experiments = std::filesystem::path(reference_data("../../bench/experiments")) / scene;
  return read_scene_file(
      std::filesystem::exists(beside_experiments) ? beside_experiments.string() : reference_data("../../" + scene),
      parameters);
}

/// Otherwise reference/data/prove_scenes has to be run again.
TEST(StoredProofs, BelongToTheScenesOfToday) {
  const auto proofs = stored_proofs();
  EXPECT_GE(proofs.size(), 40U);
  for (const auto& proof : proofs)
    EXPECT_EQ(reference::hash_of_formulas(*problem_of(proof)), proof.at("formulas_sha256"))
        << proof.at("scene") << proof.at("parameters");
}

TEST_F(ProvenReference, OfTodayIsTheStoredOne) {
  for (const auto& proof : stored_proofs()) {
    if (proof.at("seconds") > 0.2) continue;
    const auto motion = reference::certified::certified_motion(*problem_of(proof), {.digits = 30});
    const std::string name = fmt::format("{} {}", proof.at("scene").dump(), proof.at("parameters").dump());
    ASSERT_EQ(name_of(motion.grade), proof.at("grade")) << name;
    for (const auto& [list, numbers] : {std::pair{"q", motion.q}, std::pair{"v", motion.v}}) {
      ASSERT_EQ(proof.at(list).size(), numbers.size()) << name;
      for (std::size_t k = 0; k < numbers.size(); ++k) {
        const double stored = std::stod(proof.at(list)[k].at("value").get<std::string>());
        // two roundings to double, beside which radii vanish
        EXPECT_NEAR(std::stod(numbers[k].text), stored, 1e-15 * std::max(1.0, std::abs(stored))) << name;
      }
    }
  }
}

TEST(StoredProof, HoldsWithoutANewOne) {
  const auto problem = make_problem("two_balls_spring", {{"k", 1e7}});
  const auto stored = proven_reference(*problem, 0.001);  // a new one takes longer
  ASSERT_TRUE(stored);
  EXPECT_NE(stored->how.find("proven to"), std::string::npos);
  problem->set_initial_state(1.01 * problem->info().q0, problem->info().v0);
  EXPECT_FALSE(proven_reference(*problem, 0.001)) << "of another start";
}

}  // namespace
}  // namespace ricochet
