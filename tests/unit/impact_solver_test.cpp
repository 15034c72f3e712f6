#include "methods/contact_laws/impact_solver.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>

#include "methods/contact_laws/impact_sequence.h"
#include "problems/registry.h"
#include "problems/scene_file/scene_file.h"

namespace ricochet {
namespace {

/// The laws at one instant of a scene, with its sizes as the start of a step of one second sees them.
struct LawsOf {
  explicit LawsOf(std::unique_ptr<Problem> the_problem, const FrictionPolygon& polygon = FrictionPolygon())
      : problem(std::move(the_problem)), scales(*problem), law(*problem, polygon, scales, counters) {
    problem->set_impact_law({});  // (2), (3) are Newton's law; stated_impact_test.cpp has the others
    const ProblemInfo& info = problem->info();
    scales.begin_step(info.q0.data(), info.v0.data(), 1, true);
    Lambda_n.setZero(info.n_c());
    Lambda_t.setZero(info.n_lambda_t);
  }

  void prepare(const Vector& q, const std::vector<int>& contacts) {
    ASSERT_TRUE(law.prepare(q, contacts));
    for (const int i : contacts)
      scales.record_contact(i, law.normal(i), law.normal_delassus(i), law.tangential_delassus(i));
  }
  /// v+ of all these contacts, those with a negative normal velocity the ones that need an impulse.
  Vector impact(const Vector& q, Vector v, const std::vector<int>& contacts) {
    prepare(q, contacts);
    std::vector<int> approaching;
    for (const int i : contacts) {
      scales.record_approach(i, law.normal_velocity_scale(i, v));
      scales.record_slip(i, law.slip_velocity_scale(i, v));
      if (law.normal_velocity(i, v) < 0) approaching.push_back(i);
    }
    EXPECT_EQ(law.impact(contacts, approaching, v, Lambda_n, Lambda_t), LcpStatus::solved);
    return v;
  }

  std::unique_ptr<Problem> problem;
  Counters counters;
  ContactScales scales;
  ImpactSolver law;
  Vector Lambda_n, Lambda_t;
};

Vector values(std::initializer_list<double> list) {
  return Eigen::Map<const Vector>(list.begin(), static_cast<Eigen::Index>(list.size()));
}

void expect_near(const Vector& actual, const Vector& value) {
  ASSERT_EQ(actual.size(), value.size());
  // A handful of additions and one small linear system, of numbers up to 10.
  for (Eigen::Index k = 0; k < value.size(); ++k) EXPECT_NEAR(actual[k], value[k], 1e-14) << k;
}

void expect_near(const Vector& actual, std::initializer_list<double> expected) {
  expect_near(actual, values(expected));
}

// --- impacts that follow each other

/// Three equal elastic balls, the last apart by rounding. At 1 m/s that flight is too short for its load to change a
/// velocity, so the impulse goes through at this instant; at 1 um/s it takes 0.2 us, a flight of its own.
TEST(ImpactSequences, GoOnThroughFlightsInWhichNoVelocityChanges) {
  for (const double speed : {1.0, 1e-6}) {
    LawsOf laws(read_scene_text(R"({"q0": [0, 0.2, 0.4000000000002], "v0": [0, 0, 0], "T": 1,
        "M": [[1, 0, 0], [0, 1, 0], [0, 0, 1]], "f": [0, 0, 1], "contacts": [
        {"name": "first pair", "gap": "q[1]-q[0]-0.2", "e": 1}, {"name": "second pair", "gap": "q[2]-q[1]-0.2", "e": 1}]})",
                                "row of balls"));
    ImpactSequence sequence(*laws.problem, laws.scales, laws.law);
    const Vector& q = laws.problem->info().q0;
    std::vector<int> touching;
    sequence.find_touching(q, nullptr, touching);
    EXPECT_EQ(touching, std::vector{0});
    ASSERT_EQ(sequence.candidates(), (std::vector{0, 1}));
    laws.prepare(q, sequence.candidates());
    Vector v = values({speed, 0, 0});
    for (const int i : sequence.candidates()) laws.scales.record_approach(i, laws.law.normal_velocity_scale(i, v));
    const auto outcome = sequence.apply_impacts(q, nullptr, touching, v, laws.Lambda_n, laws.Lambda_t);
    EXPECT_EQ(outcome.result, ImpactSequence::Result::done);
    const bool goes_on = speed == 1;
    EXPECT_EQ(outcome.n_impacts, goes_on ? 2 : 1);
    expect_near(v / speed, goes_on ? values({0, 0, 1}) : values({0, 1, 0}));
    expect_near(laws.Lambda_n / speed, goes_on ? values({1, 1}) : values({1, 0}));
  }
}

