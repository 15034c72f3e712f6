// Metrics of a motion: known distances between two motions, events of which one is missing, laws that are violated, and
// the momentum of bodies.
#include "bench/measure/metrics/metrics.h"

#include <gtest/gtest.h>

#include <cmath>

#include "bench/measure/metrics/momentum.h"
#include "methods/registry.h"
#include "problems/geometry.h"
#include "problems/registry.h"
#include "reference/agreement.h"
#include "tests/test_data.h"

namespace ricochet {
namespace {

Solution solved(const Problem& problem, const std::string& method, int steps, double tolerance) {
  Settings settings;
  settings.steps = steps;
  settings.tolerance = tolerance;
  settings.recording = Recording::motion;
  Solution solution = make_method(method)->solve(problem, settings);
  EXPECT_TRUE(solution.succeeded()) << solution.message;
  return solution;
}

TEST(Metrics, OfTheReferenceItselfAreRounding) {
  const auto problem = make_problem("two_balls_spring");
  const auto truth = reference_motion(*problem, reference::make_reference(*problem)).motion;
  ASSERT_TRUE(truth);
  const Metrics m = measure_metrics(*problem, *truth, &*truth);
  EXPECT_LT(m.position_error, 1e-12) << "interpolation";
  EXPECT_LT(m.velocity_error, 1e-12);
  EXPECT_EQ(m.event_time_error, 0);
  EXPECT_EQ(m.missed_events, 0);
  EXPECT_EQ(m.spurious_events, 0);
  EXPECT_EQ(m.energy_error, 0);
  EXPECT_LT(m.signorini, 1e-10) << "its event tolerance";
  EXPECT_LT(m.restitution, 1e-10);
  EXPECT_TRUE(std::isnan(m.cone)) << "nothing rubs";
  EXPECT_TRUE(std::isnan(m.constraint_drift)) << "nothing is held";
}

TEST(Metrics, SayHowFarAMotionIsOff) {
  const auto problem = make_problem("two_balls_spring");
  const auto truth = reference_motion(*problem, reference::make_reference(*problem)).motion;
  ASSERT_TRUE(truth);
  // Later by dt: events by dt, q by |v| dt, the integral of v by dt times the sum of what v does, jumps among it.
  constexpr double dt = 1e-4;
  Solution late = *truth;
  late.motion = {};
  for (std::size_t piece = 0; piece < truth->motion.n_pieces(); ++piece) {
    late.motion.add(truth->motion.begin_of(piece), truth->motion.end_of(piece), 8, [&](double s, Vector& q, Vector& v) {
      truth->motion.within(piece, s, q, v);
      q[0] += dt;
    });
  }
  late.events.front().t += dt;
  late.events.front().Lambda_n *= 1.25;
  late.events.push_back(late.events.back());
  late.events.back().kind = EventKind::slip_reversal;
  const Metrics m = measure_metrics(*problem, late, &*truth);
  EXPECT_NEAR(m.position_error, dt, 1e-10);
  EXPECT_NEAR(m.event_time_error, dt, 1e-12);
  EXPECT_NEAR(m.impulse_error, 0.25 * truth->events.front().Lambda_n.maxCoeff(), 1e-12);
  EXPECT_EQ(m.spurious_events, 1);
  EXPECT_EQ(m.missed_events, 0);
}

TEST(Metrics, OfTimeSteppingAreOfFirstOrderInEveryNorm) {
  const auto problem = make_problem("two_balls_spring");
  const auto truth = reference_motion(*problem, reference::make_reference(*problem)).motion;
  ASSERT_TRUE(truth);
  const Metrics coarse = measure_metrics(*problem, solved(*problem, "moreau_jean", 1000, 0), &*truth);
  const Metrics fine = measure_metrics(*problem, solved(*problem, "moreau_jean", 8000, 0), &*truth);
  EXPECT_LT(fine.position_error, coarse.position_error / 4);
  EXPECT_LT(fine.velocity_error, coarse.velocity_error / 4) << "jumps do not hurt it";
  EXPECT_LT(fine.event_time_error, coarse.event_time_error / 2);
  EXPECT_LT(fine.signorini, coarse.signorini / 2) << "impulses act a step from the contact";
  EXPECT_LT(fine.restitution, 1e-12) << "the law holds in each step";
}

TEST(Metrics, SeeLawsThatAreViolated) {
  const auto problem = make_problem("block_on_ramp");
  Solution s = solved(*problem, "event_driven", 0, 1e-9);
  Event event;
  event.contact = 0;
  event.q = problem->info().q0;
  event.v_minus = event.v_plus = Vector::Zero(problem->n_q());
  event.Lambda_n = Vector::Constant(problem->n_c(), 2);
  event.Lambda_t = Vector::Constant(problem->info().n_lambda_t, 5);
  s.events = {event};
  const Metrics m = measure_metrics(*problem, s, nullptr);
  const ContactInfo& contact = problem->info().contacts[0];
  const double W = problem->normal_jacobian(event.q).col(0).dot(problem->mass_matrix(event.q).inverse() *
                                                                problem->normal_jacobian(event.q).col(0));
  EXPECT_NEAR(m.cone, W * (5 - 2 * contact.mu), 1e-12);
  EXPECT_TRUE(std::isnan(m.position_error)) << "without a reference";

  s.events[0].Lambda_n[0] = -1;
  EXPECT_NEAR(measure_metrics(*problem, s, nullptr).restitution, W, 1e-12) << "it pulls";
}

/// A block that slides, sticks and slides again: one contact that stays closed.
TEST(Metrics, OfPersistentContactAreThoseOfItsForces) {
  const auto problem = ground_truth_problem("P4b_spring_driven_block");
  const auto truth = reference_motion(*problem, reference::make_reference(*problem)).motion;
  ASSERT_TRUE(truth);
  const Metrics of_reference = measure_metrics(*problem, *truth, &*truth);
  EXPECT_LT(of_reference.contact_gap, 1e-12);
  EXPECT_LT(of_reference.contact_cone, 1e-8) << "its interpolant is differentiated";
  EXPECT_LT(of_reference.contact_dissipation, 1e-8);
  EXPECT_EQ(of_reference.contact_pull, 0);

  // Time stepping has the laws in each step, but switches a part of a step late.
  const Metrics coarse = measure_metrics(*problem, solved(*problem, "moreau_jean", 500, 0), &*truth);
  const Metrics fine = measure_metrics(*problem, solved(*problem, "moreau_jean", 4000, 0), &*truth);
  EXPECT_GT(coarse.contact_dissipation, 0);
  EXPECT_LT(fine.contact_dissipation, coarse.contact_dissipation / 4) << "order 1";
  const Metrics fesd = measure_metrics(*problem, solved(*problem, "fesd:radau-iia:3", 100, 0), &*truth);
  EXPECT_LT(fesd.contact_dissipation, fine.contact_dissipation / 100);
}

/// The motion of a reference, whose v gets another acceleration `a` and whose q is moved by `d`, both of one coordinate.
Solution pushed(const Solution& truth, Eigen::Index coordinate, double a, double d) {
  Solution other = truth;
  other.motion = {};
  for (std::size_t piece = 0; piece < truth.motion.n_pieces(); ++piece) {
    const double begin = truth.motion.begin_of(piece), h = truth.motion.end_of(piece) - begin;
    other.motion.add(begin, begin + h, 12, [&](double s, Vector& q, Vector& v) {
      truth.motion.within(piece, s, q, v);
      q[coordinate] += d;
      v[coordinate] += a * (begin + s * h);
    });
  }
  return other;
}

TEST(Metrics, SeeForcesThatNoContactHas) {
  const auto problem = ground_truth_problem("P4b_spring_driven_block");
  const auto truth = reference_motion(*problem, reference::make_reference(*problem)).motion;
  ASSERT_TRUE(truth);
  const double T = problem->info().end_time, g = 9.81;  // of masses of 1 kg: W m = 1
  const Metrics slid = measure_metrics(*problem, pushed(*truth, 0, 30, 0), &*truth);
  EXPECT_GT(slid.contact_cone, 0.5 * 30 * T) << "most of the force is outside of the cone";
  EXPECT_LT(slid.contact_cone, 30 * T);
  EXPECT_EQ(slid.contact_pull, 0);

  const Metrics lifted = measure_metrics(*problem, pushed(*truth, 1, -3 * g, 1e-3), &*truth);
  EXPECT_NEAR(lifted.contact_pull, 2 * g * T, 1e-6) << "down by 3 g, of which its weight does one";
  EXPECT_NEAR(lifted.contact_gap, 1e-3, 1e-12);
}

/// A ball that rests after its impact, by methods whose forces are in accelerations and by one with forces in impulses.
TEST(Metrics, OfAContactThatAnImpactCloses) {
  const auto problem = ground_truth_problem("P1c_ball_e0");
  const auto truth = reference_motion(*problem, reference::make_reference(*problem)).motion;
  ASSERT_TRUE(truth);
  for (const auto& [method, steps, tolerance] :
       {std::tuple("event_driven", 0, 1e-9), std::tuple("fesd:gauss:2", 40, 0.0),
        std::tuple("fesd_adaptive:radau-iia:3", 0, 1e-9), std::tuple("moreau_jean", 1000, 0.0)}) {
    const Metrics m = measure_metrics(*problem, solved(*problem, method, steps, tolerance), &*truth);
    EXPECT_LT(m.contact_gap, 0.01) << method << ": at most a step of time stepping from the ground";
    EXPECT_NEAR(m.contact_pull, 0, 1e-9) << method;
  }
}

TEST(Metrics, OfJointsAreTheirDriftAlone) {
  const auto problem = make_problem("pendulum_wall_cartesian");
  const auto truth = reference_motion(*problem, reference::make_reference(*problem)).motion;
  ASSERT_TRUE(truth);
  const Metrics m = measure_metrics(*problem, solved(*problem, "event_driven", 0, 1e-6), &*truth);
  EXPECT_FALSE(std::isnan(m.constraint_drift));
  EXPECT_TRUE(std::isnan(m.contact_gap));
}

TEST(Metrics, OfRedundantContactsHaveNoForces) {
  const auto problem = make_problem("block_on_feet");
  const auto truth = reference_motion(*problem, reference::make_reference(*problem)).motion;
  ASSERT_TRUE(truth);
  const Metrics m = measure_metrics(*problem, *truth, &*truth);
  EXPECT_LT(m.contact_gap, 1e-9);
  EXPECT_TRUE(std::isnan(m.contact_cone));
}

TEST(Metrics, MomentumOfAFreeBodyIsKept) {
  const auto problem = make_problem("box_3d", {{"height", 100}, {"duration", 1}});
  const ProblemInfo& info = problem->info();
  const Solution s = solved(*problem, "fesd_adaptive:gauss:4", 0, 1e-11);
  const Momentum start = momentum(*problem, info.q0, info.v0), end = momentum(*problem, s.q, s.v);
  const double m = info.geometry->bodies[0].mass, g = info.geometry->gravity[2], t = s.t;
  EXPECT_NEAR(end.linear[2] - start.linear[2], m * g * t, 1e-8) << "its weight";
  // About the origin gravity turns the body as it moves away: dL = r x m g t.
  const Vector r0 = info.q0.head(3), v0 = info.v0.head(3);
  const double torque = -m * g * (r0[0] * t + v0[0] * t * t / 2);
  EXPECT_NEAR(end.angular[1] - start.angular[1], torque, 1e-7 * (1 + std::abs(torque)));
  EXPECT_NEAR(end.angular[2], start.angular[2], 1e-8) << "about the vertical";
}

}  // namespace
}  // namespace ricochet
