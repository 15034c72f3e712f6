#include "problems/scene.h"

namespace ricochet {
namespace {

// A double pendulum of two uniform rods whose tip strikes rough ground obliquely.
//
//    +  pivot                 D = theta_1 - theta_2, both angles from the vertical, rods of mass m and length l
//     \ theta_1               M = m l^2 ( 4/3          cos(D) / 2 )
//      o                                ( cos(D) / 2   1/3        )
//       \ theta_2             f = m l (-l/2 sin(D) theta_2'^2 - 3/2 g sin(theta_1),
//        \                              l/2 sin(D) theta_1'^2 - 1/2 g sin(theta_2))
//   _______o____  tip         f_c = H - l cos(theta_1) - l cos(theta_2)
//                             v_t = l cos(theta_1) theta_1' + l cos(theta_2) theta_2'
//
// Kane's puzzle: the normal impulse alone reverses the slip, and the friction impulse then points along the slip that
// was there before. With Newton's law its work over both velocities, Lambda_t (v_t+ + v_t-) / 2, is positive: for
// e = mu = 0.5 the kinetic energy grows by 59 % (without gravity). Default parameters lose energy; mu = 0.5 gains it.
// q[0] and q[1] are the angles theta_1, theta_2 from the vertical; the tip starts `clearance` above the ground.
template <class T>
struct KanePendulum {
  static constexpr SceneText text{
      "kane_pendulum", "double pendulum that strikes rough ground (Kane's puzzle)",
      "Kane, Levinson, Dynamics: Theory and Applications (1985); Stronge, Impact Mechanics, ch. 5",
      "slip that reverses in an impact: for mu = 0.5 Newton's law gains energy"};

  T m{1.0}, l{1.0}, g{9.81}, e{0.5}, mu{0.1}, clearance{0.001};
  T theta1_0{0.3490658503988659}, theta2_0{0.5235987755982988}, omega1_0{-0.1}, omega2_0{-0.2}, duration{0.02};

  void parameters(auto&& visit) {
    visit("m", m, "kg");
    visit("l", l, "m");
    visit("g", g, "m/s^2");
    visit("e", e, "1");
    visit("mu", mu, "1");
    visit("clearance", clearance, "m");
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
    const T coupling = m * l * l * cos(q[0] - q[1]) / 2;
    return {{{m * l * l * 4 / 3, coupling}, {coupling, m * l * l / 3}}};
  }
  Vec<T, 2> force(const Vec<T, 2>& q, const Vec<T, 2>& v) const {
    using std::sin;
    const T coupling = m * l * l * sin(q[0] - q[1]) / 2;
    return {-coupling * v[1] * v[1] - m * g * l * sin(q[0]) * 3 / 2,
            coupling * v[0] * v[0] - m * g * l * sin(q[1]) / 2};
  }
  std::array<Contact<T>, 1> contacts() const { return {{{"tip", e, mu}}}; }
  Vec<T, 1> gap(const Vec<T, 2>& q) const {
    using std::cos;
    return {l * (cos(theta1_0) + cos(theta2_0)) + clearance - l * cos(q[0]) - l * cos(q[1])};
  }
  std::array<std::array<Vec<T, 2>, 1>, 1> tangents(const Vec<T, 2>& q) const {
    using std::cos;
    return {{{{{l * cos(q[0]), l * cos(q[1])}}}}};
  }
  T potential_energy(const Vec<T, 2>& q) const {
    using std::cos;
    return -m * g * l * (cos(q[0]) * 3 + cos(q[1])) / 2;
  }

  GeometryOf<T> geometry() const {
    using std::cos;
    GeometryOf<T> geometry{.gravity = {0, -g, 0}};
    const T quarter = quarter_turn<T>();  // the x of a rod is along it, downwards
    const int upper = geometry.add_body({.name = "upper rod",
                                         .mass = m,
                                         .inertia = {0, 0, m * l * l / 12},
                                         .rotation = BodyRotation::planar,
                                         .angles = {{{0, -quarter}, {}, {}}},
                                         .centre_from_pivot = {l / 2, 0, 0}});
    const int lower = geometry.add_body({.name = "lower rod",
                                         .mass = m,
                                         .inertia = {0, 0, m * l * l / 12},
                                         .position = {{{-1, l / 2}, {}, {}}},
                                         .rotation = BodyRotation::planar,
                                         .angles = {{{1, -quarter}, {}, {}}},
                                         .parent = upper,
                                         .centre_from_pivot = {l / 2, 0, 0}});
    geometry.add_shape({.kind = ShapeKind::capsule, .body = upper, .size = {0, l / 2, 0}});
    const int line = geometry.add_shape({.kind = ShapeKind::capsule, .body = lower, .size = {0, l / 2, 0}});
    const int ground = geometry.add_shape(
        {.kind = ShapeKind::half_space, .position = {0, -l * (cos(theta1_0) + cos(theta2_0)) - clearance, 0}});
    geometry.pairs = {{0, ground, line, 1}};
    return geometry;
  }
};

const bool kane_pendulum_registered = register_scene<KanePendulum>();

}  // namespace
}  // namespace ricochet
