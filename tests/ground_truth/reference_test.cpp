// The reference where it is hard to go on: slip in space that ends, redundant contacts, rest, accumulations, surfaces
// that move, and scenes in other units or with strangers in them.
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <numbers>

#include "methods/registry.h"
#include "reference/agreement.h"
#include "reference/force_division.h"
#include "reference/force_equations.h"
#include "tests/test_data.h"

namespace ricochet {
namespace {

std::unique_ptr<Problem> reference_scene(const std::string& id, const ParameterChanges& changes = {}) {
  return read_scene_file(test_data("reference_scenes.json") + "#" + id, changes);
}

Solution reference_of(const Problem& problem, double tolerance = 1e-10) {
  return reference::integrate_event_located(problem, {.tolerance = tolerance});
}

class Hard : public testing::TestWithParam<const char*> {};

TEST_P(Hard, IsSolvedByAdamsAndBdfAndAnotherMethod) {
  const auto problem = reference_scene(GetParam());
  const auto reference = reference::make_reference(*problem, 1e-12);
  EXPECT_GE(reference.digits(), 7);
  Settings settings;
  settings.tolerance = 1e-10;
  const Solution other = make_method("fesd_adaptive:radau-iia:4")->solve(*problem, settings);
  ASSERT_TRUE(other.succeeded()) << other.message;
  // 1e3 tolerances of either.
  EXPECT_LE(reference.error_of(other), 1e-7);
}

INSTANTIATE_TEST_SUITE_P(Scenes, Hard,
                         testing::Values("spring_pulls_back", "rod_comes_to_lie", "rod_lies_on_both_ends",
                                         "jointed_masses_slip", "jointed_masses_rest"),
                         [](const auto& test) { return test.param; });

TEST(SlipInSpace, EndsThoughASpringTurnsItUntilTheEnd) {
  for (const char* id : {"spring_pulls_back", "masses_in_space"}) {
    const Solution s = reference_of(*reference_scene(id));
    ASSERT_TRUE(s.succeeded()) << id << ": " << s.message;
    EXPECT_LE(s.counters.steps, 1000) << id << ": a hundred are enough, where it hung it took millions";
    bool stops = false;
    for (const auto& event : s.events) stops = stops || event.kind == EventKind::slip_to_stick;
    EXPECT_TRUE(stops) << id;
  }
}

TEST(Accumulation, NamesItsContacts) {
  const Solution column = reference_of(*reference_scene("two_balls_collapse"));
  EXPECT_EQ(column.status, Status::step_limit);
  EXPECT_NE(column.message.find("the impacts of contacts 'floor', 'balls' accumulate"), std::string::npos)
      << column.message;
}

TEST(Limits, StepsAndEventsEndARun) {
  const auto problem = reference_scene("spring_pulls_back");
  const Solution steps = reference::integrate_event_located(*problem, {.max_steps = 20});
  EXPECT_EQ(steps.status, Status::step_limit);
  EXPECT_NE(steps.message.find("20 steps"), std::string::npos) << steps.message;
  const Solution events = reference::integrate_event_located(*problem, {.max_events = 1});
  EXPECT_EQ(events.status, Status::step_limit);
  EXPECT_NE(events.message.find("1 events"), std::string::npos) << events.message;
}

/// The ball of "shaken_table" by itself.
struct ShakenTable {
  double A = 0.02, w = 30, g = 9.81;
  double height(double t) const { return A * std::sin(w * t); }
  double speed(double t) const { return A * w * std::cos(w * t); }
  /// When the ball that lies on the table from t on is thrown off: A w^2 sin(w t) = g, on the way up.
  double leaves(double t) const {
    double when = std::asin(g / (A * w * w)) / w;
    while (when < t) when += 2 * std::numbers::pi / w;
    return when;
  }
  /// When the ball that is thrown off at t comes back.
  double lands(double t) const {
    const auto gap = [&](double s) { return height(t) + s * (speed(t) - 0.5 * g * s) - height(t + s); };
    double before = 1e-3, step = 1e-4;  // the gap is open there
    while (gap(before + step) > 0) before += step;
    for (int k = 0; k < 50; ++k, step /= 2) {
      if (gap(before + step / 2) > 0) before += step / 2;
    }
    return t + before;
  }
};

TEST(MovingSurface, ABallThatLandsWithoutRestitutionStaysUntilItIsThrownOffAgain) {
  const ShakenTable table;
  const auto problem = reference_scene("shaken_table");
  for (const auto integrator : {reference::adams, reference::bdf}) {
    for (const double tolerance : {1e-8, 1e-9, 1e-10, 1e-11, 1e-12}) {
      const Solution s =
          reference::integrate_event_located(*problem, {.integrator = integrator, .tolerance = tolerance});
      ASSERT_TRUE(s.succeeded()) << tolerance << ": " << s.message;
      ASSERT_EQ(s.events.size(), 5U) << tolerance;
      double t = 0;
      for (std::size_t k = 0; k < s.events.size(); ++k) {
        EXPECT_EQ(s.events[k].kind, k % 2 == 0 ? EventKind::detach : EventKind::impact) << tolerance << " " << k;
        t = k % 2 == 0 ? table.leaves(t) : table.lands(t);
        // The clock loses up to 1e-9 at each impact; 1e3 tolerances.
        EXPECT_NEAR(s.events[k].t, t, 2e-8 + 1e3 * tolerance) << tolerance << " " << k;
      }
    }
  }
}

TEST(MovingSurface, IsNotPassedInFreeFallWhoseStepsHaveNoError) {
  // Five flights end within two waves of the table, and the motion between them is a polynomial.
  const auto problem =
      reference_scene("shaken_table", {{"A", 0.0214}, {"w", 39.7546}, {"e", 0.5}, {"y", 0.0413}, {"v", 0}, {"T", 0.3}});
  for (const double tolerance : {1e-8, 1e-9, 1e-10, 1e-11, 1e-12}) {
    const Solution s = reference_of(*problem, tolerance);
    ASSERT_TRUE(s.succeeded()) << tolerance << ": " << s.message;
    EXPECT_EQ(s.events.size(), 5U) << tolerance;
  }
}

TEST(Rest, IsKeptByRedundantContacts) {
  // Two normal and two tangential forces too many, and nothing moves, so that every size comes from the weight.
  const Solution s = reference_of(*reference_scene("three_legs"));
  ASSERT_TRUE(s.succeeded()) << s.message;
  EXPECT_TRUE(s.events.empty());
  EXPECT_LE(s.v.cwiseAbs().maxCoeff(), 1e-12) << "hundreds of roundings of what the weight does in the run";
  EXPECT_EQ(s.initial_modes, std::vector(3, ContactMode::stick));
}

TEST(Redundant, EightFeetStopTogether) {
  const auto problem = make_problem("block_on_feet");
  const Solution s = reference_of(*problem);
  ASSERT_TRUE(s.succeeded()) << s.message;
  EXPECT_EQ(kinds(s), std::vector(problem->info().contacts.size(), EventKind::slip_to_stick));
  const double v = problem->info().v0[0], mu = problem->info().contacts[0].mu;
  EXPECT_NEAR(s.q[0] - problem->info().q0[0], v * v / (2 * mu * 9.81), 1e-8) << "a hundred tolerances";
  EXPECT_LE(s.v.cwiseAbs().maxCoeff(), 1e-12) << "a thousand roundings, of eight feet";
}

TEST(Scales, OtherUnitsGiveTheSameMotion) {
  const Solution expected = reference_of(*reference_scene("jointed_masses"));
  ASSERT_TRUE(expected.succeeded()) << expected.message;
  ASSERT_GE(expected.events.size(), 3U);
  const double much = std::pow(2, 20), little = 1 / much;  // exact, so that nothing but thresholds could differ
  const std::vector<std::array<double, 3>> units{{much, 1, 1}, {little, 1, 1}, {1, much, 1},          {1, little, 1},
                                                 {1, 1, much}, {1, 1, little}, {little, much, little}};
  for (const auto& [L, s, m] : units) {
    const Solution other = reference_of(*reference_scene("jointed_masses", {{"L", L}, {"s", s}, {"m", m}}));
    ASSERT_TRUE(other.succeeded()) << L << " " << s << " " << m << ": " << other.message;
    EXPECT_EQ(kinds(other), kinds(expected));
    // Steps are the same, so that only powers and orders of sums may round differently: thousands of roundings.
    EXPECT_LE((other.q / L - expected.q).cwiseAbs().maxCoeff(), 1e-12) << L << " " << s << " " << m;
    EXPECT_LE((other.v * (s / L) - expected.v).cwiseAbs().maxCoeff(), 1e-12) << L << " " << s << " " << m;
  }
}

TEST(Scales, AStrangerThatIsFastAndHeavyChangesNothing) {
  const Solution alone = reference_of(*reference_scene("jointed_masses")),
                 together = reference_of(*reference_scene("jointed_masses_and_stranger"));
  ASSERT_TRUE(alone.succeeded() && together.succeeded()) << alone.message << together.message;
  EXPECT_EQ(kinds(together), kinds(alone));
  // CVODE's error norm is a mean over all unknowns, so steps differ: 1e3 tolerances.
  EXPECT_LE((together.q.head(4) - alone.q).cwiseAbs().maxCoeff(), 1e-7);
  EXPECT_LE((together.v.head(4) - alone.v).cwiseAbs().maxCoeff(), 1e-7);
}

TEST(ForceEquations, ShareTheLeastForces) {
  // Two equal supports at one place, and one of its own.
  Matrix R(2, 3);
  R << 1, 1, 0, 0, 0, 1;
  const Matrix A = R.transpose() * R;
  const reference::ForceEquations equations(A, A.diagonal());
  const auto x = equations.solve(Eigen::Vector3d(6, 6, 2), Eigen::Vector3d(6, 6, 2));
  ASSERT_TRUE(x);
  EXPECT_LE((*x - Vector(Eigen::Vector3d(3, 3, 2))).norm(), with_rounding(0) * 6);
  EXPECT_FALSE(equations.determines(0));
  EXPECT_FALSE(equations.determines(1));
  EXPECT_TRUE(equations.determines(2));
  EXPECT_TRUE(equations.determines_motion(R));
  EXPECT_FALSE(equations.determines_motion(Matrix::Identity(3, 3)));
  EXPECT_FALSE(equations.solve(Eigen::Vector3d(6, 5, 2), Eigen::Vector3d(6, 6, 2))) << "out of reach";
}

TEST(ForceDivision, IsTheFarthestInsideTheCones) {
  // Two supports side by side carry 10 N each and hold 6 N together, one of them with little friction.
  const Eigen::Vector4d least(10, 3, 10, 3), N(0, 1, 0, -1);
  const Vector x = reference::steadiest_division(least, N, {{0, 1, 0.2}, {2, 1, 0.5}});
  EXPECT_NEAR(x[1], 1.5, 1e-14) << "2 - x = 5 - (6 - x)";
  EXPECT_NEAR(x[3], 4.5, 1e-14);
  const Vector spare = reference::steadiest_division(least, N, {{0, 1, 0.2}, {2, 1, 0.2}});
  EXPECT_LT(reference::slack(spare, {{0, 1, 0.2}, {2, 1, 0.2}}), 0) << "6 N are more than both can hold";
}

TEST(ForceDivision, CutsConesInSpace) {
  Vector least(6);
  least << 10, 3, 4, 10, 3, 4;
  Matrix N = Matrix::Zero(6, 2);
  N(1, 0) = N(2, 1) = 1;
  N(4, 0) = N(5, 1) = -1;
  const std::vector<reference::ForceCone> cones{{0, 2, 0.1}, {3, 2, 1.1}};
  const Vector x = reference::steadiest_division(least, N, cones);
  // Together 10 N along (3, 4); 1 - x = 11 - (10 - x) at x = 0.
  EXPECT_NEAR(reference::slack(x, cones), 1, 1e-8) << "ten times what ends the cuts, of 10 N";
  EXPECT_NEAR(x[4], 6, 1e-3) << "flat across the force: the square root of that";
}

}  // namespace
}  // namespace ricochet
