#include "problems/scene.h"

namespace ricochet {
namespace {

// A block on a rough ramp, q[0] = x down the ramp, q[1] = y across it, with initial speed v_x0.
//
//      [ ]/
//      / /        m x'' = m g sin(slope) + lambda_t
//       /         m y'' = -m g cos(slope) + lambda_n,   f_c = y,   v_t = x'
//   ___/______
//
// At rest it sticks exactly when tan(slope) <= mu. Thrown upwards (v_x0 < 0) it stops, and then has to decide.
template <class T>
struct BlockOnRamp {
  static constexpr SceneText text{"block_on_ramp", "block on a rough ramp", "Coulomb friction, closed form",
                                  "it sticks up to exactly one angle, tan(slope) = mu"};

  T m{1.0}, g{9.81}, mu{0.5}, slope{0.35}, v_x0{-1.0}, duration{0.5};

  void parameters(auto&& visit) {
    visit("m", m, "kg");
    visit("g", g, "m/s^2");
    visit("mu", mu, "1");
    visit("slope", slope, "rad");
    visit("v_x0", v_x0, "m/s");
    visit("duration", duration, "s");
  }

  Vec<T, 2> q0() const { return {0, 0}; }
  Vec<T, 2> v0() const { return {v_x0, 0}; }
  T end_time() const { return duration; }

  Vec<T, 2> mass() const { return {m, m}; }
  Vec<T, 2> force(const Vec<T, 2>&, const Vec<T, 2>&) const {
    using std::cos, std::sin;
    return {m * g * sin(slope), -m * g * cos(slope)};
  }
  std::array<Contact<T>, 1> contacts() const { return {{{"ramp", 0, mu}}}; }
  Vec<T, 1> gap(const Vec<T, 2>& q) const { return {q[1]}; }
  std::array<std::array<Vec<T, 2>, 1>, 1> tangents(const Vec<T, 2>&) const { return {{{{{1, 0}}}}}; }
  T potential_energy(const Vec<T, 2>& q) const {
    using std::cos, std::sin;
    return m * g * (q[1] * cos(slope) - q[0] * sin(slope));
  }

  /// A block of 20 cm by 10 cm in the axes of the ramp; q is the middle of its lower face.
  GeometryOf<T> geometry() const {
    using std::cos, std::sin;
    GeometryOf<T> geometry{.gravity = {g * sin(slope), -g * cos(slope), 0}};
    const int block = geometry.add_body({.name = "block", .mass = m, .position = {{{0}, {1}, {}}}});
    const T height = T(1) / 10;
    const int ramp = geometry.add_shape({.kind = ShapeKind::half_space});
    const int box = geometry.add_shape(
        {.kind = ShapeKind::box, .body = block, .size = {height, height / 2, height}, .position = {0, height / 2, 0}});
    geometry.pairs = {{0, ramp, box}};
    return geometry;
  }
};

const bool block_on_ramp_registered = register_scene<BlockOnRamp>();

}  // namespace
}  // namespace ricochet
