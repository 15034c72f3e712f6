#include "problems/control/control_scene.h"

namespace ricochet {
namespace {

// The first cart is driven and has to bring the second one, which it can only bump into, to its place. Its own track
// ends at 1.05 m, so it cannot push gently all the way.
//
//    u-> [ 1 ]        [ 2 ]           q = (x_1, x_2), front of cart 1 and back of cart 2
//   ______o_o__________o_o______      m_1 x_1'' = u - d x_1' - lambda_n,   m_2 x_2'' = -d x_2' + lambda_n    (1)
//                                     f_c = x_2 - x_1
template <class T>
struct TwoCarts {
  static constexpr SceneText text{"two_carts", "a driven cart hits another one, which moves to its target",
                                  "after Lin, Ohtsuka, IEEE Trans. Automatic Control (2022), and FESD-J, section 5.3",
                                  "one elastic impact, whose time and velocity the optimisation determines"};

  T m_1{1.0}, m_2{1.0}, d{0.5}, e{0.5}, u_guess{3.0}, duration{2.0};

  void parameters(auto&& visit) {
    visit("m_1", m_1, "kg");
    visit("m_2", m_2, "kg");
    visit("d", d, "N s/m");
    visit("e", e, "1");
    visit("u_guess", u_guess, "N");
    visit("duration", duration, "s");
  }

  Vec<T, 2> q0() const { return {0, 1}; }
  Vec<T, 2> v0() const { return {0, 0}; }
  T end_time() const { return duration; }
  Vec<T, 2> mass() const { return {m_1, m_2}; }
  Vec<T, 2> force(const Vec<T, 2>&, const Vec<T, 2>& v) const { return {-d * v[0], -d * v[1]}; }  // (1)
  Mat<T, 2, 1> input(const Vec<T, 2>&) const { return {{{1}, {0}}}; }
  Vec<T, 1> control() const { return {u_guess}; }
  std::array<Contact<T>, 1> contacts() const { return {{{"bumper", e}}}; }
  Vec<T, 1> gap(const Vec<T, 2>& q) const { return {q[1] - q[0]}; }

  ControlGrid grid() const { return {10, 2, "radau-iia:3"}; }
  ControlBounds<2, 1> bounds() const { return {every<2>(-5), {1.05, 5}, every<2>(-10), every<2>(10), {-20.0}, {20.0}}; }
  Vec<T, 2> goal() const { return {0, 2}; }
  /// Squared distance to the goal, weighted.
  T distance(const Vec<T, 2>& q) const { return q[0] * q[0] + 10 * (q[1] - 2) * (q[1] - 2); }
  T running_cost(const Vec<T, 2>& q, const Vec<T, 2>&, const Vec<T, 1>& u) const {
    return distance(q) + u[0] * u[0] / 100;
  }
  T terminal_cost(const Vec<T, 2>& q, const Vec<T, 2>& v) const {
    return 100 * distance(q) + v[0] * v[0] + v[1] * v[1];
  }

  GeometryOf<T> geometry() const {
    const T length = T(3) / 10, height = T(4) / 25, wheel = T(1) / 20, end = T(21) / 20;
    GeometryOf<T> geometry;
    geometry.add_shape({.kind = ShapeKind::half_space, .name = "ground"});
    geometry.add_shape({.kind = ShapeKind::box, .size = {wheel / 10, wheel / 2, 0}, .position = {end, -wheel / 2, 0}});
    const auto add_cart = [&](int k, const T& mass, const T& middle) {
      const int body = geometry.add_body({.name = k == 0 ? "cart 1" : "cart 2",
                                          .mass = mass,
                                          .position = {{{k, middle}, {-1, 2 * wheel + height / 2}, {}}}});
      for (const int side : {-1, 1})
        geometry.add_shape({.kind = ShapeKind::sphere,
                            .body = body,
                            .size = {wheel, 0, 0},
                            .position = {side * (length / 2 - wheel), -wheel - height / 2, 0}});
      return geometry.add_shape({.kind = ShapeKind::box, .body = body, .size = {length / 2, height / 2, 0}});
    };
    add_cart(0, m_1, -length / 2);
    const int front = geometry.add_shape({.kind = ShapeKind::half_space,
                                          .body = 0,
                                          .position = {length / 2, 0, 0},
                                          .angles = {0, 0, -quarter_turn<T>()}});
    geometry.pairs = {{0, front, add_cart(1, m_2, length / 2)}};
    return geometry;
  }
};

const bool two_carts_registered = register_control_problem<TwoCarts>();

}  // namespace
}  // namespace ricochet
