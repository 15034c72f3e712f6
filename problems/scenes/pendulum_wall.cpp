#include "problems/scene.h"

namespace ricochet {
namespace {

// A pendulum that swings against a vertical wall at x = -w.
//
//      +          m l^2 theta'' = -m g l sin(theta) + l cos(theta) lambda_n
//   |   \         x = l sin(theta),   f_c = x + w
//   |    \ theta
//   |     o
//
// q[0] is the angle theta from the vertical.
template <class T>
struct PendulumWall {
  static constexpr SceneText text{"pendulum_wall", "pendulum that hits a vertical wall",
                                  "mathematical pendulum, Newton restitution",
                                  "nonlinear force, nonlinear gap: J_n changes during the step"};

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

  Vec<T, 1> q0() const { return {theta0}; }
  Vec<T, 1> v0() const { return {0}; }
  T end_time() const { return duration; }

  Vec<T, 1> mass() const { return {m * l * l}; }
  Vec<T, 1> force(const Vec<T, 1>& q, const Vec<T, 1>&) const {
    using std::sin;
    return {-m * g * l * sin(q[0])};
  }
  std::array<Contact<T>, 1> contacts() const { return {{{"wall", e}}}; }
  Vec<T, 1> gap(const Vec<T, 1>& q) const {
    using std::sin;
    return {l * sin(q[0]) + w};
  }
  T potential_energy(const Vec<T, 1>& q) const {
    using std::cos;
    return -m * g * l * cos(q[0]);
  }

  GeometryOf<T> geometry() const {
    GeometryOf<T> geometry{.gravity = {0, -g, 0}};
    const T quarter = quarter_turn<T>();
    const int bob = geometry.add_body({.name = "bob",
                                       .mass = m,
                                       .rotation = BodyRotation::planar,
                                       .angles = {{{0, -quarter}, {}, {}}},  // its x is along the rod
                                       .centre_from_pivot = {l, 0, 0}});
    const int wall =
        geometry.add_shape({.kind = ShapeKind::half_space, .position = {-w, 0, 0}, .angles = {0, 0, -quarter}});
    geometry.pairs = {{0, wall, geometry.add_shape({.kind = ShapeKind::sphere, .body = bob})}};
    geometry.links = {{-1, bob}};
    return geometry;
  }
};

const bool pendulum_wall_registered = register_scene<PendulumWall>();

}  // namespace
}  // namespace ricochet