// --- Newton's law

TEST(ImpactLaws, ReflectABall) {
  LawsOf ball(make_problem("oblique_impact", {{"m", 2}, {"e", 0.6}, {"mu", 0.2}}));
  expect_near(ball.impact(values({0, 0}), values({0, -1.5}), {0}), {0, 0.9});
  expect_near(ball.Lambda_n, {2 * 1.6 * 1.5});  // m (1 + e) |v-|
  expect_near(ball.Lambda_t, {0});
}

/// A ball hits three that touch each other: with Newton's law at all three contacts, the first one opens with e u and
/// the others stay closed.
TEST(ImpactLaws, StrikeARowAtOnce) {
  const double e = 0.8, u = 3, m = 0.5;
  LawsOf row(make_problem("ball_row_touching", {{"e", e}, {"m", m}}));
  const double rest = (1 + e) * u / 4, first = rest - e * u;
  expect_near(row.impact(row.problem->info().q0, values({u, 0, 0, 0}), {0, 1, 2}), {first, rest, rest, rest});
  expect_near(row.Lambda_n, {m * (u - first), 2 * m * rest, m * rest});
}

/// Balls that both approach their floor: each is an island. One that needs no impulse keeps its velocity, and what
/// stands in its place among the impulses.
TEST(ImpactLaws, LeaveOtherIslandsAlone) {
  LawsOf balls(make_problem("separate_balls", {{"n", 3}, {"falling", 0}, {"e", 0.5}, {"m", 0.2}}));
  balls.Lambda_n.setConstant(7);
  const Vector v = balls.impact(balls.problem->info().q0, values({-2, 0, -1}), {0, 1, 2});
  expect_near(v, {1, 0, 0.5});
  expect_near(balls.Lambda_n, {0.2 * 1.5 * 2, 7, 0.2 * 1.5});
  EXPECT_EQ(balls.counters.complementarity_solves, 2);
}

// --- Coulomb's law on the impulses

TEST(ImpactLaws, LetABallSlipOrStick) {
  const double m = 2, e = 0.6, mu = 0.2, Lambda = m * (1 + e) * 1.5;
  LawsOf ball(make_problem("oblique_impact", {{"m", m}, {"e", e}, {"mu", mu}}));
  // Fast: friction takes mu Lambda_n / m = 0.48 of the slip, and the ball slips on.
  expect_near(ball.impact(values({0, 0}), values({-3, -1.5}), {0}), {-3 + mu * Lambda / m, 0.9});
  expect_near(ball.Lambda_n, {Lambda});
  expect_near(ball.Lambda_t, {mu * Lambda});
  // Slow: it takes all of it.
  expect_near(ball.impact(values({0, 0}), values({0.4, -1.5}), {0}), {0, 0.9});
  expect_near(ball.Lambda_n, {Lambda});
  expect_near(ball.Lambda_t, {-m * 0.4});
}

