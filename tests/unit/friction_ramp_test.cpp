#include "bench/studies/friction_ramp/friction_ramp.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "bench/studies/friction_ramp/ramp_rows.h"
#include "methods/registry.h"
#include "problems/input_error.h"
#include "problems/registry.h"
#include "tests/round_trip.h"

namespace ricochet {
namespace {

TEST(ExactRamp, KnowsEveryPhase) {
  const double g = 9.81, c = 0.8, s = 0.6, t = 0.5;  // tan = 0.75
  const auto rest = ExactRamp{.mu = 0.75, .tangent = 0.75}.at(t);
  EXPECT_EQ(rest.x, 0) << "on the boundary it sticks";
  const auto slides = ExactRamp{.mu = 0.5, .tangent = 0.75}.at(t);
  EXPECT_NEAR(slides.v, g * (s - 0.5 * c) * t, 1e-15);
  EXPECT_NEAR(slides.x, 0.5 * g * (s - 0.5 * c) * t * t, 1e-15);
  const auto stops = ExactRamp{.mu = 1, .tangent = 0.75, .v_0 = 0.5}.at(t);
  EXPECT_EQ(stops.v, 0);
  EXPECT_NEAR(stops.x, 0.125 / (g * (c - s)), 1e-15);
  const auto returns = ExactRamp{.mu = 0.5, .tangent = 0.75, .v_0 = -1}.at(t);
  const double up = 1 / (g * (s + 0.5 * c));
  EXPECT_NEAR(returns.v, g * (s - 0.5 * c) * (t - up), 1e-15);
  EXPECT_NEAR(returns.x, -0.5 * up + 0.5 * g * (s - 0.5 * c) * (t - up) * (t - up), 1e-15);
  EXPECT_NEAR((ExactRamp{.mu = 0, .tangent = 0, .v_0 = -1}.at(t).x), -t, 1e-16) << "nothing stops it";
}

TEST(ExactFacets, AreTheDiscWithManyFacets) {
  for (const double direction : {0.0, 0.3, 0.7, 1.5}) {
    const ExactFacets many{.facets = 2000, .direction = direction}, disc{.facets = 0, .direction = direction};
    EXPECT_NEAR(many.limit(), 1, 2e-6) << "1 - cos(pi/F)";
    for (int k = 0; k < 2; ++k) EXPECT_NEAR(many.drift(1.5)[k], disc.drift(1.5)[k], 2e-3) << "pi/F";
  }
  const ExactFacets square{.facets = 4, .direction = std::numbers::pi / 4};
  EXPECT_NEAR(square.limit(), std::sqrt(0.5), 1e-15);
  const auto along_the_edge = ExactFacets{.facets = 4, .direction = 0.7}.drift(0.9);
  EXPECT_NEAR(std::atan2(along_the_edge[1], along_the_edge[0]), std::numbers::pi / 4, 1e-14) << "normal to the edge";
  EXPECT_EQ((ExactFacets{.facets = 4, .direction = 0}.drift(0.99)[0]), 0) << "a vertex holds as much as the disc";
}

TEST(FrictionRamp, PolygonsOfTheMethodsAreTheExactOnes) {
  const double load = 1.1, mu = 0.5, T = 0.5, g = 9.81;
  for (const auto& [method, facets] : {std::pair("fesd:radau-iia:3,cone=polyhedral,facets=4", 4),
                                       std::pair("fesd:radau-iia:3,cone=polyhedral,facets=8", 8),
                                       std::pair("fesd:radau-iia:3", 0), std::pair("moreau_jean,facets=4", 4)}) {
    for (const double direction : {0.1, 0.5, 0.75, 1.2}) {
      const auto ramp = make_problem(
          "block_on_ramp_3d", {{"mu", mu}, {"slope", std::atan(load * mu)}, {"direction", direction}, {"duration", T}});
      Settings settings;
      settings.steps = 10;
      const Solution s = make_method(method)->solve(*ramp, settings);
      ASSERT_TRUE(s.succeeded()) << method << ": " << s.message;
      const auto a = ExactFacets{.facets = facets, .direction = direction}.drift(load);
      const double size = g * mu * std::cos(std::atan(load * mu));
      for (int k = 0; k < 2; ++k)  // a constant acceleration is exact in the velocity of all of them
        EXPECT_NEAR(s.v[k], size * a[k] * T, 1e-11) << method << ", rounding of forces of 1e-12";
    }
  }
}

TEST(FrictionRamp, CountsWrongDecisions) {
  RampGrid grid;
  grid.method = "m";
  grid.v_0 = -1;
  grid.values = {0, 1};
  grid.error = {{0, std::numeric_limits<double>::quiet_NaN()}, {0.5, 0.25}};
  grid.cells = {{RampGrid::right, RampGrid::failed},
                {RampGrid::moves_but_should_rest, RampGrid::rests_but_should_move}};
  grid.message = "why";
  EXPECT_EQ(grid.wrong(), 2);
  EXPECT_EQ(grid.wrong_on_boundary(), 1);
  EXPECT_EQ(grid.largest_error(), 0.5);
  EXPECT_EQ(grid.largest_error_on_boundary(), 0.25);
  EXPECT_SURVIVES(grid);

  // In parts, as a run makes it, of two methods in turn.
  RampGrid first = grid, second = grid, other = grid;
  first.error.resize(1);
  first.cells.resize(1);
  first.message.clear();
  second.first_row = 1;
  second.error.erase(second.error.begin());
  second.cells.erase(second.cells.begin());
  other.method = "another";
  const auto whole = whole_grids({first, other, second});
  ASSERT_EQ(whole.size(), 2u);
  EXPECT_EQ(whole[0].cells, grid.cells);
  EXPECT_EQ(whole[0].error[1], grid.error[1]);
  EXPECT_EQ(whole[0].message, "why");
  EXPECT_EQ(whole[1].method, "another");
  EXPECT_EQ(whole_grids({first, other}).size(), 1u) << "a run that was interrupted";
  EXPECT_THROW(whole_grids({second}), InputError);
  const RampFacets facets{"m", 4, 1.1, {0, 1}, {1, 1}, {1, 0.9}, {0, 0.1}, {0, 0.1}};
  EXPECT_SURVIVES(facets);
}

}  // namespace
}  // namespace ricochet
