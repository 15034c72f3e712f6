#include <fmt/format.h>
#include <gtest/gtest.h>

#include "methods/event_driven/slow_slip.h"
#include "methods/registry.h"
#include "problems/scene_file/scene_file.h"
#include "tests/test_data.h"

namespace ricochet {
namespace {

constexpr double kWeight = 9.81, kHeight = 0.1;  // of a block [N], [m]

/// n blocks of 1 kg, 0.2 m wide and kHeight high, each `gap` above the one below [m].
/// @param turn  angle of every second block [rad]
std::unique_ptr<Problem> column(int n, double gap, double turn) {
  std::string q0, v0, bodies, shapes = R"({"name": "table", "kind": "half_space"})", contacts;
  for (int i = 0; i < n; ++i) {
    const char* comma = i == 0 ? "" : ", ";
    const std::string name = fmt::format("block {}", i + 1), below = i == 0 ? "table" : fmt::format("block {}", i);
    q0 += fmt::format(R"({}"0", "{:.17g}", "{:.17g}")", comma, (i + 0.5) * kHeight + (i + 1) * gap, i % 2 * turn);
    v0 += fmt::format(R"({}"0", "0", "0")", comma);
    bodies += fmt::format(R"({}{{"name": "{}", "mass": "1", "inertia": ["(w**2 + h**2)/12"],)"
                          R"( "position": ["q[{}]", "q[{}]"], "rotation": "planar", "angles": ["q[{}]"]}})",
                          comma, name, 3 * i, 3 * i + 1, 3 * i + 2);
    shapes += fmt::format(R"(, {{"name": "{}", "kind": "box", "body": "{}", "size": ["w/2", "h/2"]}})", name, name);
    for (const int side : {-1, 1})
      contacts += fmt::format(R"({}{{"name": "{} {}", "shapes": ["{}", "{}"], "corner": [{}, -1], "mu": "0.5"}})",
                              i == 0 && side < 0 ? "" : ", ", name, side < 0 ? "left" : "right", below, name, side);
  }
  return read_scene_text(
      fmt::format(R"({{"params": {{"w": "0.2", "h": "{}"}}, "q0": [{}], "v0": [{}], "T": "0.5", "geometry":)"
                  R"( {{"gravity": ["0", "-{}"], "bodies": [{}], "shapes": [{}]}}, "contacts": [{}]}})",
                  kHeight, q0, v0, kWeight, bodies, shapes, contacts),
      "column");
}

Solution event_driven(const Problem& problem, double tolerance) {
  Settings settings;
  settings.tolerance = tolerance;
  settings.recording = Recording::grid;
  return make_method("event_driven")->solve(problem, settings);
}

double kinetic_energy(const Problem& problem, const Vector& q, const Vector& v) {
  return 0.5 * v.dot(problem.mass_matrix(q) * v);
}

/// No gap is below -4 heights, each the tolerance times a size of 1. No impact adds kinetic energy, up to what moving the
/// state into the modes that follow does: velocities change by less than the tolerance of their size, energies by twice
/// that (seen 1.5).
void expect_valid(const Problem& problem, const Solution& solution, double tolerance) {
  for (const Sample& sample : solution.samples) {
    EXPECT_GE(problem.gap(sample.q).minCoeff(), -4 * tolerance) << sample.t;
    const double before = kinetic_energy(problem, sample.q, sample.v_minus);
    EXPECT_LE(kinetic_energy(problem, sample.q, sample.v_plus), (1 + 2 * tolerance) * before) << sample.t;
  }
}

/// Blocks dropped on each other hit the pile one after the other. It stands as high as their heights together.
TEST(ColumnOfBlocks, StandsAfterItsFall) {
  constexpr int n = 20;
  const auto problem = column(n, 1e-3, 0);
  const Solution solution = event_driven(*problem, 1e-6);
  ASSERT_TRUE(solution.succeeded()) << solution.message;
  expect_valid(*problem, solution, 1e-6);
  for (int i = 0; i < n; ++i) EXPECT_NEAR(solution.q[3 * i + 1], (i + 0.5) * kHeight, 1e-6) << "block " << i + 1;
  EXPECT_LE(solution.v.cwiseAbs().maxCoeff(), 1e-6);
}

/// Blocks that are turned rock on each other while they settle.
TEST(ColumnOfBlocks, StandsAfterItsBlocksHaveRocked) {
  constexpr int n = 4;
  const auto problem = column(n, 1e-3, 2e-3);
  const Solution solution = event_driven(*problem, 1e-6);
  ASSERT_TRUE(solution.succeeded()) << solution.message;
  expect_valid(*problem, solution, 1e-6);
  for (int i = 0; i < n; ++i) EXPECT_NEAR(solution.q[3 * i + 1], (i + 0.5) * kHeight, 1e-6) << "block " << i + 1;
  EXPECT_LE(solution.v.cwiseAbs().maxCoeff(), 1e-6);
}

/// A sphere falls on nine others: they slip, roll and stick, and their contacts open and close, many times in a
/// microsecond.
TEST(SpherePile, TenSpheresReachTheEnd) {
  const auto problem = make_problem("sphere_pile", {{"n", 10.0}});
  const Solution solution = event_driven(*problem, 1e-6);
  ASSERT_TRUE(solution.succeeded()) << solution.message;
  expect_valid(*problem, solution, 1e-6);
}

/// Slip counts as rest after 17 of its events that follow each other within t_low, and after a pause no more.
TEST(SlowSlip, IsFollowedForSixteenEvents) {
  const auto problem = make_problem("sphere_pile", {{"n", 2.0}});
  Counters counters;
  const ContactScales scales(*problem);
  ImpactSolver law(*problem, FrictionPolygon(), scales, counters);
  GroupRest rest(*problem, scales, law);
  SlowSlip slip(*problem, rest, law);
  constexpr double tolerance = 1e-8;
  const double t_low = problem->info().end_time / 10 * std::sqrt(2 * tolerance);
  slip.restart(tolerance);
  const DetectedEvent stops{.kind = SwitchKind::slip_stops, .contact = 0}, closes{.contact = 0};
  for (int k = 0; k < 16; ++k) slip.count(stops, 0.9 * t_low);
  for (int k = 0; k < 16; ++k) slip.count(closes, 0.9 * t_low);
  EXPECT_FALSE(slip.is_followed_enough());
  slip.count(stops, 0.9 * t_low);
  EXPECT_TRUE(slip.is_followed_enough());
  slip.count(stops, 1.1 * t_low);
  EXPECT_FALSE(slip.is_followed_enough());
}

}  // namespace
}  // namespace ricochet
