#include "problems/scene.h"

namespace ricochet {
namespace {

// A point mass above the ground, one dimension.
//
//      o  q      m q'' = -m g + lambda_n,   f_c = q - r
//   _______
//
// With 0 < e < 1 the impacts accumulate at t = sqrt(2 (height - r) / g) (1 + e) / (1 - e): the simplest Zeno point.
template <class T>
struct BouncingBall {
  static constexpr SceneText text{
      "bouncing_ball", "bouncing ball in one dimension", "Brogliato, Nonsmooth Mechanics, 3rd ed., section 1.2",
      "free flight is exact for every tableau of order >= 2, so only the impacts cause an error"};

  T m{1.0}, g{9.81}, r{0.1}, e{0.9}, height{1.0}, duration{2.0};

  void parameters(auto&& visit) {
    visit("m", m, "kg");
    visit("g", g, "m/s^2");
    visit("r", r, "m");
    visit("e", e, "1");
    visit("height", height, "m");
    visit("duration", duration, "s");
  }

  Vec<T, 1> q0() const { return {height}; }
  Vec<T, 1> v0() const { return {0}; }
  T end_time() const { return duration; }

  Vec<T, 1> mass() const { return {m}; }
  Vec<T, 1> force(const Vec<T, 1>&, const Vec<T, 1>&) const { return {-m * g}; }
  std::array<Contact<T>, 1> contacts() const { return {{{"ground", e}}}; }
  Vec<T, 1> gap(const Vec<T, 1>& q) const { return {q[0] - r}; }
  T potential_energy(const Vec<T, 1>& q) const { return m * g * q[0]; }

  GeometryOf<T> geometry() const {
    GeometryOf<T> geometry{.gravity = {0, -g, 0}};
    const int ball = geometry.add_body({.name = "ball", .mass = m, .position = {{{}, {0}, {}}}});
    const int ground = geometry.add_shape({.kind = ShapeKind::half_space});
    geometry.pairs = {{0, ground, geometry.add_shape({.kind = ShapeKind::sphere, .body = ball, .size = {r}})}};
    return geometry;
  }
};

const bool bouncing_ball_registered = register_scene<BouncingBall>();

}  // namespace
}  // namespace ricochet
