#include "problems/scene.h"

namespace ricochet {
namespace {

// A block on a rough plane with initial speed v_x0: it slips, then sticks.
//
//      [ ] ->    m x'' = lambda_t
//   _______      m y'' = -m g + lambda_n,   f_c = y,   v_t = x'
//
// q[0] is x, along the plane, and q[1] is y, above it. It stops at t = v_x0 / (mu g), x = v_x0^2 / (2 mu g).
template <class T>
struct SlidingBlock {
  static constexpr SceneText text{"sliding_block", "block sliding on a rough plane", "Coulomb friction, closed form",
                                  "persistent contact and the change from slip to stick"};

  T m{1.0}, g{9.81}, mu{0.3}, v_x0{2.0}, duration{1.0};

  void parameters(auto&& visit) {
    visit("m", m, "kg");
    visit("g", g, "m/s^2");
    visit("mu", mu, "1");
    visit("v_x0", v_x0, "m/s");
    visit("duration", duration, "s");
  }

  Vec<T, 2> q0() const { return {0, 0}; }
  Vec<T, 2> v0() const { return {v_x0, 0}; }
  T end_time() const { return duration; }

  Vec<T, 2> mass() const { return {m, m}; }
  Vec<T, 2> force(const Vec<T, 2>&, const Vec<T, 2>&) const { return {0, -m * g}; }
  std::array<Contact<T>, 1> contacts() const { return {{{"plane", 0, mu}}}; }
  Vec<T, 1> gap(const Vec<T, 2>& q) const { return {q[1]}; }
  std::array<std::array<Vec<T, 2>, 1>, 1> tangents(const Vec<T, 2>&) const { return {{{{{1, 0}}}}}; }
  T potential_energy(const Vec<T, 2>& q) const { return m * g * q[1]; }

  /// A block of 20 cm by 10 cm, of which q is the middle of the lower face.
  GeometryOf<T> geometry() const {
    GeometryOf<T> geometry{.gravity = {0, -g, 0}};
    const int block = geometry.add_body({.name = "block", .mass = m, .position = {{{0}, {1}, {}}}});
    const T height = T(1) / 10;
    const int plane = geometry.add_shape({.kind = ShapeKind::half_space});
    const int box = geometry.add_shape(
        {.kind = ShapeKind::box, .body = block, .size = {height, height / 2, height}, .position = {0, height / 2, 0}});
    geometry.pairs = {{0, plane, box}};
    return geometry;
  }
};

const bool sliding_block_registered = register_scene<SlidingBlock>();

}  // namespace
}  // namespace ricochet
