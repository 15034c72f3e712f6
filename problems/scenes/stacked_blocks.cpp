#include "problems/scene.h"

namespace ricochet {
namespace {

// Three blocks of height h on one another, which do not tilt. The lowest one is pushed away under the others.
//
//     [ 3 ]         m_i x_i'' = lambda_t^i - lambda_t^{i+1}
//     [ 2 ]         m_i y_i'' = -m_i g + lambda_n^i - lambda_n^{i+1}
//     [ 1 ] ->      f_c^1 = y_1,                 v_t^1 = x_1'
//   _________       f_c^i = y_i - y_{i-1} - h,   v_t^i = x_i' - x_{i-1}',   i = 2, 3
//
// q[0] and q[1] are x_1, y_1 of the lowest block, with y_1 its lower face, q[2] to q[5] those of the others. In slip
// every acceleration is a constant, so the motion has a closed form: block 1 brakes, 2 and 3 are dragged along,
// contacts pass from slip to stick one after the other.
template <class T>
struct StackedBlocks {
  static constexpr SceneText text{"stacked_blocks", "three stacked blocks, the lowest one pushed away",
                                  "Coulomb friction, closed form in pieces",
                                  "three closed contacts in a chain, each in slip or stick"};

  T m_1{2.0}, m_2{1.0}, m_3{0.5}, g{9.81}, h{0.1}, mu_ground{0.25}, mu_12{0.2}, mu_23{0.1}, e{0.0}, v_10{1.5};
  T duration{1.0};

  void parameters(auto&& visit) {
    visit("m_1", m_1, "kg");
    visit("m_2", m_2, "kg");
    visit("m_3", m_3, "kg");
    visit("g", g, "m/s^2");
    visit("h", h, "m");
    visit("mu_ground", mu_ground, "1");
    visit("mu_12", mu_12, "1");
    visit("mu_23", mu_23, "1");
    visit("e", e, "1");
    visit("v_10", v_10, "m/s");
    visit("duration", duration, "s");
  }

  Vec<T, 6> q0() const { return {0, 0, 0, h, 0, 2 * h}; }
  Vec<T, 6> v0() const { return {v_10, 0, 0, 0, 0, 0}; }
  T end_time() const { return duration; }

  Vec<T, 6> mass() const { return {m_1, m_1, m_2, m_2, m_3, m_3}; }
  Vec<T, 6> force(const Vec<T, 6>&, const Vec<T, 6>&) const { return {0, -m_1 * g, 0, -m_2 * g, 0, -m_3 * g}; }
  std::array<Contact<T>, 3> contacts() const {
    return {{{"ground", e, mu_ground}, {"blocks 1 and 2", e, mu_12}, {"blocks 2 and 3", e, mu_23}}};
  }
  Vec<T, 3> gap(const Vec<T, 6>& q) const { return {q[1], q[3] - q[1] - h, q[5] - q[3] - h}; }
  std::array<std::array<Vec<T, 6>, 1>, 3> tangents(const Vec<T, 6>&) const {
    return {{{{{1, 0, 0, 0, 0, 0}}}, {{{-1, 0, 1, 0, 0, 0}}}, {{{0, 0, -1, 0, 1, 0}}}}};
  }
  T potential_energy(const Vec<T, 6>& q) const { return g * (m_1 * q[1] + m_2 * q[3] + m_3 * q[5]); }

  /// Blocks of twice their height h, of which q is the middle of the lower face.
  GeometryOf<T> geometry() const {
    GeometryOf<T> geometry{.gravity = {0, -g, 0}};
    int below = geometry.add_shape({.kind = ShapeKind::half_space});
    const T masses[] = {m_1, m_2, m_3};
    for (int i = 0; i < 3; ++i) {
      const int block = geometry.add_body(
          {.name = fmt::format("block {}", i + 1), .mass = masses[i], .position = {{{2 * i}, {2 * i + 1}, {}}}});
      const int box =
          geometry.add_shape({.kind = ShapeKind::box, .body = block, .size = {h, h / 2, h}, .position = {0, h / 2, 0}});
      geometry.pairs.push_back({i, below, box});
      below = box;
    }
    return geometry;
  }
};

const bool stacked_blocks_registered = register_scene<StackedBlocks>();

}  // namespace
}  // namespace ricochet
