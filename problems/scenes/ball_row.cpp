#include "problems/scene.h"

namespace ricochet {
namespace {

// Four equal balls on a line; the first is thrown at the others.
//
//    o ->      o  o  o        m q_i'' = lambda_n^{i-1,i} - lambda_n^{i,i+1},   f_c = q_{i+1} - q_i - 2 R
//
// q[0] to q[3] are the centres from left to right. With a spacing the impacts follow one another: for e = 1 each ball
// hands its velocity on and the last one carries it all. Without spacing all of them happen at one instant, and
// Newton's law is imposed at every contact at once.
template <class T>
struct BallRow {
  static constexpr SceneText text{"ball_row", "row of four balls, hit one after the other",
                                  "Newton restitution; momentum and, for e = 1, energy are conserved",
                                  "a chain of impacts, every contact between two moving bodies"};

  T m{0.5}, R{0.05}, e{0.8}, distance{0.4}, spacing{0.08}, speed{1.0}, duration{1.2};

  void parameters(auto&& visit) {
    visit("m", m, "kg");
    visit("R", R, "m");
    visit("e", e, "1");
    visit("distance", distance, "m");
    visit("spacing", spacing, "m");
    visit("speed", speed, "m/s");
    visit("duration", duration, "s");
  }

  Vec<T, 4> q0() const {
    const T second = distance + 2 * R, pitch = spacing + 2 * R;
    return {0, second, second + pitch, second + 2 * pitch};
  }
  Vec<T, 4> v0() const { return {speed, 0, 0, 0}; }
  T end_time() const { return duration; }

  Vec<T, 4> mass() const { return {m, m, m, m}; }
  Vec<T, 4> force(const Vec<T, 4>&, const Vec<T, 4>&) const { return {0, 0, 0, 0}; }
  std::array<Contact<T>, 3> contacts() const { return {{{"first", e}, {"second", e}, {"third", e}}}; }
  Vec<T, 3> gap(const Vec<T, 4>& q) const { return {q[1] - q[0] - 2 * R, q[2] - q[1] - 2 * R, q[3] - q[2] - 2 * R}; }
  T potential_energy(const Vec<T, 4>&) const { return 0; }

  GeometryOf<T> geometry() const {
    GeometryOf<T> geometry;
    for (int i = 0; i < 4; ++i) {
      const int ball =
          geometry.add_body({.name = fmt::format("ball {}", i + 1), .mass = m, .position = {{{i}, {}, {}}}});
      geometry.add_shape({.kind = ShapeKind::sphere, .body = ball, .size = {R}});
      if (i > 0) geometry.pairs.push_back({i - 1, i - 1, i});
    }
    return geometry;
  }
};

/// The same row with balls that touch.
template <class T>
struct BallRowTouching : BallRow<T> {
  static constexpr SceneText text{"ball_row_touching", "row of three touching balls, hit by a fourth",
                                  "Newton restitution at every contact at once",
                                  "one impact that involves three contacts"};

  BallRowTouching() { this->spacing = 0; }
};

const bool ball_row_registered = register_scene<BallRow>() && register_scene<BallRowTouching>();

}  // namespace
}  // namespace ricochet
