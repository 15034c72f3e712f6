// Scene files that state a geometry: what follows from it, and what is refused.
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <nlohmann/json.hpp>
#include <random>
#include <set>

#include "methods/registry.h"
#include "problems/derivatives/symbolic_problem.h"
#include "problems/geometry.h"
#include "problems/input_error.h"
#include "problems/scene_file/scene_writer.h"
#include "tests/test_data.h"

namespace ricochet {
namespace {

using nlohmann::json;

json exported(const Problem& problem) {
  return json::parse(scene_text(problem))["problem"];
}

/// Scenes in formulas whose contacts all are pairs of shapes and nothing but gravity acts.
std::vector<std::string> geometric_scenes() {
  std::set<std::string> others = scenes_with_other_forces();
  others.insert("shaken_table");  // its table moves
  std::vector<std::string> names;
  for (const auto& entry : scenes()) {
    const auto problem = make_problem(entry.id);
    if (problem->info().geometry && problem->info().structure.has_formulas && !others.contains(entry.id) &&
        problem->info().bilateral.empty())
      names.push_back(entry.id);
  }
  return names;
}

class SceneOfGeometry : public testing::TestWithParam<std::string> {};

// M, f, gaps and tangents are taken from the file, and come back from the geometry.
TEST_P(SceneOfGeometry, HasTheEquationsOfTheFormulas) {
  const auto formulas = make_problem(GetParam());
  json scene = exported(*formulas);
  for (const char* field : {"M", "f", "potential_energy"}) scene.erase(field);
  for (json& contact : scene["contacts"]) {
    contact.erase("gap");
    contact.erase("Jt");
  }
  const auto shapes = read_scene_text(scene.dump(), GetParam());
  ASSERT_EQ(shapes->n_c(), formulas->n_c());
  ASSERT_EQ(shapes->info().n_lambda_t, formulas->info().n_lambda_t);
  std::mt19937 random(3);
  std::uniform_real_distribution<double> shift(-0.02, 0.02);  // balls on a line stay in their order
  // Two ways to write one formula: some hundred roundings in Lagrange's equations of box_3d.
  const auto expect_same = [](const Matrix& a, const Matrix& b, const char* what) {
    if (b.size() > 0) EXPECT_LE((a - b).cwiseAbs().maxCoeff(), 1e-12 * (1 + b.cwiseAbs().maxCoeff())) << what;
  };
  for (int sample = 0; sample < 5; ++sample) {
    Vector q = formulas->info().q0, v = formulas->info().v0;
    for (double& x : q) x += shift(random);
    for (double& x : v) x += 50 * shift(random);
    expect_same(shapes->mass_matrix(q), formulas->mass_matrix(q), "M");
    expect_same(shapes->force(q, v), formulas->force(q, v), "f");
    expect_same(shapes->gap(q), formulas->gap(q), "gap");
    expect_same(shapes->normal_jacobian(q), formulas->normal_jacobian(q), "J_n");
    const Matrix ours = shapes->tangent_jacobian(q), theirs = formulas->tangent_jacobian(q);
    expect_same(ours * ours.transpose(), theirs * theirs.transpose(), "J_t");
  }
}

INSTANTIATE_TEST_SUITE_P(Geometry, SceneOfGeometry, testing::ValuesIn(geometric_scenes()),
                         [](const auto& scene) { return scene.param; });

TEST(GeometryFile, MovesLikeTheCompiledScene) {
  const auto file = read_scene_file(test_data("rocking_block_geometry.json")), scene = make_problem("rocking_block");
  Settings settings;
  settings.steps = 150;
  const auto method = make_method("fesd:radau-iia:3");
  const Solution a = method->solve(*file, settings), b = method->solve(*scene, settings);
  ASSERT_TRUE(a.succeeded() && b.succeeded()) << a.message << b.message;
  ASSERT_EQ(a.events.size(), b.events.size());
  EXPECT_LE((a.q - b.q).cwiseAbs().maxCoeff(), 1e-10);  // rounding, grown by a few impacts
  EXPECT_LE((a.v - b.v).cwiseAbs().maxCoeff(), 1e-10);
}

TEST(GeometryFile, FollowsTheParametersOfTheFile) {
  const auto file = read_scene_file(test_data("rocking_block_geometry.json"), {{"b", 0.2}});
  EXPECT_EQ(file->info().geometry->shapes[1].size[0], 0.2);
  EXPECT_DOUBLE_EQ(file->mass_matrix(file->info().q0)(2, 2), (0.2 * 0.2 + 0.4 * 0.4) / 3);
}

TEST(GeometryFile, IsWrittenAsItWasRead) {
  for (const char* id : {"box_3d", "kane_pendulum", "two_balls_spring", "falling_rod"}) {
    const auto problem = make_problem(id);
    const json scene = exported(*problem);
    const auto again = read_scene_text(scene.dump(), id);
    EXPECT_EQ(exported(*again)["geometry"], scene["geometry"]) << id;
    EXPECT_EQ(exported(*again)["contacts"], scene["contacts"]) << id;
  }
}

/// What the reader says of the rocking block after `spoil` has changed it.
std::string message_of(const std::function<void(json&)>& spoil) {
  json scene = exported(*read_scene_file(test_data("rocking_block_geometry.json")));
  for (const char* field : {"M", "f", "potential_energy"}) scene.erase(field);
  for (json& contact : scene["contacts"]) contact.erase("gap");
  spoil(scene);
  try {
    read_scene_text(scene.dump(), "file");
  } catch (const InputError& error) {
    return error.what();
  }
  return "";
}

TEST(GeometryFile, RefusesWhatIsNoGeometry) {
  const auto expect = [](const std::function<void(json&)>& spoil, const char* words) {
    EXPECT_NE(message_of(spoil).find(words), std::string::npos) << message_of(spoil) << "\ninstead of\n" << words;
  };
  expect([](json&) {}, "");
  expect([](json& s) { s["geometry"]["bodies"][0]["mass"] = "-1"; }, "geometry.bodies[0].mass = -1: a number >= 0");
  expect([](json& s) { s["geometry"]["bodies"][0]["position"][0] = "2*q[0]"; },
         "geometry.bodies[0].position[0] = 2*q[0]: q[k], q[k] + a constant, or a constant");
  expect([](json& s) { s["geometry"]["bodies"][0].erase("angles"); },
         "geometry.bodies[0].angles: this field is missing");
  expect([](json& s) { s["geometry"]["bodies"][0]["rotation"] = "none"; }, "with rotation none has no angles");
  expect([](json& s) { s["geometry"]["bodies"][0]["parent"] = "block"; }, "'block': unknown");
  expect([](json& s) { s["geometry"]["shapes"][1]["body"] = "blok"; }, "did you mean block?");
  expect([](json& s) { s["geometry"]["shapes"][1]["size"] = json{"b"}; }, "2 are required");
  expect([](json& s) { s["geometry"]["shapes"][1]["name"] = "ground"; }, "a name that no other shape has");
  expect(
      [](json& s) {
        s["contacts"][0]["shapes"] = {"block", "ground"};
      },
      "a half-space must be the first of two shapes");
  expect([](json& s) { s["contacts"][0].erase("corner"); }, "contacts[0].corner: this field is missing");
  expect([](json& s) { s["contacts"][0]["corner"] = {1}; },
         "contacts[0].corner, number of entries = 1: 2 are required");
  expect([](json& s) { s["contacts"][0].erase("shapes"); }, "contacts[0].gap: this field is missing");
  expect([](json& s) { s.erase("geometry"); }, "M: this field is missing");
}

TEST(GeometryFile, RefusesAGapThatIsNotThatOfTheShapes) {
  EXPECT_NE(message_of([](json& s) {
              s["contacts"][0]["gap"] = "q[1]";
            }).find("contacts[0].gap = q[1]: that of the shapes is"),
            std::string::npos);
  EXPECT_EQ(message_of([](json& s) { s["contacts"][0]["gap"] = "q[1]-b*sin(q[2])-h*cos(q[2])"; }), "");
}

TEST(GeometryFile, RefusesABallWhoseTurnWouldShow) {
  const auto ball = make_problem("ball_3d");
  json scene = exported(*ball);
  scene["geometry"]["shapes"].push_back(
      {{"kind", "sphere"}, {"body", "ball"}, {"size", {"R"}}, {"position", {"R", "0", "0"}}});
  EXPECT_THROW(read_scene_text(scene.dump(), "file"), InputError);
}

}  // namespace
}  // namespace ricochet
