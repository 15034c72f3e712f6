#include <gtest/gtest.h>

#include "methods/registry.h"
#include "problems/input_error.h"
#include "tests/test_data.h"

namespace ricochet {
namespace {

Solution run_time_stepping(const Problem& problem, const std::string& method, int steps) {
  Settings settings;
  settings.steps = steps;
  settings.audit = true;
  return make_method(method)->solve(problem, settings);
}

double distance(const Solution& s, const Vector& q, const Vector& v) {
  return std::max((s.q - q).cwiseAbs().maxCoeff(), (s.v - v).cwiseAbs().maxCoeff());
}

TEST(MoreauJean, CountsItsWork) {
  const auto p = make_problem("bouncing_ball", {{"height", 100}});
  const Solution s = run_time_stepping(*p, "moreau_jean", 10);
  EXPECT_EQ(s.counters.force_evaluations, 10);
  EXPECT_EQ(s.counters.linear_solves, 10);
  EXPECT_EQ(s.counters.matrix_factorizations, 1) << "constant mass, constant Jacobian";
  EXPECT_EQ(s.counters.complementarity_solves, 0) << "no contact, no contact problem";
  const auto varying = read_scene_file(test_data("double_pendulum_wall.json"));
  EXPECT_EQ(run_time_stepping(*varying, "moreau_jean", 10).counters.matrix_factorizations, 10);
}

TEST(AnitescuPotra, CountsItsWork) {
  const auto p = make_problem("sliding_block");
  const Solution s = run_time_stepping(*p, "anitescu_potra", 10);
  EXPECT_EQ(s.counters.force_evaluations, 10);
  EXPECT_EQ(s.counters.mass_factorizations, 1);
  EXPECT_EQ(s.counters.complementarity_solves, 10) << "one contact problem a step, no collision";
}

TEST(MoreauJean, FallsLikeTheMidpointRule) {
  // theta = 1/2 on a constant force: exact.
  const auto p = make_problem("bouncing_ball", {{"height", 100}});
  const Solution s = run_time_stepping(*p, "moreau_jean", 16);
  EXPECT_NEAR(s.q[0], 100 - 0.5 * 9.81 * 4, 1e-12);
  EXPECT_NEAR(s.v[0], -9.81 * 2, 1e-13);
}

class TimeStepping : public testing::TestWithParam<const char*> {};

TEST_P(TimeStepping, StopsASlidingBlock) {
  const auto p = make_problem("sliding_block");
  const Solution s = run_time_stepping(*p, GetParam(), 2000);
  ASSERT_TRUE(s.succeeded()) << s.message;
  EXPECT_NEAR(s.q[0], 4 / (2 * 0.3 * 9.81), 2e-3) << "error O(h v): 1/2000 * 2";
  EXPECT_NEAR(s.v[0], 0, 1e-13) << "it sticks";
}

TEST_P(TimeStepping, ApproachesTheGroundTruthEverywhere) {
  int followed = 0;
  for (const auto& truth : ground_truth()) {
    const auto p = ground_truth_problem(truth.id);
    const bool in_space = truth.id.starts_with("P7");
    std::string method = GetParam();
    const bool has_polygon = method.ends_with("solver=lemke");
    if (in_space && has_polygon) method += ",facets=32";
    if (!make_method(method)->can_run(p->info()).ok) continue;
    const Solution s = run_time_stepping(*p, method, 40000);
    ASSERT_TRUE(s.succeeded()) << truth.id << ": " << s.message;
    // Pivoting and a tolerance of 1e-13 leave rounding; the default in space has the tolerance 1e-9.
    EXPECT_LE(s.max_residual(), in_space && method.find("solver=") == std::string::npos ? 1e-9 : 1e-12) << truth.id;
    // First order: the impact velocity over 40000 steps, times the number of impacts; two balls 160 x that (omega =
    // 141/s). In space a polygon of 32 facets leaves an angle of pi/32 between slip and friction, over a path of one
    // metre.
    const double bound = truth.id.starts_with("P2") ? 0.5 : in_space ? 0.03 : 0.01;
    EXPECT_LE(distance(s, truth.q, truth.v), bound) << truth.id << " with " << method;
    ++followed;
  }
  EXPECT_GE(followed, 2) << "the others are declined";
}

INSTANTIATE_TEST_SUITE_P(Methods, TimeStepping,
                         testing::Values("moreau_jean", "moreau_jean,theta=1", "moreau_jean,solver=lemke",
                                         "moreau_jean,implicit=full,solver=newton,contact_tolerance=1e-13",
                                         "moreau_jean,projection=on,solver=pgs,contact_tolerance=1e-13",
                                         "moreau_jean,solver=interior_point,contact_tolerance=1e-13", "anitescu_potra",
                                         "anitescu_potra,solver=interior_point,contact_tolerance=1e-13",
                                         "anitescu_potra,implicit=linear,solver=newton,contact_tolerance=1e-13",
                                         "stewart_trinkle,solver=newton,contact_tolerance=1e-13",
                                         "schatzman_paoli,solver=newton,contact_tolerance=1e-13",
                                         "anitescu_convex,solver=newton,contact_tolerance=1e-13",
                                         "generalized_alpha,solver=newton,contact_tolerance=1e-13"),
                         [](const auto& test) { return test_name(test.param); });

class RedundantContacts : public testing::TestWithParam<const char*> {};

TEST_P(RedundantContacts, ABoxComesToRestOnFourCorners) {
  const auto p = make_problem("box_3d");
  for (const int steps : {60, 600, 6000}) {
    const Solution s = run_time_stepping(*p, GetParam(), steps);
    ASSERT_TRUE(s.succeeded()) << s.message;
    // Nearly redundant contacts are solved to 1e-9 of the approach velocity by pivoting (lemke.cpp), to 1e-7 by the
    // default (exact_contact_solver.cpp); the audit divides by v+, which may be a tenth of it. At rest the forces
    // balance to the rounding of a 40 x 40 system, or to 1e-9 of h g = 0.1 m/s over an inertia of 0.003.
    const bool pivots = std::string(GetParam()).ends_with("lemke");
    EXPECT_LE(s.max_residual(), pivots ? 1e-8 : 1e-6) << steps;
    EXPECT_LE(s.v.cwiseAbs().maxCoeff(), pivots ? 1e-12 : 1e-7) << steps;
  }
}

INSTANTIATE_TEST_SUITE_P(Methods, RedundantContacts,
                         testing::Values("moreau_jean", "moreau_jean,theta=1", "anitescu_potra",
                                         "moreau_jean,solver=lemke", "moreau_jean,theta=1,solver=lemke",
                                         "anitescu_potra,solver=lemke"),
                         [](const auto& test) { return test_name(test.param); });

/// Corners that are not quite in one plane are told apart by as little as 1e-7 of their velocity when steps are coarse;
/// there the iterative solvers end with a status. With these steps they reach their tolerance.
TEST(RedundantContactsAtATolerance, AreSolvedByTheIterativeSolversToo) {
  const auto p = make_problem("box_3d");
  for (const char* method : {"moreau_jean,solver=pgs", "moreau_jean,solver=newton", "moreau_jean,solver=interior_point",
                             "anitescu_potra,solver=newton", "anitescu_potra,solver=interior_point"}) {
    const Solution s = run_time_stepping(*p, method, 600);
    ASSERT_TRUE(s.succeeded()) << method << ": " << s.message;
    EXPECT_LE(s.max_residual(), 1e-9) << method << ": the default tolerance";
    EXPECT_LE(s.v.cwiseAbs().maxCoeff(), 1e-9) << method << ": of h g = 0.01 m/s, over an inertia of 0.003";
  }
}

/// A row that is thrown at a wall closes all of its contacts in one step, and keeps them: one contact problem a step,
/// not one per contact, and few iterations for all of them.
TEST(RowOfBeads, ClosesItsContactsTogether) {
  constexpr int n = 64, steps = 50;
  const auto p = make_problem("bead_row", {{"n", n}, {"spacing", 0}, {"distance", 0.01}, {"duration", 0.05}});
  for (const char* method : {"moreau_jean,solver=newton", "stewart_trinkle,solver=newton",
                             "anitescu_convex,solver=newton", "schatzman_paoli,solver=newton"}) {
    const Solution s = run_time_stepping(*p, method, steps);
    ASSERT_TRUE(s.succeeded()) << method << ": " << s.message;
    EXPECT_EQ(s.counters.events, n) << method;
    EXPECT_LE(s.v.cwiseAbs().maxCoeff(), 1e-7) << method << ": the default tolerance of 1 m/s, through 64 contacts";
    EXPECT_LE(s.counters.complementarity_solves, steps) << method;
    EXPECT_LE(s.counters.inner_iterations, steps) << method << ": measured 4 to 29; one by one the first has 64";
  }
}

/// A sphere thrown along the ground with side spin, friction in space. Its slip velocity u keeps its direction while
/// friction takes it away at 7/2 mu g, until it rolls at t = 2 |u_0| / (7 mu g): the path is a parabola and then
/// straight, and v = 5/7 v_0 + 2/7 R (spin), whatever mu is.
std::unique_ptr<Problem> thrown_sphere() {
  return read_scene_text(R"({"params": {"R": "0.1", "mu": "0.3", "g": "9.81"},
    "q0": [0, 0, "R", 0, 0], "v0": [4.2, 0, 0, -20, 15], "T": 2,
    "M": [[1, 0, 0, 0, 0], [0, 1, 0, 0, 0], [0, 0, 1, 0, 0], [0, 0, 0, "2*R**2/5", 0], [0, 0, 0, 0, "2*R**2/5"]],
    "f": [0, 0, "-g", 0, 0],
    "contacts": [{"name": "ground", "gap": "q[2] - R", "mu": "mu", "Jt": [[1, 0, 0, 0, "-R"], [0, 1, 0, "R", 0]]}]})",
                         "thrown sphere");
}

