#include <gtest/gtest.h>

#include <cmath>

#include "methods/modes/event_functions.h"
#include "methods/modes/explicit_steps.h"
#include "methods/modes/mode_dynamics.h"
#include "methods/registry.h"
#include "methods/runge_kutta/embedded_tableau.h"
#include "tests/test_data.h"

namespace ricochet {
namespace {

Solution solve(const Problem& problem, const std::string& pair, double tolerance) {
  Settings settings;
  settings.tolerance = tolerance;
  return make_method("event_driven:" + pair)->solve(problem, settings);
}

/// The residual of (1), (2) of mode_dynamics.h as a part of their terms, from the dense views of the problem.
double residual(const Problem& problem, const std::vector<ContactMode>& modes, const Vector& q, const Vector& v,
                const Vector& a, const ModeDynamics& dynamics) {
  const ProblemInfo& info = problem.info();
  const Matrix J_n = problem.normal_jacobian(q), J_t = problem.tangent_jacobian(q);
  Vector force = problem.force(q, v);
  double worst = 0;
  const Vector normal_bias = problem.gap_acceleration_bias(q, v), slip_bias = problem.slip_acceleration_bias(q, v);
  for (int i = 0; i < info.n_c(); ++i) {
    if (!is_closed(modes[i])) continue;
    const auto& contact = info.contacts[i];
    double lambda_t[2]{0, 0};
    dynamics.tangential_force(i, lambda_t);
    force += problem.force_directions(J_n).col(i) * dynamics.normal_force(i);
    worst = std::max(worst, std::abs(J_n.col(i).dot(a) + normal_bias[i]));
    for (int d = 0; d < contact.n_t; ++d) {
      const int t = contact.tangent_index + d;
      force += problem.force_directions(J_t).col(t) * lambda_t[d];
      if (modes[i] == ContactMode::stick) worst = std::max(worst, std::abs(J_t.col(t).dot(a) + slip_bias[t]));
    }
  }
  worst = std::max(worst, (problem.mass_matrix(q) * a - force).cwiseAbs().maxCoeff() / force.cwiseAbs().maxCoeff());
  return worst;
}

struct ModeCase {
  const char* scene;
  std::vector<ContactMode> modes;
};

class ModesOf : public testing::TestWithParam<ModeCase> {};

TEST_P(ModesOf, AccelerationsFulfilTheirEquations) {
  const auto problem = make_problem(GetParam().scene);
  Counters counters;
  ModeDynamics dynamics(*problem, counters);
  Vector q = problem->info().q0, v = problem->info().v0, a(q.size());
  for (Eigen::Index k = 0; k < q.size(); ++k) v[k] += 0.1 * std::sin(1.0 + static_cast<double>(k));
  dynamics.set_modes(GetParam().modes, q.data(), v.data());
  for (int point = 0; point < 3; ++point) {
    ASSERT_TRUE(dynamics.accelerate(q.data(), v.data(), a.data()));
    // Rounding of a few dozen terms, with masses that differ by a factor 100.
    EXPECT_LE(residual(*problem, GetParam().modes, q, v, a, dynamics), 1e-11) << "point " << point;
    q += 0.01 * v;
    v += 0.01 * a;
  }
}

/// Rows, rates and directions of forces are those of the dense views of the problem.
TEST_P(ModesOf, RowsAreTheColumnsOfTheirContacts) {
  const auto problem = make_problem(GetParam().scene);
  const ProblemInfo& info = problem->info();
  ModeRows rows(*problem);
  rows.set_modes(GetParam().modes);
  Vector q = info.q0, v = info.v0;
  for (Eigen::Index k = 0; k < info.n_mechanical(); ++k) {
    q[k] += 0.02 * std::cos(1.0 + static_cast<double>(k));
    v[k] += 0.3 * std::sin(1.0 + static_cast<double>(k));
  }
  Matrix C(info.n_q, rows.size());
  Vector b(rows.size());
  rows.set_columns(q.data(), v.data(), C);
  rows.set_rates(q.data(), v.data(), b);
  const Matrix J_n = problem->normal_jacobian(q), J_t = problem->tangent_jacobian(q);
  const Matrix push_n = problem->force_directions(J_n), push_t = problem->force_directions(J_t);
  const Vector normal_bias = problem->gap_acceleration_bias(q, v), slip_bias = problem->slip_acceleration_bias(q, v);
  constexpr double kRounding = 1e-13;  // of a few dozen terms of the size of 1 to 10
  for (Eigen::Index r = 0; r < rows.size(); ++r) {
    const auto [i, tangent] = rows[r];
    const ContactInfo& contact = info.contacts[i];
    const int t = contact.tangent_index + std::max(tangent, 0);
    const Vector R = tangent < 0 ? J_n.col(i) : J_t.col(t);
    Vector direction = tangent < 0 ? push_n.col(i) : push_t.col(t), added = Vector::Zero(info.n_q);
    EXPECT_NEAR(rows.dot(rows[r], v.data()), R.dot(v), kRounding);
    EXPECT_NEAR(b[r], tangent < 0 ? normal_bias[i] : slip_bias[t], kRounding);
    rows.add(rows[r], added.data());
    EXPECT_LE((added - direction).cwiseAbs().maxCoeff(), kRounding);
    if (tangent < 0 && is_slipping(GetParam().modes[i])) {
      const Vector v_t = J_t.middleCols(contact.tangent_index, contact.n_t).transpose() * v;
      for (int d = 0; d < contact.n_t; ++d) {
        const double along = contact.n_t == 1 ? slip_sign(GetParam().modes[i]) : v_t[d] / v_t.norm();
        EXPECT_NEAR(rows.direction(i)[d], along, kRounding);
        direction -= contact.mu * along * push_t.col(contact.tangent_index + d);
      }
    }
    EXPECT_LE((C.col(r) - direction).cwiseAbs().maxCoeff(), kRounding);
    EXPECT_EQ(rows.first(i), r - std::max(tangent + 1, 0));
  }
}

using enum ContactMode;
INSTANTIATE_TEST_SUITE_P(
    Scenes, ModesOf,
    testing::Values(ModeCase{"two_balls_spring", {closed}}, ModeCase{"belt_oscillator", {stick}},
                    ModeCase{"belt_oscillator", {slip_negative}}, ModeCase{"rocking_block", {stick, open}},
                    ModeCase{"rocking_block", {slip_positive, open}}, ModeCase{"falling_rod", {slip_positive}},
                    ModeCase{"block_on_ramp_3d", {slip}}, ModeCase{"block_on_ramp_3d", {stick}},
                    ModeCase{"pendulum_wall_cartesian", {closed, open}}, ModeCase{"shaken_table", {stick}}),
    [](const auto& test) {
      std::string name = test.param.scene;
      for (const auto mode : test.param.modes) name += std::string("_") + to_string(mode);
      return test_name(name);
    });

TEST(EventDriven, FewCoordinatesAndManyHaveTheSameForces) {
  // A row of 20 beads has its accelerations by factors, one of 4 by the map P.
  for (const int n : {4, 20}) {
    const auto problem =
        make_problem("bead_row", {{"n", static_cast<double>(n)}, {"distance", 0}, {"spacing", 0}, {"speed", 1}});
    Counters counters;
    ModeDynamics dynamics(*problem, counters);
    const std::vector<ContactMode> modes(static_cast<std::size_t>(problem->n_c()), closed);
    const Vector &q = problem->info().q0, &v = problem->info().v0;
    Vector a(q.size());
    dynamics.set_modes(modes, q.data(), v.data());
    ASSERT_TRUE(dynamics.accelerate(q.data(), v.data(), a.data()));
    EXPECT_LE(a.cwiseAbs().maxCoeff(), 1e-11) << "held at the wall";
    EXPECT_GT(dynamics.normal_force(0), 0);
  }
}

/// Block i of a column starts at speed i / n and slides on the block below. All are braked by mu g, the lowest stops first,
/// and none pushes another: each moves on by v^2 / (2 mu g). From 9 blocks on, accelerations are those by factors.
TEST(EventDriven, FewBlocksAndManyAreBrakedAlike) {
  for (const int n : {8, 9, 20}) {
    const auto problem = make_problem("block_column", {{"n", static_cast<double>(n)}});
    const Solution solution = solve(*problem, "prince-dormand-8-7", 1e-8);
    ASSERT_TRUE(solution.succeeded()) << solution.message;
    for (int i = 0; i < n; ++i) {
      const double v = problem->info().v0[2 * i];
      EXPECT_NEAR(solution.q[2 * i], v * v / (2 * 0.5 * 9.81), 1e-8) << "block " << i + 1 << " of " << n;
    }
  }
}

class Pair : public testing::TestWithParam<std::string> {};

/// The tolerance is kept where the motion oscillates a hundred times and bounces twice.
TEST_P(Pair, KeepsTheTolerance) {
  const auto problem = ground_truth_problem("P2_two_balls_spring");
  const auto& cases = ground_truth();
  const auto truth = std::ranges::find(cases, std::string("P2_two_balls_spring"), &reference::GroundTruth::id);
  for (const double tolerance : {1e-5, 1e-7, 1e-9}) {
    const Solution s = solve(*problem, GetParam(), tolerance);
    ASSERT_TRUE(s.succeeded()) << s.message;
    EXPECT_EQ(s.events.size(), 2u);
    // The error of some hundred steps adds up; low orders take more of them.
    EXPECT_LE(state_error(s, *truth), 300 * tolerance) << tolerance;
    EXPECT_GE(state_error(s, *truth), 1e-3 * tolerance) << "steps far shorter than the tolerance asks for";
  }
}

INSTANTIATE_TEST_SUITE_P(All, Pair, testing::ValuesIn(embedded_tableau_names()),
                         [](const auto& test) { return test_name(test.param); });

TEST(EventDriven, PairsFromFilesAreAsThoseOfTheProgram) {
  const auto problem = ground_truth_problem("P4b_spring_driven_block");
  const Solution s = solve(*problem, "@" + test_data("heun_euler.json"), 1e-6);
  ASSERT_TRUE(s.succeeded()) << s.message;
  const Solution exact = solve(*problem, "prince-dormand-8-7", 1e-12);
  EXPECT_EQ(kinds(s), kinds(exact));
  EXPECT_LE((s.q - exact.q).norm() + (s.v - exact.v).norm(), 1e-3) << "thousands of steps of order 2";
}

/// A ball that reaches the roof at 4 mm/s and leaves it again: both ends of the step are far below.
TEST(EventDriven, SeesAGrazingImpactWithinOneStep) {
  const double faster = 2.426112037808642;  // by 1e-6 m of height than needed
  const auto problem = make_problem(
      "ball_in_box", {{"mu", 0}, {"omega0", 0}, {"x0", 0.5}, {"v_x0", 0}, {"duration", 0.4}, {"v_y0", faster}});
  const Solution s = solve(*problem, "prince-dormand-8-7", 1e-8);
  ASSERT_TRUE(s.succeeded()) << s.message;
  EXPECT_EQ(kinds(s), std::vector{EventKind::impact});
}

TEST(EventDriven, ABallComesToRest) {
  const auto problem = ground_truth_problem("P1d_ball_e05_through_zeno");
  const Solution s = solve(*problem, "prince-dormand-8-7", 1e-9);
  ASSERT_TRUE(s.succeeded()) << s.message;
  EXPECT_NEAR(s.q[0], 0.1, 1e-12) << "the height of the flights that are left out";
  EXPECT_EQ(s.v[0], 0);
  // Heights shrink by 4 from 0.9 m to some roundings of the gap, 2e-13.
  EXPECT_GE(s.events.size(), 18u);
  EXPECT_LE(s.events.size(), 25u);
}

/// A block is pushed against its slip, stops and slips back: parabolas, which every step has exactly.
TEST(EventDriven, SlipInSpaceTurnsBackThroughRest) {
  const auto problem = read_scene_file(test_data("friction_scenes.json") + "#block_turns_back");
  const double F = 5, friction = 0.3 * 9.81, turn = 1 / (F + friction), left = 0.5 - turn;
  const double x = -0.5 * turn + 0.5 * (F - friction) * left * left;
  const Vector d{{0.6, 0.8, 0}};
  for (const double tolerance : {1e-6, 1e-9, 1e-12}) {
    const Solution s = solve(*problem, "prince-dormand-8-7", tolerance);
    ASSERT_TRUE(s.succeeded()) << s.message;
    ASSERT_EQ(kinds(s), std::vector{EventKind::slip_reversal});
    EXPECT_NEAR(s.events[0].t, turn, with_rounding(0)) << tolerance;
    EXPECT_LE((s.q - x * d).norm() + (s.v - (F - friction) * left * d).norm(), with_rounding(0)) << tolerance;
  }
}

/// Slip from rest whose direction turns at once, and hardly any friction that would correct it later.
TEST(EventDriven, SlipInSpaceBeginsToTheTolerance) {
  const auto problem = read_scene_text(R"({"q0": [0, 0, 0], "v0": [0, 0, 0], "T": 5,
      "M": [[1, 0, 0], [0, 1, 0], [0, 0, 1]], "f": ["10+0.8*v[1]", "-0.8*v[0]", -10],
      "contacts": [{"name": "ground", "gap": "q[2]", "e": 0, "mu": 0.02, "Jt": [[1, 0, 0], [0, 1, 0]]}]})",
                                       "charged block");
  const auto reference = reference::make_reference(*problem);
  for (const double tolerance : {1e-6, 1e-8, 1e-10}) {
    ASSERT_LT(reference.uncertainty, tolerance);
    const Solution s = solve(*problem, "prince-dormand-8-7", tolerance);
    ASSERT_TRUE(s.succeeded()) << s.message;
    EXPECT_LE(reference.error_of(s), 3 * tolerance) << "of steps that last five seconds together";
  }
}