/// A rod that hits the ground with its tip: normal and tangential impulses turn it, and so act on each other,
///   G_nn = 1/m + l^2/(4 J) cos^2,  G_tt = 1/m + l^2/(4 J) sin^2,  G_nt = l^2/(4 J) sin cos.
TEST(ImpactLaws, CoupleNormalAndFrictionAtTheTipOfARod) {
  const double m = 1, l = 1, J = 1.0 / 12, mu = 0.4, e = 0.3, theta = 1, s = std::sin(theta), c = std::cos(theta);
  const double a = l * l / (4 * J), G_nn = 1 / m + a * c * c, G_tt = 1 / m + a * s * s, G_nt = a * s * c;
  LawsOf rod(make_problem("falling_rod", {{"mu", mu}, {"e", e}, {"theta0", theta}}));
  const Vector q = rod.problem->info().q0;
  const auto tip = [&](const Vector& v) { return std::pair(v[1] - l / 2 * c * v[2], v[0] - l / 2 * s * v[2]); };

  // It slips on: Lambda_t = -mu Lambda_n.
  const Vector fast = rod.impact(q, values({5, -1, 0}), {0});
  const double slipping = (1 + e) * 1 / (G_nn - mu * G_nt);
  expect_near(rod.Lambda_n, {slipping});
  expect_near(rod.Lambda_t, {-mu * slipping});
  EXPECT_NEAR(tip(fast).first, e * 1, 1e-14);
  EXPECT_NEAR(tip(fast).second, 5 + (G_nt - mu * G_tt) * slipping, 1e-14);
  ASSERT_GT(tip(fast).second, 0) << "else it is no slip";

  // It sticks: both velocities are given, (G_nn G_nt; G_nt G_tt) Lambda = ((1 + e) 1, -slip).
  const double slip = -1.1, determinant = G_nn * G_tt - G_nt * G_nt;
  const double Lambda_n = ((1 + e) * G_tt + G_nt * slip) / determinant,
               Lambda_t = (-G_nn * slip - G_nt * (1 + e)) / determinant;
  ASSERT_LT(std::abs(Lambda_t), mu * Lambda_n) << "else it does not stick";
  const Vector stuck = rod.impact(q, values({slip, -1, 0}), {0});
  expect_near(rod.Lambda_n, {Lambda_n});
  expect_near(rod.Lambda_t, {Lambda_t});
  EXPECT_NEAR(tip(stuck).first, e, 1e-14);
  EXPECT_NEAR(tip(stuck).second, 0, 1e-14);
}

/// In space friction is opposite to the slip velocity after the impact, in the disc or at a vertex of a polygon.
TEST(ImpactLaws, KeepFrictionInTheDiscOrThePolygon) {
  const double mu = 0.5, angle = 0.3, m = 1;
  const auto slide = [&](const FrictionPolygon& polygon) {
    LawsOf block(make_problem("block_on_ramp_3d", {{"mu", mu}, {"m", m}}), polygon);
    block.impact(values({0, 0, 0}), values({3 * std::cos(angle), 3 * std::sin(angle), -1}), {0});
    EXPECT_NEAR(block.Lambda_n[0], m * 1, 1e-14);
    return Vector(block.Lambda_t);
  };
  const Vector disc = slide(FrictionPolygon()), square = slide(FrictionPolygon(4));
  // The disc's is found by Newton's method, to 1e-12 of the impulses.
  EXPECT_NEAR(disc[0], -mu * std::cos(angle), 1e-11);
  EXPECT_NEAR(disc[1], -mu * std::sin(angle), 1e-11);
  expect_near(square, {-mu, 0});
}

// --- Forces

TEST(ContactForces, HoldASlidingBlock) {
  const double m = 2, g = 9.81, mu = 0.3;
  LawsOf block(make_problem("sliding_block", {{"m", m}, {"mu", mu}, {"g", g}}));
  const Vector q = values({0, 0}), v = values({-2, 0});
  block.prepare(q, {0});
  std::vector<ImpactSolver::ClosedContact> closed{{.contact = 0}};
  block.law.set_slide(closed[0], v, 1e-12);
  EXPECT_TRUE(closed[0].slides);
  ASSERT_EQ(block.law.contact_forces(q, v, closed, block.Lambda_n, block.Lambda_t), LcpStatus::solved);
  EXPECT_EQ(closed[0].mode, ContactMode::slip_negative);
  expect_near(block.Lambda_n, {m * g});
  expect_near(block.Lambda_t, {mu * m * g});
  expect_near(block.law.acceleration(), {mu * g, 0});
}

