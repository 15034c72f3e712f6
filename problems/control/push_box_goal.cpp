#include "problems/control/control_scene.h"

namespace ricochet {
namespace {

// A pusher brings a box on rough ground to its goal, lets go, and is back at its own place at the end. It cannot pull,
// so the box has to be let go early, with the speed that friction takes away on the rest of the way.
//
// Solved with --from-time-stepping 8 --sigma-0 0.01 --max-switches 0; with --simulate it ends in a local optimum.
//
//           ______
//   u-> [p]|  box |          goal      q = (x_p, x, y), front of the pusher, back and height of the box
//          |______|___________|___     m_p x_p'' = u - lambda_p,   m x'' = lambda_p + lambda_t,  m y'' = -m g +
//          lambda_g (1)
//                                      f_c = (x - x_p, y),   v_t = (y', x')
template <class T>
struct PushBoxGoal {
  static constexpr SceneText text{"push_box_goal", "a pusher brings a box to its goal and lets go",
                                  "after Posa, Cantu, Tedrake, Int. J. Robotics Research 33 (2014)",
                                  "a contact that closes and opens again, and a box that friction stops at the goal"};

  T m_p{1.0}, m{1.0}, g{9.81}, mu{0.3}, mu_p{0.0}, goal_x{2.0}, u_guess{5.0}, duration{2.0};

  void parameters(auto&& visit) {
    visit("m_p", m_p, "kg");
    visit("m", m, "kg");
    visit("g", g, "m/s^2");
    visit("mu", mu, "1");
    visit("mu_p", mu_p, "1");
    visit("goal", goal_x, "m");
    visit("u_guess", u_guess, "N");
    visit("duration", duration, "s");
  }

  Vec<T, 3> q0() const { return {0, 0.5, 0}; }
  Vec<T, 3> v0() const { return {0, 0, 0}; }
  T end_time() const { return duration; }
  Vec<T, 3> mass() const { return {m_p, m, m}; }
  Vec<T, 3> force(const Vec<T, 3>&, const Vec<T, 3>&) const { return {0, 0, -m * g}; }  // (1)
  Mat<T, 3, 1> input(const Vec<T, 3>&) const { return {{{1}, {0}, {0}}}; }
  Vec<T, 1> control() const { return {u_guess}; }

  std::array<Contact<T>, 2> contacts() const { return {{{"pusher", 0, mu_p}, {"ground", 0, mu}}}; }
  Vec<T, 2> gap(const Vec<T, 3>& q) const { return {q[1] - q[0], q[2]}; }
  std::array<std::array<Vec<T, 3>, 1>, 2> tangents(const Vec<T, 3>&) const { return {{{{{0, 0, 1}}}, {{{0, 1, 0}}}}}; }

  ControlGrid grid() const { return {10, 2, "radau-iia:2"}; }
  ControlBounds<3, 1> bounds() const {
    return {every<3>(-5), every<3>(5), every<3>(-10), every<3>(10), {-20.0}, {20.0}};
  }
  T running_cost(const Vec<T, 3>&, const Vec<T, 3>& v, const Vec<T, 1>& u) const {
    return u[0] * u[0] / 100 + v[0] * v[0] / 100;
  }
  T terminal_cost(const Vec<T, 3>& q, const Vec<T, 3>& v) const {
    return 100 * (q[1] - goal_x) * (q[1] - goal_x) + 10 * v[1] * v[1] + 10 * q[0] * q[0] + v[0] * v[0];
  }

  Vec<T, 3> goal() const { return {0, goal_x, 0}; }
  GeometryOf<T> geometry() const {
    const T half = T(1) / 5, thin = T(3) / 50;  // half the box, half the pusher
    GeometryOf<T> geometry{.gravity = {0, -g, 0}};
    const int ground = geometry.add_shape({.kind = ShapeKind::half_space});
    const int pusher = geometry.add_body({.name = "pusher", .mass = m_p, .position = {{{0, -thin}, {-1, half}, {}}}});
    const int box = geometry.add_body({.name = "box", .mass = m, .position = {{{1, half}, {2, half}, {}}}});
    geometry.add_shape({.kind = ShapeKind::box, .body = pusher, .size = {thin, half / 2, 0}});
    const int front = geometry.add_shape({.kind = ShapeKind::half_space,
                                          .body = pusher,
                                          .position = {thin, 0, 0},
                                          .angles = {0, 0, -quarter_turn<T>()}});
    const int pushed = geometry.add_shape({.kind = ShapeKind::box, .body = box, .size = {half, half, 0}});
    geometry.pairs = {{0, front, pushed}, {1, ground, pushed}};
    return geometry;
  }
};

const bool push_box_goal_registered = register_control_problem<PushBoxGoal>();

}  // namespace
}  // namespace ricochet
