#include "problems/control/control_scene.h"

namespace ricochet {
namespace {

// A one-legged hopper: a body on a leg that can push and swing jumps from one place, where it stands still, to another.
//
//      (x, z) O          q = (x, z, x_f, z_f), body and foot;   u = (force along the leg, torque at the hip)
//            /           d = (x - x_f, z - z_f),  l = |d|,  n = d / l,  t = (n_z, -n_x)
//           / l          m (x'', z'') = (0, -m g) + u_1 n + u_2 / l t                                            (1)
//          /             m_f (x_f'', z_f'') = (0, -m_f g) - u_1 n - u_2 / l t + contact
//   ______o____________  f_c = z_f,  v_t = x_f';   l_min <= l <= l_max
//
// Body and foot are point masses, in coordinates in which the contact is affine. Solved with
// --from-time-stepping 8 --sigma-0 0.01 --max-switches 2.
template <class T>
struct Hopper {
  static constexpr SceneText text{
      "hopper", "a one-legged hopper jumps a distance",
      "after Raibert, Legged Robots That Balance (1986), and Nurkanovic, Sartor, Albrecht, Diehl, IEEE Control Systems "
      "Letters 5 (2021)",
      "a foot that must stick, lift off, and land inelastically where it can stop"};

  T m{1.0}, m_f{0.2}, g{9.81}, mu{1.0}, l_0{0.6}, l_min{0.3}, l_max{0.8}, distance{0.5}, duration{1.0};

  void parameters(auto&& visit) {
    visit("m", m, "kg");
    visit("m_f", m_f, "kg");
    visit("g", g, "m/s^2");
    visit("mu", mu, "1");
    visit("l_0", l_0, "m");
    visit("l_min", l_min, "m");
    visit("l_max", l_max, "m");
    visit("distance", distance, "m");
    visit("duration", duration, "s");
  }

  Vec<T, 4> q0() const { return {0, l_0, 0, 0}; }
  Vec<T, 4> v0() const { return {0, 0, 0, 0}; }
  T end_time() const { return duration; }
  Vec<T, 4> mass() const { return {m, m, m_f, m_f}; }
  Vec<T, 4> force(const Vec<T, 4>&, const Vec<T, 4>&) const { return {0, -m * g, 0, -m_f * g}; }  // (1)
  Mat<T, 4, 2> input(const Vec<T, 4>& q) const {
    using std::sqrt;
    const T x = q[0] - q[2], z = q[1] - q[3], square = x * x + z * z, l = sqrt(square);
    return {{{x / l, z / square}, {z / l, -x / square}, {-x / l, -z / square}, {-z / l, x / square}}};
  }
  Vec<T, 2> control() const { return {m * g, 0}; }

  std::array<Contact<T>, 1> contacts() const { return {{{"foot", 0, mu}}}; }
  Vec<T, 1> gap(const Vec<T, 4>& q) const { return {q[3]}; }
  std::array<std::array<Vec<T, 4>, 1>, 1> tangents(const Vec<T, 4>&) const { return {{{{{0, 0, 1, 0}}}}}; }

  ControlGrid grid() const { return {10, 2, "radau-iia:3"}; }
  ControlBounds<4, 2> bounds() const {
    return {every<4>(-2), every<4>(2), every<4>(-20), every<4>(20), {-60, -20}, {60, 20}};
  }
  /// Squared distance to standing at the other place, weighted.
  T deviation(const Vec<T, 4>& q, const Vec<T, 4>& v) const {
    const Vec<T, 4> target = goal();
    T sum = 0;
    for (std::size_t k = 0; k < 4; ++k) sum += 10 * (q[k] - target[k]) * (q[k] - target[k]) + v[k] * v[k] / 10;
    return sum;
  }
  T running_cost(const Vec<T, 4>& q, const Vec<T, 4>& v, const Vec<T, 2>& u) const {
    return deviation(q, v) / 10 + (u[0] - m * g) * (u[0] - m * g) / 100 + u[1] * u[1] / 10;
  }
  T terminal_cost(const Vec<T, 4>& q, const Vec<T, 4>& v) const { return 100 * deviation(q, v); }
  std::array<T, 2> path(const Vec<T, 4>& q, const Vec<T, 4>&, const Vec<T, 2>&) const {
    const T x = q[0] - q[2], z = q[1] - q[3], square = x * x + z * z;
    return {square - l_min * l_min, l_max * l_max - square};
  }
  std::array<const char*, 2> path_names() const { return {"shortest leg", "longest leg"}; }

  Vec<T, 4> goal() const { return {distance, l_0, distance, 0}; }
  GeometryOf<T> geometry() const {
    const T head = T(1) / 10, sole = T(3) / 100;
    GeometryOf<T> geometry{.gravity = {0, -g, 0}};
    const int body = geometry.add_body({.name = "body", .mass = m, .position = {{{0}, {1}, {}}}});
    const int foot = geometry.add_body({.name = "foot", .mass = m_f, .position = {{{2}, {3}, {}}}});
    const int ground = geometry.add_shape({.kind = ShapeKind::half_space, .position = {0, -sole, 0}});
    const int ball = geometry.add_shape({.kind = ShapeKind::sphere, .body = foot, .size = {sole, 0, 0}});
    geometry.add_shape({.kind = ShapeKind::sphere, .body = body, .size = {head, 0, 0}});
    geometry.pairs = {{0, ground, ball}};
    geometry.links = {{.first = body, .second = foot}};
    return geometry;
  }
};

const bool hopper_registered = register_control_problem<Hopper>();

}  // namespace
}  // namespace ricochet
