// Physics engines as methods: the mapping of scenes, what their settings do, and what is a failed run.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <map>
#include <memory>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include "bench/plugin/load_plugins.h"
#include "methods/peers/engines/engine_method.h"
#include "methods/registry.h"
#include "problems/geometry_kinematics.h"
#include "problems/input_error.h"
#include "problems/registry.h"
#include "problems/scene_file/scene_file.h"

namespace ricochet {
namespace {

const std::vector<std::string> kEngines{"bullet", "ode", "mujoco", "box2d"};

void load_engines() {
  static const bool loaded = [] {
    std::vector<std::string> none;
    load_plugins(none);
    return true;
  }();
  ASSERT_TRUE(loaded);
}

bool is_built(const std::string& engine) {
  load_engines();
  for (const auto& entry : methods()) {
    if (entry.name == engine) return static_cast<bool>(entry.make);
  }
  ADD_FAILURE() << engine << " is not in the list of methods, built or not";
  return false;
}

Settings stepping(int steps) {
  Settings settings;
  settings.steps = steps;
  return settings;
}

class Engine : public testing::TestWithParam<std::string> {
 protected:
  void SetUp() override {
    if (!is_built(GetParam())) GTEST_SKIP() << GetParam() << " is not installed";
  }
  static std::unique_ptr<EngineMethod> made(const std::string& spec) {
    auto method = make_method(spec);
    auto* const engine = dynamic_cast<EngineMethod*>(method.get());
    EXPECT_TRUE(engine) << spec;
    if (engine) static_cast<void>(method.release());
    return std::unique_ptr<EngineMethod>(engine);
  }
};

/// Moves `q` until contact i has the gap `wanted`.
void move_to_gap(const Problem& problem, int i, double wanted, Vector& q) {
  for (int k = 0; k < 20; ++k) {
    const Vector gradient = problem.normal_jacobian(q).col(i);
    q -= gradient * (problem.gap(q)[i] - wanted) / gradient.squaredNorm();
  }
}

/// Two bodies, -1 for the world, whose shapes may touch.
using BodyPair = std::pair<int, int>;
/// The least gap of two bodies.
using BodyGaps = std::map<BodyPair, double>;

void add_gap(const EngineScene& scene, int first, int second, double gap, BodyGaps& gaps) {
  double& least = gaps.try_emplace({scene.shape(first).body, scene.shape(second).body}, HUGE_VAL).first->second;
  least = std::min(least, gap);
}

BodyGaps gaps_of_scene(const EngineScene& scene, const Vector& q) {
  BodyGaps gaps;
  const Vector f_c = scene.problem().gap(q);
  for (const ShapePair& pair : scene.geometry().pairs) add_gap(scene, pair.first, pair.second, f_c[pair.contact], gaps);
  return gaps;
}

/// What the engine finds to touch or nearly so.
BodyGaps gaps_of_engine(const EngineScene& scene, const EngineMethod& engine) {
  const std::vector<double> found = engine.gaps(scene.problem());
  BodyGaps gaps;
  for (std::size_t k = 0; k < found.size(); ++k) {
    if (!std::isnan(found[k])) add_gap(scene, scene.pairs()[k].first, scene.pairs()[k].second, found[k], gaps);
  }
  return gaps;
}

/// Corners of a box that Box2D rounds by its skin.
bool has_turning_box(const Geometry& geometry) {
  return std::ranges::any_of(geometry.shapes, [&](const BodyShape& shape) {
    return shape.kind == ShapeKind::box && shape.body >= 0 &&
           geometry.bodies[static_cast<std::size_t>(shape.body)].rotation != BodyRotation::none;
  });
}

TEST_P(Engine, FindsTheGapsOfTheScene) {
  const auto engine = made(GetParam() + ":tuned");
  std::mt19937 random(7);
  std::uniform_real_distribution<double> any(-1, 1);
  int compared = 0;
  for (const auto& entry : scenes()) {
    const auto problem = make_problem(entry.id);
    const ProblemInfo& info = problem->info();
    if (!engine->can_run(info).ok) continue;
    const EngineScene scene(*problem);
    // Single precision, with edges 100 m long; Bullet rounds edges by its margin of 1e-6 m and its planes by as much.
    double tolerance = GetParam() == "box2d" ? 2e-5 : GetParam() == "bullet" ? 5e-6 : 1e-9;
    if (GetParam() == "box2d" && has_turning_box(scene.geometry())) tolerance = 0.01 * (std::sqrt(2.0) - 1);
    // A body stays above another one's upper face.
    const bool has_faces = std::ranges::any_of(
        scene.pairs(), [&](const EnginePair& pair) { return scene.shape(pair.first).kind == ShapeKind::box; });
    const double spread = has_faces ? 0.01 : 0.3;
    for (int sample = 0; sample < 8; ++sample) {
      Vector q = info.q0;
      for (double& x : q) x += spread * any(random);
      const int contact = static_cast<int>(random() % static_cast<unsigned>(info.n_c()));
      move_to_gap(*problem, contact, 0.004 * any(random), q);
      problem->set_initial_state(q, info.v0);
      const BodyGaps ours = gaps_of_scene(scene, q);
      for (const auto& [bodies, gap] : gaps_of_engine(scene, *engine)) {
        double expected = ours.at(bodies);
        if (std::abs(expected) > 0.004) continue;  // deep inside, another face may be nearer
        // MuJoCo 2.2.2 finds half the depth of two boxes that overlap.
        if (GetParam() == "mujoco" && has_faces && bodies.first >= 0 && expected < 0) expected /= 2;
        EXPECT_NEAR(gap, expected, tolerance)
            << entry.id << ", bodies " << bodies.first << " and " << bodies.second << ", q = " << q.transpose();
        ++compared;
      }
    }
  }
  EXPECT_GT(compared, 60);
}

// Largest error of (z, v) of the ball at T = 1 s, as programs without this project measured it.
struct Measured {
  std::string spec;
  int steps;
  double error;
};

/// A slider and a wheel that dry friction stops: bounds along one coordinate are joints' frictionloss in MuJoCo.
std::unique_ptr<Problem> braked_bodies(const std::string& elements) {
  return read_scene_text(R"~({"params": {"J": "0.4"}, "q0": ["0", "0"], "v0": ["1", "3"], "T": "1",
  "geometry": {"bodies": [{"name": "slider", "mass": "2", "position": ["q[0]", "0"]},
                          {"name": "wheel", "mass": "1", "inertia": ["J"], "position": ["0", "5"],
                           "rotation": "planar", "angles": ["q[1]"]}],
               "shapes": [{"name": "slider", "kind": "sphere", "body": "slider", "size": ["0.1"]},
                          {"name": "wheel", "kind": "sphere", "body": "wheel", "size": ["0.1"]}]},
  "friction": [)~" + elements +
                             "]}",
                         "scene");
}

TEST(Engines, MujocoHasFrictionOfJoints) {
  if (!is_built("mujoco")) GTEST_SKIP() << "MuJoCo was not found";
  const std::string guide = R"({"name": "guide", "Jt": [["1", "0"]], "bound": "3"})",
                    twice = R"({"name": "brake", "Jt": [["0", "2"]], "bound": "0.5"})";
  const auto problem = braked_bodies(guide + "," + twice);
  const Solution s = make_method("mujoco:tuned")->solve(*problem, stepping(4000));
  ASSERT_TRUE(s.succeeded()) << s.message;
  // At decelerations of 3 N / 2 kg and 2 * 0.5 N m / 0.4 kg m^2; its constraints are soft.
  EXPECT_NEAR(s.q[0], 1 / (2 * 1.5), 1e-3);
  EXPECT_NEAR(s.q[1], 3 - 2.5 / 2, 1e-3) << "it still turns";
  EXPECT_NEAR(s.v[0], 0, 1e-3);
  EXPECT_NEAR(s.v[1], 0.5, 1e-3);
  EXPECT_TRUE(make_method("mujoco")->solve(*problem, stepping(4000)).succeeded());
  for (const char* other : {R"({"name": "a", "Jt": [["1", "1"]], "bound": "3"})",
                            R"({"name": "a", "Jt": [["1", "0"]], "bound": "3+v[0]**2"})"})
    EXPECT_FALSE(make_method("mujoco")->can_run(braked_bodies(other)->info()).ok) << other;
  for (const char* engine : {"bullet", "ode", "box2d"}) {
    if (is_built(engine)) EXPECT_FALSE(make_method(engine)->can_run(problem->info()).ok) << engine;
  }
}

TEST(Engines, MakeTheErrorsOfProgramsThatUseThemDirectly) {
  load_engines();
  const auto problem = make_problem("bouncing_ball", {{"r", 0.2}, {"e", 0.8}, {"duration", 1}});
  // Three bounces, exactly: g = 9.81, from 1 m.
  const double g = 9.81, first = std::sqrt(2 * 0.8 / g);
  double v = 0.8 * g * first, left = 1 - first;
  while (left > 2 * v / g) {
    left -= 2 * v / g;
    v *= 0.8;
  }
  const double z = 0.2 + v * left - g * left * left / 2;
  v -= g * left;
  const std::vector<Measured> all{
      {"bullet", 100, 1.2e-1},        {"bullet", 1600, 2.7},         {"bullet:tuned", 400, 4.5e-2},
      {"bullet:tuned", 6400, 2.4e-3}, {"ode", 1600, 4.3e-3},         {"ode:tuned", 6400, 2.4e-3},
      {"mujoco", 1600, 2.7},          {"mujoco:tuned", 400, 5.0e-1}, {"mujoco:tuned", 25600, 1.9e-2},
      {"box2d:tuned", 100, 1.1e-1},   {"box2d:tuned", 6400, 3.7e-3}};
  for (const auto& [spec, steps, error] : all) {
    if (!is_built(spec.substr(0, spec.find(':')))) continue;
    const Solution s = make_method(spec)->solve(*problem, stepping(steps));
    ASSERT_TRUE(s.succeeded()) << spec << ": " << s.message;
    const double ours = std::max(std::abs(s.q[0] - z), std::abs(s.v[0] - v));
    EXPECT_NEAR(ours, error, 0.06 * error) << spec << ", " << steps << ": two digits are known";
    EXPECT_GT(s.own_seconds, 0);
  }
}

TEST_P(Engine, GivesBackTheStateItStartedFrom) {
  const auto engine = made(GetParam());
  const double tolerance = GetParam() == "box2d" ? 1e-6 : 1e-13;  // rounding to single and double precision
  for (const auto& entry : scenes()) {
    const auto problem = make_problem(entry.id);
    if (!engine->can_run(problem->info()).ok) continue;
    const EngineScene scene(*problem);
    Vector q = problem->info().q0, v = problem->info().v0;
    const auto states = scene.states_of(q, v);
    scene.coordinates_of(states, 0, q, v);
    EXPECT_LT((q - problem->info().q0).norm() + (v - problem->info().v0).norm(), tolerance * (10 + v.norm()))
        << entry.id;
  }
}

TEST(Engines, ABodyThatTurnsInTheAirKeepsItsAngularMomentumAsWellAsTheSchemeDoes) {
  load_engines();
  const auto problem = make_problem("box_3d", {{"height", 100}, {"duration", 1}});
  const auto momentum = [&](const Vector& q, const Vector& v) {
    const Body& body = problem->info().geometry->bodies[0];
    const EngineScene scene(*problem);
    const BodyState state = scene.states_of(q, v)[0];
    Vector3<double> local = times_transposed(state.pose.R, state.omega);
    for (std::size_t k = 0; k < 3; ++k) local[k] *= body.inertia[k];
    return times(state.pose.R, local);
  };
  const auto error = [&](const std::string& spec, int steps) {
    const Solution s = make_method(spec)->solve(*problem, stepping(steps));
    EXPECT_TRUE(s.succeeded()) << spec << ": " << s.message;
    const auto d = difference(momentum(s.q, s.v), momentum(problem->info().q0, problem->info().v0));
    return std::sqrt(dot(d, d));
  };
  for (const std::string engine : {"bullet", "ode", "mujoco"}) {
    if (!is_built(engine)) continue;
    const double ratio = error(engine, 200) / error(engine, 800);
    EXPECT_NEAR(ratio, 4, 0.4) << engine << " is of first order";
  }
  if (is_built("mujoco")) {
    const double ratio = error("mujoco:tuned", 200) / error("mujoco:tuned", 800);
    EXPECT_NEAR(ratio, 16, 1.6) << "RK4 is of second order, since it averages angular velocities";
  }
}

TEST(Engines, WhatTheyComplainOfIsAFailedRun) {
  load_engines();
  if (!is_built("ode")) GTEST_SKIP();
  const auto file = std::filesystem::temp_directory_path() / "ricochet_ode_settings.json";
  std::ofstream(file) << R"({"settings": {"cfm": 0, "erp": 0}})";
  const auto problem = make_problem("stacked_blocks");
  const Solution s = make_method("ode:@" + file.string())->solve(*problem, stepping(400));
  EXPECT_EQ(s.status, Status::inner_solver_failed);
  EXPECT_NE(s.message.find("LCP internal error"), std::string::npos) << s.message;
  std::filesystem::remove(file);
}

TEST_P(Engine, DeclinesWhatItCannotBeTold) {
  const auto engine = made(GetParam());
  EXPECT_FALSE(engine->can_run(make_problem("pendulum_wall")->info()).ok);
  EXPECT_FALSE(engine->can_run(make_problem("double_pendulum_wall")->info()).ok);
  EXPECT_EQ(engine->can_run(make_problem("box_3d")->info()).ok, GetParam() != "box2d");
  EXPECT_TRUE(engine->can_run(make_problem("two_balls_spring")->info()).ok);
}

TEST_P(Engine, IsToldOfSprings) {
  // Two balls and their spring in the air: without the spring they would be 0.1 m and more from where they are.
  const auto problem = make_problem("two_balls_spring", {{"height", 100}, {"duration", 0.5}});
  const Solution truth = make_method("event_driven")->solve(*problem, [] {
    Settings settings;
    settings.tolerance = 1e-10;
    return settings;
  }());
  const Solution s = made(GetParam())->solve(*problem, stepping(2000));
  ASSERT_TRUE(s.succeeded()) << s.message;
  EXPECT_LT((s.q - truth.q).norm(), 0.01) << "engines are of first order";
}

INSTANTIATE_TEST_SUITE_P(All, Engine, testing::ValuesIn(kEngines), [](const auto& param) { return param.param; });

}  // namespace
}  // namespace ricochet
