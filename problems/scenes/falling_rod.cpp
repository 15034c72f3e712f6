#include "problems/scene.h"

namespace ricochet {
namespace {

// A slender rod that slides on its lower end and falls over, the tip ahead of the centre.
//
//    \             m x'' = lambda_t
//     \ l          m y'' = -m g + lambda_n
//      o           J theta'' = -l/2 cos(theta) lambda_n - l/2 sin(theta) lambda_t
//       \          tip: x_t = x + l/2 cos(theta),  f_c = y - l/2 sin(theta),  v_t = x' - l/2 sin(theta) theta'
//  theta (\ ->
//   _______        (x, y) is the centre, theta the angle between the rod and the ground
//
// q[0] and q[1] are the centre (x, y), q[2] is the angle theta between the rod and the ground. While the tip slips
// forward, lambda_t = -mu lambda_n, and the gap acceleration is b + p lambda_n with p = 1/m + l^2/(4 J) cos(theta)
// (cos(theta) - mu sin(theta)). p < 0 is Painleve's region: no force, or two, or only an impulse continues the slip.
// For a uniform rod it exists when mu > 4/3, first at tan(theta) = 2. Default parameters stay outside; mu = 2 and
// theta0 = 1.1 start inside. There b = l/2 sin(theta) theta'^2 - g decides: b < 0 is inconsistent, b > 0 (omega0 = 6)
// indeterminate. The run ends before the upper end lands, which is no contact of this scene.
template <class T>
struct FallingRod {
  static constexpr SceneText text{
      "falling_rod", "rod that slides on its lower end and falls",
      "Genot, Brogliato, New results on Painleve paradoxes, Eur. J. Mech. A/Solids 18 (1999)",
      "sliding that feeds back on the normal force; Painleve's region for mu > 4/3"};

  T m{1.0}, l{1.0}, J{1.0 / 12}, g{9.81}, mu{0.4}, e{0.0}, theta0{1.0}, v_tip0{1.5}, omega0{0.0}, duration{0.4};

  void parameters(auto&& visit) {
    visit("m", m, "kg");
    visit("l", l, "m");
    visit("J", J, "kg m^2");
    visit("g", g, "m/s^2");
    visit("mu", mu, "1");
    visit("e", e, "1");
    visit("theta0", theta0, "rad");
    visit("v_tip0", v_tip0, "m/s");
    visit("omega0", omega0, "rad/s");
    visit("duration", duration, "s");
  }

  Vec<T, 3> q0() const {
    using std::sin;
    return {0, l / 2 * sin(theta0), theta0};
  }
  Vec<T, 3> v0() const {
    using std::sin, std::cos;
    return {v_tip0 + l / 2 * sin(theta0) * omega0, l / 2 * cos(theta0) * omega0, omega0};
  }
  T end_time() const { return duration; }

  Vec<T, 3> mass() const { return {m, m, J}; }
  Vec<T, 3> force(const Vec<T, 3>&, const Vec<T, 3>&) const { return {0, -m * g, 0}; }
  std::array<Contact<T>, 1> contacts() const { return {{{"tip", e, mu}}}; }
  Vec<T, 1> gap(const Vec<T, 3>& q) const {
    using std::sin;
    return {q[1] - l / 2 * sin(q[2])};
  }
  std::array<std::array<Vec<T, 3>, 1>, 1> tangents(const Vec<T, 3>& q) const {
    using std::sin;
    return {{{{{1, 0, -l / 2 * sin(q[2])}}}}};
  }
  T potential_energy(const Vec<T, 3>& q) const { return m * g * q[1]; }

  /// A line without thickness. theta counts clockwise, so the rod's axes are turned by half a turn about x.
  GeometryOf<T> geometry() const {
    GeometryOf<T> geometry{.gravity = {0, -g, 0}};
    const int rod = geometry.add_body({.name = "rod",
                                       .mass = m,
                                       .inertia = {0, 0, J},
                                       .position = {{{0}, {1}, {}}},
                                       .rotation = BodyRotation::cardan,
                                       .angles = {{{-1, 2 * quarter_turn<T>()}, {}, {2}}}});
    const int ground = geometry.add_shape({.kind = ShapeKind::half_space});
    const int line = geometry.add_shape({.kind = ShapeKind::capsule, .body = rod, .size = {0, l / 2, 0}});
    geometry.pairs = {{0, ground, line, 1}};
    return geometry;
  }
};

const bool falling_rod_registered = register_scene<FallingRod>();

}  // namespace
}  // namespace ricochet
