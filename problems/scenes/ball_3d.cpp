#include "problems/scene.h"

namespace ricochet {
namespace {

// A ball with spin, thrown onto a rough plane in space.
//
//        _           m (x, y, z)'' = (lambda_t1, lambda_t2, lambda_n - m g)
//      (   ) ->      J omega' = (R lambda_t2, -R lambda_t1, 0),   J = 2/5 m R^2
//        -           f_c = z - R
//   ___________      v_t = (x' - R omega_y, y' + R omega_x)
//
// q[0] to q[2] are the centre (x, y, z), q[3] to q[5] the integrals of the angular velocity. These three are no
// orientation of the ball, but none is needed: a homogeneous ball has no gyroscopic force, and its contact does not
// depend on orientation. A ball that starts on the plane with slip and without spin ends rolling with 5/7 of that
// speed.
template <class T>
struct Ball3d {
  static constexpr SceneText text{
      "ball_3d", "ball with spin on a rough plane in space",
      "homogeneous ball, Newton restitution, Coulomb friction with a circular disc",
      "friction in two directions: the direction of slip turns while spin and velocity are exchanged"};

  T m{0.2}, R{0.1}, g{9.81}, e{0.6}, mu{0.2}, height{0.3}, v_x0{1.5}, v_y0{0.5};
  T omega_x0{20.0}, omega_y0{-5.0}, omega_z0{8.0}, duration{1.0};

  void parameters(auto&& visit) {
    visit("m", m, "kg");
    visit("R", R, "m");
    visit("g", g, "m/s^2");
    visit("e", e, "1");
    visit("mu", mu, "1");
    visit("height", height, "m");
    visit("v_x0", v_x0, "m/s");
    visit("v_y0", v_y0, "m/s");
    visit("omega_x0", omega_x0, "rad/s");
    visit("omega_y0", omega_y0, "rad/s");
    visit("omega_z0", omega_z0, "rad/s");
    visit("duration", duration, "s");
  }

  Vec<T, 6> q0() const { return {0, 0, height, 0, 0, 0}; }
  Vec<T, 6> v0() const { return {v_x0, v_y0, 0, omega_x0, omega_y0, omega_z0}; }
  T end_time() const { return duration; }

  Vec<T, 6> mass() const {
    const T J = 2 * m * R * R / 5;
    return {m, m, m, J, J, J};
  }
  Vec<T, 6> force(const Vec<T, 6>&, const Vec<T, 6>&) const { return {0, 0, -m * g, 0, 0, 0}; }
  std::array<Contact<T>, 1> contacts() const { return {{{"plane", e, mu}}}; }
  Vec<T, 1> gap(const Vec<T, 6>& q) const { return {q[2] - R}; }
  std::array<std::array<Vec<T, 6>, 2>, 1> tangents(const Vec<T, 6>&) const {
    return {{{{{1, 0, 0, 0, -R, 0}, {0, 1, 0, R, 0, 0}}}}};
  }
  T potential_energy(const Vec<T, 6>& q) const { return m * g * q[2]; }

  GeometryOf<T> geometry() const {
    GeometryOf<T> geometry{.in_space = true, .gravity = {0, 0, -g}};
    const T J = 2 * m * R * R / 5;
    const int ball = geometry.add_body({.name = "ball",
                                        .mass = m,
                                        .inertia = {J, J, J},
                                        .position = {{{0}, {1}, {2}}},
                                        .rotation = BodyRotation::spin,
                                        .angles = {{{3}, {4}, {5}}}});
    const int plane = geometry.add_shape({.kind = ShapeKind::half_space});
    geometry.pairs = {{0, plane, geometry.add_shape({.kind = ShapeKind::sphere, .body = ball, .size = {R}})}};
    return geometry;
  }
};

const bool ball_3d_registered = register_scene<Ball3d>();

}  // namespace
}  // namespace ricochet
