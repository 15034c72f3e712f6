// The motion between the steps: what it is made of, its order, its limits at events.
#include "problems/motion.h"

#include <gtest/gtest.h>

#include <cmath>

#include "bench/measure/penetration.h"
#include "methods/registry.h"
#include "problems/input_error.h"
#include "tests/test_data.h"

namespace ricochet {
namespace {

TEST(Motion, IsThePolynomialsThatItWasGiven) {
  Motion motion;
  for (const int degree : {1, 4, 12}) {
    const double begin = motion.empty() ? 0.5 : motion.end();
    motion.add(begin, begin + 2, degree, [&](double s, Vector& q, Vector& v) {
      q = Eigen::Vector2d(std::pow(s, degree), 1);
      v = Eigen::Vector2d(degree - s, std::pow(1 - s, degree));
    });
    motion.add(motion.end(), motion.end(), degree, [](double, Vector&, Vector&) { FAIL() << "no length"; });
  }
  ASSERT_EQ(motion.n_pieces(), 3u);
  EXPECT_EQ(motion.begin(), 0.5);
  EXPECT_EQ(motion.end(), 6.5);
  Vector q, v, a;
  for (const double s : {0.0, 0.1, 0.25, 0.5, 0.77, 0.999, 1.0}) {
    for (const auto& [piece, degree] : {std::pair(0, 1), std::pair(1, 4), std::pair(2, 12)}) {
      motion.at(0.5 + 2 * (piece + s), q, v, s == 1 ? Motion::Side::before : Motion::Side::after);
      // Thirteen terms of size one.
      EXPECT_NEAR(q[0], std::pow(s, degree), 1e-14);
      EXPECT_NEAR(q[1], 1, 1e-14);
      EXPECT_NEAR(v[0], degree - s, 1e-13);
      EXPECT_NEAR(v[1], std::pow(1 - s, degree), 1e-14);
      motion.acceleration_within(static_cast<std::size_t>(piece), s, a);  // a piece takes 2 s
      // Differences of values of size one over distances down to a hundredth.
      EXPECT_NEAR(a[0], -0.5, 1e-11);
      EXPECT_NEAR(a[1], -0.5 * degree * std::pow(1 - s, degree - 1), 1e-11);
    }
  }
  motion.at(2.5, q, v, Motion::Side::before);
  EXPECT_EQ(v[0], 0) << "the end of the first piece, to the bit";
  motion.at(2.5, q, v);
  EXPECT_EQ(v[0], 4) << "the begin of the second one";
  for (const double t : {0.4999, 6.5001, std::nan("")}) EXPECT_THROW(motion.at(t, q, v), InputError);
  EXPECT_THROW(Motion().at(0, q, v), InputError);
}

/// A dip between two grid points that are both above the ground.
TEST(Motion, IsInsideOfAContactBetweenItsSteps) {
  const auto ball = make_problem("bouncing_ball");
  const double rest = ball->info().q0[0] - ball->gap(ball->info().q0)[0];
  const auto dip = [&](double depth) {
    Motion motion;
    motion.add(0, 1, 2, [&](double s, Vector& q, Vector& v) {
      q = Vector::Constant(1, rest + 0.1 - (0.1 + depth) * 4 * s * (1 - s));
      v = Vector::Constant(1, (0.1 + depth) * 4 * (2 * s - 1));
    });
    return penetration(*ball, motion);
  };
  EXPECT_NEAR(dip(0.03), 0.03, 1e-14) << "s = 1/2 is one of the points";
  EXPECT_EQ(dip(-0.03), 0);
  EXPECT_EQ(penetration(*ball, Motion()), 0);
}

Solution motion_of(const Problem& problem, const std::string& method, int steps, double tolerance) {
  Settings settings;
  settings.steps = steps;
  settings.tolerance = tolerance;
  settings.recording = Recording::motion;
  return make_method(method)->solve(problem, settings);
}

/// The largest differences of q and v at times between grid points and away from events.
std::pair<double, double> differences(const Solution& a, const Solution& b) {
  double of_q = 0, of_v = 0;
  Vector q_a, v_a, q_b, v_b;
  for (int k = 0; k < 997; ++k) {
    const double t = b.t * (k + 0.37) / 997;
    const auto is_near = [&](const Event& event) { return std::abs(event.t - t) < 1e-3; };
    if (std::ranges::any_of(b.events, is_near)) continue;
    a.motion.at(t, q_a, v_a);
    b.motion.at(t, q_b, v_b);
    of_q = std::max(of_q, (q_a - q_b).cwiseAbs().maxCoeff());
    of_v = std::max(of_v, (v_a - v_b).cwiseAbs().maxCoeff());
  }
  return {of_q, of_v};
}

/// Of a pendulum that hits a wall: in v at least the order s + 1 of the stage polynomials, or that of the
/// tableau where it is lower.
TEST(Motion, HasTheOrderOfTheStagePolynomials) {
  const auto problem = make_problem("pendulum_wall");
  const Solution truth = motion_of(*problem, "fesd:gauss:6,elements=as_needed", 400, 0);
  ASSERT_TRUE(truth.succeeded()) << truth.message;
  struct Case {
    const char* tableau;
    int order;
  };
  for (const auto& [tableau, order] :
       {Case{"radau-iia:2", 3}, Case{"radau-iia:3", 4}, Case{"gauss:2", 3}, Case{"gauss:3", 4}, Case{"gauss:4", 5}}) {
    const std::string method = std::string("fesd:") + tableau + ",elements=as_needed";
    const Solution coarse = motion_of(*problem, method, 20, 0), fine = motion_of(*problem, method, 80, 0);
    ASSERT_TRUE(coarse.succeeded() && fine.succeeded()) << tableau << " " << coarse.message << fine.message;
    const auto [q_coarse, v_coarse] = differences(coarse, truth);
    const auto [q_fine, v_fine] = differences(fine, truth);
    // The largest error is where the times of the comparison lie: a third of an order.
    EXPECT_GT(std::log2(v_coarse / v_fine) / 2, order - 0.35) << tableau << " " << v_coarse << " " << v_fine;
    EXPECT_GT(std::log2(q_coarse / q_fine) / 2, order - 0.35) << tableau << " " << q_coarse << " " << q_fine;
  }
}

/// Without contacts, by stages that are no collocation: made to meet the right end.
TEST(Motion, HasTheOrderOfTheStagePolynomialsOfOtherTableaus) {
  const auto problem = make_problem("pendulum_wall");
  const Solution truth = motion_of(*problem, "irk:gauss:6,contacts=ignored", 400, 0);
  for (const char* tableau : {"radau-ia:3", "lobatto-iiic:3", "radau-iia:3"}) {
    const std::string method = std::string("irk:") + tableau + ",contacts=ignored";
    const auto [q_coarse, v_coarse] = differences(motion_of(*problem, method, 20, 0), truth);
    const auto [q_fine, v_fine] = differences(motion_of(*problem, method, 80, 0), truth);
    // Stages of Radau IA have order 2 only, and so have the accelerations that pass through them.
    const int order = std::string(tableau) == "radau-iia:3" ? 4 : 3;
    EXPECT_GT(std::log2(v_coarse / v_fine) / 2, order - 0.35) << tableau << " " << v_coarse << " " << v_fine;
    EXPECT_GT(std::log2(q_coarse / q_fine) / 2, order - 0.35) << tableau << " " << q_coarse << " " << q_fine;
  }
}

class MotionOf : public testing::TestWithParam<std::string> {};

/// From the initial state to the final one; at an impact both limits, with Newton's law between them.
TEST_P(MotionOf, GoesFromTheBeginToTheEnd) {
  const auto problem = make_problem("bouncing_ball", {{"duration", 1}});
  const bool is_adaptive = make_method(GetParam())->info().is_adaptive;
  const Solution s = motion_of(*problem, GetParam(), is_adaptive ? 0 : 400, is_adaptive ? 1e-9 : 0);
  ASSERT_TRUE(s.succeeded()) << s.message;
  ASSERT_FALSE(s.motion.empty());
  EXPECT_EQ(s.motion.begin(), 0);
  EXPECT_EQ(s.motion.end(), s.t);
  Vector q, v;
  s.motion.at(0, q, v);
  EXPECT_EQ(q, problem->info().q0);
  s.motion.at(s.t, q, v);
  EXPECT_LT((q - s.q).cwiseAbs().maxCoeff(), 1e-14) << "a projection at the end may round";
  EXPECT_LT((v - s.v).cwiseAbs().maxCoeff(), 1e-13);
  for (std::size_t piece = 1; piece < s.motion.n_pieces(); ++piece) {
    Vector before, v_before;
    s.motion.within(piece - 1, 1, before, v_before);
    s.motion.within(piece, 0, q, v);
    EXPECT_EQ(s.motion.end_of(piece - 1), s.motion.begin_of(piece));
    EXPECT_LT((q - before).cwiseAbs().maxCoeff(), 1e-9) << "positions do not jump; those of CVODE by its tolerance";
  }
  if (s.events.empty()) return;  // none are told
  const Event& impact = s.events.front();
  ASSERT_EQ(impact.kind, EventKind::impact);
  s.motion.at(impact.t, q, v, Motion::Side::before);
  EXPECT_NEAR(v[0], impact.v_minus[0], 1e-8) << "ten tolerances";
  s.motion.at(impact.t, q, v);
  EXPECT_NEAR(v[0], impact.v_plus[0], 1e-8);
  EXPECT_NEAR(q[0], impact.q[0], 1e-8) << "where the motion jumps, the impact is told";
  if (impact.modes.empty()) return;  // it is where a step says, not where bodies touch
  EXPECT_NEAR(v[0], -problem->info().contacts[0].eps_r * impact.v_minus[0], 1e-8);
}

INSTANTIATE_TEST_SUITE_P(Methods, MotionOf,
                         testing::Values("fesd:radau-iia:3,elements=as_needed", "fesd:gauss:2,elements=as_needed",
                                         "fesd_adaptive:radau-iia:3", "cvode:adams", "cvode:bdf", "arkode:erk:4", "ida",
                                         "event_driven", "event_driven:dopri5", "event_driven:radau-iia:3",
                                         "event_driven:radau-iia:5", "moreau_jean", "anitescu_potra", "schatzman_paoli",
                                         "moreau_jean,theta=1", "generalized_alpha", "rattle", "d1_minus",
                                         "event_capturing", "extrapolated_moreau"),
                         [](const auto& of) { return test_name(of.param); });

}  // namespace
}  // namespace ricochet
