#include "problems/control/control_scene.h"

namespace ricochet {
namespace {

// A cart on a rail with dry friction carries its hanging pole to another place, where both come to rest. The pole's
// motion presses the cart on the rail and relieves it, so that the friction changes with the swing; the cart may stick,
// and a force below the friction moves nothing. Solved with --from-time-stepping 8 --sigma-0 0.001. With theta_goal = 0
// it is a swing-up, which is solved in 3 s: --set theta_goal=0 --set duration=3 -N 20 --explore 15 --sigma-0 0.01
// --factor 0.2 --max-switches 0.
//
//              o  m, point mass at the end of the pole
//             / theta from upright
//        ____/____
//   u-> |___M_____|           q = (x, y, theta), cart and angle of the pole; p = (x + l sin theta, y + l cos theta)
//   _______o___o______        M |(x', y')|^2 / 2 + m |p'|^2 / 2, gravity, u on x: Lagrange's equations           (1)
//                             f_c = y,  v_t = x'
template <class T>
struct CartPoleFriction {
  static constexpr SceneText text{
      "cart_pole_friction", "a cart with dry friction moves a pole to its target",
      "after Howell, Le Cleac'h, Singh, Florence, Manchester, Sindhwani, IEEE Robotics and Automation Letters 7 (2022)",
      "stick and slip under a normal force that depends on the motion"};

  static constexpr double kPi = 3.14159265358979323846;
  T M{1.0}, m{0.2}, l{0.5}, g{9.81}, mu{0.1}, x_goal{1.0}, theta_goal{kPi}, u_guess{2.0}, duration{2.0};

  void parameters(auto&& visit) {
    visit("M", M, "kg");
    visit("m", m, "kg");
    visit("l", l, "m");
    visit("g", g, "m/s^2");
    visit("mu", mu, "1");
    visit("x_goal", x_goal, "m");
    visit("theta_goal", theta_goal, "rad");
    visit("u_guess", u_guess, "N");
    visit("duration", duration, "s");
  }

  Vec<T, 3> q0() const { return {0, 0, kPi}; }
  Vec<T, 3> v0() const { return {0, 0, 0}; }
  T end_time() const { return duration; }
  Mat<T, 3> mass(const Vec<T, 3>& q) const {  // (1)
    using std::cos, std::sin;
    const T c = m * l * cos(q[2]), s = m * l * sin(q[2]);
    return {{{M + m, 0, c}, {0, M + m, -s}, {c, -s, m * l * l}}};
  }
  Vec<T, 3> force(const Vec<T, 3>& q, const Vec<T, 3>& v) const {
    using std::cos, std::sin;
    const T c = cos(q[2]), s = sin(q[2]);
    return {m * l * s * v[2] * v[2], m * l * c * v[2] * v[2] - (M + m) * g, m * g * l * s};
  }
  Mat<T, 3, 1> input(const Vec<T, 3>&) const { return {{{1}, {0}, {0}}}; }
  Vec<T, 1> control() const { return {u_guess}; }

  std::array<Contact<T>, 1> contacts() const { return {{{"rail", 0, mu}}}; }
  Vec<T, 1> gap(const Vec<T, 3>& q) const { return {q[1]}; }
  std::array<std::array<Vec<T, 3>, 1>, 1> tangents(const Vec<T, 3>&) const { return {{{{{1, 0, 0}}}}}; }

  ControlGrid grid() const { return {12, 2, "radau-iia:3"}; }
  ControlBounds<3, 1> bounds() const {
    return {{-2, -1, -10}, {2, 1, 10}, every<3>(-20), every<3>(20), {-20.0}, {20.0}};
  }
  T running_cost(const Vec<T, 3>&, const Vec<T, 3>& v, const Vec<T, 1>& u) const {
    return u[0] * u[0] / 100 + v[0] * v[0] / 100 + v[2] * v[2] / 100;
  }
  T terminal_cost(const Vec<T, 3>& q, const Vec<T, 3>& v) const {
    return 100 * (q[0] - x_goal) * (q[0] - x_goal) + 100 * (q[2] - theta_goal) * (q[2] - theta_goal) +
           10 * (v[0] * v[0] + v[2] * v[2]);
  }

  Vec<T, 3> goal() const { return {x_goal, 0, theta_goal}; }
  GeometryOf<T> geometry() const {
    const T half_width = T(3) / 20, half_height = T(7) / 100, bob = T(1) / 20;
    GeometryOf<T> geometry{.gravity = {0, -g, 0}};
    const int cart = geometry.add_body({.name = "cart", .mass = M, .position = {{{0}, {1}, {}}}});
    // Turned about x by half a turn, the angle of the pole is one from upright, clockwise.
    const int pole = geometry.add_body({.name = "pole",
                                        .mass = m,
                                        .rotation = BodyRotation::cardan,
                                        .angles = {{{-1, 2 * quarter_turn<T>()}, {}, {2}}},
                                        .parent = cart,
                                        .centre_from_pivot = {0, -l, 0}});
    const int rail = geometry.add_shape({.kind = ShapeKind::half_space, .position = {0, -half_height, 0}});
    const int box = geometry.add_shape({.kind = ShapeKind::box, .body = cart, .size = {half_width, half_height, 0}});
    geometry.add_shape({.kind = ShapeKind::capsule,
                        .body = pole,
                        .size = {0, l / 2, 0},
                        .position = {0, l / 2, 0},
                        .angles = {0, 0, quarter_turn<T>()}});
    geometry.add_shape({.kind = ShapeKind::sphere, .body = pole, .size = {bob, 0, 0}});
    geometry.pairs = {{0, rail, box}};
    return geometry;
  }
};

const bool cart_pole_friction_registered = register_control_problem<CartPoleFriction>();

}  // namespace
}  // namespace ricochet
