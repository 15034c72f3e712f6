// Programs with complementarity constraints: known optima through every relaxation, kinds of stationary points,
// branches.
#include "methods/complementarity/mpcc/homotopy.h"

#include <gtest/gtest.h>

#include <functional>

#include "methods/complementarity/mpcc/relaxation.h"
#include "problems/input_error.h"
#include "tests/macmpec.h"

namespace ricochet {
namespace {

MpccSolution solve(const Mpcc& mpcc, HomotopyOptions options = {}) {
  return Homotopy(std::move(options)).solve(mpcc);
}

class Collection : public testing::TestWithParam<std::string_view> {};

TEST_P(Collection, IsSolvedToItsOptima) {
  for (const auto& problem : macmpec::all()) {
    SCOPED_TRACE(problem.name);
    const MpccSolution solution = solve(problem.mpcc, {.relaxation = std::string(GetParam())});
    EXPECT_TRUE(solution.succeeded()) << solution.message;
    EXPECT_NEAR(solution.objective, problem.optimum, 1e-8 * (1 + problem.optimum));  // 100 times the tolerance
    EXPECT_LE(solution.complementarity, 1e-12);
    EXPECT_LE(solution.violation.value, 1e-10);
    EXPECT_TRUE(solution.is_b_stationary);
  }
}

std::vector<std::string_view> collection_names() {
  std::vector<std::string_view> all;
  for (const auto& relaxation : relaxations()) all.push_back(relaxation.name);
  return all;
}
INSTANTIATE_TEST_SUITE_P(All, Collection, testing::ValuesIn(collection_names()),
                         [](const auto& name) { return std::string(name.param); });

TEST(Homotopy, EndsInSStationaryPointsWhereThereAreSome) {
  const MpccSolution biactive = solve(macmpec::kth1().mpcc);
  EXPECT_EQ(biactive.stationarity, Stationarity::S);
  EXPECT_EQ(biactive.n_biactive, 1);
  const MpccSolution strict = solve(macmpec::kth3().mpcc);
  EXPECT_EQ(strict.stationarity, Stationarity::S);
  EXPECT_EQ(strict.n_biactive, 0);
}

// Their solutions are B-stationary, but no multipliers of theirs are >= 0: both branches must be tried to know.
TEST(Homotopy, EndsInAnMStationaryPointThatIsNotS) {
  for (const auto& problem : {macmpec::scholtes4(), macmpec::ralph1()}) {
    const MpccSolution solution = solve(problem.mpcc);
    EXPECT_EQ(solution.stationarity, Stationarity::M) << problem.name;
    EXPECT_TRUE(solution.is_b_stationary);
    EXPECT_EQ(solution.switches, 1);
    EXPECT_FALSE(solve(problem.mpcc, {.max_branches = 0}).is_b_stationary);
  }
}

/// min a x + b y,  0 <= x _|_ y >= 0, at (0, 0), where the multipliers are a and b.
Stationarity at_origin(double a, double b) {
  macmpec::Problem p{"", 0, {}};
  const int x = p.nonnegative("x", 0), y = p.nonnegative("y", 0);
  p.minimize(0, {{x, a}, {y, b}});
  p.pair(x, y);
  return StationarityTest(p.mpcc, Vector::Zero(2), 1e-4).classify({});
}
TEST(Stationarity, FollowsTheSignsOfTheMultipliers) {
  EXPECT_EQ(at_origin(1, 1), Stationarity::S);
  EXPECT_EQ(at_origin(1, 0), Stationarity::S);
  EXPECT_EQ(at_origin(-1, 0), Stationarity::M);
  EXPECT_EQ(at_origin(0, -1), Stationarity::M);
  EXPECT_EQ(at_origin(-1, -1), Stationarity::C);
  EXPECT_EQ(at_origin(-1, 1), Stationarity::W);
}

TEST(Stationarity, IsUnknownWhereThereAreNoMultipliers) {
  StationarityTest test(macmpec::scholtes3().mpcc, Vector{{0.5, 0}}, 1e-4);
  EXPECT_EQ(test.classify({}), Stationarity::unknown);
  EXPECT_TRUE(test.biactive().empty());
}

TEST(Stationarity, AVariableThatAnotherPairHoldsIsNotBiactive) {
  macmpec::Problem p{"", 0, {}};  // x _|_ y, x _|_ z at (0, 0, 1): x is zero because of z
  const int x = p.nonnegative("x", 0), y = p.nonnegative("y", 0), z = p.nonnegative("z", 1);
  p.minimize(1, {{x, -1}, {y, 1}, {z, -2, 1}});
  p.pair(x, y);
  p.pair(x, z);
  StationarityTest test(p.mpcc, Vector{{0, 0, 1}}, 1e-4);
  EXPECT_TRUE(test.biactive().empty());
  EXPECT_EQ(test.classify({}), Stationarity::S);
}

NlpPoint primal(Vector x) {
  return {.x = std::move(x), .lambda = {}, .z_L = {}, .z_U = {}};
}

// jr1 at z2 = 0: the branch z2 = 0 ends at z1 = 0, f = 1, where the multiplier of z2 is negative.
TEST(Crossover, DescendsIntoTheOtherBranch) {
  const auto problem = macmpec::jr1();
  const NlpPoint start = primal(Vector{{-0.1, 0, 0.1}});
  const CrossoverResult stays = cross_over(problem.mpcc, start, {.ipopt = {}, .max_branches = 0});
  EXPECT_NEAR(stays.branch.objective, 1, 1e-8);
  EXPECT_FALSE(stays.is_b_stationary);
  const CrossoverResult descends = cross_over(problem.mpcc, start, {});
  EXPECT_EQ(descends.switches, 1);
  EXPECT_NEAR(descends.branch.objective, 0.5, 1e-8);
  EXPECT_TRUE(descends.is_b_stationary);
}

/// Variables x_i _|_ y_i with x_i >= 1 for the first, y_i >= 1 for all others.
macmpec::Problem one_branch(int n) {
  macmpec::Problem p{"one branch", 0, {}};
  for (int i = 0; i < n; ++i) {
    const int x = p.nonnegative("x", 1), y = p.nonnegative("y", 1);
    p.minimize(0, {{x, 0, 1}, {y, 0, 1}});
    p.row(i == 0 ? "x floor" : "y floor", 1, kInfinity, 0, {{i == 0 ? x : y, 1}});
    p.pair(x, y);
  }
  return p;
}
TEST(Crossover, FindsTheBranchThatHasASolution) {
  const auto problem = one_branch(3);
  const NlpPoint start = primal(Vector{{0.4, 0.5, 0.1, 1, 0.1, 1}});  // x_1 = 0 is the smaller side, and wrong
  const CrossoverResult result = cross_over(problem.mpcc, start, {});
  EXPECT_EQ(result.branch.status, NlpStatus::solved);
  EXPECT_NEAR(result.branch.objective, 3, 1e-8);
  EXPECT_EQ(result.switches, 1);
  EXPECT_EQ(cross_over(problem.mpcc, start, {.ipopt = {}, .max_branches = 0}).branch.status, NlpStatus::infeasible);
}

TEST(Crossover, HoldsSumsByTheirVariables) {
  macmpec::Problem p{
      "sums", 0, {}};  // min (a - 1)^2 + (b - 1)^2 + (c - 3)^2,  0 <= a + b _|_ c >= 0: c = 0 costs 9, a = b = 0 is 2
  const int a = p.nonnegative("a", 0.1), b = p.nonnegative("b", 0.1), c = p.nonnegative("c", 1);
  p.minimize(11, {{a, -2, 1}, {b, -2, 1}, {c, -6, 1}});
  p.mpcc.add_pair({a, b}, {c}, "sum");
  for (const auto& relaxation : relaxations()) {
    const MpccSolution solution = solve(p.mpcc, {.relaxation = std::string(relaxation.name)});
    EXPECT_TRUE(solution.succeeded()) << relaxation.name << solution.message;
    EXPECT_NEAR(solution.objective, 2, 1e-8) << relaxation.name;
    EXPECT_LE(solution.complementarity, 1e-12) << relaxation.name;
  }
}

// a = 0 holds the first pair, and with it the second, whose sides are both zero: b stays with the row.
TEST(Crossover, HoldsNoMoreThanItMust) {
  macmpec::Problem p{"shared", 0, {}};
  const int a = p.nonnegative("a", 0), b = p.nonnegative("b", 0), c = p.nonnegative("c", 1);
  p.minimize(1, {{a, 1}, {b, -2, 1}, {c, 0, 1}});
  p.row("c", 1, 1, 0, {{c, 1}});
  p.pair(a, c);
  p.pair(b, a);
  const CrossoverResult result = cross_over(p.mpcc, primal(Vector{{1e-3, 1e-4, 1}}), {.ipopt = {}, .max_branches = 0});
  EXPECT_EQ(result.branch.status, NlpStatus::solved);
  EXPECT_NEAR(result.branch.objective, 1, 1e-8);  // b = 1; with b held too it is 2
}

TEST(Homotopy, NamesTheRowOfAnInfeasibleProgram) {
  macmpec::Problem p{"infeasible", 0, {}};
  const int x = p.nonnegative("x", 2), y = p.nonnegative("y", 2);
  p.minimize(0, {{x, 1}, {y, 1}});
  p.row("x floor", 1, kInfinity, 0, {{x, 1}});
  p.row("y floor", 1, kInfinity, 0, {{y, 1}});
  p.pair(x, y);
  for (const auto& relaxation : relaxations()) {
    const MpccSolution solution = solve(p.mpcc, {.relaxation = std::string(relaxation.name)});
    EXPECT_EQ(solution.status, Status::infeasible) << relaxation.name;
    const bool names_row = solution.message.find("of row 'x floor'") != std::string::npos ||
                           solution.message.find("of row 'y floor'") != std::string::npos;
    const bool names_pair = solution.message.find("of pair 'x _|_ y'") != std::string::npos;
    EXPECT_TRUE(names_row || names_pair) << solution.message;
    // x = y = 1 is feasible for sigma = 1 alone: what stopped the relaxations is said, and that no branch exists.
    if (relaxation.name == "scholtes") {
      EXPECT_TRUE(names_row) << solution.message;
      EXPECT_EQ(solution.message.find("relaxation with sigma = 0.1"), 0u) << solution.message;
      EXPECT_NE(solution.message.find("; crossover, 2 branches tried"), std::string::npos) << solution.message;
    }
    EXPECT_GT(solution.complementarity + solution.violation.value, 0.1) << relaxation.name;
  }
}

TEST(Homotopy, ReportsEveryStep) {
  std::vector<double> sigmas;
  int iterations = 0;
  const auto problem = macmpec::jr2();
  const Homotopy homotopy({.sigma_0 = 0.5, .sigma_final = 1e-3, .factor = 0.2});
  const MpccSolution solution = homotopy.solve(problem.mpcc, [&](const HomotopyStep& step) {
    sigmas.push_back(step.sigma);
    iterations += step.iterations;
    EXPECT_LE(step.derivative_seconds, step.seconds);
    EXPECT_LE(step.complementarity, std::sqrt(step.sigma) + 1e-4);  // G H <= sigma
  });
  ASSERT_EQ(sigmas.size(), 5u);  // 0.5, 0.1, 0.02, 0.004, 0.001
  EXPECT_NEAR(sigmas[3], 0.004, 1e-15);
  EXPECT_EQ(sigmas[4], 1e-3);
  EXPECT_EQ(solution.steps.size(), sigmas.size());
  EXPECT_GT(solution.iterations, iterations);  // with the crossover
  EXPECT_GT(solution.seconds, solution.derivative_seconds);
}

TEST(Homotopy, SuperlinearUpdateTakesFewerSteps) {
  const auto problem = macmpec::jr2();
  const MpccSolution linear = solve(problem.mpcc),
                     superlinear = solve(problem.mpcc, {.update = SigmaUpdate::superlinear, .power = 2});
  ASSERT_EQ(superlinear.steps.size(), 6u);  // 1, 1e-1, 1e-2, 1e-4, 1e-8, 1e-9
  EXPECT_NEAR(superlinear.steps[3].sigma, 1e-4, 1e-18);
  EXPECT_EQ(linear.steps.size(), 10u);
  EXPECT_NEAR(superlinear.objective, problem.optimum, 1e-8);
}

TEST(Homotopy, MayStartStepsFromVariablesAlone) {
  for (const auto& problem : macmpec::all()) {
    const MpccSolution solution = solve(problem.mpcc, {.warm_multipliers = false});
    EXPECT_TRUE(solution.succeeded()) << problem.name << ": " << solution.message;
    EXPECT_NEAR(solution.objective, problem.optimum, 1e-8 * (1 + problem.optimum)) << problem.name;
  }
}

TEST(Homotopy, LimitsAreStatuses) {
  const auto problem = macmpec::bard1();
  const MpccSolution late = solve(problem.mpcc, {.time_limit = 1e-9});
  EXPECT_EQ(late.status, Status::time_limit);
  EXPECT_NE(late.message.find("time limit"), std::string::npos);
  const MpccSolution stopped = solve(problem.mpcc, {.max_iterations = 2});
  EXPECT_EQ(stopped.status, Status::step_limit);
  EXPECT_NE(stopped.message.find("of row '"), std::string::npos) << stopped.message;
  EXPECT_EQ(stopped.x.size(), problem.mpcc.nlp.n_variables());
}

TEST(Homotopy, RejectsOptionsOutOfRange) {
  const std::vector<std::pair<const char*, HomotopyOptions>> wrong = {
      {"relaxation = x: one of scholtes", {.relaxation = "x"}},
      {"sigma_0 = 0", {.sigma_0 = 0}},
      {"sigma_final = 2", {.sigma_final = 2}},
      {"factor = 1", {.factor = 1}},
      {"power = 1", {.power = 1}},
      {"tolerance = 0", {.tolerance = 0}},
      {"tolerance_per_sigma = -1", {.tolerance_per_sigma = -1}},
      {"max_iterations = 0", {.max_iterations = 0}},
      {"time_limit = -1", {.time_limit = -1}},
      {"max_branches = -1", {.max_branches = -1}},
  };
  for (const auto& [message, options] : wrong) {
    try {
      const Homotopy homotopy(options);
      ADD_FAILURE() << message;
    } catch (const InputError& error) {
      EXPECT_EQ(std::string(error.what()).find(message), 0u) << error.what();
      EXPECT_NE(std::string(error.what()).find("required"), std::string::npos);
    }
  }
}

TEST(Homotopy, RejectsPairsThatMayBeNegative) {
  macmpec::Problem p{"", 0, {}};
  p.pair(p.variable("x", 1, -1), p.nonnegative("y", 1));
  try {
    solve(p.mpcc);
    FAIL() << "a negative side was accepted";
  } catch (const InputError& error) {
    EXPECT_STREQ(error.what(), "pair 'x _|_ y': lower bound of 'x' = -1: 0 is required");
  }
}

}  // namespace
}  // namespace ricochet
