#include "problems/scene.h"

namespace ricochet {
namespace {

// The woodpecker toy: a sleeve with play on a vertical pole, and a woodpecker on a spring. It hacks its way down.
//
//     ||   phi_S            q = (y, phi_M, phi_S): height of the sleeve, angles of sleeve and woodpecker
//     ||  <o)__             M = [ m_S + m_M     m_S l_M          m_S l_G         ]
//    [||]/\/\(_>                [ m_S l_M       J_M + m_S l_M^2  m_S l_M l_G     ]
//     ||                        [ m_S l_G       m_S l_M l_G      J_S + m_S l_G^2 ]
//     ||                    f = (-(m_S + m_M) g,  -c (phi_M - phi_S) - m_S g l_M,  -c (phi_S - phi_M) - m_S g l_G)
//
//   beak           f_c = l_M + l_G - l_S - r_0 - h_S phi_S     v_t = y' + l_M phi_M' + (l_G - l_S) phi_S'
//   lower sleeve   f_c = r_M - r_0 + h_M phi_M                 v_t = y' + r_M phi_M'
//   upper sleeve   f_c = r_M - r_0 - h_M phi_M                 v_t = y' + r_M phi_M'
//
// q[0] is the height y of the sleeve, q[1] and q[2] are the angles phi_M, phi_S of sleeve and woodpecker. Angles are
// small and the kinematics linear, as in the source. A tilted sleeve jams by friction and holds the toy. The initial
// state is the source's point of the limit cycle, with phi_M rounded to the open side of the lower sleeve contact: a
// gap of 0.3 um closes at once, a gap of zero would leave the first step to rounding. A period takes 0.146 s.
template <class T>
struct WoodpeckerToy {
  static constexpr SceneText text{
      "woodpecker_toy", "woodpecker toy on a pole",
      "Leine, van Campen, Glocker, Journal of Vibration and Control 9 (2003); first in Glocker, Pfeiffer, Nonlinear "
      "Dynamics 7 (1995)",
      "a limit cycle of impacts, jamming by friction and slip in a full, constant M"};

  T m_M{3e-4}, J_M{5e-9}, m_S{4.5e-3}, J_S{7e-7}, c{5.6e-3}, g{9.81};
  T r_0{2.5e-3}, r_M{3.1e-3}, h_M{5.8e-3}, l_M{1e-2}, l_G{1.5e-2}, h_S{2e-2}, l_S{2.01e-2};
  T e_beak{0.5}, e_sleeve{0.0}, mu{0.3};
  T phi_M0{-0.1034}, phi_S0{-0.2788}, v_y0{-0.3411}, omega_S0{-7.4583}, duration{0.3};

  void parameters(auto&& visit) {
    visit("m_M", m_M, "kg");
    visit("J_M", J_M, "kg m^2");
    visit("m_S", m_S, "kg");
    visit("J_S", J_S, "kg m^2");
    visit("c", c, "N m/rad");
    visit("g", g, "m/s^2");
    visit("r_0", r_0, "m");
    visit("r_M", r_M, "m");
    visit("h_M", h_M, "m");
    visit("l_M", l_M, "m");
    visit("l_G", l_G, "m");
    visit("h_S", h_S, "m");
    visit("l_S", l_S, "m");
    visit("e_beak", e_beak, "1");
    visit("e_sleeve", e_sleeve, "1");
    visit("mu", mu, "1");
    visit("phi_M0", phi_M0, "rad");
    visit("phi_S0", phi_S0, "rad");
    visit("v_y0", v_y0, "m/s");
    visit("omega_S0", omega_S0, "rad/s");
    visit("duration", duration, "s");
  }

  Vec<T, 3> q0() const { return {0, phi_M0, phi_S0}; }
  Vec<T, 3> v0() const { return {v_y0, 0, omega_S0}; }
  T end_time() const { return duration; }

  Mat<T, 3> mass() const {
    return {{{m_S + m_M, m_S * l_M, m_S * l_G},
             {m_S * l_M, J_M + m_S * l_M * l_M, m_S * l_M * l_G},
             {m_S * l_G, m_S * l_M * l_G, J_S + m_S * l_G * l_G}}};
  }
  Vec<T, 3> force(const Vec<T, 3>& q, const Vec<T, 3>&) const {
    const T spring = c * (q[1] - q[2]);
    return {-(m_S + m_M) * g, -spring - m_S * g * l_M, spring - m_S * g * l_G};
  }
  std::array<Contact<T>, 3> contacts() const {
    return {{{"beak", e_beak, mu}, {"lower sleeve", e_sleeve, mu}, {"upper sleeve", e_sleeve, mu}}};
  }
  Vec<T, 3> gap(const Vec<T, 3>& q) const {
    return {l_M + l_G - l_S - r_0 - h_S * q[2], r_M - r_0 + h_M * q[1], r_M - r_0 - h_M * q[1]};
  }
  std::array<std::array<Vec<T, 3>, 1>, 3> tangents(const Vec<T, 3>&) const {
    return {{{{{1, l_M, l_G - l_S}}}, {{{1, r_M, 0}}}, {{{1, r_M, 0}}}}};
  }
  T potential_energy(const Vec<T, 3>& q) const {
    const T twist = q[1] - q[2];
    return (m_S + m_M) * g * q[0] + m_S * g * (l_M * q[1] + l_G * q[2]) + c * twist * twist / 2;
  }

  /// For drawings: the contacts of linear kinematics are none of shapes, and M is that of small angles.
  GeometryOf<T> geometry() const {
    GeometryOf<T> geometry{.gravity = {0, -g, 0}};
    const int sleeve = geometry.add_body({.name = "sleeve",
                                          .mass = m_M,
                                          .inertia = {0, 0, J_M},
                                          .position = {{{}, {0}, {}}},
                                          .rotation = BodyRotation::planar,
                                          .angles = {{{1}, {}, {}}}});
    const int bird = geometry.add_body({.name = "woodpecker",
                                        .mass = m_S,
                                        .inertia = {0, 0, J_S},
                                        .position = {{{-1, l_M}, {}, {}}},
                                        .rotation = BodyRotation::planar,
                                        .angles = {{{2}, {}, {}}},
                                        .parent = sleeve,
                                        .centre_from_pivot = {l_G, 0, 0}});
    geometry.add_shape({.kind = ShapeKind::box, .size = {r_0, 10 * h_M, r_0}});
    geometry.add_shape({.kind = ShapeKind::box, .body = sleeve, .size = {2 * r_M, h_M, r_M}});
    geometry.add_shape({.kind = ShapeKind::capsule,
                        .body = bird,
                        .size = {h_S / 4, h_S / 2, 0},
                        .position = {0, h_S / 2, 0},
                        .angles = {0, 0, quarter_turn<T>()}});
    geometry.links = {{sleeve, bird}, {bird, bird, {0, h_S, 0}, {-l_S, h_S, 0}}};  // spring, beak
    return geometry;
  }
};

const bool woodpecker_toy_registered = register_scene<WoodpeckerToy>();

}  // namespace
}  // namespace ricochet
