#include "problems/control/control_scene.h"

namespace ricochet {
namespace {

// Three boxes side by side on rough ground; the driven middle box pushes the others to their places and returns.
//
//    _____      _____      _____       q = (x_1, y_1, x_2, y_2, x_3, y_3), centres; u = horizontal force on box 2
//   |  1  |    |  2  |u-> |  3  |      m x_i'' = u delta_i2 + contact forces,  m y_i'' = -m g + contact forces    (1)
//   |_____|____|_____|____|_____|___
//
//   f_c = (x_2 - x_1 - a, x_3 - x_2 - a, y_1 - a/2, y_2 - a/2, y_3 - a/2)
//   v_t = (y_2' - y_1', y_3' - y_2', x_1', x_2', x_3')
template <class T>
struct ThreeBoxes {
  static constexpr SceneText text{"three_boxes", "three boxes on rough ground",
                                  "Nurkanovic, Frey, Pozharskiy, Diehl, FESD-J, section 5.3, corrected",
                                  "an inelastic and an elastic impact, slip and stick, in one optimisation"};

  T m{1.0}, a{2.0}, g{9.81}, e_right{0.5}, mu_box{0.1}, mu_ground{0.2}, duration{6.0};

  void parameters(auto&& visit) {
    visit("m", m, "kg");
    visit("a", a, "m");
    visit("g", g, "m/s^2");
    visit("e_right", e_right, "1");
    visit("mu_box", mu_box, "1");
    visit("mu_ground", mu_ground, "1");
    visit("duration", duration, "s");
  }

  Vec<T, 6> q0() const { return {-3, a / 2, 0, a / 2, 3, a / 2}; }
  Vec<T, 6> v0() const { return {0, 0, 0, 0, 0, 0}; }
  T end_time() const { return duration; }
  Vec<T, 6> mass() const { return {m, m, m, m, m, m}; }
  Vec<T, 6> force(const Vec<T, 6>&, const Vec<T, 6>&) const { return {0, -m * g, 0, -m * g, 0, -m * g}; }  // (1)
  Mat<T, 6, 1> input(const Vec<T, 6>&) const { return {{{0}, {0}, {1}, {0}, {0}, {0}}}; }
  Vec<T, 1> control() const { return {0}; }

  std::array<Contact<T>, 5> contacts() const {
    return {{{"left and middle", 0, mu_box},
             {"middle and right", e_right, mu_box},
             {"left on ground", 0, mu_ground},
             {"middle on ground", 0, mu_ground},
             {"right on ground", 0, mu_ground}}};
  }
  Vec<T, 5> gap(const Vec<T, 6>& q) const {
    return {q[2] - q[0] - a, q[4] - q[2] - a, q[1] - a / 2, q[3] - a / 2, q[5] - a / 2};
  }
  std::array<std::array<Vec<T, 6>, 1>, 5> tangents(const Vec<T, 6>&) const {
    return {{{{{0, -1, 0, 1, 0, 0}}},
             {{{0, 0, 0, -1, 0, 1}}},
             {{{1, 0, 0, 0, 0, 0}}},
             {{{0, 0, 1, 0, 0, 0}}},
             {{{0, 0, 0, 0, 1, 0}}}}};
  }

  ControlGrid grid() const { return {15, 2, "radau-iia:2"}; }
  ControlBounds<6, 1> bounds() const {
    return {every<6>(-10), every<6>(10), every<6>(-10), every<6>(10), {-30.0}, {30.0}};
  }
  T distance(const Vec<T, 6>& q, const Vec<T, 6>& v) const {
    const Vec<T, 6> target{-7, a / 2, 0, a / 2, 6, a / 2}, weight{10, 0.001, 1, 0.001, 10, 0.001};
    T sum = 0;
    for (std::size_t k = 0; k < 6; ++k) sum += weight[k] * (q[k] - target[k]) * (q[k] - target[k]) + v[k] * v[k] / 10;
    return sum;
  }
  T running_cost(const Vec<T, 6>& q, const Vec<T, 6>& v, const Vec<T, 1>& u) const {
    return distance(q, v) + u[0] * u[0] / 10;
  }
  T terminal_cost(const Vec<T, 6>& q, const Vec<T, 6>& v) const { return 100 * distance(q, v); }

  std::vector<Shape> shapes(const Vec<T, 6>& q) const {
    return {Shape::ground(0),
            Shape::box(1, -7, a / 2, a, a).as_goal(),
            Shape::box(2, 0, a / 2, a, a).as_goal(),
            Shape::box(3, 6, a / 2, a, a).as_goal(),
            Shape::box(1, q[0], q[1], a, a),
            Shape::box(2, q[2], q[3], a, a),
            Shape::box(3, q[4], q[5], a, a)};
  }
  /// The control, what the middle box does to its neighbours, and the friction of the ground.
  std::vector<Arrow> arrows(const Vec<T, 6>& q, const Forces& forces) const {
    const Vector &n = forces.lambda_n, &t = forces.friction;
    return {{-1, q[2], q[3], forces.u[0], 0},    {0, q[0] + a / 2, q[1], -n[0], -t[0]},
            {1, q[4] - a / 2, q[5], n[1], t[1]}, {2, q[0], q[1] - a / 2, t[2], 0},
            {3, q[2], q[3] - a / 2, t[3], 0},    {4, q[4], q[5] - a / 2, t[4], 0}};
  }
};

const bool three_boxes_registered = register_control_problem<ThreeBoxes>();

}  // namespace
}  // namespace ricochet
