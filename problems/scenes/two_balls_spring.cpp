#include "problems/scene.h"

namespace ricochet {
namespace {

// Two balls on a vertical line, joined by a stiff spring; the lower one hits the ground.
//
//      o  q[1]   m1 q[0]'' = -m1 g + k (q[1] - q[0] - l) + lambda_n
//      <         m2 q[1]'' = -m2 g - k (q[1] - q[0] - l)
//      >         f_c = q[0] - R
//      o  q[0]
//   _______
//
// Between impacts the motion is a fall plus an oscillation of omega = sqrt(k/m1 + k/m2) = 141 rad/s.
template <class T>
struct TwoBallsSpring {
  static constexpr SceneText text{
      "two_balls_spring", "two balls joined by a stiff spring",
      "Nurkanovic, Frey, Pozharskiy, Diehl, FESD-J, section 5.1; first in Chen, Acary, Virlez, Bruls, IJNME 96 (2013)",
      "two elastic impacts 19 ms apart, a spring that a step of 10 ms barely resolves"};

  T m1{1.0}, m2{1.0}, g{9.81}, R{0.2}, k{1e4}, l{1.0}, e{0.8}, height{1.0}, duration{1.0};

  void parameters(auto&& visit) {
    visit("m1", m1, "kg");
    visit("m2", m2, "kg");
    visit("g", g, "m/s^2");
    visit("R", R, "m");
    visit("k", k, "N/m");
    visit("l", l, "m");
    visit("e", e, "1");
    visit("height", height, "m");
    visit("duration", duration, "s");
  }

  Vec<T, 2> q0() const { return {height, height + l}; }
  Vec<T, 2> v0() const { return {0, 0}; }
  T end_time() const { return duration; }

  Vec<T, 2> mass() const { return {m1, m2}; }
  Vec<T, 2> force(const Vec<T, 2>& q, const Vec<T, 2>&) const {
    const T spring = k * (q[1] - q[0] - l);
    return {-m1 * g + spring, -m2 * g - spring};
  }
  std::array<Contact<T>, 1> contacts() const { return {{{"ground", e}}}; }
  Vec<T, 1> gap(const Vec<T, 2>& q) const { return {q[0] - R}; }
  T potential_energy(const Vec<T, 2>& q) const {
    const T stretch = q[1] - q[0] - l;
    return m1 * g * q[0] + m2 * g * q[1] + k * stretch * stretch / 2;
  }

  GeometryOf<T> geometry() const {
    GeometryOf<T> geometry{.gravity = {0, -g, 0}};
    const int lower = geometry.add_body({.name = "lower ball", .mass = m1, .position = {{{}, {0}, {}}}});
    const int upper = geometry.add_body({.name = "upper ball", .mass = m2, .position = {{{}, {1}, {}}}});
    const int ground = geometry.add_shape({.kind = ShapeKind::half_space});
    geometry.pairs = {{0, ground, geometry.add_shape({.kind = ShapeKind::sphere, .body = lower, .size = {R}})}};
    geometry.add_shape({.kind = ShapeKind::sphere, .body = upper, .size = {R}});
    geometry.links = {{lower, upper}};
    return geometry;
  }
};

const bool two_balls_spring_registered = register_scene<TwoBallsSpring>();

}  // namespace
}  // namespace ricochet
