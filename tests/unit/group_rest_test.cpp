#include <fmt/format.h>
#include <gtest/gtest.h>

#include "methods/registry.h"
#include "problems/scene_file/scene_file.h"
#include "tests/test_data.h"

namespace ricochet {
namespace {

Solution solve(const Problem& problem, double tolerance, const std::vector<std::string>& derivatives = {},
               const std::string& method = "event_driven") {
  Settings settings;
  settings.tolerance = tolerance;
  settings.recording = Recording::grid;
  settings.sensitivities = derivatives;
  return make_method(method)->solve(problem, settings);
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

constexpr const char* kFesd = "fesd_adaptive:radau-iia:4";

class SettledDiscsOfFesd : public testing::TestWithParam<Settled> {};

TEST_P(SettledDiscsOfFesd, ComeToRestWhereSmallTimeStepsLeaveThem) {
  const auto problem = make_problem("balls_in_box", {{"n", static_cast<double>(GetParam().n)}, {"e", GetParam().e}});
  const Solution solution = solve(*problem, 1e-8, {}, kFesd);
  ASSERT_TRUE(solution.succeeded()) << solution.message;
  EXPECT_NEAR(energy(*problem, solution), GetParam().energy, GetParam().error);
  // As above.
  for (const Sample& sample : solution.samples) EXPECT_GE(problem->gap(sample.q).minCoeff(), -4e-8) << sample.t;
  // v_minus and v are those of one place: no impact, and no group that comes to rest, gives energy.
  for (const Sample& sample : solution.samples) {
    const Matrix M = problem->mass_matrix(sample.q);
    const double before = sample.v_minus.dot(M * sample.v_minus), after = sample.v_plus.dot(M * sample.v_plus);
    EXPECT_LE(after, before + 1e-13) << sample.t;  // rounding of the kinetic energy of discs with less than 2 J
  }
}

INSTANTIATE_TEST_SUITE_P(Counts, SettledDiscsOfFesd,
                         testing::Values(Settled{5, 0, 0.343347353, 5e-6}, Settled{5, 0.3, 0.343350001, 1e-8},
                                         Settled{5, 0.8, 0.330207092, 1e-8}, Settled{8, 0, 0.856609897, 5e-6},
                                         Settled{8, 0.3, 0.7848, 1e-8}),
                         [](const auto& info) {
                           return fmt::format("{}DiscsWithE{:.0f}", info.param.n, 100 * info.param.e);
                         });

/// Impacts before a time, one of each instant.
std::vector<Event> impacts_before(const Solution& solution, double t) {
  std::vector<Event> impacts;
  for (const Event& event : solution.events) {
    const bool is_new = impacts.empty() || event.t > impacts.back().t + 1e-9;
    if (event.kind == EventKind::impact && event.t < t && is_new) impacts.push_back(event);
  }
  return impacts;
}

TEST(GroupRest, OfFesdFollowsEventDrivenUntilDiscsSettle) {
  for (const double e : {0.0}) {
    const auto problem = make_problem("balls_in_box", {{"n", 5.0}, {"e", e}});
    // Afterwards one of both counts impacts of rounding while discs settle.
    const auto fesd = impacts_before(solve(*problem, 1e-8, {}, kFesd), 0.2),
               events = impacts_before(solve(*problem, 1e-8), 0.2);
    ASSERT_EQ(fesd.size(), events.size()) << e;
    ASSERT_FALSE(fesd.empty());
    for (std::size_t k = 0; k < fesd.size(); ++k) {
      // Flights are exact: the tolerance is what captures and landings may leave.
      EXPECT_NEAR(fesd[k].t, events[k].t, 1e-8) << e;
      EXPECT_LT((fesd[k].q - events[k].q).lpNorm<Eigen::Infinity>(), 1e-8) << e;
    }
  }
}

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
    for (const char* method : {"event_driven", kFesd}) {
      const Solution solution = solve(*problem, 1e-8, {}, method);
      ASSERT_TRUE(solution.succeeded()) << solution.message;
      // Rounding of the projection of 12 velocities.
      EXPECT_LT(solution.v.lpNorm<Eigen::Infinity>(), 1e-13) << e << " " << method;
      EXPECT_LT((solution.q - problem->info().q0).lpNorm<Eigen::Infinity>(), 1e-13) << e << " " << method;
    }
  }
}

TEST(GroupRest, LeavesNothingForTheNextRunOfASolver) {
  const auto problem = make_problem("balls_in_box", {{"n", 5.0}, {"e", 0.0}});
  for (const char* name : {"event_driven", kFesd}) {
    const auto method = make_method(name);
    const auto solver = method->prepare(*problem);
    Settings settings;
    settings.tolerance = 1e-8;
    const Solution first = solver->solve(settings), second = solver->solve(settings);
    ASSERT_TRUE(first.succeeded() && second.succeeded()) << first.message << second.message;
    EXPECT_EQ(first.q, second.q) << name;
    EXPECT_EQ(first.v, second.v) << name;
  }
}

TEST(GroupRest, HasNoDerivatives) {
  const auto problem = make_problem("balls_in_box", {{"n", 12.0}, {"e", 0.3}});
  const Solution solution = solve(*problem, 1e-8, {"v0:0"});
  EXPECT_EQ(solution.status, Status::infeasible);
  const auto cusp = make_problem("balls_in_box", {{"n", 5.0}, {"e", 0.3}});
  EXPECT_EQ(solve(*cusp, 1e-8, {"v0:0"}, kFesd).status, Status::infeasible);
}

}  // namespace
}  // namespace ricochet
