// The equations of motion in fixed modes, against the equations themselves, written out with dense matrices.
#include "reference/contact_dynamics.h"

#include <gtest/gtest.h>

#include "problems/dense_solve.h"
#include "tests/test_data.h"

namespace ricochet {
namespace {

using reference::ContactDynamics;

struct MotionCase {
  const char* problem;
  ContactMode with_friction;  ///< mode of `closed`, where it has friction
  std::vector<int> closed;
};

struct Motion {
  explicit Motion(const Problem& problem)
      : a(Vector::Constant(problem.n_q(), NAN)),
        lambda_n(Vector::Zero(problem.n_c())),
        lambda_t(Vector::Zero(problem.info().n_lambda_t)) {}
  bool of(ContactDynamics& dynamics, const Vector& q, const Vector& v) {
    return dynamics.acceleration(q.data(), v.data(), a.data(), lambda_n.data(), lambda_t.data());
  }

  Vector a, lambda_n, lambda_t;
};

std::vector<ContactMode> modes_of(const Problem& problem, const MotionCase& c) {
  std::vector<ContactMode> modes(problem.info().contacts.size(), ContactMode::open);
  for (const int i : problem.info().bilateral) modes[i] = ContactMode::closed;
  for (const int i : c.closed) modes[i] = problem.info().contacts[i].n_t > 0 ? c.with_friction : ContactMode::closed;
  return modes;
}

/// A state that is nothing special. The clock runs.
Vector moved(const Problem& problem, Vector x, double by) {
  for (Eigen::Index k = 0; k < x.size(); ++k) {
    if (k != problem.info().clock) x[k] += by * std::cos(1.0 + 2.0 * static_cast<double>(k));
  }
  return x;
}

class EquationsOfMotion : public testing::TestWithParam<MotionCase> {};

TEST_P(EquationsOfMotion, Hold) {
  const auto problem = make_problem(GetParam().problem);
  const auto& info = problem->info();
  ContactDynamics dynamics(*problem);
  const auto modes = modes_of(*problem, GetParam());
  dynamics.set_modes(modes);
  Motion motion(*problem);
  for (const double by : {0.1, 0.17, -0.12}) {  // what is kept from one state holds in the next
    const Vector q = moved(*problem, info.q0, by), v = moved(*problem, info.v0, 3 * by);
    ASSERT_TRUE(motion.of(dynamics, q, v));
    const Matrix J_n = problem->normal_jacobian(q), J_t = problem->tangent_jacobian(q);
    const Vector force = problem->force(q, v), push = problem->force_directions(J_n) * motion.lambda_n +
                                                      problem->force_directions(J_t) * motion.lambda_t;
    const double size = force.cwiseAbs().maxCoeff() + push.cwiseAbs().maxCoeff();
    // Rounding of sums of at most 14 terms and of factors whose condition is below 1e3.
    EXPECT_LE((problem->mass_matrix(q) * motion.a - force - push).cwiseAbs().maxCoeff(), 1e-12 * size);  // (1)
    const double fast = 1 + motion.a.cwiseAbs().maxCoeff();
    const Vector rate = J_n.transpose() * motion.a + problem->gap_acceleration_bias(q, v);
    const Vector slip_rate = J_t.transpose() * motion.a + problem->slip_acceleration_bias(q, v);
    for (int i = 0; i < info.n_c(); ++i) {
      const int t = info.contacts[i].tangent_index, n_t = info.contacts[i].n_t;
      if (!is_closed(modes[i])) {
        EXPECT_EQ(motion.lambda_n[i], 0);
        continue;
      }
      EXPECT_LE(std::abs(rate[i]), 1e-12 * fast);                                                     // (2)
      if (modes[i] == ContactMode::stick) EXPECT_LE(slip_rate.segment(t, n_t).norm(), 1e-12 * fast);  // (3)
      if (!is_slipping(modes[i])) continue;
      const Vector v_t = J_t.middleCols(t, n_t).transpose() * v;
      const Vector d = modes[i] == ContactMode::slip ? v_t.normalized() : Vector::Constant(1, slip_sign(modes[i]));
      EXPECT_LE((motion.lambda_t.segment(t, n_t) + info.contacts[i].mu * motion.lambda_n[i] * d).norm(),
                1e-14 * std::abs(motion.lambda_n[i]));  // (4)
    }
  }
}

INSTANTIATE_TEST_SUITE_P(
    Scenes, EquationsOfMotion,
    testing::Values(MotionCase{"two_balls_spring", ContactMode::closed, {0}},
                    MotionCase{"double_pendulum_wall", ContactMode::closed, {1}},
                    MotionCase{"pendulum_wall_cartesian", ContactMode::closed, {1}},
                    MotionCase{"slider_crank_stop", ContactMode::closed, {}},
                    MotionCase{"slider_crank_clearance", ContactMode::slip_negative, {0, 1}},
                    MotionCase{"rocking_block", ContactMode::stick, {0}},
                    MotionCase{"rocking_block", ContactMode::slip_positive, {0, 1}},
                    MotionCase{"falling_rod", ContactMode::slip_negative, {0}},
                    MotionCase{"woodpecker_toy", ContactMode::stick, {0}},
                    MotionCase{"belt_oscillator", ContactMode::stick, {0}},
                    MotionCase{"shaken_table", ContactMode::stick, {0}}, MotionCase{"ball_3d", ContactMode::slip, {0}},
                    MotionCase{"ball_3d", ContactMode::stick, {0}}, MotionCase{"box_3d", ContactMode::slip, {0, 1}},
                    MotionCase{"box_3d", ContactMode::stick, {0}},
                    MotionCase{"stacked_blocks", ContactMode::stick, {0, 1, 2}}),
    [](const auto& test) {
      return test_name(std::string(test.param.problem) + "_" + to_string(test.param.with_friction) + "_" +
                       std::to_string(test.param.closed.size()));
    });

/// The columns of closed contacts are those of the dense J, and slip in space has the direction of its velocity.
TEST_P(EquationsOfMotion, HaveTheColumnsOfTheirContacts) {
  const auto problem = make_problem(GetParam().problem);
  const auto& info = problem->info();
  reference::ClosedContacts contacts(*problem);
  const auto modes = modes_of(*problem, GetParam());
  contacts.set_modes(modes);
  const Vector q = moved(*problem, info.q0, 0.1), v = moved(*problem, info.v0, 0.3);
  contacts.evaluate(q.data());
  contacts.set_directions(v.data());
  const Matrix J_n = problem->normal_jacobian(q), J_t = problem->tangent_jacobian(q);
  std::size_t n_unknowns = 0;
  for (const auto& part : contacts.parts()) {
    const ContactInfo& contact = info.contacts[part.contact];
    const double size = 1 + J_n.cwiseAbs().maxCoeff() + (J_t.size() > 0 ? J_t.cwiseAbs().maxCoeff() : 0);
    EXPECT_NEAR(contacts.columns()[part.column].dot(v.data()), J_n.col(part.contact).dot(v), 1e-14 * size);
    for (int d = 0; d < part.n_t; ++d)
      EXPECT_NEAR(contacts.columns()[part.column + 1 + d].dot(v.data()), J_t.col(contact.tangent_index + d).dot(v),
                  1e-14 * size);
    EXPECT_EQ(part.n_stuck, modes[part.contact] == ContactMode::stick ? contact.n_t : 0);
    EXPECT_EQ(contacts.unknowns()[part.row].J, contacts.columns()[part.column].J);
    n_unknowns += 1 + part.n_stuck;
    if (modes[part.contact] != ContactMode::slip) continue;
    const Vector v_t = J_t.middleCols(contact.tangent_index, 2).transpose() * v;
    for (int d = 0; d < 2; ++d) EXPECT_NEAR(contacts.direction(part)[d], v_t.normalized()[d], 1e-14);
  }
  EXPECT_EQ(contacts.unknowns().size(), n_unknowns);
}

TEST(ForceSystem, SolvesWhatIsRegular) {
  Matrix A(3, 3);
  A << 4e6, 2, 1e3, 1, 3, 0.5, 2e3, 0.1, 8;  // entries of bodies whose masses differ by 1e6
  reference::ForceSystem system;
  system.resize(3);
  system.A() = A;
  system.diagonal() = A.diagonal();
  system.factorize();
  ASSERT_TRUE(system.is_regular());
  const Vector b = Eigen::Vector3d(1e3, -2, 0.3);
  Vector x = system.scale().cwiseProduct(b);
  system.solve_scaled(x);
  x = x.cwiseProduct(system.scale());
  EXPECT_LT(((A * x - b).array() * system.scale().array()).abs().maxCoeff(), 1e-14) << "rounding, scaled";

  system.A().row(2) = 0.5 * A.row(1);
  system.A().col(2) = 0.5 * system.A().col(1);
  system.diagonal() = system.A().diagonal();
  system.factorize();
  EXPECT_FALSE(system.is_regular()) << "two contacts are one";
}

/// What is kept between events is renewed with the modes and the directions that it was made for.
TEST(ContactDynamics, KeepsNothingOfOtherModesAndDirections) {
  const auto problem = make_problem("ball_3d");
  const Vector q = problem->info().q0, v = moved(*problem, problem->info().v0, 0.3), d = Vector::Unit(2, 1);
  ContactDynamics dynamics(*problem);
  Motion motion(*problem);
  const auto same = [&](ContactMode mode, const Vector& held) {
    ContactDynamics fresh(*problem);
    fresh.set_modes({mode});
    fresh.hold_direction(0, held);
    Motion expected(*problem);
    ASSERT_TRUE(expected.of(fresh, q, v) && motion.of(dynamics, q, v));
    EXPECT_EQ(motion.a, expected.a);
    if (is_closed(mode)) EXPECT_EQ(motion.lambda_t, expected.lambda_t);
  };
  dynamics.set_modes({ContactMode::slip});
  same(ContactMode::slip, {});
  dynamics.hold_direction(0, d);
  same(ContactMode::slip, d);
  dynamics.hold_direction(0, -d);
  same(ContactMode::slip, -d);
  dynamics.hold_direction(0, {});
  same(ContactMode::slip, {});
  dynamics.set_modes({ContactMode::stick});
  same(ContactMode::stick, {});
  dynamics.set_modes({ContactMode::open});
  same(ContactMode::open, {});
}

TEST(SmallFactors, SolveAndTellWhatIsSingular) {
  srand(1);  // of Eigen's random matrices
  for (int n = 1; n <= 12; ++n) {
    const Matrix B = Matrix::Random(n, n), M = B * B.transpose() + Matrix::Identity(n, n);
    const Vector b = Vector::Random(n);
    SymmetricFactors symmetric(n, false), diagonal(n, true);
    Vector x = b;
    ASSERT_TRUE(symmetric.compute(M));
    symmetric.solve(x.data());
    EXPECT_LE((M * x - b).cwiseAbs().maxCoeff(), 1e-14 * n * n) << "rounding of n sums";
    x = b;
    ASSERT_TRUE(diagonal.compute(M.diagonal().asDiagonal()));
    diagonal.solve(x.data());
    EXPECT_LE((M.diagonal().cwiseProduct(x) - b).cwiseAbs().maxCoeff(), 1e-15);
    EXPECT_FALSE(symmetric.compute(M - 1e3 * Matrix::Identity(n, n)));

    PivotedFactors pivoted;
    x = b;
    ASSERT_TRUE(pivoted.compute(B, 1e-12));
    pivoted.solve(x.data());
    const double condition = B.inverse().norm() * B.norm();
    EXPECT_LE((B * x - b).cwiseAbs().maxCoeff(), 1e-15 * n * condition) << "backward error times the growth of x";
    if (n == 1) continue;
    Matrix singular = B;
    singular.row(n - 1) = singular.row(0);
    EXPECT_FALSE(pivoted.compute(singular, 1e-12));
  }
}

}  // namespace
}  // namespace ricochet
