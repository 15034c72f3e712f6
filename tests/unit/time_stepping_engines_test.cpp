// What engines do with contacts, in numbers that can be derived by hand: soft_step, xpbd, sap.
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "methods/registry.h"
#include "tests/solve_with_samples.h"
#include "tests/test_data.h"

namespace ricochet {
namespace {

constexpr double kStandardGravity = 9.81;

/// The sweep without springs leaves the weight as impulse, and the spring takes back a_i of it in each substep: it stands
/// where its push a_m omega f_c / (2 zeta + h omega) equals a_i h g, at g / omega^2 whatever h is.
TEST(SoftStep, RestsBelowTheSurface) {
  const auto p = make_problem("sliding_block", {{"v_x0", 0}, {"duration", 4}});
  const double omega = 2 * std::numbers::pi * 30;
  for (const int steps : {240, 960}) {
    // The way there has the rate a_m omega / (2 zeta + h omega), 7.5 / s with h = 1 / 960 s: 3e-17 is left after 4 s.
    EXPECT_NEAR(p->gap(solve_with_samples(*p, "soft_step", steps).q)[0], -kStandardGravity / (omega * omega), 1e-12)
        << steps;
  }
  const double h = 4.0 / 960 / 4, cap = 2 * std::numbers::pi / (4 * h);
  EXPECT_NEAR(p->gap(solve_with_samples(*p, "soft_step,frequency=1e9", 960).q)[0], -kStandardGravity / (cap * cap),
              1e-12);
}

/// At 30 Hz and 240 Hz of substeps impulses vanish in one step; at rest they are the weight.
TEST(SoftStep, CarriesTheWeight) {
  const auto p = make_problem("sliding_block", {{"v_x0", 0}, {"duration", 2}});
  const Solution s = solve_with_samples(*p, "soft_step", 120);
  EXPECT_LE(s.v.cwiseAbs().maxCoeff(), 1e-14) << "and nothing moves";
}

/// A ball that falls 1 cm meets the floor with 0.44 m/s.
TEST(SoftStep, DropsRestitutionBelowItsThreshold) {
  const auto p = make_problem("bouncing_ball", {{"e", 0.8}, {"height", 0.11}, {"duration", 0.06}});
  const double impact = std::sqrt(2 * kStandardGravity * 0.01), t = impact / kStandardGravity;
  const double after = 0.8 * impact - kStandardGravity * (0.06 - t);
  // First order, 1e-3 with 6000 steps: g h is 1e-4.
  EXPECT_NEAR(solve_with_samples(*p, "soft_step", 6000).v[0], after, 1e-3);
  EXPECT_NEAR(solve_with_samples(*p, "soft_step,threshold=1", 6000).v[0], 0, 1e-12);
  EXPECT_NEAR(solve_with_samples(*p, "soft_step,threshold=0.4", 6000).v[0], after, 1e-3);
}

/// Friction of soft_step has mu times the impulse that stops the approach; that of restitution comes after it and has
/// none. Friction of xpbd has mu times what of the approach is behind the surface at the end of the substep: any part.
TEST(SoftStepAndXpbd, RestitutionHasNoFriction) {
  const double mu = 0.2, e = 0.6, v_x = 3;
  const auto p =
      make_problem("oblique_impact", {{"mu", mu}, {"e", e}, {"v_x0", v_x}, {"height", 1}, {"duration", 0.6}});
  const double impact = std::sqrt(2 * kStandardGravity);
  EXPECT_NEAR(solve_with_samples(*p, "soft_step,frequency=1e9", 20000).v[0], v_x - mu * impact, 1e-3);  // g h = 3e-4
  EXPECT_NEAR(solve_with_samples(*p, "moreau_jean", 20000).v[0], v_x - mu * (1 + e) * impact, 1e-3);
  double least = 1, most = 0;
  for (int steps = 20000; steps < 20010; ++steps) {
    const double part = (v_x - solve_with_samples(*p, "xpbd", steps).v[0]) / (mu * impact);
    least = std::min(least, part);
    most = std::max(most, part);
  }
  EXPECT_GE(least, 0);
  EXPECT_LE(most, 1 + 1e-3);
  EXPECT_GT(most - least, 0.3) << "it hangs on where in the substep the impact is";
}

/// A pendulum that no wall stops: implicit Euler loses energy in proportion to the substep.
TEST(Xpbd, LosesEnergyWithTheSubstep) {
  const auto p = make_problem("pendulum_wall_cartesian", {{"w", 10}});
  const double before = *p->energy(p->info().q0, p->info().v0);
  double lost[2];
  for (int k = 0; k < 2; ++k) {
    const Solution s = solve_with_samples(*p, k == 0 ? "xpbd,substeps=5" : "xpbd,substeps=10", 600);
    lost[k] = before - *p->energy(s.q, s.v);
    EXPECT_GT(lost[k], 0);
  }
  EXPECT_NEAR(lost[0] / lost[1], 2, 0.1) << "order 1";
}

/// Sweeps of (2) converge to the joint, whose gap is (x^2 + y^2 - l^2) / (2 l): d = (h v)^2 / (2 l) + h^2 g = 2.2 mm is what
/// the free motion leaves with v < 4.4 m/s, one sweep leaves d^2 / (2 l) = 3e-6 m of it, five nothing.
TEST(Xpbd, KeepsJoints) {
  const auto p = make_problem("pendulum_wall_cartesian", {{"w", 10}});
  const int rod = p->info().bilateral.front();
  const auto drift = [&](const std::string& method) {
    double largest = 0;
    for (const auto& sample : solve_with_samples(*p, method, 300).samples)
      largest = std::max(largest, std::abs(p->gap(sample.q)[rod]));
    return largest;
  };
  EXPECT_LE(drift("xpbd,substeps=1"), 4e-6);
  EXPECT_LE(drift("xpbd,substeps=1,iterations=5"), 1e-14) << "rounding of lengths of 0.8 m";
}

/// R_n gamma_n (1 + mu^2 r) = v^ - c_n + mu |c_t|: with the weight as impulse the gap is h mu |v_t| less R_n m g h.
TEST(Sap, SlidingBlockHovers) {
  const double mu = 0.3, h = 1e-3, beta = 1;
  const auto p = make_problem("sliding_block", {{"mu", mu}, {"duration", 0.4}});
  const Solution s = solve_with_samples(*p, "sap", 400);
  const double R_n = beta * beta / (4 * std::numbers::pi * std::numbers::pi), r = 1e-3 / R_n;
  EXPECT_GT(s.v[0], 0.5) << "it still slides";
  // The gap of the next step is h (mu |v_t| - (1 + mu^2 r) R_n m g h), after v_t by a step: mu g h^2 of the former.
  EXPECT_NEAR(p->gap(s.q)[0], h * (mu * s.v[0] - (1 + mu * mu * r) * R_n * kStandardGravity * h),
              mu * mu * kStandardGravity * h * h);
}

/// A block that slides on the surface at t = 0 is thrown up with mu v / (1 + mu^2), whatever the step is.
TEST(Sap, SlidingBlockHops) {
  const double mu = 0.3, v = 2;
  const auto p = make_problem("sliding_block", {{"mu", mu}, {"v_x0", v}, {"duration", 0.3}});
  for (const int steps : {3000, 30000}) {
    const Solution s = solve_with_samples(*p, "sap", steps);
    double highest = 0;
    for (const auto& sample : s.samples) highest = std::max(highest, p->gap(sample.q)[0]);
    // 1.55 cm; the regularisation takes R_n, 2.5 %, of the speed, twice that of the height
    EXPECT_NEAR(highest, std::pow(mu * v / (1 + mu * mu), 2) / (2 * kStandardGravity), 0.06 * 0.0155) << steps;
  }
}

/// What sticks creeps with R_t gamma_t = sigma h f_t for a unit mass.
TEST(Sap, BlockOnARampCreeps) {
  const double slope = 0.35, sigma = 1e-2;
  const auto p = make_problem("block_on_ramp", {{"v_x0", 0}, {"slope", slope}});
  for (const int steps : {100, 1000}) {
    const double h = 0.5 / steps;
    EXPECT_NEAR(solve_with_samples(*p, "sap,sigma=1e-2", steps).v[0] / (sigma * h * kStandardGravity * std::sin(slope)),
                1, 1e-9);
  }
}

/// A spring that moves: as published it is implicit Euler, and theta = 1/2 takes half of the error; in the middle, order 2.
TEST(Sap, OrderOfACompliantContact) {
  const auto p =
      make_problem("bouncing_ball", {{"e", 0}, {"height", 0.1}, {"duration", 0.03}});  // starts at a gap of 0
  const std::string spring = ",stiffness=1e4,beta=0.01,theta=0.5";
  const double k = 1e4, omega = std::sqrt(k);  // m = 1, in contact to t = 0.03 < pi / omega
  const double exact = -kStandardGravity / omega * std::sin(omega * 0.03);
  const auto error = [&](const std::string& option, int steps) {
    return std::abs(solve_with_samples(*p, "sap" + spring + option, steps).v[0] - exact);
  };
  EXPECT_NEAR(std::log2(error("", 2000) / error("", 4000)), 1, 0.1);
  EXPECT_NEAR(std::log2(error(",contact=middle", 500) / error(",contact=middle", 1000)), 2, 0.1);
}

/// Where (3) is quadratic a step has one iteration, and slip in space a few.
TEST(Sap, NewtonConverges) {
  const auto plane = make_problem("sliding_block");
  EXPECT_LE(solve_with_samples(*plane, "sap", 1000).counters.inner_iterations, 1010);
  const auto space = make_problem("block_on_ramp_3d");
  EXPECT_LE(solve_with_samples(*space, "sap", 1000).counters.inner_iterations, 4000);
}

TEST(Sap, DeclinesRestitution) {
  EXPECT_FALSE(make_method("sap")->can_run(make_problem("bouncing_ball", {{"e", 0.5}})->info()).ok);
  EXPECT_TRUE(make_method("sap")->can_run(make_problem("bouncing_ball", {{"e", 0}})->info()).ok);
}

}  // namespace
}  // namespace ricochet
