#include "problems/scene.h"

namespace ricochet {
namespace {

// A double pendulum of point masses between two walls at x = +-w, driven by a constant control u at its joints.
//
//   |   +          |      q = (theta_1, theta_2), both from the vertical,   D = theta_1 - theta_2
//   |    \ l_1     |      M = [ (m_1 + m_2) l_1^2      m_2 l_1 l_2 cos(D) ]
//   |     o m_1    |          [ m_2 l_1 l_2 cos(D)     m_2 l_2^2          ]
//   |     | l_2    |      f = (-m_2 l_1 l_2 sin(D) theta_2'^2 - (m_1 + m_2) g l_1 sin(theta_1),
//   |     o m_2    |            m_2 l_1 l_2 sin(D) theta_1'^2 - m_2 g l_2 sin(theta_2)) + (1, -1/2) u
//         <-- w -->       x_2 = l_1 sin(theta_1) + l_2 sin(theta_2),   f_c = w -+ x_2
//
// q[0] and q[1] are the angles theta_1, theta_2 from the vertical.
template <class T>
struct DoublePendulumWall {
  static constexpr SceneText text{"double_pendulum_wall", "driven double pendulum between two walls",
                                  "Lagrange's equations of the double pendulum with point masses",
                                  "M(q), velocity-dependent forces, curved gaps and a control"};

  T m1{1.3}, m2{0.7}, l1{0.9}, l2{0.6}, g{9.81}, w{0.55}, e1{0.6}, e2{0.4}, tau{0.35};
  T theta1_0{0.4}, theta2_0{-0.2}, omega1_0{1.8}, omega2_0{-1.1}, duration{1.5};

  void parameters(auto&& visit) {
    visit("m1", m1, "kg");
    visit("m2", m2, "kg");
    visit("l1", l1, "m");
    visit("l2", l2, "m");
    visit("g", g, "m/s^2");
    visit("w", w, "m");
    visit("e1", e1, "1");
    visit("e2", e2, "1");
    visit("tau", tau, "N m");
    visit("theta1_0", theta1_0, "rad");
    visit("theta2_0", theta2_0, "rad");
    visit("omega1_0", omega1_0, "rad/s");
    visit("omega2_0", omega2_0, "rad/s");
    visit("duration", duration, "s");
  }

  Vec<T, 2> q0() const { return {theta1_0, theta2_0}; }
  Vec<T, 2> v0() const { return {omega1_0, omega2_0}; }
  T end_time() const { return duration; }

  Mat<T, 2> mass(const Vec<T, 2>& q) const {
    using std::cos;
    const T coupling = m2 * l1 * l2 * cos(q[0] - q[1]);
    return {{{(m1 + m2) * l1 * l1, coupling}, {coupling, m2 * l2 * l2}}};
  }
  Vec<T, 2> force(const Vec<T, 2>& q, const Vec<T, 2>& v) const {
    using std::sin;
    const T coupling = m2 * l1 * l2 * sin(q[0] - q[1]);
    return {-coupling * v[1] * v[1] - (m1 + m2) * g * l1 * sin(q[0]), coupling * v[0] * v[0] - m2 * g * l2 * sin(q[1])};
  }
  Mat<T, 2, 1> input(const Vec<T, 2>&) const { return {{{1}, {-T(1) / 2}}}; }
  Vec<T, 1> control() const { return {tau}; }
  std::array<Contact<T>, 2> contacts() const { return {{{"right wall", e1}, {"left wall", e2}}}; }
  Vec<T, 2> gap(const Vec<T, 2>& q) const {
    using std::sin;
    const T x = l1 * sin(q[0]) + l2 * sin(q[1]);
    return {w - x, w + x};
  }
  T potential_energy(const Vec<T, 2>& q) const {
    using std::cos;
    return -(m1 + m2) * g * l1 * cos(q[0]) - m2 * g * l2 * cos(q[1]) - tau * (q[0] - q[1] / 2);
  }

  GeometryOf<T> geometry() const {
    GeometryOf<T> geometry{.gravity = {0, -g, 0}};
    const T quarter = quarter_turn<T>();  // the x of a mass is along its rod
    const int upper = geometry.add_body({.name = "upper mass",
                                         .mass = m1,
                                         .rotation = BodyRotation::planar,
                                         .angles = {{{0, -quarter}, {}, {}}},
                                         .centre_from_pivot = {l1, 0, 0}});
    const int lower = geometry.add_body({.name = "lower mass",
                                         .mass = m2,
                                         .rotation = BodyRotation::planar,
                                         .angles = {{{1, -quarter}, {}, {}}},
                                         .parent = upper,
                                         .centre_from_pivot = {l2, 0, 0}});
    geometry.add_shape({.kind = ShapeKind::sphere, .body = upper});
    const int bob = geometry.add_shape({.kind = ShapeKind::sphere, .body = lower});
    const int right =
        geometry.add_shape({.kind = ShapeKind::half_space, .position = {w, 0, 0}, .angles = {0, 0, quarter}});
    const int left =
        geometry.add_shape({.kind = ShapeKind::half_space, .position = {-w, 0, 0}, .angles = {0, 0, -quarter}});
    geometry.pairs = {{0, right, bob}, {1, left, bob}};
    geometry.links = {{-1, upper}, {upper, lower}};
    return geometry;
  }
};

const bool double_pendulum_wall_registered = register_scene<DoublePendulumWall>();

}  // namespace
}  // namespace ricochet
