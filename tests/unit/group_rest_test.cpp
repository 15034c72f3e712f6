#include <fmt/format.h>
#include <gtest/gtest.h>

#include "methods/registry.h"
#include "problems/scene_file/scene_file.h"
#include "tests/test_data.h"

namespace ricochet {
namespace {

Solution solve(const Problem& problem, double tolerance, const std::vector<std::string>& derivatives = {}) {
  Settings settings;
  settings.tolerance = tolerance;
  settings.recording = Recording::grid;
  settings.sensitivities = derivatives;
  return make_method("event_driven")->solve(problem, settings);
}

double energy(const Problem& problem, const Solution& solution) {
  return problem.potential_energy(solution.q.data()) +
         0.5 * solution.v.dot(problem.mass_matrix(solution.q) * solution.v);
}

/// Discs that fall into a box and settle, among them into gaps that are as wide as they are.
struct Settled {
  int n;
  double e, energy;  ///< [J], of Moreau-Jean with 1e6 steps
  double error;      ///< [J], of that
};

class SettledDiscs : public testing::TestWithParam<Settled> {};

TEST_P(SettledDiscs, ComeToRestWhereSmallTimeStepsLeaveThem) {
  const auto problem = make_problem("balls_in_box", {{"n", static_cast<double>(GetParam().n)}, {"e", GetParam().e}});
  const Solution solution = solve(*problem, 1e-8);
  ASSERT_TRUE(solution.succeeded()) << solution.message;
  EXPECT_NEAR(energy(*problem, solution), GetParam().energy, GetParam().error);
  // A group may sink by a few heights, each 1e-8 of a box that is no larger than 1.
  for (const Sample& sample : solution.samples) EXPECT_GE(problem->gap(sample.q).minCoeff(), -4e-8) << sample.t;
}

INSTANTIATE_TEST_SUITE_P(Counts, SettledDiscs,
                         testing::Values(Settled{5, 0, 0.343347353, 5e-6}, Settled{5, 0.3, 0.343350001, 1e-8},
                                         Settled{8, 0, 0.856609897, 5e-6}, Settled{12, 0, 1.482984715, 5e-6},
                                         Settled{12, 0.3, 1.423408598, 1e-8}),
                         [](const auto& info) {
                           return fmt::format("{}DiscsWithE{:.0f}", info.param.n, 100 * info.param.e);
                         });

/// n bodies in a row that touch each other and both walls, the first with velocity 1. Impacts one at a time would go on
/// for some 40 n^2 of them, and end at rest.
std::unique_ptr<Problem> row_between_walls(int n, double e) {
  std::string q0, v0, mass, contacts;
  for (int i = 0; i < n; ++i) {
    const char* comma = i == 0 ? "" : ", ";
    q0 += fmt::format(R"({}"{}")", comma, i);
    v0 += fmt::format(R"({}"{}")", comma, i == 0 ? 1 : 0);
    std::string row;
    for (int k = 0; k < n; ++k) row += fmt::format(R"({}"{}")", k == 0 ? "" : ", ", k == i ? 1 : 0);
    mass += fmt::format("{}[{}]", comma, row);
    const std::string gap = i == 0 ? "q[0]" : fmt::format("q[{}]-q[{}]-1", i, i - 1);
    contacts += fmt::format(R"({}{{"name": "left of {}", "gap": "{}", "e": "{}"}})", comma, i, gap, e);
  }
  contacts += fmt::format(R"(, {{"name": "wall", "gap": "{}-q[{}]", "e": "{}"}})", n - 1, n - 1, e);
  std::string force;
  for (int i = 0; i < n; ++i) force += i == 0 ? R"("0")" : R"(, "0")";
  return read_scene_text(fmt::format(R"({{"q0": [{}], "v0": [{}], "T": "1", "M": [{}], "f": [{}], "contacts": [{}]}})",
                                     q0, v0, mass, force, contacts),
                         "row");
}

TEST(RowBetweenWalls, ComesToRestAtOnce) {
  for (const double e : {0.0, 0.3, 0.8}) {
    const auto problem = row_between_walls(12, e);
    const Solution solution = solve(*problem, 1e-8);
    ASSERT_TRUE(solution.succeeded()) << solution.message;
    // Rounding of the projection of 12 velocities.
    EXPECT_LT(solution.v.lpNorm<Eigen::Infinity>(), 1e-13) << e;
    EXPECT_LT((solution.q - problem->info().q0).lpNorm<Eigen::Infinity>(), 1e-13) << e;
  }
}

TEST(GroupRest, LeavesNothingForTheNextRunOfASolver) {
  const auto problem = make_problem("balls_in_box", {{"n", 5.0}, {"e", 0.0}});
  const auto method = make_method("event_driven");
  const auto solver = method->prepare(*problem);
  Settings settings;
  settings.tolerance = 1e-8;
  const Solution first = solver->solve(settings), second = solver->solve(settings);
  ASSERT_TRUE(first.succeeded() && second.succeeded()) << first.message << second.message;
  EXPECT_EQ(first.q, second.q);
  EXPECT_EQ(first.v, second.v);
}

TEST(GroupRest, HasNoDerivatives) {
  const auto problem = make_problem("balls_in_box", {{"n", 12.0}, {"e", 0.3}});
  const Solution solution = solve(*problem, 1e-8, {"v0:0"});
  EXPECT_EQ(solution.status, Status::infeasible);
}

}  // namespace
}  // namespace ricochet
