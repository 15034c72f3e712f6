// Residuals law by law, FCLib's merit function, and impulses that move nothing, on problems with known answers.
#include "methods/contact_laws/contact_residuals.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <numbers>

#include "methods/contact_laws/redundant_contacts.h"
#include "tests/contact_problems.h"

namespace ricochet {
namespace {

Vector entries(std::initializer_list<double> list) {
  return Eigen::Map<const Vector>(list.begin(), static_cast<Eigen::Index>(list.size()));
}

Vector velocities_of(const ContactProblem& problem, const Vector& r) {
  Vector w(problem.G.n_rows());
  problem.G.times(r, problem.b, w);
  return w;
}

/// One contact in space, G = 1: w = r + b.
ContactProblem point_mass(double mu, std::initializer_list<double> b) {
  ContactProblem problem;
  set_operator(problem, Matrix::Identity(3, 3), {{.n_t = 2, .mu = mu}});
  problem.b = entries(b);
  return problem;
}

TEST(ContactResiduals, SayWhichLawIsBroken) {
  const ContactProblem problem = point_mass(0.5, {-1, 3, -4});
  const auto of = [&](std::initializer_list<double> r) {
    return residuals_of(problem, entries(r), velocities_of(problem, entries(r)));
  };
  const ContactResiduals none = of({1, -0.3, 0.4});
  for (const double value : {none.signorini, none.pull, none.approach, none.cone, none.dissipation, none.angle})
    EXPECT_LE(std::abs(value), 1e-15);
  EXPECT_NEAR(of({1.5, -0.3, 0.4}).signorini, 0.75, 1e-15);
  EXPECT_NEAR(of({-0.25, 0, 0}).pull, 0.25, 1e-15);
  EXPECT_NEAR(of({0.75, 0, 0}).approach, 0.25, 1e-15);
  EXPECT_NEAR(of({1, -0.6, 0.8}).cone, 0.5, 1e-15);
  EXPECT_NEAR(of({1, -0.15, 0.2}).dissipation, 0.25 * 4.75, 1e-14) << "half of the friction, |v_t| = 5 - 0.25";
  EXPECT_NEAR(of({1, -0.5, 0}).angle, std::atan2(4, 2.5), 1e-14);
}

/// (1) of its header by hand: r = 0 has u = q, u_n + mu |u_t| = -1 + 2.5, so r - u is in the polar cone unless shifted.
TEST(FclibMerit, IsTheNaturalMapInItsUnits) {
  const ContactProblem problem = point_mass(0.5, {-1, 3, -4});
  const Vector solution = entries({1, -0.3, 0.4}), none = Vector::Zero(3);
  EXPECT_LE(fclib_merit(problem, solution, velocities_of(problem, solution)), 1e-15);
  // y = -(1.5, 3, -4), |y_t| = 5: onto the ray (1, 1/2) at (5/2 - 3/2) / (5/4) = 0.8, as long as 0.8 sqrt(1.25)
  const double q = std::sqrt(26.0);
  EXPECT_NEAR(fclib_merit(problem, none, velocities_of(problem, none)), 0.8 * std::sqrt(1.25) / (1 + std::sqrt(q)),
              1e-15);
  // In grams and millimetres the same error is another number; ours stays.
  ContactProblem small;
  set_operator(small, 1e3 * Matrix::Identity(3, 3), {{.n_t = 2, .mu = 0.5}});
  small.b = problem.b;
  const Vector off = 1.01 * solution, off_small = 1e-3 * off;
  const double here = fclib_merit(problem, off, velocities_of(problem, off)),
               there = fclib_merit(small, off_small, velocities_of(small, off_small));
  EXPECT_LT(there, 0.2 * here);
  Vector w(3);
  EXPECT_NEAR(violation(problem, off, FrictionPolygon(), w), violation(small, off_small, FrictionPolygon(), w), 1e-15);
}

/// A block on four feet in a row of unit distance, without friction: two coordinates.
TEST(RedundantContacts, HaveTheImpulsesThatMoveNothing) {
  Matrix D(2, 4);
  D << 1, 1, 1, 1, -1.5, -0.5, 0.5, 1.5;
  ContactProblem problem;
  set_operator(problem, D.transpose() * D, {{.id = 0}, {.id = 1}, {.id = 2}, {.id = 3}});
  problem.b = D.transpose() * entries({-1, 0});
  const RedundantContacts redundant(problem);
  EXPECT_EQ(redundant.n_redundant(), 2);
  EXPECT_NEAR(redundant.condition(), 5.0 / 4, 1e-14) << "rows of D are normal to each other, of squares 4 and 5";
  const Vector even = Vector::Constant(4, 0.25), outer = entries({0.5, 0, 0, 0.5});
  EXPECT_LE(redundant.internal_part(even).norm(), 1e-15);
  EXPECT_LE((redundant.internal_part(outer) - (outer - even)).norm(), 1e-15);
  EXPECT_LE((redundant.least_norm(problem, outer, 1e-9) - even).norm(), 1e-11) << "1e-12 a round, linearly";
}

/// Two contacts without friction that press on each other's back: the least norm keeps them from pulling.
TEST(RedundantContacts, HaveALeastNormSolutionInsideTheCones) {
  Matrix D(1, 3);
  D << 1, 1, -3;  // the third pushes back
  ContactProblem problem;
  set_operator(problem, D.transpose() * D, {{.id = 0}, {.id = 1}, {.id = 2}});
  problem.b = D.transpose() * entries({-1});
  const RedundantContacts redundant(problem);
  const Vector r = entries({1.5, 1, 0.5});
  ASSERT_LE(velocities_of(problem, r).head(2).norm(), 1e-15);
  const Vector least = redundant.least_norm(problem, r, 1e-9);
  EXPECT_GE(least.minCoeff(), 0);
  EXPECT_LE((least - entries({0.5, 0.5, 0})).norm(), 1e-10) << "without the bound the third would pull";
}

/// The least-norm solution is one, with the same velocities, and none that a solver finds is shorter.
TEST(RedundantContacts, HaveALeastNormSolutionThatNoSolverBeats) {
  int redundant_problems = 0, internal = 0;
  for (unsigned seed = 1; seed <= 30; ++seed) {
    const ContactProblem problem = random_problem(FrictionLaw::coulomb, 8, 2, 5, seed);
    const SolverAnswer answer = solve(*make_exact_contact_solver(1e-12, 200), problem);
    ASSERT_EQ(answer.status, ContactStatus::solved) << seed;
    if (answer.r.norm() == 0) continue;
    const RedundantContacts redundant(problem);
    EXPECT_EQ(redundant.n_redundant(), 24 - 5) << seed;
    const Vector least = redundant.least_norm(problem, answer.r, 1e-9);
    ++redundant_problems;
    internal += (least - answer.r).norm() > 0.01 * answer.r.norm();
    // 1e-9 of r outside the affine space, times G of size 10
    EXPECT_LE((velocities_of(problem, least) - answer.w).norm(), 1e-8 * answer.r.norm()) << seed;
    Vector w(24);
    EXPECT_LE(violation(problem, least, FrictionPolygon(), w), 1e-8) << seed;
    EXPECT_LE(least.norm(), (1 + 1e-9) * answer.r.norm()) << seed;
  }
  EXPECT_GT(redundant_problems, 10);
  EXPECT_GT(internal, 3) << "some solutions are not the shortest";
}

}  // namespace
}  // namespace ricochet
