// Polygons: gaps of points and discs at faces and corners, and motions over edges.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <string>

#include "methods/registry.h"
#include "problems/input_error.h"
#include "problems/scene_file/scene_file.h"
#include "problems/scene_file/scene_writer.h"

namespace ricochet {
namespace {

/// A disc, or a point if R = 0, on a polygon of the world.
std::string disc(const std::string& corners, bool is_open, double R, double x, double y, double v_x, double T,
                 const std::string& contact = R"("e": 0)") {
  return fmt::format(R"json({{"q0": [{}, {}], "v0": [{}, 0], "T": {},
      "geometry": {{"gravity": ["0", "-9.81"], "bodies": [{{"name": "disc", "mass": 1, "position": ["q[0]", "q[1]"]}}],
        "shapes": [{{"name": "table", "kind": "polygon", "corners": {}, "open": {}}},
                   {{"name": "disc", "kind": "sphere", "body": "disc", "size": [{}]}}]}},
      "contacts": [{{"name": "contact", "shapes": ["table", "disc"], {}}}]}})json",
                     x, y, v_x, T, corners, is_open, R, contact);
}

constexpr const char* kSquare = R"([["-1","-1"],["1","-1"],["1","1"],["-1","1"]])";
constexpr const char* kEdge = R"([["0","-1"],["0","0"],["-1","0"]])";
constexpr const char* kRamp = R"([["2","1.5"],["0","0"],["-1","0"]])";

double gap(const std::string& scene, double x, double y) {
  return read_scene_text(scene, "scene")->gap(Vector{{x, y}})[0];
}

TEST(Polygon, GapsOfADiscAreThoseToTheNearestFaceOrCorner) {
  const std::string scene = disc(kSquare, false, 0.25, 0, 3, 0, 1);
  EXPECT_DOUBLE_EQ(gap(scene, 0.3, 2), 0.75);
  EXPECT_DOUBLE_EQ(gap(scene, -3, 0.4), 1.75);
  EXPECT_DOUBLE_EQ(gap(scene, 0.4, -1.5), 0.25);
  EXPECT_NEAR(gap(scene, 1.3, 1.4), 0.25, 1e-15);
  EXPECT_NEAR(gap(scene, -4, -5), 4.75, 1e-15);
  EXPECT_DOUBLE_EQ(gap(scene, 0.9, 0), -0.35);  // inside
}

TEST(Polygon, GapsOfAPointAreThoseToTheFaces) {
  const std::string scene = disc(kSquare, false, 0, 0, 3, 0, 1);
  EXPECT_DOUBLE_EQ(gap(scene, 1.3, 1.4), 0.4);
  EXPECT_DOUBLE_EQ(gap(scene, 0.5, 0.9), -0.1);
  const std::string ramp = disc(kRamp, true, 0, -1, 3, 0, 1);
  EXPECT_DOUBLE_EQ(gap(ramp, -1, 0.5), 0.5);
  EXPECT_NEAR(gap(ramp, 1, 1), (1 - 0.75) * 0.8, 1e-15);
}

TEST(Polygon, DerivativesAreThoseOfTheGap) {
  for (const double R : {0.0, 0.25}) {
    const auto problem = read_scene_text(disc(kSquare, false, R, 0, 3, 0, 1), "scene");
    for (const auto& [x, y] : {std::pair{0.3, 2.0}, {1.7, 1.4}, {-4, 0.1}, {-2, -1.3}}) {
      const Vector q{{x, y}};
      const Matrix J = problem->normal_jacobian(q);
      for (int k = 0; k < 2; ++k) {
        const Vector h = 1e-6 * Vector::Unit(2, k);
        EXPECT_NEAR(J(k, 0), (problem->gap(q + h)[0] - problem->gap(q - h)[0]) / 2e-6, 1e-8);
      }
    }
  }
}

TEST(Polygon, APointSlidesOverTheEdgeAndFalls) {
  const std::string scene = disc(kEdge, true, 0, -1, 0, 2, 0.7);
  for (const char* method : {"event_driven", "fesd_adaptive:radau-iia:4", "cvode"}) {
    Settings settings;
    settings.tolerance = 1e-10;
    const auto problem = read_scene_text(scene, "scene");
    const Solution s = make_method(method)->solve(*problem, settings);
    ASSERT_TRUE(s.succeeded()) << method << ": " << s.message;
    EXPECT_NEAR(s.q[0], 0.4, 1e-8) << method;
    EXPECT_NEAR(s.q[1], -0.5 * 9.81 * 0.04, 1e-8) << method;
  }
}

/// A disc that slides slowly over a convex corner stays on it until the circle of its centre is too steep: it leaves at the
/// angle phi from the vertical with v^2 = g R cos(phi), v^2 = v_0^2 + 2 g R (1 - cos(phi)).
TEST(Polygon, ADiscGoesAroundACorner) {
  constexpr double g = 9.81, R = 0.5, v_0 = 1;
  const double cosine = (v_0 * v_0 / (g * R) + 2) / 3;
  const std::string scene = disc(kEdge, true, R, -0.2, R, v_0, 0.6);
  const auto problem = read_scene_text(scene, "scene");
  for (const char* method : {"event_driven", "fesd_adaptive:radau-iia:4", "cvode"}) {
    Settings settings;
    settings.tolerance = 1e-10;
    const Solution s = make_method(method)->solve(*problem, settings);
    ASSERT_TRUE(s.succeeded()) << method << ": " << s.message;
    ASSERT_FALSE(s.events.empty()) << method;
    EXPECT_EQ(s.events.back().kind, EventKind::detach) << method;
    EXPECT_NEAR(s.events.back().q[1], R * cosine, 1e-7) << method;
    EXPECT_NEAR(s.events.back().v_plus.squaredNorm(), g * R * cosine, 1e-6) << method;
  }
}

