// Pictures of scenes: what stands where, and what moves.
#include "reports/drawing/scene_drawing.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <regex>

#include "bench/site/drawn_scene.h"
#include "methods/registry.h"
#include "problems/geometry.h"
#include "problems/input_error.h"
#include "tests/test_data.h"

namespace ricochet {
namespace {

Solution solved_by(const Problem& problem, const std::string& method) {
  Settings settings;
  settings.steps = 100;
  settings.recording = Recording::motion;
  return make_method(method)->solve(problem, settings);
}

/// The number of the attribute `name` in the first element `tag`.
double attribute(const std::string& svg, const std::string& tag, const std::string& name) {
  std::smatch found;
  const std::regex pattern("<" + tag + " [^>]*?\\b" + name + "=\"([-0-9.]+)");
  return std::regex_search(svg, found, pattern) ? std::stod(found[1]) : NAN;
}

/// What the first element `tag` goes through in the attribute `name`.
std::vector<double> values(const std::string& svg, const std::string& tag, const std::string& name) {
  std::smatch found;
  const std::regex pattern("<" + tag + " [^>]*>(?:<animate [^>]*>)*?<animate attributeName=\"" + name +
                           "\"[^>]*values=\"([^\"]*)\"");
  std::vector<double> list;
  if (!std::regex_search(svg, found, pattern)) return list;
  std::stringstream text(found[1]);
  for (std::string number; std::getline(text, number, ';');) list.push_back(std::stod(number));
  return list;
}

constexpr double kPixels = 0.011;  // coordinates are written with two decimals, and two of them are compared

TEST(SceneDrawing, ABallStandsOnTheGround) {
  const std::string svg = scene_svg(*make_problem("bouncing_ball", {{"height", 0.1}}));
  std::smatch ground;
  ASSERT_TRUE(std::regex_search(svg, ground, std::regex("<polygon [^>]*points=\"[-0-9.]+,([-0-9.]+) ")));
  EXPECT_NEAR(attribute(svg, "circle", "cy") + attribute(svg, "circle", "r"), std::stod(ground[1]), kPixels);
  EXPECT_EQ(svg.find("<animate"), std::string::npos) << "nothing moves";
}

// A geometry for drawings alone has no pairs of shapes, which say where a surface is touched.
TEST(SceneDrawing, TheGroundIsInThePictureOfEveryCaseOfTheGroundTruth) {
  for (const auto& truth : ground_truth()) {
    const auto problem = with_picture(*make_problem(truth.id));
    const auto& shapes = problem->info().geometry->shapes;
    if (std::ranges::find(shapes, ShapeKind::half_space, &BodyShape::kind) == shapes.end()) continue;
    if (problem->info().geometry->in_space) continue;  // a patch below the bodies
    const std::string svg = scene_svg(*problem);
    std::smatch ground, size;
    ASSERT_TRUE(std::regex_search(svg, ground, std::regex("<polygon [^>]*points=\"[-0-9.]+,([-0-9.]+) "))) << truth.id;
    ASSERT_TRUE(std::regex_search(svg, size, std::regex("viewBox=\"0 0 [0-9.]+ ([0-9.]+)\""))) << truth.id;
    EXPECT_LT(std::stod(ground[1]), std::stod(size[1]) - 5) << truth.id;
  }
}

TEST(SceneDrawing, ABallFallsAsItsMotionSays) {
  const auto problem = make_problem("bouncing_ball", {{"duration", 0.4}});  // it falls 0.785 m
  const std::string svg = scene_svg(*problem, solved_by(*problem, "fesd:gauss:2"));
  const std::vector<double> y = values(svg, "circle", "cy");
  ASSERT_GT(y.size(), 60u);
  const double metre = attribute(svg, "circle", "r") / 0.1;
  EXPECT_NEAR(y.back() - y.front(), 9.81 / 2 * 0.4 * 0.4 * metre, 2 * kPixels);
  EXPECT_TRUE(std::ranges::is_sorted(y));
}

TEST(SceneDrawing, ASurfaceThatMovesByItselfMoves) {
  const auto problem = make_problem("shaken_table");
  const std::string svg = scene_svg(*problem, solved_by(*problem, "moreau_jean"));
  std::smatch found;
  ASSERT_TRUE(std::regex_search(svg, found, std::regex("<polygon [^>]*><animate attributeName=\"points\"")));
}

// x along the ramp goes down to the right: the block's centre does, too.
TEST(SceneDrawing, DownIsWhereGravityPoints) {
  const auto problem = make_problem("block_on_ramp", {{"v_x0", 1}, {"mu", 0}});
  const std::string svg = scene_svg(*problem, solved_by(*problem, "moreau_jean"));
  std::smatch way;
  ASSERT_TRUE(std::regex_search(
      svg, way, std::regex("<polyline [^>]*points=\"([-0-9.]+),([-0-9.]+) .* ([-0-9.]+),([-0-9.]+)\"/>")));
  const double dx = std::stod(way[3]) - std::stod(way[1]), dy = std::stod(way[4]) - std::stod(way[2]);
  ASSERT_GT(dx, 50);
  EXPECT_NEAR(dy / dx, std::tan(0.35), 4 * kPixels / dx);
}

TEST(SceneDrawing, EverySceneWithAGeometryIsDrawn) {
  for (const auto& entry : scenes()) {
    const auto problem = make_problem(entry.id);
    if (!problem->info().geometry) continue;
    const std::string svg = scene_svg(*problem);
    EXPECT_EQ(svg.find("nan"), std::string::npos) << entry.id;
    EXPECT_EQ(svg.find("inf\""), std::string::npos) << entry.id;
    EXPECT_TRUE(svg.ends_with("</svg>\n")) << entry.id;
  }
}

TEST(SceneDrawing, NeedsAGeometry) {
  const auto problem = read_scene_file(test_data("moving_table.json"));
  EXPECT_THROW(scene_svg(*problem), InputError);
}

}  // namespace
}  // namespace ricochet
