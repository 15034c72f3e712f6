// What happens to one contact at one instant: impulse, mode, and the modes that it might have instead.
#include "methods/fesd/element_start.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include "problems/scene_file/scene_file.h"

namespace ricochet {
namespace {

constexpr double kMass = 2, kWeight = 2 * 9.81, kRestitution = 0.5, kMu = 0.3;
// Rounding of single sums and products of numbers of the size of 1.
constexpr double kSums = 1e-14;

class ElementStartTest : public testing::Test {
 protected:
  /// A block of 2 kg at (x, height) above the ground. @param push  along the ground [N]; @param lift  against gravity
  void put_block(double push, double lift = 0) {
    problem = read_scene_text(
        fmt::format(R"({{"q0": [0, 0], "v0": [0, 0], "T": 1, "M": [[{0}, 0], [0, {0}]], "f": [{1:.17g}, {2:.17g}],
          "contacts": [{{"name": "ground", "gap": "q[1]", "e": {3}, "mu": {4}, "Jt": [[1, 0]]}}]}})",
                    kMass, push, lift - kWeight, kRestitution, kMu),
        "block");
    tableau = make_tableau("radau-iia", 2);
    scales.emplace(*problem);
    solver.emplace(*problem, tableau, FrictionPolygon(), *scales, counters);
    step.H = 0.1;
    step.resize(*problem, 2, 2);
    start.reserve(problem->info());
  }

  void begin(double v_x, double v_y, double height = 0) {
    step.elements[0].q0 << 0, height;
    step.v_minus.col(0) << v_x, v_y;
    scales->begin_step(step.elements[0].q0.data(), step.v_minus.data(), step.H, true);
    ASSERT_EQ(solver->begin({step, 0, nullptr, {}, false, start}), ElementStartSolver::Result::done);
  }

  ContactMode mode(int element = 0) const { return step.elements[static_cast<std::size_t>(element)].modes[0]; }

  Counters counters;
  std::unique_ptr<Problem> problem;
  ButcherTableau tableau;
  std::optional<ContactScales> scales;
  std::optional<ElementStartSolver> solver;
  FesdStep step;
  ElementStart start;
};

TEST_F(ElementStartTest, FlightHasNeitherImpulseNorForce) {
  put_block(0);
  begin(1, -2, 0.3);
  EXPECT_EQ(mode(), ContactMode::open);
  EXPECT_TRUE(start.touching.empty());
  EXPECT_TRUE(start.alternatives.empty());
  EXPECT_EQ(step.Lambda_n(0, 0), 0);
  EXPECT_FALSE(step.touches);
}

TEST_F(ElementStartTest, ABounceMayBeClosedInstead) {
  put_block(0);
  begin(0, -2);
  EXPECT_EQ(mode(), ContactMode::open);
  EXPECT_NEAR(step.Lambda_n(0, 0), kMass * (1 + kRestitution) * 2, kSums);
  EXPECT_NEAR(step.elements[0].v0[1], kRestitution * 2, kSums);
  EXPECT_EQ(step.n_impacts[0], 1);
  ASSERT_EQ(start.alternatives.size(), 1u);
  EXPECT_TRUE(start.alternatives[0].bounced());
  EXPECT_EQ(start.alternatives[0].mode, ContactMode::stick);
  EXPECT_NEAR(start.alternatives[0].v_n, kRestitution * 2, kSums);

  ASSERT_EQ(solver->close_instead({step, 0, nullptr, {}, false, start}, 1), ElementStartSolver::Result::done);
  EXPECT_EQ(mode(), ContactMode::stick);
  EXPECT_NEAR(start.lambda_n[0], kWeight, kWeight * kSums);
  EXPECT_EQ(start.alternatives.size(), 1u) << "they stay those of begin()";
}

TEST_F(ElementStartTest, AnImpactOfASlidingBlockHasFriction) {
  put_block(0);
  begin(5, -2);
  EXPECT_NEAR(step.Lambda_t(0, 0), -kMu * step.Lambda_n(0, 0), kSums);
  EXPECT_NEAR(step.elements[0].v0[0], 5 - kMu * (1 + kRestitution) * 2, kSums);
  begin(0.1, -2);
  EXPECT_NEAR(step.elements[0].v0[0], 0, kSums) << "it stops";
  EXPECT_NEAR(step.Lambda_t(0, 0), -kMass * 0.1, kSums);
}