TEST(DefaultInSpace, ASphereCurvesAndThenRolls) {
  const auto p = thrown_sphere();
  const Eigen::Vector2d v_0(4.2, 0), u_0(4.2 - 0.1 * 15, -0.1 * 20), d = u_0.normalized();
  const double a = 0.3 * 9.81, t_rolls = 2 * u_0.norm() / (7 * a);
  const Eigen::Vector2d v = v_0 - a * t_rolls * d,
                        x = v_0 * t_rolls - 0.5 * a * t_rolls * t_rolls * d + (2 - t_rolls) * v;
  for (const char* method :
       {"moreau_jean", "anitescu_potra", "stewart_trinkle", "schatzman_paoli", "generalized_alpha"}) {
    const Solution s = run_time_stepping(*p, method, 2000);
    ASSERT_TRUE(s.succeeded()) << method << ": " << s.message;
    EXPECT_LE((s.v.head(2) - v).norm(), 1e-6) << method << ": angular momentum about the contact, to 1e-9 a step";
    EXPECT_LE((s.q.head(2) - x).norm(), 2 * 1e-3 * v_0.norm()) << method << ": two steps of 1 ms";
  }
  // What eight facets cost: friction is up to pi / 8 off, here on a path of t_rolls |v_0| = 1.4 m.
  EXPECT_GE((run_time_stepping(*p, "moreau_jean,facets=8", 2000).q.head(2) - x).norm(), 2 * 1e-3 * v_0.norm());
}

