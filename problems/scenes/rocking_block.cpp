#include "problems/scene.h"

namespace ricochet {
namespace {

// A rectangular block, released from a tilt, that rocks from one lower corner to the other.
//
//      ______
//     |      |         m x'' = sum lambda_t,   m y'' = -m g + sum lambda_n
//     |  o   | 2 h     J phi'' = moments of the corner forces,   J = m (b^2 + h^2) / 3
//     |______|         corners  x_c = x -+ b cos(phi) + h sin(phi),  f_c = y -+ b sin(phi) - h cos(phi),  v_t = x_c'
//   ____________       left: upper sign, right: lower sign; phi counterclockwise, so phi > 0 stands on the left corner
//       2 b
//
// q[0] and q[1] are the centre (x, y), q[2] is the tilt phi. With e = 0 and enough friction the block pivots about the
// new corner, and angular momentum about that corner leaves it 1 - 3/2 sin(alpha)^2 of its angular velocity, with
// tan(alpha) = b / h (Housner). It goes on rocking for b/h < sqrt(2) and stops in one impact for a flatter block.
template <class T>
struct RockingBlock {
  static constexpr SceneText text{"rocking_block", "block that rocks between two corners",
                                  "Housner, Bulletin of the Seismological Society of America 53 (1963)",
                                  "an impact of one corner while the other is in contact, and opens"};

  T m{1.0}, g{9.81}, b{0.1}, h{0.4}, mu{0.6}, e{0.0}, phi0{0.12}, duration{1.5};

  void parameters(auto&& visit) {
    visit("m", m, "kg");
    visit("g", g, "m/s^2");
    visit("b", b, "m");
    visit("h", h, "m");
    visit("mu", mu, "1");
    visit("e", e, "1");
    visit("phi0", phi0, "rad");
    visit("duration", duration, "s");
  }

  Vec<T, 3> q0() const {
    using std::sin, std::cos;
    return {b * cos(phi0) - h * sin(phi0), b * sin(phi0) + h * cos(phi0), phi0};
  }
  Vec<T, 3> v0() const { return {0, 0, 0}; }
  T end_time() const { return duration; }

  Vec<T, 3> mass() const { return {m, m, m * (b * b + h * h) / 3}; }
  Vec<T, 3> force(const Vec<T, 3>&, const Vec<T, 3>&) const { return {0, -m * g, 0}; }
  std::array<Contact<T>, 2> contacts() const { return {{{"left corner", e, mu}, {"right corner", e, mu}}}; }
  Vec<T, 2> gap(const Vec<T, 3>& q) const {
    using std::sin, std::cos;
    return {q[1] - b * sin(q[2]) - h * cos(q[2]), q[1] + b * sin(q[2]) - h * cos(q[2])};
  }
  std::array<std::array<Vec<T, 3>, 1>, 2> tangents(const Vec<T, 3>& q) const {
    using std::sin, std::cos;
    return {{{{{1, 0, b * sin(q[2]) + h * cos(q[2])}}}, {{{1, 0, -b * sin(q[2]) + h * cos(q[2])}}}}};
  }
  T potential_energy(const Vec<T, 3>& q) const { return m * g * q[1]; }

  GeometryOf<T> geometry() const {
    GeometryOf<T> geometry{.gravity = {0, -g, 0}};
    const int block = geometry.add_body({.name = "block",
                                         .mass = m,
                                         .inertia = {0, 0, m * (b * b + h * h) / 3},
                                         .position = {{{0}, {1}, {}}},
                                         .rotation = BodyRotation::planar,
                                         .angles = {{{2}, {}, {}}}});
    const int ground = geometry.add_shape({.kind = ShapeKind::half_space});
    const int box = geometry.add_shape({.kind = ShapeKind::box, .body = block, .size = {b, h, b}});
    geometry.pairs = {{0, ground, box, 0}, {1, ground, box, 1}};  // lower corners, left and right
    return geometry;
  }
};

const bool rocking_block_registered = register_scene<RockingBlock>();

}  // namespace
}  // namespace ricochet
