#include "problems/assembly/assembled_problem.h"
#include "problems/assembly/scene_parameters.h"

namespace ricochet {
namespace {

// n balls side by side over a floor, far from each other: the first `falling` of them fall, the others lie there.
//
//    o                   m z_i'' = -m g + lambda_n^i,   f_c^i = z_i - R
//      o
//   _______o_o_o_o_o_
//
// Falling ball i of k starts at the height i H / k. What has an impact of one ball to do with the others?

template <class T>
struct BallOnFloor : ContactScene<T, 1> {
  Vec<T, 1> gap(const Vec<T, 1>& q) const { return {q[0] - this->size}; }
};

constexpr SceneText kSeparateBallsText{"separate_balls", "n balls over a floor, some fall and the others lie",
                                       "closed form", "events of one contact among many others"};

std::unique_ptr<Problem> make_separate_balls(const SceneParameters& p) {
  const int n = p.count("n", 1, 10000), falling = p.count("falling", 0, n);
  const double m = p.positive("m"), R = p.positive("R"), H = p.positive("H");
  auto balls = std::make_unique<AssembledProblem>(kSeparateBallsText, p["duration"]);
  const auto floor = balls->add_kind<BallOnFloor>({{R, p["e"]}});
  GeometryOf<double> geometry{.gravity = {0, -p["g"], 0}};
  const int ground = geometry.add_shape({.kind = ShapeKind::half_space});
  for (int i = 0; i < n; ++i) {
    balls->add_coordinate(m, -m * p["g"], i < falling ? R + H * (i + 1) / falling : R, 0);
    const std::string name = fmt::format("ball {}", i + 1);
    balls->add_contact(floor, {i}, name);
    const int ball = geometry.add_body({.name = name, .mass = m, .position = {{{-1, 3 * R * i}, {i}, {}}}});
    geometry.pairs.push_back({i, ground, geometry.add_shape({.kind = ShapeKind::sphere, .body = ball, .size = {R}})});
  }
  balls->set_geometry(std::move(geometry));
  return balls;
}

const bool separate_balls_registered = register_assembled_scene(kSeparateBallsText,
                                                                {{"n", 4, "1"},
                                                                 {"falling", 1, "1"},
                                                                 {"m", 0.2, "kg"},
                                                                 {"R", 0.05, "m"},
                                                                 {"g", 9.81, "m/s^2"},
                                                                 {"e", 0.5, "1"},
                                                                 {"H", 0.2, "m"},
                                                                 {"duration", 0.25, "s"}},
                                                                make_separate_balls);

}  // namespace
}  // namespace ricochet
