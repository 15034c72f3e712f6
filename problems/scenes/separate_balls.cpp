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

template <class T>
struct SeparateBalls {
  static constexpr SceneText text{"separate_balls", "n balls over a floor, some fall and the others lie", "closed form",
                                  "events of one contact among many others"};

  static void assemble(AssemblyOf<T>& balls, const SceneParametersOf<T>& p) {
    const int n = p.count("n", 1, 10000), falling = p.count("falling", 0, n);
    const T m = p.positive("m"), R = p.positive("R"), H = p.positive("H");
    const auto floor = balls.add_kind(BallOnFloor<T>{{R, p["e"]}});
    GeometryOf<T> geometry{.gravity = {0, -p["g"], 0}};
    const int ground = geometry.add_shape({.kind = ShapeKind::half_space});
    for (int i = 0; i < n; ++i) {
      balls.add_coordinate(m, -m * p["g"], i < falling ? R + H * (i + 1) / falling : R, 0);
      const std::string name = fmt::format("ball {}", i + 1);
      balls.add_contact(floor, {i}, name);
      const int ball = geometry.add_body({.name = name, .mass = m, .position = {{{-1, 3 * R * i}, {i}, {}}}});
      geometry.pairs.push_back({i, ground, geometry.add_shape({.kind = ShapeKind::sphere, .body = ball, .size = {R}})});
    }
    balls.set_geometry(std::move(geometry));
  }
};

const bool separate_balls_registered = register_assembled_scene<SeparateBalls>({{"n", 4, "1"},
                                                                                {"falling", 1, "1"},
                                                                                {"m", 0.2, "kg"},
                                                                                {"R", 0.05, "m"},
                                                                                {"g", 9.81, "m/s^2"},
                                                                                {"e", 0.5, "1"},
                                                                                {"H", 0.2, "m"},
                                                                                {"duration", 0.25, "s"}});

}  // namespace
}  // namespace ricochet
