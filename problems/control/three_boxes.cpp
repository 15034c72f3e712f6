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
    const Vec<T, 6> target = goal(), weight{10, 0.001, 1, 0.001, 10, 0.001};
    T sum = 0;
    for (std::size_t k = 0; k < 6; ++k) sum += weight[k] * (q[k] - target[k]) * (q[k] - target[k]) + v[k] * v[k] / 10;
    return sum;
  }
  T running_cost(const Vec<T, 6>& q, const Vec<T, 6>& v, const Vec<T, 1>& u) const {
    return distance(q, v) + u[0] * u[0] / 10;
  }
  T terminal_cost(const Vec<T, 6>& q, const Vec<T, 6>& v) const { return 100 * distance(q, v); }

  Vec<T, 6> goal() const { return {-7, a / 2, 0, a / 2, 6, a / 2}; }
  GeometryOf<T> geometry() const {
    GeometryOf<T> geometry{.gravity = {0, -g, 0}};
    const int ground = geometry.add_shape({.kind = ShapeKind::half_space});
    std::vector<int> boxes;
    for (const char* name : {"left box", "middle box", "right box"}) {
      const int k = 2 * static_cast<int>(boxes.size());
      const int body = geometry.add_body({.name = name, .mass = m, .position = {{{k}, {k + 1}, {}}}});
      boxes.push_back(geometry.add_shape({.kind = ShapeKind::box, .body = body, .size = {a / 2, a / 2, 0}}));
    }
    const auto side_of_middle = [&](int side) {
      return geometry.add_shape({.kind = ShapeKind::half_space,
                                 .body = 1,
                                 .position = {side * a / 2, 0, 0},
                                 .angles = {0, 0, -side * quarter_turn<T>()}});
    };
    geometry.pairs = {{0, side_of_middle(-1), boxes[0]}, {1, side_of_middle(1), boxes[2]}};
    for (const int box : boxes) geometry.pairs.push_back({static_cast<int>(geometry.pairs.size()), ground, box});
    return geometry;
  }
};

const bool three_boxes_registered = register_control_problem<ThreeBoxes>();

}  // namespace
}  // namespace ricochet
