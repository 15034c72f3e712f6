// The contact laws at one instant: random problems held against the laws themselves, and problems with known answers.
#include "methods/contact_laws/friction_problem.h"

#include <gtest/gtest.h>

#include <random>

namespace ricochet {
namespace {

struct Instance {
  Matrix G;
  Vector b;
  std::vector<FrictionProblem::Contact> contacts;
};

/// n_c contacts on a body of n_q coordinates; G = D' M^-1 D is positive semidefinite, singular when there are more rows
/// than coordinates.
Instance random_instance(int n_c, int n_t, int n_q, unsigned seed) {
  std::mt19937 generator(seed);
  std::uniform_real_distribution<double> uniform(-1, 1);
  const int n = n_c * (1 + n_t);
  Instance instance;
  Matrix D(n_q, n);
  for (auto& entry : D.reshaped()) entry = uniform(generator);
  instance.G = D.transpose() * D;
  Vector v(n_q);
  for (auto& entry : v) entry = uniform(generator);
  instance.b = D.transpose() * v;  // velocities of some free motion
  for (int i = 0; i < n_c; ++i) instance.contacts.push_back({.mu = 0.1 + std::abs(uniform(generator)), .n_t = n_t});
  return instance;
}

/// Largest violation of (1)-(4) of the header, relative to the largest terms.
double violation(const Instance& instance, const Vector& r) {
  const Vector w = instance.G * r + instance.b;
  const double r_size = r.cwiseAbs().maxCoeff() + 1e-300,
               w_size = w.cwiseAbs().maxCoeff() + instance.b.cwiseAbs().maxCoeff();
  double worst = 0;
  Eigen::Index row = 0;
  for (const auto& contact : instance.contacts) {
    const double r_n = r[row], w_n = w[row];
    worst = std::max({worst, -r_n / r_size, -w_n / w_size, std::abs(r_n * w_n) / (r_size * w_size)});
    const Vector r_t = r.segment(row + 1, contact.n_t), w_t = w.segment(row + 1, contact.n_t);
    if (contact.slides) {
      for (int d = 0; d < contact.n_t; ++d)
        worst = std::max(worst, std::abs(r_t[d] + contact.mu * r_n * contact.direction[d]) / r_size);
    } else if (contact.n_t > 0) {
      worst = std::max(worst, (r_t.norm() - contact.mu * r_n) / r_size);
      worst = std::max(worst, (w_t.norm() * r_t + contact.mu * r_n * w_t).cwiseAbs().maxCoeff() / (r_size * w_size));
    }
    row += 1 + contact.n_t;
  }
  return worst;
}

struct RandomProblemShape {
  int n_c, n_t, n_q;
};

class RandomProblems : public testing::TestWithParam<RandomProblemShape> {};

TEST_P(RandomProblems, FulfilTheContactLaws) {
  const auto [n_c, n_t, n_q] = GetParam();
  FrictionProblem solver;
  solver.resize(n_c, n_c * n_t);
  int open = 0, stick = 0, slip = 0;
  for (unsigned seed = 1; seed <= 200; ++seed) {
    Instance instance = random_instance(n_c, n_t, n_q, seed);
    Vector r(instance.b.size());
    ASSERT_EQ(solver.solve(instance.G, instance.b, 0, instance.contacts, r), LcpStatus::solved) << "seed " << seed;
    // 1e-11: the solver's rounding of 1e-12 in each of a few dozen terms
    EXPECT_LE(violation(instance, r), 1e-11) << "seed " << seed;
    for (const auto& contact : instance.contacts) {
      open += contact.mode == ContactMode::open;
      stick += contact.mode == ContactMode::stick;
      slip += is_slipping(contact.mode);
    }
  }
  EXPECT_GT(open, 20);
  if (n_t > 0) {
    EXPECT_GT(stick, 5);
    EXPECT_GT(slip, 20);
  }
}

INSTANTIATE_TEST_SUITE_P(Shapes, RandomProblems,
                         testing::Values(RandomProblemShape{1, 0, 2}, RandomProblemShape{3, 0, 4},
                                         RandomProblemShape{1, 1, 3}, RandomProblemShape{3, 1, 6},
                                         RandomProblemShape{4, 1, 3}, RandomProblemShape{1, 2, 3},
                                         RandomProblemShape{2, 2, 6}, RandomProblemShape{4, 2, 6}),
                         [](const auto& test) {
                           return "contacts_" + std::to_string(test.param.n_c) + "_tangents_" +
                                  std::to_string(test.param.n_t) + "_coordinates_" + std::to_string(test.param.n_q);
                         });

/// A contact of a pendulum: normal and tangent push one coordinate, the determinant of G is rounding of zero, and sticking
/// has many impulses. All stop the coordinate.
TEST(FrictionProblem, OfOneCoordinateStopsIt) {
  FrictionProblem solver;
  solver.resize(1, 1);
  for (unsigned seed = 1; seed <= 2000; ++seed) {
    Instance instance = random_instance(1, 1, 1, seed);
    instance.b[0] = -std::abs(instance.b[0]);  // it approaches
    instance.b[1] = instance.b[0] * instance.G(1, 0) / instance.G(0, 0);
    // No slip that pulls the bodies together.
    instance.contacts.front().mu = 0.9 * std::min(1.0, std::abs(instance.G(0, 0) / instance.G(0, 1)));
    Vector r(2);
    ASSERT_EQ(solver.solve(instance.G, instance.b, 0, instance.contacts, r), LcpStatus::solved) << "seed " << seed;
    EXPECT_LE(violation(instance, r), 1e-9) << "seed " << seed;  // what sticking may leave
  }
}

/// A unit point mass: G is the identity, so r is what stops b, cut off by the cone.
TEST(FrictionProblem, OfAPointMassIsTheProjectionOntoTheCone) {
  FrictionProblem solver;
  solver.resize(1, 2);
  const Matrix G = Matrix::Identity(3, 3);
  Vector r(3);
  std::vector<FrictionProblem::Contact> contacts{{.mu = 0.5, .n_t = 2}};
  ASSERT_EQ(solver.solve(G, Eigen::Vector3d(-1, 0.3, -0.2), 0, contacts, r), LcpStatus::solved);
  EXPECT_EQ(contacts[0].mode, ContactMode::stick);
  EXPECT_LE((r - Eigen::Vector3d(1, -0.3, 0.2)).norm(), 1e-15);

  ASSERT_EQ(solver.solve(G, Eigen::Vector3d(-1, 3, -4), 0, contacts, r), LcpStatus::solved);
  EXPECT_EQ(contacts[0].mode, ContactMode::slip);
  EXPECT_LE((r - Eigen::Vector3d(1, -0.3, 0.4)).norm(), 1e-15) << "0.5 N s against the direction (3, -4) / 5";

  ASSERT_EQ(solver.solve(G, Eigen::Vector3d(1, 3, -4), 0, contacts, r), LcpStatus::solved);
  EXPECT_EQ(contacts[0].mode, ContactMode::open);
  EXPECT_EQ(r.norm(), 0);
}

/// A rod that slides into its contact (Painleve): the normal force would have to grow with itself.
TEST(FrictionProblem, SaysWhenNoForceIsConsistent) {
  FrictionProblem solver;
  solver.resize(1, 1);
  Matrix G(2, 2);
  G << 1, 2, 2, 5;  // sliding with mu = 1 to the right: w_n = (1 - 2) r_n + b_n
  Vector r(2);
  std::vector<FrictionProblem::Contact> contacts{{.mu = 1, .n_t = 1, .slides = true, .direction = {1, 0}}};
  EXPECT_EQ(solver.solve(G, Eigen::Vector2d(-1, 0), 0, contacts, r), LcpStatus::ray);
  contacts[0].direction[0] = -1;
  ASSERT_EQ(solver.solve(G, Eigen::Vector2d(-1, 0), 0, contacts, r), LcpStatus::solved);
  EXPECT_NEAR(r[0], 1.0 / 3, 1e-16);
  EXPECT_NEAR(r[1], 1.0 / 3, 1e-16);
}

}  // namespace
}  // namespace ricochet
