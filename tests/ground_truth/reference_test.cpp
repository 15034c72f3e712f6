// The reference where it is hard to go on: slip in space that ends, redundant contacts, rest, accumulations, surfaces
// that move, and scenes in other units or with strangers in them.
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <numbers>

#include "methods/registry.h"
#include "reference/agreement.h"
#include "reference/bracketed_root.h"
#include "reference/contact_dynamics.h"
#include "reference/flights.h"
#include "reference/force_division.h"
#include "reference/force_equations.h"
#include "reference/slip_start.h"
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

/// The last flights of a ball are lower than the errors of a loose tolerance, and may begin below the ground.
TEST(Accumulation, OfABallIsPassedAtAnyTolerance) {
  for (const double eps_r : {0.3, 0.5}) {
    const auto problem = make_problem("bouncing_ball", {{"e", eps_r}});
    for (const auto integrator : {reference::adams, reference::bdf}) {
      for (const double tolerance : {1e-3, 1e-4, 1e-6, 1e-8}) {
        const Solution s =
            reference::integrate_event_located(*problem, {.integrator = integrator, .tolerance = tolerance});
        ASSERT_TRUE(s.succeeded()) << eps_r << " " << tolerance << ": " << s.message;
        EXPECT_LE(std::abs(problem->gap(s.q)[0]), tolerance) << eps_r << ": it lies on the ground";
      }
    }
  }
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

/// Bounds of a force of zero are not zero, but a rounding outward. They do not bound the steps.
TEST(ForcesInTime, OfZeroTakeFewSteps) {
  const auto problem = read_scene_text(
      R"json({"q0": [0, 0], "v0": [0.8, 0], "T": 0.6, "M": [[1, 0], [0, 1]], "f": [0, "-5*max(t-0.2,0)**2"],
              "contacts": [{"name": "jaw", "gap": "q[1]", "e": 0, "mu": 0.5, "Jt": [[1, 0]]}]})json",
      "late press");
  const Solution s = reference_of(*problem, 1e-10);
  ASSERT_TRUE(s.succeeded()) << s.message;
  EXPECT_LE(s.counters.steps, 2000);  // some 50 000 at the finest that is looked ahead
  // From the press on, v' = -0.5 * 5 (t - 0.2)^2.
  EXPECT_NEAR(s.v[0], 0.8 - 2.5 * std::pow(0.4, 3) / 3, 1e-8);
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

/// A spring pulls a mass off a wall at -0.5 m, past the stop at 0: x = -0.5 + 1.5 cos 2t hits it without a bounce and
/// stays, so that the final state says nothing of when that was.
TEST(Reference, BoundsTheTimesOfItsEvents) {
  const auto problem = read_scene_text(
      R"scene({"q0": [1], "v0": [0], "T": 1, "M": [[1]], "f": ["-4*(q[0]+0.5)"], "contacts": [{"name": "stop", "gap": "q[0]",
          "e": 0}]})scene",
      "mass at a stop");
  for (const double tolerance : {1e-8, 1e-10, 1e-12}) {
    const auto reference = reference::make_reference(*problem, tolerance);
    ASSERT_EQ(kinds(reference.solution), std::vector{EventKind::impact});
    EXPECT_LE(std::abs(reference.solution.q[0]), with_rounding(0));
    const double error = std::abs(reference.solution.events[0].t - 0.5 * std::acos(1.0 / 3));
    EXPECT_LE(error, reference.uncertainty) << tolerance;
    EXPECT_LE(reference.uncertainty, 1e4 * tolerance);
  }
}

/// (1) of flights.h: steps are a tenth of the time in which the parabola of the gap comes to zero.
TEST(Flights, EndWhereTheParabolaOfTheGapDoes) {
  const auto problem = make_problem("bouncing_ball", {{"duration", 10}});
  const reference::Scales scales(*problem);
  const double radius = -problem->gap(Vector::Zero(1))[0];
  const auto first_step = [&](double gap, double rate, double a) {
    reference::Flights flights(*problem, scales, 1e-12, 1e-9);
    flights.start(0, Vector::Constant(1, radius + gap), Vector::Constant(1, rate), Vector::Constant(1, a),
                  {ContactMode::open});
    return flights.first_step();
  };
  struct Flight {
    double gap, rate, a;
  };
  for (const auto& [gap, rate, a] : {Flight{1e-6, 0, -10}, Flight{1e-6, 1e-3, -10}, Flight{0, 1e-3, -10},
                                     Flight{1e-6, -1e-2, 0}, Flight{1e-6, -1e-2, 5}}) {
    const double t = 10 * first_step(gap, rate, a);
    ASSERT_GT(t, 0);
    const auto height = [&gap = gap, &rate = rate, &a = a](double at) { return gap + at * (rate + 0.5 * a * at); };
    EXPECT_NEAR(height(t), 0, 1e-15) << gap << " " << rate << " " << a << ": the gap is a difference of positions";
    for (const double part : {0.1, 0.5, 0.9}) EXPECT_GT(height(part * t), 0);
  }
  EXPECT_EQ(first_step(1e-6, 1e-3, 5), 0) << "it never closes";
  EXPECT_EQ(first_step(1e-6, -1e-3, 5), 0) << "it turns back 0.9 um above the surface";
}

