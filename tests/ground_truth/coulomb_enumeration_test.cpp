// The contact law with friction, against its own definition.
#include "reference/coulomb_enumeration.h"

#include <gtest/gtest.h>

#include <random>

namespace ricochet::reference {
namespace {

/// Largest violation of 0 <= u_n _|_ z_n >= 0 and Coulomb's law, relative to the largest z times the largest b.
double violation(const CoulombSolution& s, const Vector& b, const std::vector<CoulombContact>& contacts) {
  double worst = 0;
  int row = 0;
  const double z_size = s.z.cwiseAbs().maxCoeff(), u_size = b.cwiseAbs().maxCoeff();
  for (const auto& contact : contacts) {
    const double z_n = s.z[row], u_n = s.u[row];
    worst = std::max({worst, -z_n / z_size, -u_n / u_size, std::abs(z_n * u_n) / (z_size * u_size)});
    const auto z_t = s.z.segment(row + 1, contact.n_t), u_t = s.u.segment(row + 1, contact.n_t);
    worst = std::max(worst, (z_t.norm() - contact.mu * z_n) / z_size);
    // Opposite and at the edge of the cone, or at rest: mu z_n |u_t| + z_t' u_t = 0.
    worst = std::max(worst, std::abs(contact.mu * z_n * u_t.norm() + z_t.dot(u_t)) / (z_size * u_size));
    row += 1 + contact.n_t;
  }
  return worst;
}

std::vector<CoulombSolution> solve(const Matrix& G, const Vector& b, const std::vector<CoulombContact>& contacts) {
  return solve_coulomb_by_enumeration(G, b, b.cwiseAbs(), contacts);
}

TEST(CoulombEnumeration, SolvesRandomContactProblems) {
  std::mt19937 random(7);
  std::normal_distribution<double> normal;
  const auto gaussian = [&] { return normal(random); };
  int pressed = 0, all = 0;
  for (const int n_t : {1, 2}) {
    for (int n = 1; n <= 5; ++n) {
      for (int trial = 0; trial < 20 / n; ++trial) {
        const int rows = n * (1 + n_t);
        // More coordinates than rows: no redundant contacts. mu this small: the solution is unique.
        const Matrix J = Matrix::NullaryExpr(3 * rows, rows, gaussian);
        const Vector v = Vector::NullaryExpr(3 * rows, gaussian);
        const std::vector<CoulombContact> contacts(static_cast<std::size_t>(n), {n_t, 0.3, {}});
        const Vector b = J.transpose() * v;
        const auto solutions = solve(J.transpose() * J, b, contacts);
        ASSERT_EQ(solutions.size(), 1u) << n << " contacts, n_t = " << n_t << ", trial " << trial;
        ++all;
        if (solutions[0].z.isZero()) continue;
        ++pressed;
        EXPECT_LE(violation(solutions[0], b, contacts), 1e-11) << "ten times what the enumeration takes for rounding";
      }
    }
  }
  EXPECT_GE(pressed, all / 2) << "one contact is open in half of the cases, several in less";
}

TEST(CoulombEnumeration, KeepsAKnownDirection) {
  // Sliding to the right while the tangential acceleration points left: friction still opposes the motion.
  const Matrix G = Matrix::Identity(2, 2);
  const Vector b = Eigen::Vector2d(-1, -3);
  const auto solutions = solve(G, b, {{1, 0.5, Vector::Ones(1)}});
  ASSERT_EQ(solutions.size(), 1u);
  EXPECT_EQ(solutions[0].modes[0], ContactMode::slip_positive);
  EXPECT_DOUBLE_EQ(solutions[0].z[1], -0.5);
}

TEST(CoulombEnumeration, FindsNoneAndSeveral) {
  // Painleve: the normal coefficient 1 - mu G_nt of slip- is negative.
  Matrix G(2, 2);
  G << 1, -1, -1, 2;
  const std::vector<CoulombContact> sliding{{1, 2, -Vector::Ones(1)}};
  EXPECT_TRUE(solve(G, Eigen::Vector2d(-1, 0), sliding).empty());
  EXPECT_EQ(solve(G, Eigen::Vector2d(1, 0), sliding).size(), 2u);
}

TEST(CoulombEnumeration, MixesContactsWithAndWithoutFriction) {
  Matrix G(3, 3);
  G << 2, 0.1, 0.2, 0.1, 1, 0.3, 0.2, 0.3, 1;
  const auto solutions = solve(G, Eigen::Vector3d(-1, -1, -5), {{0, 0, {}}, {1, 0.4, {}}});
  ASSERT_EQ(solutions.size(), 1u);
  EXPECT_EQ(solutions[0].modes, (std::vector{ContactMode::closed, ContactMode::slip_negative}));
  EXPECT_DOUBLE_EQ(solutions[0].z[2], 0.4 * solutions[0].z[1]);
}

}  // namespace
}  // namespace ricochet::reference