TEST(Polygon, AtTheFootOfARampTheFaceIsHit) {
  const std::string scene = disc(kRamp, true, 0, -0.5, 0, 1, 0.55);
  for (const char* method : {"event_driven", "fesd_adaptive:radau-iia:4", "cvode"}) {
    Settings settings;
    settings.tolerance = 1e-10;
    const Solution s = make_method(method)->solve(*read_scene_text(scene, "scene"), settings);
    ASSERT_TRUE(s.succeeded()) << method << ": " << s.message;
    const double speed = 0.8 - 0.6 * 9.81 * 0.05;  // along the ramp
    EXPECT_NEAR(s.v[0], 0.8 * speed, 1e-8) << method;
    EXPECT_NEAR(s.v[1], 0.6 * speed, 1e-8) << method;
  }
}

/// A box of 0.2 m on a table from x = -2 to 0, whose edge is rounded by 1 cm: corners of the box on the table, and the edge
/// on the faces of the box. Where two sharp corners meet, no normal is defined.
std::string box_on_table(double x, double v, double T, double mu) {
  std::string contacts;
  for (int k = 0; k < 4; ++k)
    contacts +=
        fmt::format(R"({{"name": "corner {0}", "shapes": ["table", "box"], "corner": [{0}], "mu": {1}}}, )", k, mu);
  return fmt::format(R"json({{"q0": [{0}, 0.1, 0], "v0": [{1}, 0, 0], "T": {2},
      "geometry": {{"gravity": ["0", "-9.81"],
        "bodies": [{{"name": "box", "mass": 1, "inertia": ["0.02/3"], "position": ["q[0]", "q[1]"],
                     "rotation": "planar", "angles": ["q[2]"]}}],
        "shapes": [{{"name": "table", "kind": "polygon", "corners": [["-2","-1"],["0","-1"],["0","0"],["-2","0"]]}},
          {{"name": "box", "kind": "polygon", "body": "box",
            "corners": [["-0.1","-0.1"],["0.1","-0.1"],["0.1","0.1"],["-0.1","0.1"]]}},
          {{"name": "edge", "kind": "sphere", "position": ["-0.01", "-0.01"], "size": ["0.01"]}}]}},
      "contacts": [{4}{{"name": "edge", "shapes": ["box", "edge"], "mu": {3}}}]}})json",
                     x, v, T, mu, contacts);
}

TEST(Polygon, ABoxSlidesOverTheEdgeOfATableAndTilts) {
  const auto problem = read_scene_text(box_on_table(-0.3, 1.2, 0.45, 0), "scene");
  Vector first;
  for (const char* method : {"event_driven", "fesd_adaptive:radau-iia:4", "arkode"}) {
    Settings settings;
    settings.tolerance = 1e-9;
    const Solution s = make_method(method)->solve(*problem, settings);
    ASSERT_TRUE(s.succeeded()) << method << ": " << s.message;
    EXPECT_LT(s.q[2], -0.01) << method;  // it has tilted over the edge
    if (first.size() == 0) first = s.q;
    EXPECT_NEAR((s.q - first).norm(), 0, 1e-5) << method;
  }
}

TEST(Polygon, IsWrittenAndReadAgain) {
  for (const std::string& scene : {disc(kSquare, false, 0.25, 0, 3, 0, 1), disc(kRamp, true, 0.1, -1, 3, 0, 1)}) {
    const auto problem = read_scene_text(scene, "scene");
    const auto again = read_scene_text(scene_text(*problem), "again");
    EXPECT_EQ(again->gap(Vector{{1.3, 1.4}})[0], problem->gap(Vector{{1.3, 1.4}})[0]);
    EXPECT_EQ(scene_text(*again), scene_text(*problem));
  }
}

TEST(Polygon, MistakesAreRejected) {
  const auto reads = [](const char* corners, bool is_open) {
    return read_scene_text(disc(corners, is_open, 0, 0, 3, 0, 1), "scene");
  };
  EXPECT_THROW(reads(R"([["0","0"],["1","0"]])", false), InputError);                        // no polygon
  EXPECT_THROW(reads(R"([["0","0"],["0","1"],["1","1"],["1","0"]])", false), InputError);    // clockwise
  EXPECT_THROW(reads(R"([["0","0"],["2","0"],["1","0.5"],["2","2"]])", false), InputError);  // not convex
  EXPECT_THROW(reads(R"([["0","0"],["1","0"],["1","0"],["0","1"]])", false), InputError);    // a corner twice
  EXPECT_THROW(reads(R"([["0","0"],["1","0"],["1","1"],["2","1"]])", true), InputError);     // turns to both sides
}

}  // namespace
}  // namespace ricochet
