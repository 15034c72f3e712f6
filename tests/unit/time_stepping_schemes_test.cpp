// Single steps that can be checked by hand, and what each scheme promises.
#include <gtest/gtest.h>

#include <Eigen/LU>
#include <cmath>

#include "methods/registry.h"
#include "problems/input_error.h"
#include "tests/solve_with_samples.h"
#include "tests/test_data.h"

namespace ricochet {
namespace {

/// A ball of radius 0.1 whose gap is 0.5 m; one step of 0.4 s would take it to -0.28.
TEST(StewartTrinkle, LandsOnTheSurfaceWithinOneStep) {
  const auto p = make_problem("bouncing_ball", {{"e", 0}, {"height", 0.6}, {"duration", 0.8}});
  const Solution s = solve_with_samples(*p, "stewart_trinkle", 2);
  // v_1 = -9.81 0.4 = -3.924, gap - 0.4 3.924 < 0: v_1 = -gap / h
  EXPECT_NEAR(s.samples[0].q[0], 0.1, 1e-15);
  EXPECT_NEAR(s.samples[0].v_plus[0], -0.5 / 0.4, 1e-15);
  EXPECT_NEAR(s.samples[1].v_plus[0], 0, 1e-15) << "and the next step stops it";
}

/// q_{k+1} = -e q_{k-1} about the surface, when the free motion would go below that.
TEST(SchatzmanPaoli, ReflectsThePositionBefore) {
  const double e = 0.9, g = 9.81, h = 0.1;
  const auto p = make_problem("bouncing_ball", {{"e", e}, {"height", 0.6}, {"duration", 0.5}});
  const Solution s = solve_with_samples(*p, "schatzman_paoli", 5);
  double before = 0.5, now = 0.5, v = 0;  // gaps
  for (int k = 0; k < 5; ++k) {
    double next = now + h * (v - h * g);
    if (next + e * before < 0) next = -e * before;
    v = (next - now) / h;
    // a dozen operations on numbers of order one
    EXPECT_NEAR(s.samples[k].q[0] - 0.1, next, 1e-14) << k;
    EXPECT_NEAR(s.samples[k].v_plus[0], v, 1e-13) << k;
    before = now;
    now = next;
  }
  EXPECT_FALSE(s.events.empty()) << "it has met the floor";
}

/// Slip opens the gap of the convex scheme by h mu |v_t|, Coulomb's law leaves it closed.
TEST(AnitescuConvex, OpensTheGapOfASlidingContact) {
  const auto p = make_problem("sliding_block", {{"duration", 0.1}});
  const Solution convex = solve_with_samples(*p, "anitescu_convex", 1),
                 coulomb = solve_with_samples(*p, "stewart_trinkle", 1);
  const double mu = p->info().contacts[0].mu, h = 0.1;
  EXPECT_NEAR(p->gap(coulomb.q)[0], 0, 1e-15);
  EXPECT_GT(convex.v[0], 0.1) << "it still slides";
  EXPECT_NEAR(p->gap(convex.q)[0], h * mu * convex.v[0], 1e-14);
}

/// m x'' = -k x - c x' without contacts, in `steps` steps of length h.
class LinearOscillator : public testing::Test {
 protected:
  static constexpr double m = 2, k = 18, c = 0.4, h = 0.1;
  static constexpr int steps = 40;
  const std::unique_ptr<Problem> p = read_scene_text(
      R"scene({"params": {}, "q0": ["1"], "v0": ["0.5"], "T": "4", "M": [["2"]], "f": ["-18*q[0]-0.4*v[0]"],
          "contacts": []})scene",
      "oscillator");
};

/// A step multiplies (x, x') by a matrix that is known, that of the theta rule for the implicit schemes and of the
/// symplectic Euler method for the explicit ones. Orders would not tell a wrong coefficient of h^2 in the matrix that
/// they solve with.
TEST_F(LinearOscillator, StepsAreThoseOfTheTextbook) {
  const auto expect_steps = [&](const std::string& method, const Eigen::Matrix2d& step) {
    const Solution s = solve_with_samples(*p, method, steps);
    Eigen::Vector2d x(1, 0.5);
    for (int n = 0; n < steps; ++n) x = step * x;
    EXPECT_NEAR(s.q[0], x[0], 1e-13) << method << ": rounding of 40 steps";
    EXPECT_NEAR(s.v[0], x[1], 1e-13) << method;
  };
  Eigen::Matrix2d A;
  A << 0, 1, -k / m, -c / m;
  const auto theta_rule = [&](double theta) -> Eigen::Matrix2d {
    const auto I = Eigen::Matrix2d::Identity();
    return (I - theta * h * A).inverse() * (I + (1 - theta) * h * A);
  };
  for (const char* method : {"moreau_jean", "moreau_jean,implicit=full", "penalty", "generalized_alpha,rho_inf=1"})
    expect_steps(method, theta_rule(0.5));
  expect_steps("moreau_jean,theta=0.7", theta_rule(0.7));
  expect_steps("moreau_jean,theta=1", theta_rule(1));
  expect_steps("anitescu_potra,implicit=linear", theta_rule(1));

  Eigen::Matrix2d kick, drift;
  kick << 1, 0, -h * k / m, 1 - h * c / m;
  drift << 1, h, 0, 1;
  for (const char* method : {"anitescu_potra", "stewart_trinkle", "schatzman_paoli", "anitescu_convex"})
    expect_steps(method, drift * kick);
}

