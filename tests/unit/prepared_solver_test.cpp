// Solvers that are kept between runs: a run knows nothing of those before it.
#include <gtest/gtest.h>

#include "methods/registry.h"
#include "problems/input_error.h"
#include "tests/test_data.h"

namespace ricochet {
namespace {

void expect_same(const Solution& a, const Solution& b, const char* which) {
  SCOPED_TRACE(which);
  EXPECT_EQ(a.status, b.status);
  EXPECT_EQ(a.message, b.message);
  EXPECT_EQ(a.t, b.t);
  EXPECT_EQ(a.q, b.q);
  EXPECT_EQ(a.v, b.v);
  EXPECT_EQ(a.counters.steps, b.counters.steps);
  EXPECT_EQ(a.counters.elements, b.counters.elements);
  ASSERT_EQ(a.events.size(), b.events.size());
  for (std::size_t k = 0; k < a.events.size(); ++k) {
    EXPECT_EQ(a.events[k].t, b.events[k].t) << "event " << k;
    EXPECT_EQ(a.events[k].kind, b.events[k].kind) << "event " << k;
    EXPECT_EQ(a.events[k].v_plus, b.events[k].v_plus) << "event " << k;
    EXPECT_EQ(a.events[k].Lambda_n, b.events[k].Lambda_n) << "event " << k;
  }
}

/// Coarse runs have other element lengths than fine ones, and other switches.
Settings settings_of(bool is_adaptive, bool is_coarse) {
  Settings settings;
  if (is_adaptive)
    settings.tolerance = is_coarse ? 1e-3 : 1e-6;
  else
    settings.steps = is_coarse ? 7 : 40;
  settings.time_limit = 0;
  return settings;
}

class PreparedSolver : public testing::TestWithParam<std::string> {};

TEST_P(PreparedSolver, ForgetsTheRunsBefore) {
  const auto method = make_method(GetParam());
  int compared = 0;
  for (const auto& scene : scenes()) {
    const auto problem = make_problem(scene.id);
    const ProblemInfo& info = problem->info();
    if (info.n_q > 20 || !method->can_run(info).ok) continue;
    SCOPED_TRACE(scene.id);
    const bool is_adaptive = method->info().is_adaptive;
    const Settings settings = settings_of(is_adaptive, false);
    const Vector q0 = info.q0, v0 = info.v0;
    const auto solver = method->prepare(*problem);
    const Solution first = solver->solve(settings);
    expect_same(first, method->solve(*problem, settings), "the first run");

    // Another run from another state, with other lengths and modes, then the first one again.
    Vector slower = v0;
    slower.head(info.n_mechanical()) *= 0.7;
    problem->set_initial_state(q0, slower);
    solver->solve(settings_of(is_adaptive, true));
    problem->set_initial_state(q0, v0);
    expect_same(solver->solve(settings), first, "after another run");
    ++compared;
  }
  EXPECT_GT(compared, 10);
}

INSTANTIATE_TEST_SUITE_P(Methods, PreparedSolver,
                         testing::Values("fesd:radau-iia:3,elements=as_needed", "fesd:gauss:2,elements=as_needed",
                                         "fesd:radau-iia:2,cone=polyhedral,elements=as_needed",
                                         "fesd_adaptive:radau-iia:3", "event_driven", "event_driven:radau-iia:3",
                                         "moreau_jean"),
                         [](const auto& of) { return test_name(of.param); });

TEST(PreparedSolver, ChecksWhatMethodsCheck) {
  const auto problem = make_problem("bouncing_ball");
  const auto method = make_method("fesd:radau-iia:2");
  const auto solver = method->prepare(*problem);
  EXPECT_THROW(solver->solve({}), InputError) << "no steps";
  Settings settings = settings_of(false, false);
  settings.recording = Recording::final_state;
  EXPECT_TRUE(solver->solve(settings).events.empty());
  EXPECT_THROW(make_method("irk:radau-iia:2")->prepare(*problem), InputError) << "declined";
}

/// The inner tolerance belongs to a run, not to the solver.
TEST(PreparedSolver, FollowsTheInnerTolerance) {
  const auto problem = make_problem("slider_crank_stop");
  const auto method = make_method("fesd:radau-iia:2");
  const auto solver = method->prepare(*problem);
  Settings exact = settings_of(false, false), rough = exact;
  rough.inner_tolerance = 1e-4;
  const Solution first = solver->solve(exact);
  EXPECT_NE(solver->solve(rough).q, first.q);
  expect_same(solver->solve(exact), first, "as before");
}

}  // namespace
}  // namespace ricochet
