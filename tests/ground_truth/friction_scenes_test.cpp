// The reference on scenes with friction that the ground truth has not: begin of slip in space, curved and several
// contacts, impacts in space, and states without a solution or with several.
#include <gtest/gtest.h>

#include <cmath>

#include "reference/agreement.h"
#include "tests/test_data.h"

namespace ricochet {
namespace {

std::unique_ptr<Problem> friction_scene(const std::string& id, const ParameterChanges& changes = {}) {
  return read_scene_file(test_data("friction_scenes.json") + "#" + id, changes);
}

TEST(FrictionInSpace, BeginsToSlipAtTheConeAsTheClosedFormDoes) {
  const auto problem = friction_scene("block_begins_to_slide");
  const auto reference = reference::make_reference(*problem);
  const Solution& s = reference.solution;
  ASSERT_EQ(kinds(s), std::vector{EventKind::stick_to_slip});
  EXPECT_NEAR(s.events[0].t, 0.3, reference.uncertainty);
  EXPECT_EQ(s.initial_modes, std::vector{ContactMode::stick});
  EXPECT_EQ(s.events[0].modes, std::vector{ContactMode::slip});
  const Vector q = Eigen::Vector4d(1. / 3, 1. / 4, 0, 1), v = Eigen::Vector4d(1, 1, 0, 1);  // s = 1
  EXPECT_LE(reference::final_state_difference(s.q, s.v, q, v), reference.uncertainty);
  EXPECT_GE(reference.digits(), 9);
}

TEST(FrictionInSpace, SlipsFromRestAsTheClosedFormDoes) {
  const auto problem = friction_scene("block_starts_at_once");
  const auto reference = reference::make_reference(*problem);
  const Vector q = Eigen::Vector4d(1. / 2, 1. / 3, 0, 1), v = Eigen::Vector4d(1, 1, 0, 1);
  EXPECT_LE(reference::final_state_difference(reference.solution.q, reference.solution.v, q, v), reference.uncertainty);
  EXPECT_GE(reference.digits(), 9);
  EXPECT_EQ(reference.solution.initial_modes, std::vector{ContactMode::slip});
}

TEST(FrictionInSpace, TurnsBackThroughRest) {
  const auto problem = friction_scene("block_turns_back");
  const auto reference = reference::make_reference(*problem);
  const Solution& s = reference.solution;
  const double g = 9.81, mu = 0.3, F = 5, T = 0.5;
  const double turn = 1 / (F + mu * g), back = F - mu * g;
  const double x = -0.5 * turn + 0.5 * back * (T - turn) * (T - turn);
  const Vector d = Eigen::Vector3d(0.6, 0.8, 0);
  ASSERT_EQ(kinds(s), std::vector{EventKind::slip_reversal});
  EXPECT_NEAR(s.events[0].t, turn, reference.uncertainty);
  EXPECT_LE(reference::final_state_difference(s.q, s.v, x * d, back * (T - turn) * d), reference.uncertainty);
  EXPECT_GE(reference.digits(), 9);
}

TEST(FrictionInSpace, ImpactsOfABallFollowTheClosedForm) {
  const auto problem = friction_scene("spinning_ball");
  const auto reference = reference::make_reference(*problem);
  // Slip velocity against impulse: v_t+ = v_t- + (1/m + r^2/J) Lambda_t, with 1/m + r^2/J = 7/2 for a full ball, m = 1.
  const double r = 0.1, g = 9.81, mu = 0.3, e = 0.6;
  Eigen::Vector2d v_t(0.6 - 5 * r, -0.4 + 2 * r);
  double v_n = std::sqrt(2 * g * (0.5 - r));
  bool sticks = false;
  for (const auto& event : reference.solution.events) {
    ASSERT_EQ(event.kind, EventKind::impact);
    const double Lambda_n = (1 + e) * v_n;
    Eigen::Vector2d Lambda_t = -2. / 7 * v_t;
    sticks = Lambda_t.norm() <= mu * Lambda_n;
    if (!sticks) Lambda_t = -mu * Lambda_n * v_t.normalized();
    EXPECT_NEAR(event.Lambda_n[0], Lambda_n, 10 * reference.uncertainty);
    EXPECT_LE((event.Lambda_t - Lambda_t).norm(), 10 * reference.uncertainty);
    v_t += 7. / 2 * Lambda_t;
    v_n *= e;
  }
  EXPECT_TRUE(sticks);
  EXPECT_EQ(reference.solution.events.size(), 6u);
  EXPECT_GE(reference.digits(), 9);
}

/// Bead on the lower half circle at the angle phi behind its left end: w = phi'^2 obeys
/// dw/dphi = 2 g/R (cos phi - mu sin phi) - 2 mu w while phi grows, and the same with -mu while it falls.
struct Bowl {
  double mu, g = 9.81;
  double A = 6 * mu * g / (1 + 4 * mu * mu), B = 2 * g - 2 * mu * A;
  double periodic(double phi) const { return A * std::cos(phi) + B * std::sin(phi); }
  double w(double phi, double phi0, double w0) const {
    return periodic(phi) + (w0 - periodic(phi0)) * std::exp(-2 * mu * (phi - phi0));
  }
};

double angle(const Vector& q) {
  return std::atan2(-q[1], -q[0]);
}

TEST(FrictionOnACurve, BeadInABowlFollowsItsEnergyLaw) {
  const auto problem = friction_scene("bead_in_rough_bowl");
  const auto reference = reference::make_reference(*problem);
  const Solution& s = reference.solution;
  ASSERT_EQ(kinds(s), std::vector{EventKind::slip_reversal});
  const double turn = angle(s.events[0].q);
  // w changes by up to 2 g per radian and 2 |v| per m/s: 20 times the uncertainty of the state.
  const double bound = 20 * reference.uncertainty;
  EXPECT_NEAR((Bowl{0.2}.w(turn, 0, 1)), 0, bound);
  EXPECT_NEAR((Bowl{-0.2}.w(angle(s.q), turn, 0)), s.v.squaredNorm(), bound);
  EXPECT_NEAR(s.q.norm(), 1, reference.uncertainty);
  EXPECT_GE(reference.digits(), 9);
}

TEST(SeveralContacts, FourBlocksStickAndSlipInTurn) {
  const auto problem = friction_scene("train");
  const auto reference = reference::make_reference(*problem);
  const Solution& s = reference.solution;
  EXPECT_GE(reference.digits(), 9);
  EXPECT_EQ(s.events.size(), 17u);
  EXPECT_EQ(s.events.back().modes, std::vector<ContactMode>(4, ContactMode::stick));
  EXPECT_LE(s.v.cwiseAbs().maxCoeff(), with_rounding(0)) << "stuck, so only rounding is left";
  // Stuck for good: the springs pull less than the friction can hold.
  const Vector f = problem->force(s.q, s.v);
  for (int i = 0; i < 4; ++i) EXPECT_LE(std::abs(f[2 * i]), problem->info().contacts[i].mu * 9.81);
}

TEST(SeveralContacts, LadderLeavesTheWallAtZeroForce) {
  const auto problem = friction_scene("ladder");
  const auto reference = reference::make_reference(*problem);
  const Solution& s = reference.solution;
  EXPECT_GE(reference.digits(), 9);
  EXPECT_EQ(s.initial_modes, (std::vector{ContactMode::slip_positive, ContactMode::slip_negative}));
  ASSERT_EQ(kinds(s), std::vector{EventKind::detach});
  EXPECT_EQ(s.events[0].modes, (std::vector{ContactMode::slip_positive, ContactMode::open}));
  EXPECT_LT(*problem->energy(s.q, s.v), *problem->energy(problem->info().q0, problem->info().v0));
}

TEST(SeveralContacts, LadderAtRestStaysThoughItsForcesAreNotUnique) {
  // Both ends stick: four conditions on three coordinates, the wall may push the more the more it pulls down.
  const auto problem = friction_scene("ladder", {{"omega", 0}, {"mu", 2}});
  const Solution s = reference::integrate_event_located(*problem, {});
  ASSERT_TRUE(s.succeeded()) << s.message;
  EXPECT_TRUE(s.events.empty());
  EXPECT_EQ(s.initial_modes, std::vector(2, ContactMode::stick));
  // Hundreds of roundings of what the weight does in the run.
  EXPECT_LE(reference::final_state_difference(s.q, s.v, problem->info().q0, problem->info().v0), 1e-12);
}

TEST(Painleve, SlidingRodHasNoSolution) {
  const Solution s = reference::integrate_event_located(*friction_scene("rod"), {});
  EXPECT_EQ(s.status, Status::inner_solver_failed);
  EXPECT_NE(s.message.find("inconsistent: no combination of modes satisfies the contact law at 'tip'"),
            std::string::npos)
      << s.message;
}

TEST(Painleve, TurningRodHasTwo) {
  const Solution s = reference::integrate_event_located(*friction_scene("rod", {{"omega", 6}}), {});
  EXPECT_EQ(s.status, Status::inner_solver_failed);
  EXPECT_NE(s.message.find("indeterminate"), std::string::npos) << s.message;
  EXPECT_NE(s.message.find("'tip' may be open or slip-"), std::string::npos) << s.message;
}

TEST(Painleve, BelowTheCriticalFrictionTheRodSticksWhereItStops) {
  // 1/m + (l^2 / J)(cos^2 - mu sin cos) > 0 for mu < 1.347 at 60 degrees.
  const auto reference = reference::make_reference(*friction_scene("rod", {{"mu", 1.2}}));
  EXPECT_EQ(kinds(reference.solution), std::vector{EventKind::slip_to_stick});
  EXPECT_GE(reference.digits(), 9);
}

}  // namespace
}  // namespace ricochet