/// A block on a plane that a spring pulls to the origin: r'' = -k r + mu g along a line, so r = d + (r_0 - d) cos wt with
/// d = mu g / k as long as it slips. A step of the collocation has the local error of Radau IIA with five stages.
TEST(SlipStart, HasOrderNine) {
  const double mu = 0.3, g = 9.81, k = 25, r_0 = 1.5;
  const Vector along{{0.6, 0.8, 0}};
  const auto problem = read_scene_text(R"({"q0": [0.9, 1.2, 0], "v0": [0, 0, 0], "T": 1,
      "M": [[1, 0, 0], [0, 1, 0], [0, 0, 1]], "f": ["-25*q[0]", "-25*q[1]", -9.81], "contacts": [{"name": "plane",
      "gap": "q[2]", "e": 0, "mu": 0.3, "Jt": [[1, 0, 0], [0, 1, 0]]}]})",
                                       "block on a spring");
  const reference::Scales scales(*problem);
  reference::ContactDynamics dynamics(*problem);
  dynamics.set_modes({ContactMode::slip});
  const auto error = [&](double h) {
    // Any step is accepted, of which two halves are kept.
    const auto start = reference::start_slip(
        *problem, scales, dynamics, problem->info().q0, problem->info().v0, {{0, -along.head(2), 1e3}},
        {.longest_step = 2 * h, .end = 2 * h, .tolerance = 1, .keeps_modes = [](const auto&...) { return true; }});
    if (!start || start->duration != 2 * h) return std::nan("");
    const double d = mu * g / k, w = std::sqrt(k), r = d + (r_0 - d) * std::cos(2 * w * h),
                 rate = -(r_0 - d) * w * std::sin(2 * w * h);
    return (start->q - r * along).norm() + (start->v - rate * along).norm();
  };
  const double coarse = error(0.2), fine = error(0.1);
  EXPECT_NEAR(std::log2(coarse / fine), 10, 0.5) << coarse << ", " << fine;
}

/// Both ends may have one sign where a root is an end of the bracket up to rounding.
TEST(BracketedRoot, IsTheNearerEndWhereNoSignChanges) {
  EXPECT_NEAR(reference::bracketed_root([](double x) { return 2 - x * x; }, 0, 2), std::numbers::sqrt2, 1e-14);
  EXPECT_EQ(reference::bracketed_root([](double x) { return -1e-18 - x; }, 0, 2), 0);
  EXPECT_EQ(reference::bracketed_root([](double x) { return 2 - x + 1e-15; }, 0, 2), 2);
  EXPECT_EQ(reference::bracketed_root([](double x) { return x; }, 0, 2), 0);
}

/// Balls of 1 g, 1000 kg and 10 kg on a vertical line: the light one is squeezed between floor and the others. GSL ended
/// the program, since a polynomial was below zero where the state of the same time was not.
TEST(Reference, FollowsALightBallBetweenHeavyOnes) {
  const auto problem = read_scene_text(R"({"q0": [0.0277, 0.2404, 0.2645], "v0": [0, -0.0582, 0], "T": 0.5613,
    "M": [[1e-3, 0, 0], [0, 1e3, 0], [0, 0, 10]], "f": ["-1e-3*9.81", "-1e3*9.81", "-10*9.81"],
    "contacts": [{"name": "floor", "gap": "q[0]", "e": 1}, {"name": "lower", "gap": "q[1]-q[0]", "e": 1},
                 {"name": "upper", "gap": "q[2]-q[1]", "e": 0}]})",
                                       "light");
  Settings settings;
  settings.tolerance = 1e-10;
  const Solution other = make_method("event_driven")->solve(*problem, settings);
  ASSERT_TRUE(other.succeeded()) << other.message;
  for (const double tolerance : {1e-8, 1e-9, 1e-10, 1e-11, 1e-12}) {
    const Solution s = reference_of(*problem, tolerance);
    ASSERT_TRUE(s.succeeded()) << tolerance << ": " << s.message;
    EXPECT_NEAR(s.q[1], other.q[1], 100 * tolerance + 1e-8) << "the tolerance of either, times the bounces";
  }
}

}  // namespace
}  // namespace ricochet
