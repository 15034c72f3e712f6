#include "problems/assembly/scene_parameters.h"

namespace ricochet {
namespace {

// n blocks on top of each other on rough ground; each slides on the one below.
//
//     [___]->    q = (x_1, y_1, ..., x_n, y_n),   m v' = (0, -m g) + contacts,
//    [___]->     f_c^i = y_i - y_{i-1} - H,   v_t^i = x_i' - x_{i-1}',   ground: y_0 = -H / 2, x_0 = 0
//     [___]
//   ---------
//
// Blocks do not tip. Block i starts with the speed i speed / n, so every contact slips until friction stops it.

template <class T>
struct BlockOnGround : ContactScene<T, 2> {
  Vec<T, 1> gap(const Vec<T, 2>& q) const { return {q[1] - this->size / 2}; }
  std::array<std::array<Vec<T, 2>, 1>, 1> tangents(const Vec<T, 2>&) const { return {{{{{1, 0}}}}}; }
};

template <class T>
struct BlockOnBlock : ContactScene<T, 4> {
  Vec<T, 1> gap(const Vec<T, 4>& q) const { return {q[3] - q[1] - this->size}; }
  std::array<std::array<Vec<T, 4>, 1>, 1> tangents(const Vec<T, 4>&) const { return {{{{{-1, 0, 1, 0}}}}}; }
};

template <class T>
struct BlockColumn {
  static constexpr SceneText text{"block_column", "a column of n blocks that slide on each other", "Coulomb friction",
                                  "n contacts with friction, loads that grow with the height"};

  static void assemble(AssemblyOf<T>& column, const SceneParametersOf<T>& p) {
    const int n = p.count("n", 1, 10000);
    const T H = p.positive("H");
    const auto ground = column.add_kind(BlockOnGround<T>{{H, p["e"], p["mu"]}});
    const auto pair = column.add_kind(BlockOnBlock<T>{{H, p["e"], p["mu"]}});
    GeometryOf<T> geometry{.gravity = {0, -p["g"], 0}};
    int below = geometry.add_shape({.kind = ShapeKind::half_space});
    T m = p.positive("m");
    for (int i = 0; i < n; ++i, m *= p.positive("ratio")) {  // ratio: of a block's mass to that of the one below
      column.add_coordinate(m, 0, 0, p["speed"] * (i + 1) / n);
      column.add_coordinate(m, -m * p["g"], H / 2 + i * H, 0);
      const int block = geometry.add_body(
          {.name = fmt::format("block {}", i + 1), .mass = m, .position = {{{2 * i}, {2 * i + 1}, {}}}});
      const int box = geometry.add_shape({.kind = ShapeKind::box, .body = block, .size = {H, H / 2, H}});
      geometry.pairs.push_back({i, below, box});
      below = box;
    }
    column.add_contact(ground, {0, 1}, "ground");
    for (int i = 1; i < n; ++i)
      column.add_contact(pair, {2 * i - 2, 2 * i - 1, 2 * i, 2 * i + 1}, fmt::format("blocks {}, {}", i, i + 1));
    column.set_geometry(std::move(geometry));
  }
};

const bool block_column_registered = register_assembled_scene<BlockColumn>({{"n", 2, "1"},
                                                                            {"m", 1, "kg"},
                                                                            {"H", 0.1, "m"},
                                                                            {"g", 9.81, "m/s^2"},
                                                                            {"e", 0, "1"},
                                                                            {"mu", 0.5, "1"},
                                                                            {"speed", 1, "m/s"},
                                                                            {"ratio", 1, "1"},
                                                                            {"duration", 0.5, "s"}});

}  // namespace
}  // namespace ricochet
