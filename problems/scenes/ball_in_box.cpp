#include "problems/scene.h"

namespace ricochet {
namespace {

// A disc with spin that bounces between the four rough walls of a box, in the plane.
//
//    ___________       m x'' = ...,  m y'' = -m g + ...,  J phi'' = R sum +-lambda_t,   J = m R^2 / 2
//   |     _     |
//   |    ( ) -> | H    left   f_c = x - R        v_t = y' - R phi'
//   |           |      right  f_c = W - x - R    v_t = y' + R phi'
//   |___________|      floor  f_c = y - R        v_t = x' + R phi'
//         W            roof   f_c = H - y - R    v_t = x' - R phi'
//
// q[0] and q[1] are the centre (x, y), q[2] is the angle phi.
template <class T>
struct BallInBox {
  static constexpr SceneText text{"ball_in_box", "disc with spin in a box with four rough walls",
                                  "Newton restitution with Coulomb friction on the impulse",
                                  "oblique impacts that exchange spin and velocity, on walls of every direction"};

  T m{1.0}, R{0.1}, g{9.81}, W{1.0}, H{0.8}, e{0.8}, mu{0.2};
  T x0{0.3}, y0{0.4}, v_x0{2.5}, v_y0{1.5}, omega0{-10.0}, duration{1.2};

  void parameters(auto&& visit) {
    visit("m", m, "kg");
    visit("R", R, "m");
    visit("g", g, "m/s^2");
    visit("W", W, "m");
    visit("H", H, "m");
    visit("e", e, "1");
    visit("mu", mu, "1");
    visit("x0", x0, "m");
    visit("y0", y0, "m");
    visit("v_x0", v_x0, "m/s");
    visit("v_y0", v_y0, "m/s");
    visit("omega0", omega0, "rad/s");
    visit("duration", duration, "s");
  }

  Vec<T, 3> q0() const { return {x0, y0, 0}; }
  Vec<T, 3> v0() const { return {v_x0, v_y0, omega0}; }
  T end_time() const { return duration; }

  Vec<T, 3> mass() const { return {m, m, m * R * R / 2}; }
  Vec<T, 3> force(const Vec<T, 3>&, const Vec<T, 3>&) const { return {0, -m * g, 0}; }
  std::array<Contact<T>, 4> contacts() const {
    return {{{"left", e, mu}, {"right", e, mu}, {"floor", e, mu}, {"roof", e, mu}}};
  }
  Vec<T, 4> gap(const Vec<T, 3>& q) const { return {q[0] - R, W - q[0] - R, q[1] - R, H - q[1] - R}; }
  std::array<std::array<Vec<T, 3>, 1>, 4> tangents(const Vec<T, 3>&) const {
    return {{{{{0, 1, -R}}}, {{{0, 1, R}}}, {{{1, 0, R}}}, {{{1, 0, -R}}}}};
  }
  T potential_energy(const Vec<T, 3>& q) const { return m * g * q[1]; }

  GeometryOf<T> geometry() const {
    GeometryOf<T> geometry{.gravity = {0, -g, 0}};
    const int disc = geometry.add_body({.name = "disc",
                                        .mass = m,
                                        .inertia = {0, 0, m * R * R / 2},
                                        .position = {{{0}, {1}, {}}},
                                        .rotation = BodyRotation::planar,
                                        .angles = {{{2}, {}, {}}}});
    const int shape = geometry.add_shape({.kind = ShapeKind::sphere, .body = disc, .size = {R}});
    const T quarter = quarter_turn<T>();
    const auto add_wall = [&](int contact, const T& x, const T& y, const T& angle) {
      const int wall =
          geometry.add_shape({.kind = ShapeKind::half_space, .position = {x, y, 0}, .angles = {0, 0, angle}});
      geometry.pairs.push_back({contact, wall, shape});
    };
    add_wall(0, 0, 0, -quarter);
    add_wall(1, W, 0, quarter);
    add_wall(2, 0, 0, 0);
    add_wall(3, 0, H, 2 * quarter);
    return geometry;
  }
};

const bool ball_in_box_registered = register_scene<BallInBox>();

}  // namespace
}  // namespace ricochet