/// The recursion of Chung and Hulbert (1993) for (q, v, a), a the algorithmic acceleration.
TEST_F(LinearOscillator, StepsOfGeneralizedAlphaAreThoseOfTheTextbook) {
  for (const double rho : {0.0, 0.6, 0.9}) {
    const double alpha_m = (2 * rho - 1) / (rho + 1), alpha_f = rho / (rho + 1), gamma = 0.5 - alpha_m + alpha_f;
    const double beta = 0.25 * (1 - alpha_m + alpha_f) * (1 - alpha_m + alpha_f);
    double q = 1, v = 0.5, a = -(k * q + c * v) / m;
    for (int n = 0; n < steps; ++n) {
      const double acceleration = -(k * q + c * v) / m;
      q += h * v + h * h * (0.5 - beta) * a;
      v += h * (1 - gamma) * a;
      const double without = (1 - alpha_f) * -(k * q + c * v) / m + alpha_f * acceleration - alpha_m * a;
      a = without / (1 - alpha_m + (1 - alpha_f) * (k * h * h * beta + c * h * gamma) / m);
      q += h * h * beta * a;
      v += h * gamma * a;
    }
    const Solution s = solve_with_samples(*p, "generalized_alpha,rho_inf=" + std::to_string(rho), steps);
    EXPECT_NEAR(s.q[0], q, 1e-12) << "rho_inf = " << rho << ": rounding of 40 steps";
    EXPECT_NEAR(s.v[0], v, 1e-12) << "rho_inf = " << rho;
  }
}

TEST(Penalty, BrakesWithCoulombsFriction) {
  for (const double mu : {0.25, 0.5}) {
    const auto p = make_problem("sliding_block", {{"g", 10}, {"mu", mu}, {"v_x0", 2.5}, {"duration", 2}});
    const Solution s = solve_with_samples(*p, "penalty", 20000);
    // The springs settle at first, and friction is regularised at the end.
    EXPECT_NEAR(s.q[0], 2.5 * 2.5 / (2 * mu * 10), 1e-3) << "mu = " << mu;
  }
}

/// A step of the fully implicit method fulfils the theta rule, which one Newton step does not.
TEST(MoreauJean, FullyImplicitFulfilsTheThetaRule) {
  const auto p = make_problem("pendulum_wall", {{"w", 5}, {"duration", 0.5}});
  const double theta = 0.7, h = 0.5;
  const auto defect = [&](const std::string& method) {
    const Solution s = solve_with_samples(*p, method, 1);
    const Vector &q = p->info().q0, &v = p->info().v0;
    EXPECT_NEAR(s.q[0], q[0] + h * (theta * s.v[0] + (1 - theta) * v[0]), 1e-14);
    const Matrix M = p->mass_matrix(q);
    return std::abs(
        (M * (s.v - v) - h * (theta * p->force(s.q, s.v) + (1 - theta) * p->force(q, v))).cwiseAbs().maxCoeff());
  };
  EXPECT_LE(defect("moreau_jean,theta=0.7,implicit=full"), 1e-12);  // 1e-13 of the velocity, times M and h f_q
  EXPECT_GE(defect("moreau_jean,theta=0.7"), 1e-3);
}

TEST(MoreauJean, ProjectionLeavesNoPenetration) {
  const auto deepest = [&](const char* problem, const std::string& method) {
    const auto p = make_problem(problem);
    const Solution s = solve_with_samples(*p, method, 300);
    EXPECT_EQ(s.samples.size(), 300u) << s.message;
    double worst = 0;
    for (const auto& sample : s.samples) worst = std::min(worst, p->gap(sample.q).minCoeff());
    return -worst;
  };
  for (const char* problem : {"bouncing_ball", "ball_in_box", "double_pendulum_wall"}) {
    EXPECT_GE(deepest(problem, "moreau_jean"), 1e-4) << problem;
    EXPECT_LE(deepest(problem, "moreau_jean,projection=on"), 1e-12) << problem << ": 1e-13 of coordinates up to 4";
  }
  const auto joined = make_problem("pendulum_wall_cartesian");
  const auto drift = [&](const std::string& method) {
    return std::abs(joined->gap(solve_with_samples(*joined, method, 300).q)[joined->info().bilateral[0]]);
  };
  EXPECT_LE(drift("moreau_jean,theta=1,projection=on"), 1e-12) << "1e-13 is what the projection leaves";
  EXPECT_GE(drift("moreau_jean,theta=1"), 1e-6);
}