TEST(DefaultInSpace, IsThatOfPivotingInThePlane) {
  const auto p = make_problem("sliding_block");
  const Solution by_default = run_time_stepping(*p, "moreau_jean", 100),
                 pivots = run_time_stepping(*p, "moreau_jean,solver=lemke", 100);
  EXPECT_EQ(by_default.q, pivots.q) << "the same code";
  EXPECT_EQ(by_default.counters.pivots, pivots.counters.pivots);
}

TEST(TimeSteppingOptions, AreChecked) {
  EXPECT_THROW(make_method("moreau_jean,solver=pgs,facets=8"), InputError) << "the disc is exact";
  EXPECT_THROW(make_method("moreau_jean,solver=simplex"), InputError);
  EXPECT_THROW(make_method("moreau_jean,contact_tolerance=1e-8"), InputError) << "Lemke's method has none";
  EXPECT_THROW(make_method("moreau_jean,solver=exact,facets=8"), InputError) << "the disc is exact";
  EXPECT_THROW(make_method("moreau_jean,solver=newton,contact_iterations=0"), InputError);
  EXPECT_THROW(make_method("moreau_jean,solver=interior_point,facets=8"), InputError) << "the disc is exact";
  EXPECT_THROW(make_method("generalized_alpha,rho_inf=1.1"), InputError);
  EXPECT_THROW(make_method("penalty,stiffness=-1"), InputError);
  EXPECT_THROW(make_method("anitescu_potra,implicit=full"), InputError);
  EXPECT_THROW(make_method("moreau_jean,theta=0.4"), InputError);
  EXPECT_THROW(make_method("moreau_jean,facets=5"), InputError);
  EXPECT_THROW(make_method("moreau_jean:3"), InputError);
  EXPECT_THROW(make_method("anitescu_potra,facets=2"), InputError);
}

}  // namespace
}  // namespace ricochet
