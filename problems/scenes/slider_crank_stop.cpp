#include "problems/scene.h"

namespace ricochet {
namespace {

// A slider-crank mechanism in absolute coordinates: every body has its own, and six joint equations hold them together.
// The crank falls and drives the slider against a stop.
//
//           .B.                       q = (x_1, y_1, theta_1, x_2, y_2, theta_2, x_3)
//     l_1  /   `-._ l_2                   centres and angles of crank and rod, position of the slider
//         /        `-._           |   M = diag(m_1, m_1, m_1 l_1^2 / 12, m_2, m_2, m_2 l_2^2 / 12, m_3)
//        O              [C]       |   f = (0, -m_1 g, 0, 0, -m_2 g, 0, 0)
//     ---+--------------------    |
//                       x_3       d   f_stop = d - x_3
//
//   with r_i = l_i / 2 (cos(theta_i), sin(theta_i)) and p_i = (x_i, y_i):
//     O   p_1 - r_1 = 0,   B   p_1 + r_1 - (p_2 - r_2) = 0,   C   p_2 + r_2 - (x_3, 0) = 0
//
// q[0] to q[2] are centre and angle of the crank, q[3] to q[5] those of the rod, q[6] is the place of the slider.
template <class T>
struct SliderCrankStop {
  static constexpr SceneText text{
      "slider_crank_stop", "slider-crank mechanism that hits a stop, in absolute coordinates",
      "Nikravesh, Computer-Aided Analysis of Mechanical Systems (1988), absolute coordinates",
      "six curved bilateral constraints: every impact of the slider acts on all bodies"};

  T l_1{0.3}, l_2{0.5}, m_1{0.6}, m_2{1.0}, m_3{0.4}, g{9.81};
  T d{0.77}, e{0.6}, theta_1_0{1.1}, omega_0{0.5}, duration{1.0};

  void parameters(auto&& visit) {
    visit("l_1", l_1, "m");
    visit("l_2", l_2, "m");
    visit("m_1", m_1, "kg");
    visit("m_2", m_2, "kg");
    visit("m_3", m_3, "kg");
    visit("g", g, "m/s^2");
    visit("d", d, "m");
    visit("e", e, "1");
    visit("theta_1_0", theta_1_0, "rad");
    visit("omega_0", omega_0, "rad/s");
    visit("duration", duration, "s");
  }

  /// The angle of the rod that puts C on the slider's line: l_1 sin(theta_1) + l_2 sin(theta_2) = 0.
  T theta_2_0() const {
    using std::sin, std::asin;
    return -asin(l_1 * sin(theta_1_0) / l_2);
  }
  Vec<T, 7> q0() const {
    using std::sin, std::cos;
    const T x_1 = l_1 / 2 * cos(theta_1_0), y_1 = l_1 / 2 * sin(theta_1_0);
    const T x_2 = l_2 / 2 * cos(theta_2_0()), y_2 = l_2 / 2 * sin(theta_2_0());
    return {x_1, y_1, theta_1_0, 2 * x_1 + x_2, 2 * y_1 + y_2, theta_2_0(), 2 * x_1 + 2 * x_2};
  }
  Vec<T, 7> v0() const {
    using std::sin, std::cos;
    const T c_1 = l_1 / 2 * cos(theta_1_0), s_1 = l_1 / 2 * sin(theta_1_0);
    const T c_2 = l_2 / 2 * cos(theta_2_0()), s_2 = l_2 / 2 * sin(theta_2_0());
    const T omega_2 = -omega_0 * c_1 / c_2;
    return {-s_1 * omega_0,
            c_1 * omega_0,
            omega_0,
            -2 * s_1 * omega_0 - s_2 * omega_2,
            2 * c_1 * omega_0 + c_2 * omega_2,
            omega_2,
            -2 * s_1 * omega_0 - 2 * s_2 * omega_2};
  }
  T end_time() const { return duration; }

  Vec<T, 7> mass() const { return {m_1, m_1, m_1 * l_1 * l_1 / 12, m_2, m_2, m_2 * l_2 * l_2 / 12, m_3}; }
  Vec<T, 7> force(const Vec<T, 7>&, const Vec<T, 7>&) const { return {0, -m_1 * g, 0, 0, -m_2 * g, 0, 0}; }
  std::array<Contact<T>, 7> contacts() const {
    return {{{"stop", e},
             joint<T>("O, x"),
             joint<T>("O, y"),
             joint<T>("B, x"),
             joint<T>("B, y"),
             joint<T>("C, x"),
             joint<T>("C, y")}};
  }
  Vec<T, 7> gap(const Vec<T, 7>& q) const {
    using std::sin, std::cos;
    const T c_1 = l_1 / 2 * cos(q[2]), s_1 = l_1 / 2 * sin(q[2]), c_2 = l_2 / 2 * cos(q[5]), s_2 = l_2 / 2 * sin(q[5]);
    return {d - q[6],          q[0] - c_1, q[1] - s_1, q[0] + c_1 - q[3] + c_2, q[1] + s_1 - q[4] + s_2,
            q[3] + c_2 - q[6], q[4] + s_2};
  }
  T potential_energy(const Vec<T, 7>& q) const { return m_1 * g * q[1] + m_2 * g * q[4]; }

  /// The slider is 10 cm long, and the stop half of that behind d.
  GeometryOf<T> geometry() const {
    GeometryOf<T> geometry{.gravity = {0, -g, 0}};
    const auto add_rod = [&](const char* name, const T& m, const T& l, int k) {
      const int rod = geometry.add_body({.name = name,
                                         .mass = m,
                                         .inertia = {0, 0, m * l * l / 12},
                                         .position = {{{k}, {k + 1}, {}}},
                                         .rotation = BodyRotation::planar,
                                         .angles = {{{k + 2}, {}, {}}}});
      geometry.add_shape({.kind = ShapeKind::capsule, .body = rod, .size = {0, l / 2, 0}});
    };
    add_rod("crank", m_1, l_1, 0);
    add_rod("rod", m_2, l_2, 3);
    const int slider = geometry.add_body({.name = "slider", .mass = m_3, .position = {{{6}, {}, {}}}});
    const T half = T(1) / 20;
    const int box = geometry.add_shape({.kind = ShapeKind::box, .body = slider, .size = {half, half / 2, half}});
    const int stop = geometry.add_shape(
        {.kind = ShapeKind::half_space, .position = {d + half, 0, 0}, .angles = {0, 0, quarter_turn<T>()}});
    geometry.pairs = {{0, stop, box}};
    return geometry;
  }
};

const bool slider_crank_stop_registered = register_scene<SliderCrankStop>();

}  // namespace
}  // namespace ricochet
