#include "bench/studies/zeno/zeno.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "methods/fesd/pivoting_solver.h"
#include "methods/runge_kutta/butcher_tableau.h"
#include "problems/input_error.h"
#include "problems/registry.h"
#include "tests/round_trip.h"

namespace ricochet {
namespace {

TEST(Capture, IsWhatClosedElementsDo) {
  for (const char* family : {"radau-iia", "radau-ia", "lobatto-iiic", "gauss"}) {
    for (int n_s = 2; n_s <= 5; ++n_s) {
      const std::string name = family + (":" + std::to_string(n_s));
      const ZenoCapture c = measure_capture(name);
      EXPECT_NEAR(c.measured_kappa, c.kappa, 1e-11 * c.kappa) << name << ": the accuracy of the stage forces, 1e-12";
      EXPECT_NEAR(c.measured_kept, c.kept, 1e-12) << name << ": the same";
      EXPECT_NEAR(c.kept, std::string(family) != "gauss" ? 0 : n_s % 2 ? -1 : 1, 1e-12) << name << ": rounding";
    }
  }
}

TEST(Capture, FollowsTheFormulaOfCollocation) {
  for (int n_s = 1; n_s <= 9; ++n_s) {
    const ButcherTableau tableau = make_tableau("radau-iia", n_s);
    double first = 1 / tableau.c[0];
    for (int k = 1; k < n_s; ++k) first *= 1 - tableau.c[0] / tableau.c[k];
    EXPECT_NEAR(capture(tableau).kappa, first, 1e-11 * first) << "condition of A with nine stages, about 1e3";
  }
  // 2 J_1(z)/z with z = 2.404825..., J_1(z) = 0.519147...; the next term is of relative order 1/n_s^2.
  EXPECT_NEAR(capture(make_tableau("radau-iia", 9)).kappa / 81, 0.43175, 0.43175 * 1.0 / 81);
  EXPECT_FALSE(std::isfinite(capture(make_tableau("lobatto-iiia", 3)).kappa)) << "its first stage is explicit";
}

/// Steps of one element from the ground, upwards with v+ = 1: between a flight that fits and a capture that is long
/// enough there is nothing.
TEST(Capture, LeavesAGapAfterTheFlight) {
  const double g = 9.81, e = 0.5, flight = 2 / g;
  const auto ball = make_problem("bouncing_ball", {{"e", e}});
  const ButcherTableau tableau = make_tableau("radau-iia", 4);
  const double kappa = capture(tableau).kappa;
  const auto advance = [&](double h, double& v_end) {
    Counters counters;
    PivotingSolver solver(*ball, tableau, {.n_fe = 1}, counters);
    solver.start(Vector::Constant(1, 0.1), Vector::Constant(1, -1 / e));
    const Status status = solver.advance(h);
    v_end = status == Status::success ? solver.step().last().v1[0] : 0;
    return status;
  };
  double v_end = 0;
  EXPECT_EQ(advance(0.999 * flight, v_end), Status::success);
  EXPECT_NEAR(v_end, 1 - g * 0.999 * flight, 1e-13) << "rounding";
  EXPECT_EQ(advance(1.001 * flight, v_end), Status::infeasible);
  EXPECT_EQ(advance(0.999 * kappa / g, v_end), Status::infeasible);
  EXPECT_EQ(advance(1.001 * kappa / g, v_end), Status::success);
  EXPECT_NEAR(v_end, 0, 1e-13) << "rounding";
}

TEST(ExactBall, BouncesAsTheReferenceSays) {
  const ExactBall ball{.e = 0.5};
  EXPECT_NEAR(ball.t_Z(), 3 * std::sqrt(1.8 / 9.81), 1e-15);
  const double t_0 = std::sqrt(1.8 / 9.81);
  EXPECT_NEAR(ball.height(t_0), 0, 1e-15);
  EXPECT_NEAR(ball.height(1.5 * t_0), 0.9 / 4, 1e-15) << "the first flight rises to e^2 h_0";
  EXPECT_NEAR(ball.height(2 * t_0 + 0.25 * t_0), 0.9 / 16, 1e-15);
  EXPECT_EQ(ball.height(3.1 * t_0), 0);
  const std::vector<double> times = ball.highest_after(2.1 * t_0);
  ASSERT_GE(times.size(), 40u) << "flights until they are shorter than rounding";
  for (int k = 0; k < 8; ++k)
    EXPECT_NEAR(ball.height(times[k]), 0.9 * std::pow(0.25, k + 2), 1e-15) << "the first flight was over";
}

TEST(Zeno, RestTimeIsWithinTheBound) {
  for (const char* method :
       {"fesd:radau-iia:2", "fesd:radau-iia:3,elements=as_needed", "fesd:radau-iia:4,elements=as_needed",
        "fesd:radau-iia:5,elements=as_needed", "fesd:lobatto-iiic:3,elements=as_needed"}) {
    int captured = 0;
    for (const double e : {0.3, 0.7}) {
      for (const double H : {0.1, 0.03, 0.01, 0.003}) {
        const ZenoRun run = measure_rest(method, e, H, 0);
        if (!run.has_bound()) continue;
        ++captured;
        const double rounding = 1e-13;
        EXPECT_GE(run.rest_error(), -rounding) << run.command;
        EXPECT_LE(run.rest_error(), run.rest_bound + rounding) << run.command;
        EXPECT_LE(run.position_error, run.position_bound + rounding) << run.command;
        EXPECT_NEAR(run.rest_error(), 2 * run.v_plus / (9.81 * (1 - e)), 1e-9)
            << "the flights left out; a gap of 1e-16 over the least speed, 1e-7: " << run.command;
      }
    }
    EXPECT_GE(captured, 4) << method << ": of 8; the others may have no solution";
  }
}

/// R(inf) is +-1, but the element that closes a bounce is projected.
TEST(Zeno, GaussAbsorbsWhatItCloses) {
  for (const char* method : {"fesd:gauss:1", "fesd:gauss:2", "fesd:gauss:3"}) {
    const ZenoRun run = measure_rest(method, 0.5, 0.05, 0);
    ASSERT_TRUE(run.rests) << method << ": " << run.message;
    EXPECT_GT(run.v_plus, 0) << method;
    EXPECT_LT(std::abs(run.v_end), 1e-12) << method << ": rounding of some hundred elements";
  }
}

TEST(Zeno, ErrorControlRestsWithinItsTolerance) {
  for (const double tolerance : {1e-3, 1e-5}) {
    const ZenoRun run = measure_rest("fesd_adaptive:radau-iia:3", 0.5, 0, tolerance);
    ASSERT_TRUE(run.has_bound()) << run.message;
    EXPECT_LE(run.v_plus, tolerance);
    EXPECT_LE(std::abs(run.rest_error()), run.rest_bound + 1e-13) << "rounding";
  }
}

/// Too late and too early by twice the bound, and within it.
TEST(Zeno, TheTableCountsRunsOutsideOfTheirBound) {
  std::vector<ZenoRun> runs;
  for (const double error : {2e-3, -2e-3, 5e-4}) {
    ZenoRun run{.method = "m", .command = "", .e = 0.5, .H = 0.1, .status = "success", .message = ""};
    run.rests = true;
    run.t_Z = 1;
    run.t_rest = 1 - error;
    run.rest_bound = run.position_bound = 1e-3;
    runs.push_back(run);
  }
  const Table table = zeno_table(runs);
  ASSERT_EQ(table.rows.size(), 1u);
  const auto cell = [&](const std::string& header) {
    const auto column = std::ranges::find(table.columns, header, &Table::Column::header);
    return table.rows[0].at(static_cast<std::size_t>(column - table.columns.begin()));
  };
  EXPECT_EQ(cell("above bound"), "2");
  EXPECT_EQ(cell("largest error / bound"), "2.000");
}

TEST(Zeno, SurvivesTheRoundTrip) {
  ZenoRun run{.method = "fesd:radau-iia:1", .command = "x", .e = 0.5, .H = 0.1, .status = "success", .message = "m"};
  run.rest_bound = run.position_bound = std::numeric_limits<double>::quiet_NaN();
  run.rests = true;
  run.t_rest = 1.25;
  EXPECT_SURVIVES(run);
  EXPECT_FALSE(run.has_bound());
  const ZenoCapture capture{"radau-iia:3", 3, 4.1, 0, 4.2, 1e-14};
  EXPECT_SURVIVES(capture);
  EXPECT_THROW(measure_capture("lobatto-iiia:3"), InputError);
}

}  // namespace
}  // namespace ricochet
