// The contact solvers against the laws, against each other, and on problems with known answers.
#include "methods/contact_laws/solvers/contact_solver.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <random>

#include "methods/contact_laws/friction_set.h"
#include "problems/input_error.h"
#include "tests/contact_problems.h"
#include "tests/test_data.h"

namespace ricochet {
namespace {

using SolverKind = ContactSolverKind;

std::unique_ptr<ContactSolver> solver_of(SolverKind kind, int facets = 8) {
  return make_contact_solver(
      {.kind = kind, .facets = kind == SolverKind::lemke ? facets : 0, .tolerance = 1e-12, .iterations = 200000});
}

Vector vector(std::initializer_list<double> entries) {
  return Eigen::Map<const Vector>(entries.begin(), static_cast<Eigen::Index>(entries.size()));
}

std::string name_of(SolverKind kind) {
  return std::array{"automatic", "lemke", "exact", "pgs", "newton", "interior_point", "admm", "staggered"}.at(
      static_cast<std::size_t>(kind));
}

struct RandomContactShape {
  SolverKind kind;
  FrictionLaw law;
  int n_c, n_t, n_q;
};

class RandomContactProblems : public testing::TestWithParam<RandomContactShape> {};

TEST_P(RandomContactProblems, AreSolved) {
  const auto [kind, law, n_c, n_t, n_q] = GetParam();
  const auto solver = solver_of(kind);
  int open = 0, stick = 0, slip = 0;
  for (unsigned seed = 1; seed <= 100; ++seed) {
    const ContactProblem problem = random_problem(law, n_c, n_t, n_q, seed);
    const SolverAnswer answer = solve(*solver, problem);
    ASSERT_EQ(answer.status, ContactStatus::solved) << "seed " << seed;
    // 1e-12 is what the iterative solvers are asked for; pivoting has the rounding of a few dozen pivots.
    EXPECT_LE(answer.violation, kind == SolverKind::lemke ? 1e-11 : 1e-12) << "seed " << seed;
    for (int i = 0; i < n_c; ++i) {
      const int row = problem.G.row(i);
      if (answer.r[row] < 1e-9)
        ++open;
      else if (n_t > 0)
        ++(answer.w.segment(row + 1, n_t).norm() > 1e-9 ? slip : stick);
    }
  }
  EXPECT_GT(open, 20);
  if (n_t > 0) {
    EXPECT_GT(stick, 2);
    EXPECT_GT(slip, 10);
  }
}

std::vector<RandomContactShape> shapes() {
  std::vector<RandomContactShape> all;
  for (const SolverKind kind : {SolverKind::lemke, SolverKind::exact, SolverKind::pgs, SolverKind::newton,
                                SolverKind::interior_point, SolverKind::admm, SolverKind::staggered}) {
    for (const FrictionLaw law : {FrictionLaw::coulomb, FrictionLaw::associated}) {
      if (kind == SolverKind::staggered && law == FrictionLaw::associated) continue;  // declined
      for (const auto& [n_c, n_t, n_q] :
           {std::array{1, 0, 2}, {4, 0, 3}, {1, 1, 3}, {3, 1, 9}, {4, 1, 9}, {1, 2, 3}, {2, 2, 6}, {4, 2, 14}})
        all.push_back({kind, law, n_c, n_t, n_q});
    }
  }
  return all;
}

std::string name_of_shape(const testing::TestParamInfo<RandomContactShape>& test) {
  const RandomContactShape& s = test.param;
  return test_name(fmt::format("{}_{}_{}_contacts_{}_tangents_{}_coordinates", name_of(s.kind),
                               s.law == FrictionLaw::coulomb ? "coulomb" : "associated", s.n_c, s.n_t, s.n_q));
}

INSTANTIATE_TEST_SUITE_P(Shapes, RandomContactProblems, testing::ValuesIn(shapes()), name_of_shape);

/// Where the solution is unique: without friction, or convex with a regular G, the velocities of all solvers agree.
TEST(ContactSolvers, AgreeWhereTheVelocitiesAreUnique) {
  for (const auto& [law, n_t, n_q] :
       {std::tuple{FrictionLaw::coulomb, 0, 3}, {FrictionLaw::associated, 1, 14}, {FrictionLaw::associated, 2, 20}}) {
    for (unsigned seed = 1; seed <= 10; ++seed) {
      const ContactProblem problem = random_problem(law, 4, n_t, n_q, seed);
      const SolverAnswer newton = solve(*solver_of(SolverKind::newton), problem),
                         pgs = solve(*solver_of(SolverKind::pgs), problem),
                         interior = solve(*solver_of(SolverKind::interior_point), problem),
                         admm = solve(*solver_of(SolverKind::admm), problem),
                         lemke = solve(*solver_of(SolverKind::lemke, 64), problem);
      // 1e-12 of the natural map, times the condition of G, up to 1e4 for these seeds
      EXPECT_LE((newton.w - pgs.w).norm(), 1e-8) << "seed " << seed;
      EXPECT_LE((newton.w - interior.w).norm(), 1e-8) << "seed " << seed;
      EXPECT_LE((newton.w - admm.w).norm(), 1e-8) << "seed " << seed;
      // 64 facets turn the direction of friction by up to half the angle between two of them
      EXPECT_LE((newton.w - lemke.w).norm(), n_t == 2 ? std::numbers::pi / 64 * newton.w.norm() : 1e-8)
          << "seed " << seed;
    }
  }
}

/// Whether the last iteration leaves an error of its tolerance, where others end with the rounding of an exact step.
bool ends_at_its_tolerance(SolverKind kind) {
  return kind == SolverKind::admm || kind == SolverKind::staggered;
}
// 1e-12 of the velocities in these problems, 1 to 5, with G = I, in two rows.
constexpr double kIterated = 1e-11;

class EverySolver : public testing::TestWithParam<SolverKind> {};

/// A unit point mass: G is the identity.
TEST_P(EverySolver, StopsAPointMassWithinItsCone) {
  const auto solver = solver_of(GetParam());
  const double rounding = ends_at_its_tolerance(GetParam()) ? kIterated : 1e-15;
  ContactProblem problem;
  set_operator(problem, Matrix::Identity(2, 2), {{.n_t = 1, .mu = 0.5}});
  problem.b = vector({-1, 0.3});
  EXPECT_LE((solve(*solver, problem).r - vector({1, -0.3})).norm(), rounding) << "stick";
  problem.b = vector({-1, 5});
  EXPECT_LE((solve(*solver, problem).r - vector({1, -0.5})).norm(), rounding) << "slip";
  problem.b = vector({1, 5});
  EXPECT_EQ(solve(*solver, problem).r.norm(), 0) << "open";
  if (GetParam() == SolverKind::staggered) return;  // it declines the associated law
  problem.law = FrictionLaw::associated;
  // K* says w_n >= mu |w_t|: along the ray (1, -1/2), r = (2.5 - 1) / 1.25 times it
  EXPECT_LE((solve(*solver, problem).r - vector({1.2, -0.6})).norm(), std::max(rounding, 1e-12)) << "slip lifts off";
}

TEST(ContactSolvers, WithTheDiscSlideAgainstTheVelocity) {
  ContactProblem problem;
  set_operator(problem, Matrix::Identity(3, 3), {{.n_t = 2, .mu = 0.5}});
  problem.b = vector({-1, 3, -4});
  for (const SolverKind kind : {SolverKind::exact, SolverKind::pgs, SolverKind::newton, SolverKind::interior_point,
                                SolverKind::admm, SolverKind::staggered}) {
    EXPECT_LE((solve(*solver_of(kind), problem).r - vector({1, -0.3, 0.4})).norm(),
              ends_at_its_tolerance(kind) ? kIterated : 1e-13)
        << name_of(kind);
  }
}

/// With the friction of an impulse p that is there already, an open contact can brake.
TEST_P(EverySolver, BrakesWithThePresentImpulse) {
  ContactProblem problem;
  set_operator(problem, Matrix::Identity(2, 2), {{.n_t = 1, .mu = 0.5, .present = 2}});
  problem.b = vector({0.25, 3});
  const double rounding = ends_at_its_tolerance(GetParam()) ? kIterated : 1e-14;
  EXPECT_LE((solve(*solver_of(GetParam()), problem).r - vector({0, -1})).norm(), rounding);
  problem.b = vector({-1, 3});
  EXPECT_LE((solve(*solver_of(GetParam()), problem).r - vector({1, -1.5})).norm(), rounding);
}

/// A rigid box on four corners: twelve impulses, six coordinates. The velocities are unique when it sticks.
TEST_P(EverySolver, PutsABoxOnFourCorners) {
  Matrix J = Matrix::Zero(6, 12);  // about the centre of mass, half edges 1, 1, 1/2; unit mass and inertia
  for (int corner = 0; corner < 4; ++corner) {
    const Eigen::Vector3d arm(corner % 2 ? 1 : -1, corner / 2 ? 1 : -1, -0.5);
    const Eigen::Vector3d directions[] = {{0, 0, 1}, {1, 0, 0}, {0, 1, 0}};
    for (int d = 0; d < 3; ++d) {
      J.col(3 * corner + d) << directions[d], arm.cross(directions[d]);
    }
  }
  std::vector<ContactProblem::Contact> contacts;
  for (int i = 0; i < 4; ++i) contacts.push_back({.id = i, .n_t = 2, .mu = 0.8});
  ContactProblem problem;
  set_operator(problem, J.transpose() * J, contacts);
  Vector v(6);
  v << 0.2, 0.1, -1, 0, 0, 0;
  problem.b = J.transpose() * v;
  const SolverAnswer answer = solve(*solver_of(GetParam()), problem);
  ASSERT_EQ(answer.status, ContactStatus::solved);
  EXPECT_LE(answer.w.cwiseAbs().maxCoeff(), 1e-11) << "it stops";
  EXPECT_LE(answer.violation, 1e-11);
  EXPECT_NEAR(answer.r[0] + answer.r[3] + answer.r[6] + answer.r[9], 1, 1e-11) << "and the corners share its weight";
}

/// A warm start from the solution costs less than a cold one, and stays there. Whether it costs nothing is rounding's
/// to say, problem by problem: an impulse of zero in a basis, a violation just above the tolerance.
TEST_P(EverySolver, StartsWhereItEnded) {
  const auto solver = solver_of(GetParam());
  std::int64_t cold = 0, warm = 0;
  for (unsigned seed = 1; seed <= 50; ++seed) {
    const ContactProblem problem = random_problem(FrictionLaw::coulomb, 4, 1, 12, seed);
    Vector r = Vector::Zero(problem.G.n_rows());
    Counters first, again;
    ASSERT_EQ(solver->solve(problem, r), ContactStatus::solved) << "seed " << seed;
    solver->count(first);
    cold += first.pivots + first.inner_iterations;
    ASSERT_EQ(solver->solve(problem, r), ContactStatus::solved) << "seed " << seed;
    solver->count(again);
    warm += again.pivots + again.inner_iterations;
    Vector w(problem.G.n_rows());
    EXPECT_LE(violation(problem, r, solver->polygon(), w), GetParam() == SolverKind::lemke ? 1e-11 : 1e-12)
        << "seed " << seed << ": the tolerance, and of pivoting its rounding";
  }
  EXPECT_LE(10 * warm, cold) << "the active set stays";
}

INSTANTIATE_TEST_SUITE_P(Solvers, EverySolver,
                         testing::Values(SolverKind::lemke, SolverKind::exact, SolverKind::pgs, SolverKind::newton,
                                         SolverKind::interior_point, SolverKind::admm, SolverKind::staggered),
                         [](const auto& test) { return name_of(test.param); });

/// A column of blocks that falls onto the ground as one, at unit speed: contact i carries those above.
ContactProblem column(const Vector& masses) {
  const int n = static_cast<int>(masses.size());
  Matrix J = Matrix::Zero(n, n);
  for (int i = 0; i < n; ++i) {
    J(i, i) = 1;
    if (i > 0) J(i - 1, i) = -1;
  }
  std::vector<ContactProblem::Contact> contacts;
  for (int i = 0; i < n; ++i) contacts.push_back({.id = i});
  ContactProblem problem;
  set_operator(problem, J.transpose() * masses.cwiseInverse().asDiagonal() * J, contacts);
  problem.b = J.transpose() * Vector::Constant(n, -1);
  return problem;
}

TEST(ContactSolvers, SolveALongColumn) {
  const int n = 200;  // sparse: above kMaxDenseContacts
  const ContactProblem problem = column(Vector::Ones(n));
  EXPECT_EQ(problem.G.n_blocks(), 3 * n - 2);
  for (const SolverKind kind :
       {SolverKind::exact, SolverKind::newton, SolverKind::interior_point, SolverKind::admm, SolverKind::staggered}) {
    const SolverAnswer answer = solve(*solver_of(kind), problem);
    ASSERT_EQ(answer.status, ContactStatus::solved) << name_of(kind);
    // G^-1 has norm 4 n^2 / pi^2 = 16000; tolerance 1e-12 of the largest velocity term, 2 n
    for (int i = 0; i < n; ++i) EXPECT_NEAR(answer.r[i], n - i, 1e-5) << name_of(kind) << " " << i;
    EXPECT_LE(answer.violation, 1e-12) << name_of(kind);
  }
}

/// A heavy block on a light one, where Gauss-Seidel needs sweeps in proportion to the ratio of the masses.
TEST(ContactSolvers, PutAHeavyBlockOnALightOne) {
  const double ratio = 1e6;
  const ContactProblem problem = column(vector({1, ratio}));
  for (const SolverKind kind : {SolverKind::lemke, SolverKind::exact, SolverKind::newton, SolverKind::interior_point,
                                SolverKind::admm, SolverKind::staggered}) {
    const SolverAnswer answer = solve(*solver_of(kind), problem);
    ASSERT_EQ(answer.status, ContactStatus::solved) << name_of(kind);
    // 1e-12 of the largest velocity term, `ratio`, is 1e-6 at each contact: the speed of the upper block may be off by
    // that of both, and so r
    EXPECT_NEAR(answer.r[0], 1 + ratio, 2e-6 * ratio) << name_of(kind);
    EXPECT_NEAR(answer.r[1], ratio, 2e-6 * ratio) << name_of(kind);
  }
}

TEST(ContactSolvers, SayWhenTheToleranceIsNotReached) {
  const ContactProblem problem = random_problem(FrictionLaw::coulomb, 4, 2, 14, 3);
  Vector r = Vector::Zero(problem.G.n_rows());
  EXPECT_EQ(make_gauss_seidel_contact_solver(1e-12, 2)->solve(problem, r), ContactStatus::iteration_limit);
}

TEST(ContactSolvers, StaggeredProjectionsDeclineTheAssociatedLaw) {
  const ContactProblem problem = random_problem(FrictionLaw::associated, 4, 2, 14, 3);
  Vector r = Vector::Zero(problem.G.n_rows());
  EXPECT_THROW(make_staggered_contact_solver(1e-12, 2)->solve(problem, r), InputError);
  ContactProblem frictionless = random_problem(FrictionLaw::associated, 4, 0, 14, 3);
  Vector r_n = Vector::Zero(frictionless.G.n_rows());
  EXPECT_EQ(make_staggered_contact_solver(1e-12, 2)->solve(frictionless, r_n), ContactStatus::solved)
      << "(1) alone is the problem";
}

/// An operator whose skew part a scheme with implicit forces makes: (3) keeps it although its factor does not.
TEST(ContactSolvers, AdmmSolvesWithAnOperatorThatIsNotSymmetric) {
  ContactProblem problem;
  Matrix G(3, 3);
  G << 2, 0.3, -0.2, -0.1, 3, 0.5, 0.4, -0.5, 2.5;
  set_operator(problem, G, {{.n_t = 2, .mu = 0.4}});
  problem.b = vector({-1, 2, -0.5});
  const SolverAnswer admm = solve(*solver_of(SolverKind::admm), problem),
                     pgs = solve(*solver_of(SolverKind::pgs), problem);
  ASSERT_EQ(admm.status, ContactStatus::solved);
  EXPECT_LE((admm.r - pgs.r).norm(), kIterated);
}

/// A warm and two cold starts, each with Newton's method after it.
TEST(ContactSolvers, TheInteriorPointKeepsItsLimitOfIterations) {
  constexpr double kUnreachable = -1;
  for (const auto law : {FrictionLaw::coulomb, FrictionLaw::associated}) {
    for (const int limit : {1, 7, 60}) {
      const ContactProblem problem = random_problem(law, 4, 2, 14, 3);
      const auto solver = make_interior_point_contact_solver(kUnreachable, limit);
      Vector r = Vector::Zero(problem.G.n_rows());
      for (const char* start : {"cold", "warm"}) {
        EXPECT_EQ(solver->solve(problem, r), ContactStatus::iteration_limit) << start;
        Counters counters;
        solver->count(counters);
        EXPECT_LE(counters.inner_iterations, 3 * limit) << start;
      }
    }
  }
}

/// The nearest point of a convex set: no point of the set lies on the other side of it, as seen from where it came from.
TEST(FrictionSet, HasTheNearestPoint) {
  std::mt19937 generator(1);
  std::uniform_real_distribution<double> uniform(-1, 1);
  for (int sample = 0; sample < 300; ++sample) {
    const int n_t = sample % 3;
    const double mu = 0.7, p = sample % 2 ? 0.4 : 0;
    double x[3]{}, y[3]{};
    for (int d = 0; d <= n_t; ++d) x[d] = y[d] = 2 * uniform(generator);
    project_on_friction_set(mu, n_t, p, y);
    EXPECT_GE(y[0], 0);
    EXPECT_LE(tangential_length(y + 1, n_t), mu * (y[0] + p) + 1e-15) << "rounding of numbers of size 1";
    for (int other = 0; other < 50; ++other) {
      double z[3]{std::abs(2 * uniform(generator)), 0, 0}, product = 0;
      for (int d = 1; d <= n_t; ++d) z[d] = mu * (z[0] + p) * uniform(generator) / std::sqrt(2);
      for (int d = 0; d <= n_t; ++d) product += (x[d] - y[d]) * (z[d] - y[d]);
      EXPECT_LE(product, 1e-14) << sample << ": rounding of numbers of size 1";
    }
  }
}

/// The map that all solvers share: its derivatives against differences.
TEST(ContactMap, HasTheDerivativesOfItsValue) {
  std::mt19937 generator(1);
  std::uniform_real_distribution<double> uniform(-1, 1);
  const double step = 1e-6;
  for (const FrictionLaw law : {FrictionLaw::coulomb, FrictionLaw::associated}) {
    for (int sample = 0; sample < 200; ++sample) {
      const ContactProblem::Contact contact{.n_t = sample % 3, .mu = 0.6};
      double r[3], w[3];
      for (int d = 0; d < 3; ++d) {
        r[d] = uniform(generator) + (d == 0);
        w[d] = uniform(generator);
      }
      ContactMap at, plus, minus;
      at.evaluate(law, contact, 0.7, 0.7, r, w);
      for (int e = 0; e <= contact.n_t; ++e) {
        for (double* x : {&r[e], &w[e]}) {
          const double value = *x;
          *x = value + step;
          plus.evaluate(law, contact, 0.7, 0.7, r, w);
          *x = value - step;
          minus.evaluate(law, contact, 0.7, 0.7, r, w);
          *x = value;
          for (int d = 0; d <= contact.n_t; ++d) {
            const double exact = x == &r[e] ? at.F_r[d][e] : at.F_w[d][e];
            // second differences of order step^2 / size^2, rounding 1e-10; no sample is within a step of a kink
            EXPECT_NEAR((plus.F[d] - minus.F[d]) / (2 * step), exact, 1e-6) << sample << " " << d << " " << e;
          }
        }
      }
    }
  }
}

}  // namespace
}  // namespace ricochet