/// On a ramp a block at rest sticks where tan(slope) <= mu, and else begins to slip.
TEST(ContactForces, LetABlockStickOrSlipOnARamp) {
  const double m = 1, g = 9.81, slope = 0.4;
  for (const double mu : {0.6, 0.2}) {
    LawsOf block(make_problem("block_on_ramp", {{"m", m}, {"mu", mu}, {"g", g}, {"slope", slope}}));
    const Vector q = block.problem->info().q0, v = Vector::Zero(2);
    block.prepare(q, {0});
    std::vector<ImpactSolver::ClosedContact> closed{{.contact = 0}};
    ASSERT_EQ(block.law.contact_forces(q, v, closed, block.Lambda_n, block.Lambda_t), LcpStatus::solved);
    const bool sticks = std::tan(slope) <= mu;
    EXPECT_NEAR(block.Lambda_n[0], m * g * std::cos(slope), 1e-14 * m * g);
    EXPECT_NEAR(std::abs(block.Lambda_t[0]), (sticks ? std::sin(slope) : mu * std::cos(slope)) * m * g, 1e-14 * m * g);
    EXPECT_EQ(closed[0].mode == ContactMode::stick, sticks);
    EXPECT_EQ(is_slipping(closed[0].mode), !sticks);
  }
}

/// The rod of Painleve's paradox, sliding forward: the gap acceleration is b + p lambda_n (falling_rod.cpp).
TEST(ContactForces, KnowPainlevesParadox) {
  const double m = 1, l = 1, J = 1.0 / 12, g = 9.81, theta = 1.1, s = std::sin(theta), c = std::cos(theta);
  const auto rod_with = [&](double mu) { return make_problem("falling_rod", {{"mu", mu}, {"theta0", theta}}); };
  const auto p = [&](double mu) { return 1 / m + l * l / (4 * J) * c * (c - mu * s); };
  const auto sliding_forces = [&](LawsOf& rod, double omega, ImpactSolver::ClosedContact& closed) {
    const Vector q = rod.problem->info().q0, v = values({2 + l / 2 * s * omega, l / 2 * c * omega, omega});
    rod.prepare(q, {0});
    rod.law.set_slide(closed, v, 1e-12);
    return rod.law.contact_forces(q, v, {&closed, 1}, rod.Lambda_n, rod.Lambda_t);
  };
  const double forward = 1;
  for (const double omega : {0.0, 2.0}) {  // outside: one force
    LawsOf rod(rod_with(0.4));
    ImpactSolver::ClosedContact closed{.contact = 0};
    ASSERT_EQ(sliding_forces(rod, omega, closed), LcpStatus::solved);
    EXPECT_NEAR(rod.law.sliding_delassus(0, &forward), p(0.4), 1e-14);
    const double b = l / 2 * s * omega * omega - g;
    ASSERT_LT(b, 0);
    expect_near(rod.Lambda_n, {-b / p(0.4)});
    expect_near(rod.Lambda_t, {0.4 * b / p(0.4)});
    EXPECT_EQ(closed.mode, ContactMode::slip_positive);
    EXPECT_FALSE(rod.law.is_pulled_apart(0));
  }
  ASSERT_LT(p(2), 0);
  {  // b < 0: no force keeps it closed, and none opens it
    LawsOf rod(rod_with(2));
    ImpactSolver::ClosedContact closed{.contact = 0};
    EXPECT_NE(sliding_forces(rod, 0, closed), LcpStatus::solved);
    EXPECT_NEAR(rod.law.sliding_delassus(0, &forward), p(2), 1e-14);
  }
  {  // b > 0: it may open, or stay closed with lambda_n = -b / p. Both are solutions, and sliding_delassus() says so.
    LawsOf rod(rod_with(2));
    ImpactSolver::ClosedContact closed{.contact = 0};
    ASSERT_EQ(sliding_forces(rod, 6, closed), LcpStatus::solved);
    EXPECT_LT(rod.law.sliding_delassus(0, &forward), 0);
    const double b = l / 2 * s * 36 - g, lambda = rod.Lambda_n[0];
    EXPECT_TRUE(lambda == 0 || std::abs(lambda + b / p(2)) <= 1e-13) << lambda;
  }
}

