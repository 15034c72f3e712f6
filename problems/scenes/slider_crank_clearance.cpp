#include "problems/scene.h"

namespace ricochet {
namespace {

// A slider-crank mechanism whose slider, of length 2 a and height 2 b, has the clearance c to either side of its guide.
//
//                          ____________________      q = (theta_1, theta_2, theta_3): crank, rod, slider
//             o._                _______             C = (m_2 / 2 + m_3) l_1 l_2
//       l_1  /   `-._ l_2       |   o   | 2 b        M = [ J_1 + (m_1/4 + m_2 + m_3) l_1^2   C cos(theta_2 - theta_1) ]
//           /        `-._ . . . |_______|                [ symmetric        J_2 + (m_2/4 + m_3) l_2^2                 ]
//          +               ____________________      and J_3 for theta_3
//
//   f_1 =  C sin(theta_2 - theta_1) theta_2'^2 - (m_1/2 + m_2 + m_3) g l_1 cos(theta_1)
//   f_2 = -C sin(theta_2 - theta_1) theta_1'^2 - (m_2/2 + m_3) g l_2 cos(theta_2)
//
// q[0], q[1], q[2] are the angles theta_1, theta_2, theta_3 of crank, rod and slider. The centre of the slider is the
// end of the rod, and each of its four corners touches the upper or lower guide, b + c above and below the middle: f_c
// is the distance, v_t the velocity of the corner along the guide. No drive: the crank starts with omega_1, the rod
// such that the slider does not move sideways.
template <class T>
struct SliderCrankClearance {
  static constexpr SceneText text{
      "slider_crank_clearance", "slider-crank mechanism with clearance in the guide",
      "Flores, Leine, Glocker, Multibody System Dynamics 23 (2010)",
      "corner impacts in a fast mechanism: M(q), velocity-dependent forces, a light slider"};

  T l_1{0.153}, l_2{0.306}, a{0.05}, b{0.025}, c{0.001};
  T m_1{0.038}, m_2{0.038}, m_3{0.076}, J_1{7.4e-5}, J_2{5.9e-4}, J_3{2.7e-6};
  T g{9.81}, mu{0.01}, e{0.4}, omega_1{150.0}, duration{0.05};

  void parameters(auto&& visit) {
    visit("l_1", l_1, "m");
    visit("l_2", l_2, "m");
    visit("a", a, "m");
    visit("b", b, "m");
    visit("c", c, "m");
    visit("m_1", m_1, "kg");
    visit("m_2", m_2, "kg");
    visit("m_3", m_3, "kg");
    visit("J_1", J_1, "kg m^2");
    visit("J_2", J_2, "kg m^2");
    visit("J_3", J_3, "kg m^2");
    visit("g", g, "m/s^2");
    visit("mu", mu, "1");
    visit("e", e, "1");
    visit("omega_1", omega_1, "rad/s");
    visit("duration", duration, "s");
  }

  Vec<T, 3> q0() const { return {0, 0, 0}; }
  Vec<T, 3> v0() const { return {omega_1, -omega_1 * l_1 / l_2, 0}; }
  T end_time() const { return duration; }

  T coupling() const { return (m_2 / 2 + m_3) * l_1 * l_2; }
  Mat<T, 3> mass(const Vec<T, 3>& q) const {
    using std::cos;
    const T C = coupling() * cos(q[1] - q[0]);
    return {{{J_1 + (m_1 / 4 + m_2 + m_3) * l_1 * l_1, C, 0}, {C, J_2 + (m_2 / 4 + m_3) * l_2 * l_2, 0}, {0, 0, J_3}}};
  }
  Vec<T, 3> force(const Vec<T, 3>& q, const Vec<T, 3>& v) const {
    using std::sin, std::cos;
    const T C = coupling() * sin(q[1] - q[0]);
    return {C * v[1] * v[1] - (m_1 / 2 + m_2 + m_3) * g * l_1 * cos(q[0]),
            -C * v[0] * v[0] - (m_2 / 2 + m_3) * g * l_2 * cos(q[1]), 0};
  }
  std::array<Contact<T>, 4> contacts() const {
    return {{{"upper left", e, mu}, {"upper right", e, mu}, {"lower left", e, mu}, {"lower right", e, mu}}};
  }
  Vec<T, 4> gap(const Vec<T, 3>& q) const {
    using std::sin, std::cos;
    const T y = l_1 * sin(q[0]) + l_2 * sin(q[1]), along = a * sin(q[2]), across = b * cos(q[2]);
    return {b + c - (y - along + across), b + c - (y + along + across), b + c + (y - along - across),
            b + c + (y + along - across)};
  }
  std::array<std::array<Vec<T, 3>, 1>, 4> tangents(const Vec<T, 3>& q) const {
    using std::sin, std::cos;
    const T crank = -l_1 * sin(q[0]), rod = -l_2 * sin(q[1]), along = a * sin(q[2]), across = b * cos(q[2]);
    return {{{{{crank, rod, along - across}}},
             {{{crank, rod, -along - across}}},
             {{{crank, rod, along + across}}},
             {{{crank, rod, -along + across}}}}};
  }
  T potential_energy(const Vec<T, 3>& q) const {
    using std::sin;
    return (m_1 / 2 + m_2 + m_3) * g * l_1 * sin(q[0]) + (m_2 / 2 + m_3) * g * l_2 * sin(q[1]);
  }

  GeometryOf<T> geometry() const {
    GeometryOf<T> geometry{.gravity = {0, -g, 0}};
    const int crank = geometry.add_body({.name = "crank",
                                         .mass = m_1,
                                         .inertia = {0, 0, J_1},
                                         .rotation = BodyRotation::planar,
                                         .angles = {{{0}, {}, {}}},
                                         .centre_from_pivot = {l_1 / 2, 0, 0}});
    const int rod = geometry.add_body({.name = "rod",
                                       .mass = m_2,
                                       .inertia = {0, 0, J_2},
                                       .position = {{{-1, l_1 / 2}, {}, {}}},
                                       .rotation = BodyRotation::planar,
                                       .angles = {{{1}, {}, {}}},
                                       .parent = crank,
                                       .centre_from_pivot = {l_2 / 2, 0, 0}});
    const int slider = geometry.add_body({.name = "slider",
                                          .mass = m_3,
                                          .inertia = {0, 0, J_3},
                                          .position = {{{-1, l_2 / 2}, {}, {}}},
                                          .rotation = BodyRotation::planar,
                                          .angles = {{{2}, {}, {}}},
                                          .parent = rod});
    geometry.add_shape({.kind = ShapeKind::capsule, .body = crank, .size = {0, l_1 / 2, 0}});
    geometry.add_shape({.kind = ShapeKind::capsule, .body = rod, .size = {0, l_2 / 2, 0}});
    const int box = geometry.add_shape({.kind = ShapeKind::box, .body = slider, .size = {a, b, b}});
    const int upper = geometry.add_shape(
        {.kind = ShapeKind::half_space, .position = {0, b + c, 0}, .angles = {0, 0, 2 * quarter_turn<T>()}});
    const int lower = geometry.add_shape({.kind = ShapeKind::half_space, .position = {0, -b - c, 0}});
    geometry.pairs = {{0, upper, box, 2}, {1, upper, box, 3}, {2, lower, box, 0}, {3, lower, box, 1}};
    return geometry;
  }
};

const bool slider_crank_clearance_registered = register_scene<SliderCrankClearance>();

}  // namespace
}  // namespace ricochet