/// Eight feet carry a block: thirteen forces too many, and whichever share is taken no foot starts to slip.
TEST(EventDriven, RedundantContactsKeepTheirModes) {
  const auto problem = make_problem("block_on_feet");
  for (const double tolerance : {1e-4, 1e-8, 1e-12}) {
    const Solution s = solve(*problem, "prince-dormand-8-7", tolerance);
    ASSERT_TRUE(s.succeeded()) << s.message;
    EXPECT_EQ(s.events.size(), 8u) << "every foot stops once";
  }
}

/// Samples between the ends of steps change no step, and are as exact as these. Stick, slip and reversal, in the plane
/// and in space, where slip stops and begins again.
/// A foot whose slip stops while another contact rests on a face that turns: rates of closed contacts are rounding, of
/// either sign, and a contact that they open hops lower than its gap can tell.
TEST(EventDriven, ContactsThatRoundingOpensCloseAgain) {
  const auto problem = read_scene_file(test_data("domino_row.json"));
  const auto run = [&](const std::string& method, double tolerance) {
    Settings settings;
    settings.tolerance = tolerance;
    const Solution s = make_method(method)->solve(*problem, settings);
    EXPECT_TRUE(s.succeeded()) << method << ", " << tolerance << ": " << s.message;
    return s;
  };
  const Solution truth = run("cvode:adams", 1e-12);
  for (const double tolerance : {1e-4, 1e-5, 1e-6, 1e-7, 1e-8, 1e-9, 1e-10, 1e-11}) {
    const Solution s = run("event_driven", tolerance);
    // Eleven events, each of which may multiply errors by a few.
    EXPECT_LT((s.q - truth.q).lpNorm<Eigen::Infinity>(), 100 * tolerance + 1e-9) << tolerance;
  }
}

