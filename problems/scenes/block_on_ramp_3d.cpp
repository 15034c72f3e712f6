#include "problems/scene.h"

namespace ricochet {
namespace {

// A block at rest on a rough ramp in space: q[0] = x and q[1] = y in the plane of the ramp, q[2] = z across it.
//
//   m (x, y)'' = m g sin(slope) d + lambda_t,   d = (cos(direction), sin(direction)) the way down
//   m z''      = -m g cos(slope) + lambda_n,    f_c = z,   v_t = (x', y')
//
// With the friction disc it sticks exactly when tan(slope) <= mu, and else moves the way down, which is at the angle
// `direction` from the first axis. A polygon in place of the disc has its vertices at fixed angles, and then it
// matters.
template <class T>
struct BlockOnRamp3d {
  static constexpr SceneText text{"block_on_ramp_3d", "block on a rough ramp in space", "Coulomb friction, closed form",
                                  "the downhill direction is not along a facet of a friction polygon"};

  T m{1.0}, g{9.81}, mu{0.5}, slope{0.6}, direction{0.3}, duration{0.5};

  void parameters(auto&& visit) {
    visit("m", m, "kg");
    visit("g", g, "m/s^2");
    visit("mu", mu, "1");
    visit("slope", slope, "rad");
    visit("direction", direction, "rad");
    visit("duration", duration, "s");
  }

  Vec<T, 3> q0() const { return {0, 0, 0}; }
  Vec<T, 3> v0() const { return {0, 0, 0}; }
  T end_time() const { return duration; }

  Vec<T, 3> mass() const { return {m, m, m}; }
  Vec<T, 3> force(const Vec<T, 3>&, const Vec<T, 3>&) const {
    using std::cos, std::sin;
    return {m * g * sin(slope) * cos(direction), m * g * sin(slope) * sin(direction), -m * g * cos(slope)};
  }
  std::array<Contact<T>, 1> contacts() const { return {{{"ramp", 0, mu}}}; }
  Vec<T, 1> gap(const Vec<T, 3>& q) const { return {q[2]}; }
  std::array<std::array<Vec<T, 3>, 2>, 1> tangents(const Vec<T, 3>&) const { return {{{{{1, 0, 0}, {0, 1, 0}}}}}; }
  T potential_energy(const Vec<T, 3>& q) const {
    using std::cos, std::sin;
    return m * g * (q[2] * cos(slope) - sin(slope) * (q[0] * cos(direction) + q[1] * sin(direction)));
  }

  /// A block of 20 cm by 20 cm by 10 cm, of which q is the middle of the lower face, in the axes of the ramp.
  GeometryOf<T> geometry() const {
    using std::cos, std::sin;
    GeometryOf<T> geometry{
        .in_space = true,
        .gravity = {g * sin(slope) * cos(direction), g * sin(slope) * sin(direction), -g * cos(slope)}};
    const int block = geometry.add_body({.name = "block", .mass = m, .position = {{{0}, {1}, {2}}}});
    const T height = T(1) / 10;
    const int ramp = geometry.add_shape({.kind = ShapeKind::half_space});
    const int box = geometry.add_shape(
        {.kind = ShapeKind::box, .body = block, .size = {height, height, height / 2}, .position = {0, 0, height / 2}});
    geometry.pairs = {{0, ramp, box}};
    return geometry;
  }
};

const bool block_on_ramp_3d_registered = register_scene<BlockOnRamp3d>();

}  // namespace
}  // namespace ricochet