/// Constant force: a parabola, which second-order methods follow exactly.
TEST(GeneralizedAlpha, FallsExactly) {
  const auto p = make_problem("bouncing_ball", {{"height", 100}, {"e", 1}});  // symplectic asks for e = 1
  for (const char* method : {"generalized_alpha", "generalized_alpha,rho_inf=0", "symplectic", "penalty"}) {
    const Solution s = solve_with_samples(*p, method, 16);
    ASSERT_TRUE(s.succeeded()) << method << ": " << s.message;
    EXPECT_NEAR(s.q[0], 100 - 0.5 * 9.81 * 4, 1e-12) << method;
    EXPECT_NEAR(s.v[0], -9.81 * 2, 1e-13) << method;
  }
}

TEST(Symplectic, KeepsTheEnergyThroughManyImpacts) {
  // A parabola is exact, so the energy of the ball is kept to rounding: 1e5 steps of 1e-16 each, with 126 impacts.
  const auto ball = make_problem("bouncing_ball", {{"e", 1}, {"duration", 100}});
  const Solution bounced = solve_with_samples(*ball, "symplectic", 100000);
  const double before = *ball->energy(ball->info().q0, ball->info().v0);
  EXPECT_GE(bounced.events.size(), 100u);
  EXPECT_NEAR(*ball->energy(bounced.q, bounced.v), before, 1e-11 * before);

  // With a spring the error is O(h^2) at all times: 200 s, hundreds of impacts, no drift.
  const auto balls = make_problem("two_balls_spring", {{"e", 1}, {"k", 1000}, {"duration", 200}});
  const auto worst_error = [&](int steps) {
    const Solution s = solve_with_samples(*balls, "symplectic", steps);
    const double start = *balls->energy(balls->info().q0, balls->info().v0);
    double first = 0, last = 0;  // largest in the first and in the last tenth
    for (std::size_t k = 0; k < s.samples.size(); ++k) {
      const double error = std::abs(*balls->energy(s.samples[k].q, s.samples[k].v_plus) / start - 1);
      if (10 * k < s.samples.size()) first = std::max(first, error);
      if (10 * k >= 9 * s.samples.size()) last = std::max(last, error);
    }
    EXPECT_GE(s.events.size(), 100u);
    EXPECT_LE(last, 10 * first) << "what a drift over ten times the time would be";
    return std::max(first, last);
  };
  EXPECT_LE(worst_error(200000), 5e-3);
}

TEST(Symplectic, SaysWhatItDoesNotRun) {
  const auto reason = [](const char* problem) {
    return make_method("symplectic")->can_run(make_problem(problem)->info()).reason;
  };
  EXPECT_EQ(reason("bouncing_ball"), "it conserves energy, eps_r = 1 is required in every contact");
  EXPECT_EQ(reason("sliding_block"), "it conserves energy, friction does not");
  EXPECT_EQ(reason("pendulum_wall_cartesian"), "bilateral constraints are not part of the scheme");
}

/// One bounce: the velocity after it is -e times that before, as the damping was chosen for.
TEST(Penalty, HasTheRestitutionOfTheContact) {
  for (const double e : {0.2, 0.9}) {
    const auto p = make_problem("bouncing_ball", {{"e", e}, {"g", 1e-3}, {"height", 0.6}, {"duration", 60}});
    const Solution s = solve_with_samples(*p, "penalty,stiffness=1e4", 300000);
    ASSERT_FALSE(s.events.empty());
    const double fall = -std::sqrt(2 * 1e-3 * 0.5);
    double after = 0;
    for (const auto& sample : s.samples) after = std::max(after, sample.v_plus[0]);
    // 150 steps of 2e-4 s in the contact; the damping force jumps at the surface, inside a step: first order
    EXPECT_NEAR(after / -fall, e, 0.02) << e;
  }
}

/// Twice the stiffness: the resting ball sinks half as deep, m g / k.
TEST(Penalty, SinksByTheWeightOverTheStiffness) {
  for (const double k : {1e4, 2e4}) {
    const auto p = make_problem("bouncing_ball", {{"e", 0}, {"height", 0.1}, {"duration", 2}});
    const Solution s = solve_with_samples(*p, "penalty,stiffness=" + std::to_string(k), 20000);
    EXPECT_NEAR(s.q[0], 0.1 - 9.81 / k, 1e-9) << "at rest to exp(-omega t / 10), omega t = 200";
  }
}

TEST(Inelastic, MethodsDeclineRestitution) {
  for (const char* method : {"stewart_trinkle", "anitescu_convex"}) {
    const auto support = make_method(method)->can_run(make_problem("bouncing_ball")->info());
    EXPECT_FALSE(support.ok);
    EXPECT_EQ(support.reason, "it has no restitution, eps_r = 0 is required in every contact");
  }
}

}  // namespace
}  // namespace ricochet