TEST(EventDriven, DenseSamplesAreAsExactAsTheSteps) {
  for (const bool in_space : {false, true}) {
    const auto problem = in_space ? read_scene_file(test_data("dragged_block_3d.json"))
                                  : ground_truth_problem("P4b_spring_driven_block");
    const auto sampled = [&](double tolerance) {
      Settings settings;
      settings.tolerance = tolerance;
      settings.recording = Recording::grid;
      return make_method("event_driven:prince-dormand-8-7,samples=37")->solve(*problem, settings);
    };
    const double tolerance = 1e-8, T = problem->info().end_time;
    const Solution s = sampled(tolerance), exact = sampled(1e-13),
                   plain = solve(*problem, "prince-dormand-8-7", tolerance);
    ASSERT_TRUE(s.succeeded() && exact.succeeded()) << s.message << exact.message;
    EXPECT_EQ(s.q, plain.q);
    EXPECT_EQ(s.v, plain.v);
    EXPECT_EQ(s.counters.steps, plain.counters.steps);
    std::vector<Sample> dense, dense_exact;
    const auto is_event = [&](const Solution& x, const Sample& sample) {
      return std::ranges::any_of(x.events, [&](const Event& e) { return e.t == sample.t; });
    };
    for (const auto& sample : s.samples) {
      if (!is_event(s, sample) && sample.t > 0) dense.push_back(sample);
    }
    for (const auto& sample : exact.samples) {
      if (!is_event(exact, sample) && sample.t > 0) dense_exact.push_back(sample);
    }
    ASSERT_EQ(dense.size(), 37u);
    ASSERT_EQ(dense_exact.size(), 37u);
    for (std::size_t k = 0; k < dense.size(); ++k) {
      EXPECT_DOUBLE_EQ(dense[k].t, T * static_cast<double>(k + 1) / 37);
      // Errors of a few dozen steps add up.
      EXPECT_LE((dense[k].q - dense_exact[k].q).lpNorm<Eigen::Infinity>(), 100 * tolerance) << dense[k].t;
      EXPECT_LE((dense[k].v_plus - dense_exact[k].v_plus).lpNorm<Eigen::Infinity>(), 100 * tolerance) << dense[k].t;
    }
  }
}

}  // namespace
}  // namespace ricochet
