// Coulomb's law with the cone as published, squared, and with a polygon in place of the friction disc.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <numeric>
#include <set>

#include "methods/contact_laws/friction_problem.h"
#include "methods/registry.h"
#include "problems/input_error.h"
#include "problems/registry.h"
#include "problems/scene_file/scene_file.h"
#include "tests/solve_with_samples.h"
#include "tests/test_data.h"

namespace ricochet {
namespace {

/// The bound of the audit: residuals relative to the terms that cancel.
constexpr double kConeAudit = 1e-12;

Solution run_with_cone(const Problem& problem, const std::string& method, int steps, bool audit = true) {
  Settings settings;
  settings.steps = steps;
  settings.audit = audit;
  const Solution s = solve_with_samples(problem, method, settings);
  if (audit) EXPECT_LE(s.max_residual(), kConeAudit) << method << ", " << steps << " steps";
  return s;
}

/// A block on a rough plane in space; a weight drags it around.
std::unique_ptr<Problem> dragged_block(const ParameterChanges& changes) {
  return read_scene_file(test_data("dragged_block_3d.json"), changes);
}
/// The block alone, thrown with (v_x, v_y).
std::unique_ptr<Problem> thrown_block(double v_x, double v_y) {
  return dragged_block({{"k", 0}, {"K", 0}, {"X_0", 0}, {"V_Y0", 0}, {"mu", 0.1}, {"v_x0", v_x}, {"v_y0", v_y}});
}

double difference(const Solution& a, const Solution& b) {
  return std::max((a.q - b.q).cwiseAbs().maxCoeff(), (a.v - b.v).cwiseAbs().maxCoeff());
}

TEST(FrictionPolygon, InThePlaneIsTheExactCone) {
  for (const char* scene :
       {"stacked_blocks", "falling_rod", "slider_crank_stop", "oblique_impact", "belt_oscillator"}) {
    const auto p = make_problem(scene);
    const std::string method = "fesd:radau-iia:3,elements=as_needed";
    const Solution exact = run_with_cone(*p, method, 200),
                   polyhedral = run_with_cone(*p, method + ",cone=polyhedral,facets=4", 200);
    EXPECT_EQ(exact.q, polyhedral.q) << scene;
    EXPECT_EQ(exact.v, polyhedral.v) << scene;
    EXPECT_EQ(exact.counters.inner_iterations, polyhedral.counters.inner_iterations) << scene;
  }
}

// With four facets and v_x > v_y > 0 the vertex -x carries the force until v_x = v_y; then the edge between -x and -y
// does, with mu g / sqrt(2) against v, until both components stop at once. Every tableau is exact on these parabolas.
TEST(FrictionPolygon, SlipAtAVertexAndThenOnAnEdge) {
  const double mu_g = 0.1 * 9.81, v_x = 1.1, v_y = 0.3;
  const double turn = (v_x - v_y) / mu_g, stop = turn + 2 * v_y / mu_g;
  const auto p = thrown_block(v_x, v_y);
  for (const char* tableau : {"radau-iia:2", "radau-iia:3", "gauss:2", "gauss:3"}) {
    const Solution s = run_with_cone(*p, std::string("fesd:") + tableau + ",cone=polyhedral,facets=4", 40);
    ASSERT_EQ(s.events.size(), 2U) << tableau;
    EXPECT_EQ(s.initial_modes[0], ContactMode::vertex_slip);
    EXPECT_EQ(s.events[0].kind, EventKind::facet_change);
    EXPECT_EQ(s.events[0].modes[0], ContactMode::edge_slip);
    EXPECT_EQ(s.events[1].kind, EventKind::slip_to_stick);
    // Rounding of 40 steps.
    EXPECT_NEAR(s.events[0].t, turn, 1e-13);
    EXPECT_NEAR(s.events[1].t, stop, 1e-13);
    EXPECT_NEAR(s.q[0], (v_x + v_y) / 2 * turn + v_y * v_y / mu_g, 1e-13);
    EXPECT_NEAR(s.q[1], v_y * turn + v_y * v_y / mu_g, 1e-13);
    EXPECT_LE(s.v.cwiseAbs().maxCoeff(), 1e-13);
  }
}

TEST(FrictionPolygon, SlipThatStopsAtAVertex) {
  const double mu_g = 0.1 * 9.81, v_x = 1.1;
  const auto p = thrown_block(v_x, 0);
  const Solution s = run_with_cone(*p, "fesd:radau-iia:3,cone=polyhedral,facets=4", 40);
  ASSERT_EQ(s.events.size(), 1U);
  EXPECT_NEAR(s.events[0].t, v_x / mu_g, 1e-13);
  EXPECT_NEAR(s.q[0], v_x * v_x / (2 * mu_g), 1e-13);
  EXPECT_NEAR(s.q[1], 0, 1e-13);
}

TEST(FrictionPolygon, OrderThroughItsSwitches) {
  const auto p = dragged_block({{"mu", 0.7}, {"T", 3}});
  for (const int facets : {4, 6}) {
    const std::string polygon = ",elements=as_needed,cone=polyhedral,facets=" + std::to_string(facets);
    const Solution fine = run_with_cone(*p, "fesd:radau-iia:4" + polygon, 1000, false);
    std::set<EventKind> kinds;
    for (const auto& event : fine.events) kinds.insert(event.kind);
    EXPECT_TRUE(kinds.contains(EventKind::facet_change) && kinds.contains(EventKind::slip_to_stick) &&
                kinds.contains(EventKind::stick_to_slip));
    for (const int n_s : {2, 3}) {
      std::vector<double> x, y;
      for (const int steps : {60, 85, 120, 170, 240, 339, 480}) {
        const Solution s = run_with_cone(*p, "fesd:radau-iia:" + std::to_string(n_s) + polygon, steps);
        x.push_back(std::log(steps));
        const double error = difference(s, fine);
        std::printf("%d facets, %d stages, %d steps: %.2e\n", facets, n_s, steps, error);
        y.push_back(std::log(error));
      }
      const double mean = std::accumulate(x.begin(), x.end(), 0.0) / static_cast<double>(x.size());
      double slope = 0, size = 0;
      for (std::size_t k = 0; k < x.size(); ++k) {
        slope -= (x[k] - mean) * y[k];
        size += (x[k] - mean) * (x[k] - mean);
      }
      RecordProperty("order_" + std::to_string(facets) + "_" + std::to_string(n_s), std::to_string(slope / size));
      EXPECT_GE(slope / size, 2 * n_s - 1 - 0.2) << facets << " facets, " << n_s << " stages";
    }
  }
}

// A polygon of F facets turns the force by at most pi/F. Slip that turns meets errors of either sign for a time of 1/F
// each: order 2, or 3/2 where its direction has an extremum and turns by pi/F in a time of 1/sqrt(F) only.
TEST(FrictionPolygon, ConvergesToTheDisc) {
  const auto p = dragged_block({});
  const Solution disc = run_with_cone(*p, "fesd:radau-iia:3,elements=as_needed", 100);
  double before = 0, first = 0, last = 0;
  for (const int facets : {4, 8, 16, 32, 64}) {
    const Solution s =
        run_with_cone(*p, "fesd:radau-iia:3,elements=as_needed,cone=polyhedral,facets=" + std::to_string(facets), 100);
    const double error = difference(s, disc);
    std::printf("%4d facets: difference to the disc %.2e, ratio %.1f\n", facets, error, before / error);
    before = error;
    if (facets == 8) first = error;
    last = error;
  }
  EXPECT_GE(first / last, std::pow(8, 1.5)) << "from 8 to 64 facets";
}

TEST(FrictionPolygon, IsTheLimitOfTimeSteppingWithTheSameFacets) {
  const auto p = dragged_block({});
  const Solution s = run_with_cone(*p, "fesd:radau-iia:3,elements=as_needed,cone=polyhedral,facets=6", 100);
  const Solution disc = run_with_cone(*p, "fesd:radau-iia:3,elements=as_needed", 100);
  for (const char* method : {"anitescu_potra,facets=6", "moreau_jean,facets=6"}) {
    double coarse = 0;
    for (const int steps : {2000, 8000, 32000}) {
      const Solution stepped = run_with_cone(*p, method, steps, false);
      const double error = difference(stepped, s);
      std::printf("%s, %d steps: %.2e, to the disc %.2e\n", method, steps, error, difference(stepped, disc));
      if (steps == 2000) coarse = error;
      if (steps == 32000) {
        EXPECT_LE(error, coarse / 8) << method << ": 16 for order 1";
        EXPECT_LE(error, 0.1 * difference(stepped, disc)) << method << ": the limit is that of the polygon";
      }
    }
  }
}

TEST(FrictionPolygon, OnASpinningBallAndItsImpacts) {
  const auto p = make_problem("ball_3d");
  const Solution disc = run_with_cone(*p, "fesd:radau-iia:3,elements=as_needed", 100);
  double coarse = 0;
  for (const int facets : {8, 64}) {
    const Solution s =
        run_with_cone(*p, "fesd:radau-iia:3,elements=as_needed,cone=polyhedral,facets=" + std::to_string(facets), 100);
    const double error = difference(s, disc);
    if (facets == 8) coarse = error;
    if (facets == 64)
      EXPECT_LE(error, coarse / 4) << "an impulse has one direction: 8 for order 1; the phase scatters by 2";
  }
}

TEST(FrictionPolygon, OnRedundantContacts) {
  const auto p = make_problem("box_3d");
  const Solution s = run_with_cone(*p, "fesd:radau-iia:3,elements=as_needed,cone=polyhedral", 200);
  // It comes to rest on four corners; the velocities that are left are rounding of 1 m/s.
  EXPECT_LE(s.v.cwiseAbs().maxCoeff(), 1e-14);
}

TEST(FrictionPolygon, TheLawOfAnEdge) {
  // r_t = mu r_n d_k + l (d_1 - d_0): the load along the edge decides between both vertices and a force between them.
  FrictionProblem solver;
  solver.resize(1, 2, FrictionPolygon(4));
  const Matrix G = Matrix::Identity(3, 3);
  for (const double load : {-2.0, -0.1, 0.1, 2.0}) {
    std::vector<FrictionProblem::Contact> contacts{
        {.mu = 0.5, .n_t = 2, .slides = true, .direction = {-1, 0}, .is_on_edge = true, .facet = 0}};
    Vector b(3), r(3);
    b << -1, load / std::sqrt(2.0), -load / std::sqrt(2.0);
    ASSERT_EQ(solver.solve(G, b, 0, contacts, r), LcpStatus::solved);
    const Vector w = G * r + b;
    EXPECT_NEAR(r[1] + r[2], 0.5, 1e-15);
    if (std::abs(load) > 1) {
      EXPECT_EQ(contacts[0].mode, ContactMode::vertex_slip);
      EXPECT_EQ(contacts[0].facet, load > 0 ? 1 : 0);
    } else {
      EXPECT_EQ(contacts[0].mode, ContactMode::edge_slip);
      EXPECT_NEAR(w[2] - w[1], 0, 1e-15);
    }
  }
}

TEST(SquaredCone, HasTheSolutionsOfTheExactOneAndSaysWhereItHasNone) {
  for (const char* scene : {"ball_3d", "stacked_blocks"}) {
    const auto p = make_problem(scene);
    const std::string method = "fesd:radau-iia:3,elements=as_needed";
    const Solution exact = run_with_cone(*p, method, 100), squared = run_with_cone(*p, method + ",cone=squared", 100);
    EXPECT_EQ(exact.q, squared.q);
    EXPECT_EQ(exact.v, squared.v);
    std::int64_t impossible = 0;
    for (const auto& residual : squared.residuals) impossible += residual.impossible;
    for (const auto& residual : exact.residuals) EXPECT_EQ(residual.impossible, 0);
    EXPECT_GT(impossible, 0) << scene << ": no impulse carries the slip between two impacts";
  }
}

TEST(FrictionCone, RefusesWhatItCannotDo) {
  EXPECT_THROW(make_method("fesd:radau-iia:3,cone=round"), InputError);
  EXPECT_THROW(make_method("fesd:radau-iia:3,cone=polyhedral,facets=5"), InputError);
  EXPECT_THROW(make_method("fesd:radau-iia:3,cone=polyhedral,facets=2"), InputError);
  EXPECT_THROW(make_method("fesd:radau-iia:3,facets=8"), InputError) << "of the polyhedral cone only";
  const auto p = dragged_block({});
  EXPECT_FALSE(make_method("fesd:radau-iia:3,cone=polyhedral,switches=published")->can_run(p->info()).ok);
  Settings settings;
  settings.steps = 10;
  settings.sensitivities = {"q0:0"};
  EXPECT_THROW(make_method("fesd:radau-iia:3,cone=polyhedral")->solve(*p, settings), InputError);
}

}  // namespace
}  // namespace ricochet