TEST_F(ElementStartTest, ABlockAtRestSticks) {
  put_block(1);
  begin(0, 0);
  EXPECT_EQ(mode(), ContactMode::stick);
  EXPECT_EQ(step.Lambda_n(0, 0), 0);
  EXPECT_TRUE(start.alternatives.empty());
  ASSERT_TRUE(start.has_forces);
  EXPECT_NEAR(start.lambda_n[0], kWeight, kWeight * kSums);
  EXPECT_NEAR(start.lambda_t[0], -1, kSums);
  EXPECT_NEAR(start.acceleration.norm(), 0, 9.81 * kSums);
}

TEST_F(ElementStartTest, ABlockAtRestNearTheConeMaySlip) {
  put_block(0.95 * kMu * kWeight);
  begin(0, 0);
  EXPECT_EQ(mode(), ContactMode::stick);
  ASSERT_EQ(start.alternatives.size(), 1u);
  EXPECT_EQ(start.alternatives[0].mode, ContactMode::slip_positive);
  EXPECT_FALSE(start.alternatives[0].bounced());
}

TEST_F(ElementStartTest, APushBeyondTheConeBeginsToSlip) {
  put_block(-2 * kMu * kWeight);
  begin(0, 0);
  EXPECT_EQ(mode(), ContactMode::slip_negative);
  EXPECT_EQ(start.from_rest, std::vector<int>{0});
  EXPECT_NEAR(start.lambda_t[0], kMu * kWeight, kWeight * kSums);
  ASSERT_EQ(start.alternatives.size(), 1u);
  EXPECT_EQ(start.alternatives[0].mode, ContactMode::stick);
}

TEST_F(ElementStartTest, SlipGoesOn) {
  put_block(0);
  begin(-3, 0);
  EXPECT_EQ(mode(), ContactMode::slip_negative);
  EXPECT_TRUE(start.from_rest.empty());
  EXPECT_NEAR(start.acceleration[0], kMu * 9.81, 9.81 * kSums);
  EXPECT_TRUE(start.alternatives.empty());
}

TEST_F(ElementStartTest, ALoadThatPullsOpensTheContact) {
  put_block(0, kWeight + 3);
  begin(0, 0);
  EXPECT_EQ(start.touching, std::vector<int>{0});
  EXPECT_EQ(mode(), ContactMode::open);
  EXPECT_NEAR(start.acceleration[1], 3 / kMass, kWeight * kSums);
  EXPECT_EQ(start.lambda_n[0], 0);
}

TEST_F(ElementStartTest, PartingBodiesGetNoImpulse) {
  put_block(0);
  begin(0, 2);
  EXPECT_EQ(mode(), ContactMode::open);
  EXPECT_EQ(step.Lambda_n(0, 0), 0);
  EXPECT_EQ(step.elements[0].v0[1], 2);
}

/// Slip begins against the force that has reached its cone, whatever the load says then.
TEST_F(ElementStartTest, AContactSlipsAfterReachingItsCone) {
  put_block(kMu * kWeight);
  begin(0, 0);
  Element& left = step.elements[0];
  left.modes[0] = ContactMode::stick;
  left.q1 = left.v1 = Vector::Zero(2);
  left.a.setZero();
  left.lambda_n.setConstant(kWeight);
  left.lambda_t.setConstant(-kMu * kWeight);
  left.end_lambda_n << kWeight;
  left.end_lambda_t << -kMu * kWeight;
  step.elements[1].q0.setZero();
  step.v_minus.col(1).setZero();
  const Switch end{.kind = SwitchKind::cone_reached, .contact = 0};
  ASSERT_EQ(solver->begin({step, 1, &left, end, true, start}), ElementStartSolver::Result::done);
  EXPECT_EQ(mode(1), ContactMode::slip_positive);
  EXPECT_EQ(start.from_rest, std::vector<int>{0});
  ASSERT_EQ(start.alternatives.size(), 1u);
  EXPECT_EQ(start.alternatives[0].mode, ContactMode::stick);
}

TEST_F(ElementStartTest, AContactOpensWhenItsForceVanishes) {
  put_block(0);
  begin(0, 0);
  Element& left = step.elements[0];
  left.modes[0] = ContactMode::stick;
  left.lambda_n.setConstant(1);
  left.end_lambda_n << 0;
  left.end_lambda_t << 0;
  step.elements[1].q0.setZero();
  step.v_minus.col(1).setZero();
  const Switch end{.kind = SwitchKind::force_vanishes, .contact = 0};
  ASSERT_EQ(solver->begin({step, 1, &left, end, true, start}), ElementStartSolver::Result::done);
  EXPECT_EQ(mode(1), ContactMode::open);
  EXPECT_TRUE(start.closed.empty());
}

}  // namespace
}  // namespace ricochet
