// Bilateral constraints: mechanisms in absolute coordinates against the same ones in minimal coordinates, whose motion
// needs none.
#include <gtest/gtest.h>

#include <cmath>

#include "bench/measure/sensitivities.h"
#include "methods/registry.h"
#include "problems/input_error.h"
#include "reference/agreement.h"
#include "tests/solve_with_samples.h"
#include "tests/test_data.h"

namespace ricochet {
namespace {

Solution run(const Problem& problem, const std::string& method, int steps,
             std::vector<std::string> sensitivities = {}) {
  Settings settings;
  settings.steps = steps;
  settings.tolerance = 1e-10;
  settings.audit = true;
  settings.sensitivities = std::move(sensitivities);
  return solve_with_samples(problem, method, settings);
}

double largest_gap(const Problem& problem, const Solution& s) {
  EXPECT_FALSE(s.samples.empty()) << s.message;
  double largest = 0;
  for (const auto& sample : s.samples) {
    const Vector gap = problem.gap(sample.q);
    for (const int i : problem.info().bilateral) largest = std::max(largest, std::abs(gap[i]));
  }
  return largest;
}

/// theta, theta' of the pendulum in Cartesian coordinates.
Vector angle(const Vector& q, const Vector& v) {
  return Eigen::Vector2d(std::atan2(q[0], -q[1]), (q[0] * v[1] - q[1] * v[0]) / q.squaredNorm());
}

const reference::Reference& pendulum() {
  static const auto reference = reference::make_reference(*make_problem("pendulum_wall"));
  return reference;
}

double pendulum_error(const Solution& s) {
  const Solution& exact = pendulum().solution;
  return (angle(s.q, s.v) - Eigen::Vector2d(exact.q[0], exact.v[0])).cwiseAbs().maxCoeff();
}

/// log2 of what the errors at N and 2 N steps differ by.
double order(double coarse, double fine) {
  return std::log2(coarse / fine);
}

class CartesianPendulum : public testing::TestWithParam<int> {};

/// Projected onto the constraint at the end of each element, Radau IIA keeps 2 n_s - 1 through impacts; without, the
/// curved constraint would leave n_s.
TEST_P(CartesianPendulum, HasTheOrderOfTheTableau) {
  const int n_s = GetParam();
  const std::string method = "fesd:radau-iia:" + std::to_string(n_s);
  const auto p = make_problem("pendulum_wall_cartesian");
  const int steps = n_s == 4 ? 16 : 100;  // with four stages 100 would end at the uncertainty of the reference
  const Solution coarse = run(*p, method, steps), fine = run(*p, method, 4 * steps);
  ASSERT_TRUE(coarse.succeeded() && fine.succeeded()) << coarse.message << fine.message;
  EXPECT_LE(fine.max_residual(), 1e-12);
  EXPECT_GE(order(pendulum_error(coarse), pendulum_error(fine)) / 2, 2 * n_s - 1 - 0.3)
      << pendulum_error(coarse) << " " << pendulum_error(fine);
}

INSTANTIATE_TEST_SUITE_P(RadauIIA, CartesianPendulum, testing::Values(1, 2, 3, 4));

TEST(CartesianPendulumEvents, AreThoseOfTheAngle) {
  const auto p = make_problem("pendulum_wall_cartesian");
  const auto& exact = pendulum().solution.events;
  for (const char* method : {"fesd:radau-iia:4", "fesd:radau-iia:4,n_fe=4", "fesd:radau-iia:4,elements=as_needed",
                             "fesd:radau-iia:4,elements=as_needed,n_fe=1"}) {
    const Solution s = run(*p, method, 400);
    ASSERT_TRUE(s.succeeded()) << method << ": " << s.message;
    EXPECT_LE(s.max_residual(), 1e-12) << method;
    EXPECT_LE(pendulum_error(s), 1e-11) << method << ", the claim of the reference is " << pendulum().uncertainty;
    ASSERT_EQ(s.events.size(), exact.size()) << method;
    for (std::size_t k = 0; k < exact.size(); ++k) {
      const Event& e = s.events[k];
      EXPECT_NEAR(e.t, exact[k].t, 1e-12) << method;
      // The rod takes the part of the wall's impulse along it, -Lambda x / l, and x = -w.
      EXPECT_NEAR(e.Lambda_n[1], e.Lambda_n[0] * 0.3 / 0.8, 1e-13) << method;
    }
  }
}

TEST(Bilateral, ElasticImpactsKeepTheEnergy) {
  for (const char* scene : {"pendulum_wall_cartesian", "slider_crank_stop"}) {
    const auto p = make_problem(scene, {{"e", 1}, {"duration", 3}});
    const Solution s = run(*p, "fesd:radau-iia:4", 400);
    ASSERT_TRUE(s.succeeded()) << s.message;
    EXPECT_GE(s.events.size(), 2u);
    ASSERT_GE(s.samples.size(), 400u);
    const double before = *p->energy(p->info().q0, p->info().v0);
    for (const auto& sample : s.samples) ASSERT_NEAR(*p->energy(sample.q, sample.v_plus), before, 1e-11) << scene;
    EXPECT_LE(largest_gap(*p, s), 1e-14) << scene;
  }
}

TEST(Bilateral, ReferencesAgree) {
  const auto cartesian = reference::make_reference(*make_problem("pendulum_wall_cartesian"));
  EXPECT_LE(cartesian.uncertainty, 3 * pendulum().uncertainty) << "the constraint costs the reference no digit";
  EXPECT_LE(pendulum_error(cartesian.solution), 3 * (cartesian.uncertainty + pendulum().uncertainty))
      << "theta' = v / l, l = 0.8, and both components of v";
  ASSERT_EQ(cartesian.solution.events.size(), pendulum().solution.events.size());
  for (std::size_t k = 0; k < cartesian.solution.events.size(); ++k) {
    const Event &a = cartesian.solution.events[k], &b = pendulum().solution.events[k];
    EXPECT_NEAR(a.t, b.t, cartesian.uncertainty + pendulum().uncertainty);
    EXPECT_NEAR(a.Lambda_n[1], a.Lambda_n[0] * 0.3 / 0.8, cartesian.uncertainty);
  }
}

TEST(SliderCrankStop, AgreesWithTheReference) {
  const auto p = make_problem("slider_crank_stop");
  const auto exact = reference::make_reference(*p);
  EXPECT_GE(exact.digits(), 8) << "the BDF runs decide";
  const Solution s = run(*p, "fesd:radau-iia:4", 400);
  ASSERT_TRUE(s.succeeded()) << s.message;
  EXPECT_LE(reference::final_state_difference(s.q, s.v, exact.solution.q, exact.solution.v), 1.5e-10)
      << "4e-11 measured, the error of the Adams run";
  ASSERT_EQ(s.events.size(), exact.solution.events.size());
  for (std::size_t k = 0; k < s.events.size(); ++k) {
    EXPECT_NEAR(s.events[k].t, exact.solution.events[k].t, exact.uncertainty);
    EXPECT_LE((s.events[k].Lambda_n - exact.solution.events[k].Lambda_n).cwiseAbs().maxCoeff(), 1e-10)
        << "impulses of all joints";
  }
}

TEST(SliderCrankStop, HasOneFreedom) {
  const auto p = make_problem("slider_crank_stop");
  const Solution s = run(*p, "fesd:radau-iia:3", 200);
  ASSERT_TRUE(s.succeeded()) << s.message;
  ASSERT_GE(s.samples.size(), 200u);
  for (const auto& sample : s.samples) {
    const double c_1 = 0.3 * std::cos(sample.q[2]), s_1 = 0.3 * std::sin(sample.q[2]);
    EXPECT_NEAR(sample.q[6], c_1 + std::sqrt(0.25 - s_1 * s_1), 1e-14);
    EXPECT_NEAR(sample.v_plus[6], -sample.v_plus[2] * s_1 * (1 + c_1 / std::sqrt(0.25 - s_1 * s_1)), 1e-12);
  }
}

TEST(BilateralSensitivities, AreThoseOfTheAngle) {
  const std::vector<std::string> names{"param:m", "param:g",      "param:l",       "param:w",
                                       "param:e", "param:theta0", "param:duration"};
  const Solution cartesian = run(*make_problem("pendulum_wall_cartesian"), "fesd:radau-iia:4", 400, names),
                 exact = run(*make_problem("pendulum_wall"), "fesd:radau-iia:4", 400, names);
  ASSERT_TRUE(cartesian.succeeded() && exact.succeeded()) << cartesian.message << exact.message;
  ASSERT_EQ(cartesian.events.size(), exact.events.size());
  ASSERT_FALSE(exact.events.empty());
  const Vector q = cartesian.q, v = cartesian.v;
  const double l2 = q.squaredNorm(), omega = angle(q, v)[1];
  for (Eigen::Index k = 0; k < static_cast<Eigen::Index>(names.size()); ++k) {
    const Vector dq = cartesian.dq.col(k), dv = cartesian.dv.col(k);
    const double dtheta = (q[0] * dq[1] - q[1] * dq[0]) / l2,
                 domega = (dq[0] * v[1] + q[0] * dv[1] - dq[1] * v[0] - q[1] * dv[0] - 2 * omega * q.dot(dq)) / l2;
    const double size = std::max(1.0, std::abs(exact.dv(0, k)));
    EXPECT_NEAR(dtheta, exact.dq(0, k), 1e-10 * size) << names[static_cast<std::size_t>(k)];
    EXPECT_NEAR(domega, exact.dv(0, k), 1e-10 * size) << names[static_cast<std::size_t>(k)];
    EXPECT_NEAR(q.dot(dq), k == 2 ? 0.8 : 0, 1e-12 * size) << "d(x^2 + y^2) = d(l^2)";
    for (std::size_t event = 0; event < exact.events.size(); ++event)
      EXPECT_NEAR(cartesian.events[event].dt[k], exact.events[event].dt[k], 1e-10 * size);
  }
}

TEST(BilateralSensitivities, NeedAStartThatVariesWithinTheConstraints) {
  const auto p = make_problem("pendulum_wall_cartesian");
  for (const char* name : {"q0:0", "v0:1"}) {
    try {
      run(*p, "fesd:radau-iia:3", 10, {name});
      FAIL() << name;
    } catch (const InputError& error) {
      EXPECT_NE(std::string(error.what()).find("bilateral constraint 'rod'"), std::string::npos) << error.what();
    }
  }
}

/// Two blocks that are one: the motion of a block of twice the mass, with friction, on every path of the contact laws.
TEST(Bilateral, JoinedBlocksSlideAndStickAsOne) {
  const std::string file = test_data("joined_blocks.json");
  const auto p = read_scene_file(file);
  for (const char* method : {"fesd:radau-iia:3", "fesd:gauss:3,elements=as_needed", "fesd_adaptive:radau-iia:4",
                             "cvode:adams", "moreau_jean", "anitescu_potra"}) {
    const Solution s = run(*p, method, 200), one = run(*make_problem("sliding_block"), method, 200);
    ASSERT_TRUE(s.succeeded() && one.succeeded()) << method << ": " << s.message << one.message;
    EXPECT_NEAR(s.q[0], one.q[0], 1e-12) << method;
    EXPECT_NEAR(s.q[2], one.q[0] + 1, 1e-12) << method;
    EXPECT_NEAR(s.v[0], one.v[0], 1e-12) << method;
    EXPECT_LE(s.max_residual(), 1e-12) << method;
  }
}

/// Slip reversals under curved constraints, whose forces share the normal force: the end velocity is projected along
/// the directions of the forces, friction included. Orthogonally projected, it would leave n_s - 1.
TEST(CrankWithFriction, HasTheOrderOfTheTableau) {
  const auto p = read_scene_file(test_data("crank_with_friction.json"));
  const auto exact = reference::make_reference(*p);
  for (const auto& [n_s, steps] : {std::pair{2, 100}, {3, 50}, {4, 25}}) {
    const std::string method = "fesd:radau-iia:" + std::to_string(n_s) + ",elements=as_needed";
    const Solution coarse = run(*p, method, steps), fine = run(*p, method, 2 * steps);
    ASSERT_TRUE(coarse.succeeded() && fine.succeeded()) << method << ": " << coarse.message << fine.message;
    EXPECT_LE(fine.max_residual(), 1e-12) << method;
    ASSERT_EQ(fine.events.size(), exact.solution.events.size()) << method;
    const auto error = [&](const Solution& s) {
      return reference::final_state_difference(s.q, s.v, exact.solution.q, exact.solution.v);
    };
    // Measured 2.9, 5.9 and 8.1.
    EXPECT_GE(order(error(coarse), error(fine)), 2 * n_s - 1 - 0.3) << method;
    EXPECT_LE(std::abs(fine.events.back().t - exact.solution.events.back().t), 2e-6) << method;
  }
}

TEST(CrankWithFriction, HasTheDerivativesOfTheDiscreteSolution) {
  const auto p = read_scene_file(test_data("crank_with_friction.json"));
  const auto method = make_method("fesd:radau-iia:3,elements=as_needed");
  Settings settings;
  settings.steps = 100;
  settings.sensitivities = {"param:mu", "param:m_3", "param:l_1", "param:theta0"};
  const Solution s = method->solve(*p, settings), differences = solve_with_differences(*method, *p, settings, 1e-4);
  ASSERT_TRUE(s.succeeded() && differences.succeeded()) << s.message << differences.message;
  EXPECT_LE(reference::sensitivity_difference(s, differences), 2e-8);
}

TEST(BilateralTimeStepping, KeepsItsOrders) {
  const auto swing = make_problem("pendulum_wall_cartesian", {{"duration", 0.5}});  // no impact yet
  const auto exact = reference::make_reference(*make_problem("pendulum_wall", {{"duration", 0.5}})).solution;
  const auto error = [&](const char* method, int steps) {
    const Solution s = run(*swing, method, steps);
    EXPECT_LE(s.max_residual(), 1e-12) << "G' v+ + s = 0 is part of the audit";
    return (angle(s.q, s.v) - Eigen::Vector2d(exact.q[0], exact.v[0])).cwiseAbs().maxCoeff();
  };
  EXPECT_NEAR(order(error("moreau_jean", 400), error("moreau_jean", 800)), 2, 0.05);
  EXPECT_NEAR(order(error("anitescu_potra", 400), error("anitescu_potra", 800)), 1, 0.05);
  const auto p = make_problem("pendulum_wall_cartesian");
  EXPECT_NEAR(order(largest_gap(*p, run(*p, "moreau_jean", 1000)), largest_gap(*p, run(*p, "moreau_jean", 4000))) / 2,
              2, 0.1);
  for (const char* method : {"moreau_jean", "anitescu_potra"}) {
    const Solution s = run(*p, method, 100000);
    EXPECT_LE(pendulum_error(s), 3e-3) << method;
    // An impulse of the wall and that of the rod, in the step of the impact.
    EXPECT_NEAR(s.events[0].Lambda_n[1], s.events[0].Lambda_n[0] * 0.3 / 0.8, 2e-3) << method;
  }
}

TEST(BilateralSupport, SaysWhichTableausHoldThem) {
  const auto p = make_problem("pendulum_wall_cartesian");
  for (const char* method : {"fesd:gauss:2", "fesd_adaptive:gauss:4", "irk:gauss:4,contacts=ignored"}) {
    EXPECT_NE(make_method(method)->can_run(p->info()).reason.find("'rod' needs a stiffly accurate tableau"),
              std::string::npos);
  }
  EXPECT_NE(make_method("fesd:lobatto-iiia:3")->can_run(p->info()).reason.find("singular"), std::string::npos);
}

}  // namespace
}  // namespace ricochet
