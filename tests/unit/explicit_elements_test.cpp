#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "methods/registry.h"
#include "methods/runge_kutta/embedded_tableau.h"
#include "problems/input_error.h"
#include "problems/registry.h"
#include "reference/proven.h"
#include "tests/test_data.h"

namespace ricochet {
namespace {

Settings audited(double tolerance) {
  Settings settings;
  settings.tolerance = tolerance;
  settings.recording = Recording::events;
  settings.audit = true;
  return settings;
}

class ExplicitElements : public testing::TestWithParam<const char*> {};

/// Impacts, take-off from a curve, stick and slip under a load that depends on time, curved contacts with friction, slip in
/// space that stops, and bilateral constraints, by every pair.
TEST_P(ExplicitElements, ReachTheTruth) {
  for (const char* scene :
       {"double_pendulum_wall", "P8a_bead_leaves_circle", "belt_oscillator", "rocking_block", "P4b_spring_driven_block",
        "P7a_slide3d_to_stick", "P7b_slide3d_no_stick", "slider_crank_stop"}) {
    SCOPED_TRACE(scene);
    const auto problem = make_problem(scene);
    const reference::Reference truth = reference::truth_of(*problem);
    const Solution s = make_method(std::string("fesd_adaptive:") + GetParam())->solve(*problem, audited(1e-8));
    ASSERT_TRUE(s.succeeded()) << s.message;
    // The motion amplifies the errors of steps at the tolerance, those of slider_crank_stop a hundred times.
    EXPECT_LE(truth.error_of(s), 3e-6);
    EXPECT_LE(s.max_residual(), 2e-12) << "the bound of the conformance tests";
  }
}

INSTANTIATE_TEST_SUITE_P(Pairs, ExplicitElements,
                         testing::Values("bogacki-shampine-5-4", "dop853", "dopri5", "prince-dormand-8-7",
                                         "tsitouras-5-4", "verner-7-6", "verner-9-8"),
                         [](const auto& test) {
                           std::string name = test.param;
                           std::erase(name, '-');
                           return name;
                         });

/// A switch is solved for: its function is rounding at the event, at any tolerance.
TEST(ExplicitElements, EndWhereTheGapIsZero) {
  const auto problem = make_problem("double_pendulum_wall");
  for (const double tolerance : {1e-3, 1e-6, 1e-9}) {
    const Solution s = make_method("fesd_adaptive:dopri5")->solve(*problem, audited(tolerance));
    ASSERT_TRUE(s.succeeded()) << s.message;
    ASSERT_FALSE(s.events.empty());
    for (const Event& event : s.events)
      EXPECT_LE(std::abs(problem->gap(event.q)[event.contact]), 1e-14) << "rounding of positions of 1 m";
  }
}

/// An accumulation of impacts ends at rest on the surface, whatever the tolerance.
TEST(ExplicitElements, ComeToRest) {
  const auto problem = make_problem("P1d_ball_e05_through_zeno");
  for (const double tolerance : {1e-4, 1e-8, 1e-12}) {
    const Solution s = make_method("fesd_adaptive:prince-dormand-8-7")->solve(*problem, audited(tolerance));
    ASSERT_TRUE(s.succeeded()) << s.message;
    EXPECT_NEAR(problem->gap(s.q)[0], 0, 1e-13) << "rounding";
    EXPECT_EQ(s.v[0], 0);
    EXPECT_LE(s.max_residual(), 2e-12);
  }
}

/// A contact in which nothing happens has no contact problem at the start of its elements.
TEST(ExplicitElements, GoOnWithoutAContactProblem) {
  const auto problem = make_problem("P8a_bead_leaves_circle");
  const auto problems_at = [&](double tolerance) {
    const Solution s = make_method("fesd_adaptive:dopri5")->solve(*problem, audited(tolerance));
    EXPECT_TRUE(s.succeeded()) << s.message;
    EXPECT_GT(s.counters.steps, 5);
    return s.counters.complementarity_solves;
  };
  EXPECT_EQ(problems_at(1e-4), problems_at(1e-10)) << "the start and the take-off, however many elements";
}

TEST(ExplicitElements, TakePairsFromFiles) {
  const auto problem = make_problem("double_pendulum_wall");
  const Solution s = make_method("fesd_adaptive:@" + test_data("heun_euler.json"))->solve(*problem, audited(1e-4));
  ASSERT_TRUE(s.succeeded()) << s.message;
  EXPECT_LE(reference::truth_of(*problem).error_of(s), 1e-2) << "order 2 at 1e-4, amplified by the motion";
}

TEST(ExplicitElements, DeclineWhatTheyCannotDo) {
  EXPECT_THROW(make_method("fesd_adaptive:dopri5,cone=polyhedral"), InputError);
  Settings with_derivatives = audited(1e-6);
  with_derivatives.sensitivities = {"q0:0"};
  EXPECT_THROW(make_method("fesd_adaptive:dopri5")->solve(*make_problem("bouncing_ball"), with_derivatives),
               InputError);
}

}  // namespace
}  // namespace ricochet
