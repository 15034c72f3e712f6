#include "problems/scene.h"

namespace ricochet {
namespace {

// The pendulum of pendulum_wall in Cartesian coordinates: a point mass on a rod, a bilateral constraint.
//
//      +          q = (x, y)
//   |   \         m x'' =        (x / l) lambda_rod + lambda_wall
//   |    \ l      m y'' = -m g + (y / l) lambda_rod
//   |     o       f_rod = (x^2 + y^2 - l^2) / (2 l) = 0,   f_wall = x + w
//
// q[0] and q[1] are the place (x, y) of the mass from the pivot. The rod pulls with -lambda_rod, and the angle
// atan2(x, -y) moves as in pendulum_wall.
template <class T>
struct PendulumWallCartesian {
  static constexpr SceneText text{"pendulum_wall_cartesian",
                                  "pendulum on a rod that hits a wall, in Cartesian coordinates",
                                  "mathematical pendulum as a point mass with a bilateral constraint",
                                  "a curved bilateral constraint, which transmits the impact"};

  T m{1.0}, g{9.81}, l{0.8}, w{0.3}, e{0.7}, theta0{1.2}, duration{3.0};

  void parameters(auto&& visit) {
    visit("m", m, "kg");
    visit("g", g, "m/s^2");
    visit("l", l, "m");
    visit("w", w, "m");
    visit("e", e, "1");
    visit("theta0", theta0, "rad");
    visit("duration", duration, "s");
  }

  Vec<T, 2> q0() const {
    using std::sin, std::cos;
    return {l * sin(theta0), -l * cos(theta0)};
  }
  Vec<T, 2> v0() const { return {0, 0}; }
  T end_time() const { return duration; }

  Vec<T, 2> mass() const { return {m, m}; }
  Vec<T, 2> force(const Vec<T, 2>&, const Vec<T, 2>&) const { return {0, -m * g}; }
  std::array<Contact<T>, 2> contacts() const { return {{{"wall", e}, joint<T>("rod")}}; }
  Vec<T, 2> gap(const Vec<T, 2>& q) const { return {q[0] + w, (q[0] * q[0] + q[1] * q[1] - l * l) / (2 * l)}; }
  T potential_energy(const Vec<T, 2>& q) const { return m * g * q[1]; }

  GeometryOf<T> geometry() const {
    GeometryOf<T> geometry{.gravity = {0, -g, 0}};
    const int bob = geometry.add_body({.name = "bob", .mass = m, .position = {{{0}, {1}, {}}}});
    const int wall = geometry.add_shape(
        {.kind = ShapeKind::half_space, .position = {-w, 0, 0}, .angles = {0, 0, -quarter_turn<T>()}});
    geometry.pairs = {{0, wall, geometry.add_shape({.kind = ShapeKind::sphere, .body = bob})}};
    geometry.links = {{-1, bob}};
    return geometry;
  }
};

const bool pendulum_wall_cartesian_registered = register_scene<PendulumWallCartesian>();

}  // namespace
}  // namespace ricochet
