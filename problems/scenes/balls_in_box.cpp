#include <random>

#include "problems/assembly/scene_parameters.h"

namespace ricochet {
namespace {

// n discs fall into a box without friction.
//
//   |  o   o |     q = (x_1, y_1, ...),   m v' = (0, -m g) + contacts
//   | o o o  |     f_c = x - R,   L - R - x,   y - R,   |p_j - p_i| - 2 R of every pair
//   |________|
//
// They start on a grid of pitch 2.5 R, each with a velocity of its own, up to `speed` in each direction.

template <class T>
struct DiscAtWall : ContactScene<T, 1> {
  T at{0.0}, side{1.0};
  void parameters(auto&& visit) {
    ContactScene<T, 1>::parameters(visit);
    visit("at", at, "m");
    visit("side", side, "1");
  }
  Vec<T, 1> gap(const Vec<T, 1>& q) const { return {side * (q[0] - at) - this->size}; }
};

template <class T>
struct DiscAtDisc : ContactScene<T, 4> {
  Vec<T, 1> gap(const Vec<T, 4>& q) const {
    using std::sqrt;
    const T x = q[2] - q[0], y = q[3] - q[1];
    return {sqrt(x * x + y * y) - 2 * this->size};
  }
};

template <class T>
struct BallsInBox {
  static constexpr SceneText text{"balls_in_box", "n discs that fall into a box", "Newton restitution, no friction",
                                  "n (n - 1) / 2 + 3 n possible contacts, few of them active, all curved"};

  static void assemble(AssemblyOf<T>& box, const SceneParametersOf<T>& p) {
    const int n = p.count("n", 1, 1000);
    const T m = p.positive("m"), R = p.positive("R"), pitch = T(5) / 2 * R;
    const int per_row = static_cast<int>(std::ceil(std::sqrt(n)));
    const T L = per_row * pitch + R / 2;
    const auto left = box.add_kind(DiscAtWall<T>{{R, p["e"]}, 0, 1});
    const auto right = box.add_kind(DiscAtWall<T>{{R, p["e"]}, L, -1});
    const auto pair = box.add_kind(DiscAtDisc<T>{{R, p["e"]}});
    std::mt19937 random(static_cast<unsigned>(p.count("seed", 0, 1000000)));
    // Not std::uniform_real_distribution: its numbers differ between libraries.
    const auto velocity = [&] { return p["speed"] * (2.0 * random() / std::mt19937::max() - 1); };
    for (int i = 0; i < n; ++i) {
      box.add_coordinate(m, 0, T(3) / 2 * R + (i % per_row) * pitch, velocity());
      box.add_coordinate(m, -m * p["g"], T(3) / 2 * R + (i / per_row) * pitch, velocity());
    }
    GeometryOf<T> geometry{.gravity = {0, -p["g"], 0}};
    const T quarter = quarter_turn<T>();
    const int left_wall = geometry.add_shape({.kind = ShapeKind::half_space, .angles = {0, 0, -quarter}});
    const int right_wall =
        geometry.add_shape({.kind = ShapeKind::half_space, .position = {L, 0, 0}, .angles = {0, 0, quarter}});
    const int floor = geometry.add_shape({.kind = ShapeKind::half_space});
    std::vector<int> discs;
    for (int i = 0; i < n; ++i) {
      const int disc = geometry.add_body(
          {.name = fmt::format("disc {}", i + 1), .mass = m, .position = {{{2 * i}, {2 * i + 1}, {}}}});
      discs.push_back(geometry.add_shape({.kind = ShapeKind::sphere, .body = disc, .size = {R}}));
      const auto add = [&](auto kind, int coordinate, const char* where, int wall) {
        const int contact = box.add_contact(kind, {coordinate}, fmt::format("disc {}, {}", i + 1, where));
        geometry.pairs.push_back({contact, wall, discs.back()});
      };
      add(left, 2 * i, "left", left_wall);
      add(right, 2 * i, "right", right_wall);
      add(left, 2 * i + 1, "floor", floor);
    }
    for (int i = 0; i < n; ++i) {
      for (int j = i + 1; j < n; ++j) {
        const int contact =
            box.add_contact(pair, {2 * i, 2 * i + 1, 2 * j, 2 * j + 1}, fmt::format("discs {}, {}", i + 1, j + 1));
        geometry.pairs.push_back({contact, discs[i], discs[j]});
      }
    }
    box.set_geometry(std::move(geometry));
  }
};

const bool balls_in_box_registered = register_assembled_scene<BallsInBox>({{"n", 3, "1"},
                                                                           {"m", 0.1, "kg"},
                                                                           {"R", 0.05, "m"},
                                                                           {"g", 9.81, "m/s^2"},
                                                                           {"e", 0, "1"},
                                                                           {"speed", 0.5, "m/s"},
                                                                           {"seed", 1, "1"},
                                                                           {"duration", 1, "s"}});

}  // namespace
}  // namespace ricochet
