#include "problems/scene.h"

namespace ricochet {
namespace {

// A ball with linear drag bounces on a table that shakes.
//
//      o          m y'' = -m g - c y' + lambda_n,   f_c = y - A sin(omega t)
//      |
//   =======  ^ A sin(omega t)
//
// q[0] is y, the height of the ball. The table is a surface that moves by itself, so df_c/dt = -A omega cos(omega t) is
// part of the impact law. The ball gains and loses energy with the phase of the table; neighbouring motions part from
// each other.
template <class T>
struct ShakenTable {
  static constexpr SceneText text{"shaken_table", "ball that bounces on a shaken table",
                                  "bouncing ball map: Holmes, J. Sound Vib. 84 (1982) 173-189",
                                  "impacts with a moving surface"};

  T m{1.0}, g{9.81}, c{0.5}, e{0.8}, A{0.02}, omega{25.0}, height{0.2}, duration{1.9};

  void parameters(auto&& visit) {
    visit("m", m, "kg");
    visit("g", g, "m/s^2");
    visit("c", c, "N s/m");
    visit("e", e, "1");
    visit("A", A, "m");
    visit("omega", omega, "rad/s");
    visit("height", height, "m");
    visit("duration", duration, "s");
  }

  Vec<T, 1> q0() const { return {height}; }
  Vec<T, 1> v0() const { return {0}; }
  T end_time() const { return duration; }

  Vec<T, 1> mass() const { return {m}; }
  Vec<T, 1> force(const Vec<T, 1>&, const Vec<T, 1>& v) const { return {-m * g - c * v[0]}; }
  std::array<Contact<T>, 1> contacts() const { return {{{"table", e}}}; }
  Vec<T, 1> gap(const Vec<T, 1>& q, const T& t) const {
    using std::sin;
    return {q[0] - A * sin(omega * t)};
  }

  /// The table where it is at t = 0: what moves by itself is no body.
  GeometryOf<T> geometry() const {
    GeometryOf<T> geometry{.gravity = {0, -g, 0}};
    const int ball = geometry.add_body({.name = "ball", .mass = m, .position = {{{}, {0}, {}}}});
    const int table = geometry.add_shape({.kind = ShapeKind::half_space});
    geometry.pairs = {{0, table, geometry.add_shape({.kind = ShapeKind::sphere, .body = ball})}};
    return geometry;
  }
};

const bool shaken_table_registered = register_scene<ShakenTable>();

}  // namespace
}  // namespace ricochet
