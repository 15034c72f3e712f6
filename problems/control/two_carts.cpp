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
  /// Squared distance to x_1 = 0, x_2 = 2.
  T distance(const Vec<T, 2>& q) const { return q[0] * q[0] + 10 * (q[1] - 2) * (q[1] - 2); }
  T running_cost(const Vec<T, 2>& q, const Vec<T, 2>&, const Vec<T, 1>& u) const {
    return distance(q) + u[0] * u[0] / 100;
  }
  T terminal_cost(const Vec<T, 2>& q, const Vec<T, 2>& v) const {
    return 100 * distance(q) + v[0] * v[0] + v[1] * v[1];
  }

  static constexpr double kWidth = 0.3, kHeight = 0.16, kWheel = 0.05;
  std::vector<Shape> shapes(const Vec<T, 2>& q) const {
    std::vector<Shape> shapes{Shape::ground(0), Shape::segment(0, 1.05, -0.04, 1.05, 0)};
    const auto add_cart = [&](int body, double back, bool is_goal) {
      const double y = 2 * kWheel, front = back + kWidth;
      for (const Shape& shape :
           {Shape::box(body, back + kWidth / 2, y + kHeight / 2, kWidth, kHeight),
            Shape::circle(body, back + kWheel, kWheel, kWheel), Shape::circle(body, front - kWheel, kWheel, kWheel)})
        shapes.push_back(is_goal ? shape.as_goal() : shape);
    };
    add_cart(1, -kWidth, true);
    add_cart(2, 2, true);
    add_cart(1, q[0] - kWidth, false);
    add_cart(2, q[1], false);
    return shapes;
  }
  std::vector<Arrow> arrows(const Vec<T, 2>& q, const Forces& forces) const {
    const double y = 2 * kWheel + kHeight / 2;
    return {{-1, q[0] - kWidth / 2, y, forces.u[0], 0}, {0, q[1], y, forces.lambda_n[0], 0}};
  }
};

const bool two_carts_registered = register_control_problem<TwoCarts>();

}  // namespace
}  // namespace ricochet
