#include "problems/assembly/scene_parameters.h"

namespace ricochet {
namespace {

// n beads of radius R in a tube, thrown at a wall, which gravity pulls them to.
//
//    |o o o o  <- v_0, g       m x_i'' = -m g + lambda_n^i - lambda_n^{i+1},   f_c^1 = x_1 - R,
//    | 1 2 3 4                                                                 f_c^i = x_i - x_{i-1} - 2 R
//
// Without restitution all of them stay where they meet: n contacts, each body in two.

template <class T>
struct BeadAtWall : ContactScene<T, 1> {
  Vec<T, 1> gap(const Vec<T, 1>& q) const { return {q[0] - this->size}; }
};

template <class T>
struct BeadAtBead : ContactScene<T, 2> {
  Vec<T, 1> gap(const Vec<T, 2>& q) const { return {q[1] - q[0] - 2 * this->size}; }
};

template <class T>
struct BeadRow {
  static constexpr SceneText text{"bead_row", "a row of n beads thrown at a wall",
                                  "closed form for e = 0: all come to rest",
                                  "n contacts in a chain: cost of a method per contact"};

  static void assemble(AssemblyOf<T>& row, const SceneParametersOf<T>& p) {
    const int n = p.count("n", 1, 10000);
    const T m = p.positive("m"), R = p.positive("R");
    const auto wall = row.add_kind(BeadAtWall<T>{{R, p["e"]}});
    const auto pair = row.add_kind(BeadAtBead<T>{{R, p["e"]}});
    for (int i = 0; i < n; ++i)
      row.add_coordinate(m, -m * p["g"], p["distance"] + R + i * (2 * R + p["spacing"]), -p["speed"]);
    row.add_contact(wall, {0}, "wall");
    for (int i = 1; i < n; ++i) row.add_contact(pair, {i - 1, i}, fmt::format("beads {}, {}", i, i + 1));

    GeometryOf<T> geometry{.gravity = {-p["g"], 0, 0}};
    int neighbour = geometry.add_shape({.kind = ShapeKind::half_space, .angles = {0, 0, -quarter_turn<T>()}});
    for (int i = 0; i < n; ++i) {
      const int bead =
          geometry.add_body({.name = fmt::format("bead {}", i + 1), .mass = m, .position = {{{i}, {}, {}}}});
      const int shape = geometry.add_shape({.kind = ShapeKind::sphere, .body = bead, .size = {R}});
      geometry.pairs.push_back({i, neighbour, shape});
      neighbour = shape;
    }
    row.set_geometry(std::move(geometry));
  }
};

const bool bead_row_registered = register_assembled_scene<BeadRow>({{"n", 8, "1"},
                                                                    {"m", 0.5, "kg"},
                                                                    {"R", 0.05, "m"},
                                                                    {"g", 9.81, "m/s^2"},
                                                                    {"e", 0, "1"},
                                                                    {"distance", 0.05, "m"},
                                                                    {"spacing", 0.001, "m"},
                                                                    {"speed", 1, "m/s"},
                                                                    {"duration", 0.5, "s"}});

}  // namespace
}  // namespace ricochet
