#include "problems/scene.h"

namespace ricochet {
namespace {

// A point mass thrown over a rough floor: impacts with normal and tangential impulse.
//
//    o ->        m x'' = lambda_t
//   _______      m y'' = -m g + lambda_n,   f_c = y,   v_t = x'
//
// q[0] is x, along the floor, and q[1] is y, above it. The first impacts slip (|Lambda_t| = mu Lambda_n), the last one
// sticks (v_t+ = 0).
template <class T>
struct ObliqueImpact {
  static constexpr SceneText text{"oblique_impact", "point mass bouncing obliquely on a rough floor",
                                  "Newton restitution with Coulomb friction on the impulse, closed form",
                                  "tangential impulses that slip and that stick"};

  T m{1.0}, g{9.81}, mu{0.2}, e{0.6}, v_x0{3.0}, height{1.0}, duration{1.55};

  void parameters(auto&& visit) {
    visit("m", m, "kg");
    visit("g", g, "m/s^2");
    visit("mu", mu, "1");
    visit("e", e, "1");
    visit("v_x0", v_x0, "m/s");
    visit("height", height, "m");
    visit("duration", duration, "s");
  }

  Vec<T, 2> q0() const { return {0, height}; }
  Vec<T, 2> v0() const { return {v_x0, 0}; }
  T end_time() const { return duration; }

  Vec<T, 2> mass() const { return {m, m}; }
  Vec<T, 2> force(const Vec<T, 2>&, const Vec<T, 2>&) const { return {0, -m * g}; }
  std::array<Contact<T>, 1> contacts() const { return {{{"floor", e, mu}}}; }
  Vec<T, 1> gap(const Vec<T, 2>& q) const { return {q[1]}; }
  std::array<std::array<Vec<T, 2>, 1>, 1> tangents(const Vec<T, 2>&) const { return {{{{{1, 0}}}}}; }
  T potential_energy(const Vec<T, 2>& q) const { return m * g * q[1]; }

  GeometryOf<T> geometry() const {
    GeometryOf<T> geometry{.gravity = {0, -g, 0}};
    const int mass = geometry.add_body({.name = "mass", .mass = m, .position = {{{0}, {1}, {}}}});
    const int floor = geometry.add_shape({.kind = ShapeKind::half_space});
    geometry.pairs = {{0, floor, geometry.add_shape({.kind = ShapeKind::sphere, .body = mass})}};
    return geometry;
  }
};

const bool oblique_impact_registered = register_scene<ObliqueImpact>();

}  // namespace
}  // namespace ricochet