/// Bodies that fall together touch without a force, and are not pulled apart.
TEST(ContactForces, AreNoneBetweenBodiesThatFallTogether) {
  LawsOf row(make_problem("ball_row_touching"));  // without any load
  const Vector q = row.problem->info().q0, v = Vector::Constant(4, 2);
  row.prepare(q, {0, 1, 2});
  std::vector<ImpactSolver::ClosedContact> closed{{.contact = 1}, {.contact = 2}};
  ASSERT_EQ(row.law.contact_forces(q, v, closed, row.Lambda_n, row.Lambda_t), LcpStatus::solved);
  expect_near(row.Lambda_n, {0, 0, 0});
  for (const auto& contact : closed) {
    EXPECT_EQ(contact.mode, ContactMode::open);
    EXPECT_FALSE(row.law.is_pulled_apart(contact.contact));
  }
}

TEST(ImpactLaws, RefuseDependentBilateralConstraints) {
  const auto problem = make_problem("pendulum_wall_cartesian");
  LawsOf pendulum(make_problem("pendulum_wall_cartesian"));
  // At length zero the rod's constraint has no gradient.
  EXPECT_FALSE(pendulum.law.prepare(Vector::Zero(problem->n_q()), {}));
}

// --- Balances, on every scene that starts with closed contacts

std::vector<int> closed_at_start(const Problem& problem) {
  const ProblemInfo& info = problem.info();
  const Vector gap = problem.gap(info.q0);
  std::vector<int> closed;
  for (const int i : info.unilateral) {
    if (gap[i] <= 1e-12) closed.push_back(i);
  }
  return closed;
}

std::vector<std::string> scenes_that_touch() {
  std::vector<std::string> names;
  for (const auto& scene : scenes()) {
    if (!closed_at_start(*make_problem(scene.id)).empty()) names.push_back(scene.id);
  }
  return names;
}

class TouchingScene : public testing::TestWithParam<std::string> {
 protected:
  LawsOf laws_{make_problem(GetParam())};
  const Problem& problem_ = *laws_.problem;
  const ProblemInfo& info_ = problem_.info();
  const std::vector<int> touching_ = closed_at_start(problem_);
  const Matrix J_n_ = problem_.normal_jacobian(info_.q0), J_t_ = problem_.tangent_jacobian(info_.q0);

  /// J_n Lambda_n + J_t Lambda_t
  Vector pushed(const Vector& n, const Vector& t) const {
    return problem_.force_directions(J_n_) * n + problem_.force_directions(J_t_) * t;
  }
  /// 0 <= r_n _|_ w_n >= 0, ||r_t|| <= mu r_n, both relative to sizes of r and w.
  void expect_law(int i, double r_n, double w_n, const Vector& r_t, double r_size, double w_size) const {
    const auto& contact = info_.contacts[i];
    EXPECT_GE(r_n, 0) << contact.name;
    EXPECT_GE(w_n, -1e-11 * w_size) << contact.name;
    EXPECT_LE(std::min(r_n / r_size, w_n / w_size), 1e-11) << contact.name;
    const double friction = r_t.segment(contact.tangent_index, contact.n_t).norm();
    EXPECT_LE(friction, contact.mu * r_n + 1e-11 * r_size) << contact.name;
  }
};

