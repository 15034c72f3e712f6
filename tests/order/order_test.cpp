// Observed orders, fitted by the same rule as in the reports.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>

#include "methods/registry.h"
#include "reference/agreement.h"
#include "reference/proven.h"
#include "reports/order_fit.h"
#include "tests/test_data.h"

namespace ricochet {
namespace {

struct Truth {
  Vector q, v;
  double uncertainty;
};

std::optional<OrderFit> observe(const Problem& problem, const Truth& truth, const std::string& spec,
                                const std::vector<int>& grid) {
  const auto method = make_method(spec);
  std::vector<ricochet::Run> records;
  for (const int steps : grid) {
    Settings settings;
    settings.steps = steps;
    const Solution s = method->solve(problem, settings);
    ricochet::Run r;
    r.setting.steps = steps;
    r.h_bar = problem.info().end_time / steps;
    r.status = to_string(s.status);
    r.error = reference::final_state_difference(s.q, s.v, truth.q, truth.v);
    r.reference_error = truth.uncertainty;
    r.solution_size = std::max(truth.q.cwiseAbs().maxCoeff(), truth.v.cwiseAbs().maxCoeff());
    records.push_back(r);
  }
  std::vector<const ricochet::Run*> pointers;
  for (const auto& r : records) pointers.push_back(&r);
  return fit_order(pointers);
}

std::vector<int> logarithmic(double from, double to, int per_decade) {
  std::vector<int> grid;
  for (double n = from; n <= to * 1.0001; n *= std::pow(10, 1.0 / per_decade)) {
    const int steps = static_cast<int>(std::lround(n));
    if (grid.empty() || steps > grid.back()) grid.push_back(steps);
  }
  return grid;
}

Truth truth_of(const Problem& problem) {
  const auto reference = reference::make_reference(problem);
  return {reference.solution.q, reference.solution.v, reference.uncertainty};
}

/// What a fitted order may lack of the nominal one: errors saw-tooth with the place of an impact in its step.
constexpr double kSlack = 0.2;

struct Case {
  const char* method;
  double order;
  double from, to;
};

/// Switching times that the published equations leave open: order 2 without pinning, the tableau's order with it, on
/// flat and on curved contacts.
struct PinningCase {
  const char *problem, *method;
  double least, most;
  double from, to;
};

class Pinning : public testing::TestWithParam<PinningCase> {};

TEST_P(Pinning, DecidesTheOrder) {
  const auto& p = GetParam();
  const bool is_file = std::string(p.problem).find(".json") != std::string::npos;
  const auto problem =
      is_file ? read_scene_file(test_data(std::string("../../") + p.problem)) : ground_truth_problem(p.problem);
  const auto fit = observe(*problem, truth_of(*problem), p.method, logarithmic(p.from, p.to, 12));
  ASSERT_TRUE(fit);
  EXPECT_GE(fit->slope, p.least) << "window " << fit->first_steps << " .. " << fit->last_steps;
  EXPECT_LE(fit->slope, p.most) << "window " << fit->first_steps << " .. " << fit->last_steps;
}

// Bounds: the expected order with a slack of 0.2; 0.6 below and above 2 without pinning, where the error is a
// saw-tooth.
constexpr const char* kBead = "bench/experiments/scenes/pulled_bead.json";
INSTANTIATE_TEST_SUITE_P(
    Switches, Pinning,
    testing::Values(PinningCase{"P8b_spring_table", "fesd:radau-iia:3", 4.8, 5.6, 10, 270},
                    PinningCase{"P8b_spring_table", "fesd:radau-iia:3,switches=published_earliest", 1.4, 2.6, 10, 1000},
                    PinningCase{"P8b_spring_table", "fesd:radau-iia:2,gap_tolerance=1", 2.8, 3.3, 30, 270},
                    PinningCase{"P4a_clock_driven_block", "fesd:radau-iia:2", 2.8, 3.6, 20, 1000},
                    PinningCase{"P4a_clock_driven_block", "fesd:radau-iia:3,switches=published_earliest", 1.4, 2.6, 20,
                                1000},
                    PinningCase{"P8a_bead_leaves_circle", "fesd:radau-iia:2,gap_tolerance=1", 2.8, 3.2, 10, 270},
                    PinningCase{"P8a_bead_leaves_circle", "fesd:radau-iia:3", 4.5, 5.6, 10, 90},
                    PinningCase{kBead, "fesd:radau-iia:2", 2.8, 3.4, 10, 270},
                    PinningCase{"P4a_clock_driven_block", "time_freezing:radau-iia:2", 2.8, 3.6, 20, 1000},
                    PinningCase{"P4b_spring_driven_block", "time_freezing:radau-iia:3", 4.8, 5.2, 50, 1000},
                    PinningCase{"P4b_spring_driven_block", "time_freezing:gauss:2", 3.8, 4.2, 50, 1000},
                    PinningCase{"P8a_bead_leaves_circle", "time_freezing:radau-iia:2", 2.8, 3.2, 10, 270},
                    PinningCase{"P8a_bead_leaves_circle", "time_freezing:gauss:2", 3.8, 4.2, 10, 270},
                    PinningCase{"P8b_spring_table", "time_freezing:radau-iia:2", 2.8, 3.2, 100, 1000}),
    [](const auto& test) { return test_name(std::string(test.param.problem) + "_" + test.param.method); });

class TwoBalls : public testing::TestWithParam<Case> {};

TEST_P(TwoBalls, HasItsOrderThroughElasticImpacts) {
  const auto problem = make_problem("two_balls_spring");
  const auto& cases = ground_truth();
  const auto truth =
      std::find_if(cases.begin(), cases.end(), [](const auto& c) { return c.id == "P2_two_balls_spring"; });
  const auto fit = observe(*problem, {truth->q, truth->v, 1e-15}, GetParam().method,
                           logarithmic(GetParam().from, GetParam().to, 12));
  ASSERT_TRUE(fit);
  EXPECT_GE(fit->slope, GetParam().order - kSlack) << "window " << fit->first_steps << " .. " << fit->last_steps;
}

// Grids: from the first N that is asymptotic for the stiff spring, one and a half decades or to rounding.
INSTANTIATE_TEST_SUITE_P(Methods, TwoBalls,
                         testing::Values(Case{"fesd:radau-iia:1", 1, 1e5, 1e6}, Case{"fesd:radau-iia:2", 3, 100, 2000},
                                         Case{"fesd:radau-iia:3", 5, 60, 2000}, Case{"fesd:radau-iia:4", 7, 50, 800},
                                         Case{"fesd:gauss:1", 2, 1000, 1e5}, Case{"fesd:gauss:2", 4, 100, 2000},
                                         Case{"fesd:gauss:3", 6, 60, 1200}, Case{"fesd:gauss:4", 8, 50, 500},
                                         Case{"fesd:lobatto-iiia:3", 4, 100, 2000},
                                         Case{"time_freezing:radau-iia:2", 3, 600, 6000},
                                         Case{"time_freezing:radau-iia:3", 5, 200, 2000},
                                         Case{"time_freezing:gauss:2", 4, 200, 4000}, Case{"moreau_jean", 1, 2e4, 2e6},
                                         Case{"anitescu_potra", 1, 2e4, 2e6}, Case{"schatzman_paoli", 1, 2e4, 1e6},
                                         Case{"generalized_alpha", 1, 2e4, 6e5}, Case{"rattle", 1, 2e4, 6e5},
                                         Case{"d1_minus", 1, 2e4, 6e5}, Case{"event_capturing,order=2", 2, 1000, 20000},
                                         Case{"event_capturing,order=4", 4, 200, 2000},
                                         Case{"anitescu_potra,implicit=linear", 1, 1e5, 2e6}),
                         [](const auto& test) { return test_name(test.param.method); });

/// Time stepping of higher order, where nothing switches and where contacts and joints turn: orders that others lose.
struct SteppingCase {
  const char *problem, *method;
  double order, from, to;
};

class TimeStepping : public testing::TestWithParam<SteppingCase> {};

TEST_P(TimeStepping, HasItsOrder) {
  const auto& p = GetParam();
  const bool is_scene = std::string(p.problem).find("P") != 0;
  const auto problem = is_scene ? make_problem(p.problem) : ground_truth_problem(p.problem);
  const auto fit = observe(*problem, truth_of(*problem), p.method, logarithmic(p.from, p.to, 12));
  ASSERT_TRUE(fit);
  EXPECT_GE(fit->slope, p.order - kSlack) << "window " << fit->first_steps << " .. " << fit->last_steps;
  EXPECT_LE(fit->slope, p.order + 2 * kSlack) << "window " << fit->first_steps << " .. " << fit->last_steps;
}

INSTANTIATE_TEST_SUITE_P(
    Methods, TimeStepping,
    testing::Values(SteppingCase{"falling_rod", "rattle", 2, 100, 10000},
                    SteppingCase{"falling_rod", "d1_minus", 2, 100, 10000},
                    SteppingCase{"falling_rod", "generalized_alpha", 1, 100, 10000},
                    SteppingCase{"falling_rod", "event_capturing,order=3", 3, 20, 400},
                    SteppingCase{"P7b_slide3d_no_stick", "rattle", 2, 100, 10000},
                    SteppingCase{"P7b_slide3d_no_stick", "d1_minus", 2, 100, 10000},
                    SteppingCase{"P7b_slide3d_no_stick", "moreau_jean", 1, 100, 10000},
                    SteppingCase{"P8a_bead_leaves_circle", "event_capturing,order=2", 2, 100, 1000},
                    SteppingCase{"P8a_bead_leaves_circle", "event_capturing,order=3", 3, 20, 400},
                    SteppingCase{"pendulum_wall_cartesian", "event_capturing,order=3", 3, 50, 1000},
                    // Single steps are as short as they get from N = 317 on.
                    SteppingCase{"pendulum_wall", "event_capturing,order=4", 4, 15, 300},
                    SteppingCase{"pendulum_wall", "event_capturing,order=2", 2, 50, 3000}),
    [](const auto& test) { return test_name(std::string(test.param.problem) + "_" + test.param.method); });

TEST(TwoBallsSensitivities, HaveTheTableausOrder) {
  const auto problem = ground_truth_problem("P2_two_balls_spring");
  const auto truth = reference::read_ground_truth(reference_data("ground_truth.json"), "P2_two_balls_spring");
  for (const auto& [method, order, from, to] :
       {Case{"fesd:radau-iia:2", 3, 200, 4000}, Case{"fesd:radau-iia:3", 5, 100, 2000},
        Case{"fesd:gauss:2", 4, 200, 4000}}) {
    for (std::size_t k = 0; k < truth.sensitivities.size(); ++k) {
      const auto& expected = truth.sensitivities[k];
      std::vector<ricochet::Run> records;
      for (const int steps : logarithmic(from, to, 24)) {
        Settings settings;
        settings.steps = steps;
        settings.sensitivities = {expected.wrt};
        const Solution s = make_method(method)->solve(*problem, settings);
        ricochet::Run r;
        r.setting.steps = steps;
        r.h_bar = problem->info().end_time / steps;
        r.status = to_string(s.status);
        r.error = reference::final_state_difference(s.dq.col(0), s.dv.col(0), expected.dq, expected.dv);
        r.reference_error = 1e-15;
        r.solution_size = std::max(expected.dq.cwiseAbs().maxCoeff(), expected.dv.cwiseAbs().maxCoeff());
        records.push_back(r);
      }
      std::vector<const ricochet::Run*> pointers;
      for (const auto& r : records) pointers.push_back(&r);
      const auto fit = fit_order(pointers);
      ASSERT_TRUE(fit) << method << " " << expected.wrt;
      EXPECT_GE(fit->slope, order - kSlack) << method << " " << expected.wrt;
    }
  }
}

/// Where impacts fall inside their steps makes errors saw-tooth over half a decade; many N average that out.
constexpr int kDense = 40;

TEST(PendulumWall, OrdersWithANonlinearGap) {
  const auto problem = make_problem("pendulum_wall");
  const Truth truth = truth_of(*problem);
  ASSERT_LE(truth.uncertainty, 1e-9);
  for (const auto& [method, order, from, to] :
       {Case{"fesd:radau-iia:2", 3, 30, 1000}, Case{"fesd:radau-iia:3", 5, 10, 200}, Case{"fesd:gauss:2", 4, 20, 1000},
        Case{"fesd:gauss:3", 6, 8, 60}}) {
    const auto fit = observe(*problem, truth, method, logarithmic(from, to, kDense));
    ASSERT_TRUE(fit) << method;
    EXPECT_GE(fit->slope, order - kSlack) << method << " window " << fit->first_steps << " .. " << fit->last_steps;
  }
}

TEST(DoublePendulum, OrdersWithAVaryingMassMatrix) {
  const auto problem = read_scene_file(test_data("double_pendulum_wall.json"));
  const Truth truth = truth_of(*problem);
  ASSERT_LE(truth.uncertainty, 1e-9);
  for (const auto& [method, order, from, to] :
       {Case{"fesd:radau-iia:2", 3, 30, 1000}, Case{"fesd:radau-iia:3", 5, 10, 200},
        Case{"fesd:gauss:2", 4, 15, 1000}}) {
    const auto fit = observe(*problem, truth, method, logarithmic(from, to, kDense));
    ASSERT_TRUE(fit) << method;
    EXPECT_GE(fit->slope, order - kSlack) << method << " window " << fit->first_steps << " .. " << fit->last_steps;
  }
}

/// Through slip, stick and slip of friction elements whose bound depends on the time or the velocity.
TEST(FrictionElements, OrdersThroughStickAndSlip) {
  for (const char* scene : {"clutch.json", "dry_hinge.json"}) {
    const auto problem = read_scene_file(test_data(scene));
    const auto proven = reference::truth_of(*problem);
    const Truth truth{proven.solution.q, proven.solution.v, proven.uncertainty};
    ASSERT_LE(truth.uncertainty, 1e-14);
    for (const auto& [method, order, from, to] :
         {Case{"fesd:radau-iia:2", 3, 100, 3000}, Case{"fesd:radau-iia:3", 5, 15, 200},
          Case{"fesd:gauss:2", 4, 20, 1000}, Case{"fesd:gauss:3", 6, 15, 120}}) {
      const auto fit = observe(*problem, truth, method, logarithmic(from, to, kDense));
      ASSERT_TRUE(fit) << scene << " " << method;
      EXPECT_GE(fit->slope, order - kSlack)
          << scene << " " << method << " window " << fit->first_steps << " .. " << fit->last_steps;
    }
  }
}

/// Through forces that bend, jump in time and jump in position: every tableau keeps its order, because every element has
/// one set of smooth formulas. Through slip that reverses: Radau IIA and Gauss.
class Branches : public testing::TestWithParam<Case> {};

/// A fitted order may differ by this: borders divide steps, and the error depends on the place of the border in a step.
constexpr double kBorderSlack = 0.5;

TEST_P(Branches, KeepTheOrderOfTheTableau) {
  const auto& p = GetParam();
  const std::string method = p.method;
  std::vector<std::string> scenes = {"pendulum_on_spring", "pendulum_pushed", "pendulum_over_plate"};
  if (method.find("radau-iia") != std::string::npos || method.find("gauss") != std::string::npos)
    scenes.emplace_back("pendulum_in_turning_sleeve");
  for (const auto& scene : scenes) {
    const auto problem = read_scene_file(test_data("../../bench/experiments/scenes/" + scene + ".json"));
    const auto proven = reference::truth_of(*problem);
    ASSERT_LE(proven.uncertainty, 1e-14) << scene;
    const auto fit = observe(*problem, {proven.solution.q, proven.solution.v, proven.uncertainty}, method,
                             logarithmic(p.from, p.to, p.order <= 2 ? 12 : kDense));
    ASSERT_TRUE(fit) << scene;
    RecordProperty(scene, fmt::format("{:.2f}", fit->slope));
    EXPECT_GE(fit->slope, p.order - kBorderSlack)
        << scene << " window " << fit->first_steps << " .. " << fit->last_steps;
    EXPECT_LE(fit->slope, p.order + kBorderSlack)
        << scene << " window " << fit->first_steps << " .. " << fit->last_steps;
  }
}

// Grids: from the first N that is asymptotic to rounding, in 3 to 6 s.
INSTANTIATE_TEST_SUITE_P(
    Tableaus, Branches,
    testing::Values(Case{"fesd:radau-iia:1", 1, 1e4, 2e5}, Case{"fesd:radau-iia:2", 3, 40, 1500},
                    Case{"fesd:radau-iia:3", 5, 40, 240}, Case{"fesd:radau-iia:4", 7, 20, 90},
                    Case{"fesd:gauss:1", 2, 150, 5000}, Case{"fesd:gauss:2", 4, 40, 1500},
                    Case{"fesd:gauss:3", 6, 40, 240}, Case{"fesd:gauss:4", 8, 20, 90},
                    Case{"fesd:radau-ia:2", 3, 40, 1500}, Case{"fesd:radau-ia:3", 5, 40, 240},
                    Case{"fesd:lobatto-iiia:2", 2, 150, 5000}, Case{"fesd:lobatto-iiia:3", 4, 40, 1500},
                    Case{"fesd:lobatto-iiia:4", 6, 40, 240}, Case{"fesd:lobatto-iiib:2", 2, 150, 5000},
                    Case{"fesd:lobatto-iiib:3", 4, 40, 1500}, Case{"fesd:lobatto-iiib:4", 6, 40, 240},
                    Case{"fesd:lobatto-iiic:2", 2, 150, 5000}, Case{"fesd:lobatto-iiic:3", 4, 40, 1500},
                    Case{"fesd:lobatto-iiic:4", 6, 40, 240}),
    [](const auto& test) { return test_name(test.param.method); });

TEST(SmoothMotion, OrdersWithoutImpacts) {
  // The wall is out of reach: what remains is the smooth order of each method.
  const auto problem = make_problem("pendulum_wall", {{"w", 5}});
  const Truth truth = truth_of(*problem);
  for (const auto& [method, order, from, to] :
       {Case{"irk:gauss:2,contacts=ignored", 4, 30, 1000}, Case{"irk:radau-iia:2,contacts=ignored", 3, 30, 1000},
        Case{"irk:radau-ia:2,contacts=ignored", 3, 30, 1000}, Case{"irk:lobatto-iiia:3,contacts=ignored", 4, 30, 1000},
        Case{"irk:lobatto-iiib:3,contacts=ignored", 4, 30, 1000},
        Case{"irk:lobatto-iiic:3,contacts=ignored", 4, 30, 1000}, Case{"irk:gauss:3,contacts=ignored", 6, 18, 90},
        Case{"moreau_jean", 2, 100, 1e5}, Case{"moreau_jean,theta=1", 1, 1e3, 1e6},
        Case{"moreau_jean,implicit=full", 2, 100, 3e4}, Case{"generalized_alpha", 2, 100, 3e4},
        Case{"generalized_alpha,rho_inf=0", 2, 100, 3e4}, Case{"penalty", 2, 100, 1e5},
        Case{"anitescu_potra", 1, 1e3, 1e6}, Case{"anitescu_potra,implicit=linear", 1, 1e3, 1e6},
        Case{"schatzman_paoli", 1, 1e3, 1e6}}) {
    const auto fit = observe(*problem, truth, method, logarithmic(from, to, 12));
    ASSERT_TRUE(fit) << method;
    EXPECT_GE(fit->slope, order - kSlack) << method << " window " << fit->first_steps << " .. " << fit->last_steps;
    EXPECT_LE(fit->slope, order + 1) << method << ": more would be another method";
  }
}

TEST(SmoothMotion, OrderTwoWithAVaryingMassMatrix) {
  const auto problem = read_scene_file(test_data("double_pendulum_wall.json"), {{"w", 5}});
  const Truth truth = truth_of(*problem);
  for (const char* method : {"moreau_jean", "moreau_jean,implicit=full", "generalized_alpha", "penalty"}) {
    const auto fit = observe(*problem, truth, method, logarithmic(300, 3e4, 8));
    ASSERT_TRUE(fit) << method;
    EXPECT_GE(fit->slope, 2 - kSlack) << method;
  }
}

TEST(SmoothMotion, SymplecticHasOrderTwo) {
  const auto problem = make_problem("pendulum_wall", {{"w", 5}, {"e", 1}});
  const auto fit = observe(*problem, truth_of(*problem), "symplectic", logarithmic(100, 1e5, 8));
  ASSERT_TRUE(fit);
  EXPECT_GE(fit->slope, 2 - kSlack);
}

/// Inelastic contact with friction: three slip reversals, five transitions between stick and slip.
TEST(StickSlip, FirstOrderOfTheInelasticMethods) {
  const auto problem = ground_truth_problem("P4b_spring_driven_block");
  const auto truth = reference::read_ground_truth(reference_data("ground_truth.json"), "P4b_spring_driven_block");
  for (const char* method : {"stewart_trinkle", "anitescu_convex", "anitescu_convex,solver=newton"}) {
    const auto fit = observe(*problem, {truth.q, truth.v, 1e-15}, method, logarithmic(1000, 1e5, 12));
    ASSERT_TRUE(fit) << method;
    EXPECT_GE(fit->slope, 1 - kSlack) << method;
  }
}

/// Surfaces that move by themselves: impacts with a shaken table, a table that throws a ball off, stick, slip and
/// reversal on a belt whose speed varies.
/// (With more stages the first two are rounding from N = 50 on.)
class MovingScenes : public testing::TestWithParam<PinningCase> {};

TEST_P(MovingScenes, KeepTheOrder) {
  const auto& p = GetParam();
  const auto& cases = moving_scenes();
  const auto truth = std::find_if(cases.begin(), cases.end(), [&](const auto& c) { return c.id == p.problem; });
  const auto fit =
      observe(*moving_scene(p.problem), {truth->q, truth->v, 1e-15}, p.method, logarithmic(p.from, p.to, kDense));
  ASSERT_TRUE(fit);
  EXPECT_GE(fit->slope, p.least) << "window " << fit->first_steps << " .. " << fit->last_steps;
  EXPECT_LE(fit->slope, p.most) << "window " << fit->first_steps << " .. " << fit->last_steps;
}

INSTANTIATE_TEST_SUITE_P(
    Methods, MovingScenes,
    testing::Values(PinningCase{"shaken_table_bounces", "fesd:radau-iia:2,elements=as_needed", 2.8, 4, 20, 1000},
                    PinningCase{"shaken_table_bounces", "fesd:radau-iia:3,elements=as_needed", 4.8, 6, 10, 200},
                    PinningCase{"shaken_table_bounces", "fesd:gauss:2,elements=as_needed", 3.8, 5, 20, 1000},
                    PinningCase{"shaken_table_throws", "fesd:radau-iia:2,elements=as_needed", 2.8, 4, 20, 500},
                    PinningCase{"belt_of_varying_speed", "fesd:radau-iia:2,elements=as_needed", 2.8, 4, 30, 1000},
                    PinningCase{"belt_of_varying_speed", "fesd:radau-iia:3,elements=as_needed", 4.8, 6, 20, 300},
                    PinningCase{"belt_of_varying_speed", "moreau_jean", 0.8, 1.6, 1e3, 1e5},
                    PinningCase{"belt_of_varying_speed", "anitescu_potra", 0.8, 1.6, 1e3, 1e5},
                    PinningCase{"belt_of_varying_speed", "stewart_trinkle", 0.8, 1.6, 1e3, 1e5},
                    PinningCase{"shaken_table_throws", "moreau_jean", 0.8, 1.6, 1e3, 1e5},
                    PinningCase{"shaken_table_bounces", "anitescu_potra", 0.8, 1.6, 1e4, 1e6},
                    PinningCase{"shaken_table_bounces", "schatzman_paoli", 0.8, 1.6, 1e4, 1e6},
                    PinningCase{"shaken_table_throws", "generalized_alpha", 0.8, 1.6, 1e3, 1e5}),
    [](const auto& test) { return test_name(std::string(test.param.problem) + "_" + test.param.method); });

/// The compliant baseline gets stiffer with the root of h. Its errors, some percent, are not in the window of a fit.
TEST(Impacts, PenaltyHasOrderOneHalf) {
  const auto problem = ground_truth_problem("P1a_ball_e09");
  const auto truth = reference::read_ground_truth(reference_data("ground_truth.json"), "P1a_ball_e09");
  const auto mean_error = [&](double from) {
    double sum = 0;
    const auto grid = logarithmic(from, 2 * from, 40);
    for (const int steps : grid) {
      Settings settings;
      settings.steps = steps;
      const Solution s = make_method("penalty")->solve(*problem, settings);
      sum += std::log10(reference::final_state_difference(s.q, s.v, truth.q, truth.v));
    }
    return sum / static_cast<double>(grid.size());
  };
  const double slope = (mean_error(2e3) - mean_error(2e5)) / 2;
  EXPECT_GE(slope, 0.5 - kSlack);
  EXPECT_LE(slope, 0.5 + kSlack);
}

}  // namespace
}  // namespace ricochet
