#include "problems/assembly/scene_parameters.h"

namespace ricochet {
namespace {

// A block on n feet that slides on rough ground, in the plane.
//
//      ___________        q = (x, y, theta): centre and angle,   m, J = m (a^2 + c^2) / 3
//     |     +     | ->    foot i at s_i = -a + 2 a (i - 1) / (n - 1) along the block, c below its centre:
//     |_._._._._._|         f_c^i = y + s_i sin(theta) - c cos(theta)
//   ________________        v_t^i = x' + (c cos(theta) - s_i sin(theta)) theta'
//
// n closed contacts on three coordinates: n - 2 normal forces and n - 1 friction forces are redundant, the motion is
// not. While mu c < a all feet stay down, the block brakes by mu g and stops after v_x0^2 / (2 mu g).

template <class T>
struct FootOnGround : ContactScene<T, 3> {
  T s{0.0};
  void parameters(auto&& visit) {
    ContactScene<T, 3>::parameters(visit);
    visit("s", s, "m");
  }
  Vec<T, 1> gap(const Vec<T, 3>& q) const {
    using std::sin, std::cos;
    return {q[1] + s * sin(q[2]) - this->size * cos(q[2])};
  }
  std::array<std::array<Vec<T, 3>, 1>, 1> tangents(const Vec<T, 3>& q) const {
    using std::sin, std::cos;
    return {{{{{1, 0, this->size * cos(q[2]) - s * sin(q[2])}}}}};
  }
};

template <class T>
struct BlockOnFeet {
  static constexpr SceneText text{"block_on_feet", "a block that slides on n feet and stops",
                                  "Coulomb friction, closed form",
                                  "more contacts than coordinates: the motion is unique, the forces are not"};

  static void assemble(AssemblyOf<T>& block, const SceneParametersOf<T>& p) {
    const int n = p.count("n", 2, 1000);
    const T m = p.positive("m"), a = p.positive("a"), c = p.positive("c");
    block.add_coordinate(m, 0, 0, p["v_x0"]);
    block.add_coordinate(m, -m * p["g"], c, 0);
    block.add_coordinate(m * (a * a + c * c) / 3, 0, 0, 0);
    GeometryOf<T> geometry{.gravity = {0, -p["g"], 0}};
    const int body = geometry.add_body({.name = "block",
                                        .mass = m,
                                        .inertia = {0, 0, m * (a * a + c * c) / 3},
                                        .position = {{{0}, {1}, {}}},
                                        .rotation = BodyRotation::planar,
                                        .angles = {{{2}, {}, {}}}});
    const int ground = geometry.add_shape({.kind = ShapeKind::half_space});
    geometry.add_shape({.kind = ShapeKind::box, .body = body, .size = {a, c, a}});
    for (int i = 0; i < n; ++i) {
      const T s = -a + 2 * a * i / (n - 1);
      const auto foot = block.add_kind(FootOnGround<T>{{c, p["e"], p["mu"]}, s});
      block.add_contact(foot, {0, 1, 2}, fmt::format("foot {}", i + 1));
      const int point = geometry.add_shape({.kind = ShapeKind::sphere, .body = body, .position = {s, -c, 0}});
      geometry.pairs.push_back({i, ground, point});
    }
    block.set_geometry(std::move(geometry));
  }
};

const bool block_on_feet_registered = register_assembled_scene<BlockOnFeet>({{"n", 8, "1"},
                                                                             {"m", 1, "kg"},
                                                                             {"a", 0.2, "m"},
                                                                             {"c", 0.05, "m"},
                                                                             {"g", 9.81, "m/s^2"},
                                                                             {"e", 0, "1"},
                                                                             {"mu", 0.3, "1"},
                                                                             {"v_x0", 0.8, "m/s"},
                                                                             {"duration", 0.5, "s"}});

}  // namespace
}  // namespace ricochet