TEST_P(TouchingScene, BalancesTheMomentumOfImpacts) {
  const Matrix M = problem_.mass_matrix(info_.q0);
  std::mt19937 random(7);
  std::uniform_real_distribution<double> number(-1, 1);
  int n_struck = 0;
  for (int repetition = 0; repetition < 5; ++repetition) {
    Vector v = info_.v0;
    for (int k = 0; k < info_.n_mechanical(); ++k) v[k] += number(random);
    laws_.Lambda_n.setZero();
    laws_.Lambda_t.setZero();
    const Vector v_plus = laws_.impact(info_.q0, v, touching_);
    if (testing::Test::HasFailure()) return;
    const Vector change = M * (v_plus - v), impulse = pushed(laws_.Lambda_n, laws_.Lambda_t);
    const double r_size = std::max(1e-300, laws_.Lambda_n.cwiseAbs().maxCoeff());
    const double w_size = std::max(v.cwiseAbs().maxCoeff(), v_plus.cwiseAbs().maxCoeff());
    // (1): the velocities round by their own size, the impulses by theirs.
    const double rounding = 1e-12 * (M.cwiseAbs().maxCoeff() * w_size + r_size);
    EXPECT_LE((change - impulse).lpNorm<Eigen::Infinity>(), rounding);
    // (2), (3); bilateral constraints only where an impact happens at all.
    const bool struck = laws_.Lambda_n.cwiseAbs().maxCoeff() > 0;
    n_struck += struck;
    for (const int i : touching_) {
      const double w_n = J_n_.col(i).dot(v_plus) + info_.contacts[i].eps_r * J_n_.col(i).dot(v);
      expect_law(i, laws_.Lambda_n[i], w_n, laws_.Lambda_t, r_size, w_size);
    }
    for (const int i : info_.bilateral) {
      if (struck) EXPECT_LE(std::abs(J_n_.col(i).dot(v_plus)), 1e-11 * w_size) << info_.contacts[i].name;
    }
  }
  EXPECT_GT(n_struck, 0) << "else nothing was tested";
}

TEST_P(TouchingScene, BalancesTheForces) {
  const Vector &q = info_.q0, &v = info_.v0;
  laws_.prepare(q, touching_);
  std::vector<ImpactSolver::ClosedContact> closed;
  for (const int i : touching_) {
    closed.push_back({.contact = i});
    laws_.law.set_slide(closed.back(), v, 1e-12);
  }
  ASSERT_EQ(laws_.law.contact_forces(q, v, closed, laws_.Lambda_n, laws_.Lambda_t), LcpStatus::solved);
  const Vector w = laws_.law.acceleration(), f = problem_.force(q, v), bias = problem_.gap_acceleration_bias(q, v);
  const Matrix M = problem_.mass_matrix(q);
  const double r_size = std::max(1e-300, std::max(f.cwiseAbs().maxCoeff(), laws_.Lambda_n.cwiseAbs().maxCoeff()));
  const double w_size =
      std::max({1e-300, w.cwiseAbs().maxCoeff(), laws_.law.free_acceleration(q, v).cwiseAbs().maxCoeff()});
  const Vector balance = M * w - f - pushed(laws_.Lambda_n, laws_.Lambda_t);  // (4)
  EXPECT_LE(balance.lpNorm<Eigen::Infinity>(), 1e-12 * (M.cwiseAbs().maxCoeff() * w_size + r_size));
  for (const auto& c : closed) {  // (5), (6)
    const auto& contact = info_.contacts[c.contact];
    expect_law(c.contact, laws_.Lambda_n[c.contact], J_n_.col(c.contact).dot(w) + bias[c.contact], laws_.Lambda_t,
               r_size, w_size);
    for (int d = 0; d < contact.n_t && c.slides; ++d)
      EXPECT_NEAR(laws_.Lambda_t[contact.tangent_index + d], -contact.mu * laws_.Lambda_n[c.contact] * c.direction[d],
                  1e-12 * r_size);
  }
  for (const int i : info_.bilateral)
    EXPECT_LE(std::abs(J_n_.col(i).dot(w) + bias[i]), 1e-11 * w_size) << info_.contacts[i].name;
}

INSTANTIATE_TEST_SUITE_P(ImpactSolver, TouchingScene, testing::ValuesIn(scenes_that_touch()),
                         [](const auto& test) { return test.param; });

}  // namespace
}  // namespace ricochet
