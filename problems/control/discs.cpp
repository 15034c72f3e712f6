#include "problems/control/control_scene.h"

namespace ricochet {
namespace {

// Two discs in a horizontal plane swap their places around an obstacle; only the first one is driven.
//
//                  ,--.                  q = (x_1, y_1, x_2, y_2),  u = force on disc 1
//     (1) ->      ( ob )       (2)       m_i v_i' = -c_f v_i / sqrt(|v_i|^2 + eps^2) + u delta_i1 + contact     (1)
//                  `--'                  f_c = |p_1 - p_2|^2 - (r_1 + r_2)^2      [m^2]
//
// Path constraints keep both discs away from the obstacle, |p_i|^2 >= (r_ob + r_i)^2. The paper prints the drag as
// v / |v + eps|, which is singular at v = -eps; that is the problem `discs_printed_drag`.
template <class T, bool printed_drag>
struct DiscsWithDrag {
  T m_1{2.0}, m_2{1.0}, r_1{0.3}, r_2{0.2}, r_ob{1.0}, c_f{2.0}, eps{0.1}, e{0.0}, duration{4.0};

  void parameters(auto&& visit) {
    visit("m_1", m_1, "kg");
    visit("m_2", m_2, "kg");
    visit("r_1", r_1, "m");
    visit("r_2", r_2, "m");
    visit("r_ob", r_ob, "m");
    visit("c_f", c_f, "N");
    visit("eps", eps, "m/s");
    visit("e", e, "1");
    visit("duration", duration, "s");
  }

  Vec<T, 4> q0() const { return {-2, 0, 2, 0}; }
  Vec<T, 4> v0() const { return {0, 0, 0, 0}; }
  T end_time() const { return duration; }
  Vec<T, 4> mass() const { return {m_1, m_1, m_2, m_2}; }

  Vec<T, 4> force(const Vec<T, 4>&, const Vec<T, 4>& v) const {  // (1)
    using std::sqrt;
    Vec<T, 4> f;
    for (std::size_t i = 0; i < 4; i += 2) {
      const T x = printed_drag ? v[i] + eps : v[i], y = printed_drag ? v[i + 1] + eps : v[i + 1];
      const T size = printed_drag ? sqrt(x * x + y * y) : sqrt(x * x + y * y + eps * eps);
      f[i] = -c_f * v[i] / size;
      f[i + 1] = -c_f * v[i + 1] / size;
    }
    return f;
  }
  Mat<T, 4, 2> input(const Vec<T, 4>&) const { return {{{1, 0}, {0, 1}, {0, 0}, {0, 0}}}; }
  Vec<T, 2> control() const { return {0, 0}; }

  std::array<Contact<T>, 1> contacts() const { return {{{"discs", e}}}; }
  Vec<T, 1> gap(const Vec<T, 4>& q) const {
    const T x = q[0] - q[2], y = q[1] - q[3];
    return {x * x + y * y - (r_1 + r_2) * (r_1 + r_2)};
  }

  ControlGrid grid() const { return {25, 2, "radau-iia:2"}; }
  ControlBounds<4, 2> bounds() const {
    return {every<4>(-10), every<4>(10), every<4>(-5), every<4>(5), every<2>(-30), every<2>(30)};
  }
  /// Squared distance to the swapped places at rest, weighted.
  T distance(const Vec<T, 4>& q, const Vec<T, 4>& v) const {
    const Vec<T, 4> target = goal();
    T sum = 0;
    for (std::size_t k = 0; k < 4; ++k) sum += 10 * (q[k] - target[k]) * (q[k] - target[k]) + v[k] * v[k] / 100;
    return sum;
  }
  T running_cost(const Vec<T, 4>& q, const Vec<T, 4>& v, const Vec<T, 2>& u) const {
    return distance(q, v) + (u[0] * u[0] + u[1] * u[1]) / 10;
  }
  T terminal_cost(const Vec<T, 4>& q, const Vec<T, 4>& v) const { return 100 * distance(q, v); }
  std::array<T, 2> path(const Vec<T, 4>& q, const Vec<T, 4>&, const Vec<T, 2>&) const {
    return {q[0] * q[0] + q[1] * q[1] - (r_ob + r_1) * (r_ob + r_1),
            q[2] * q[2] + q[3] * q[3] - (r_ob + r_2) * (r_ob + r_2)};
  }
  std::array<const char*, 2> path_names() const { return {"obstacle, disc 1", "obstacle, disc 2"}; }

  Vec<T, 4> goal() const { return {2, 0, -2, 0}; }
  GeometryOf<T> geometry() const {
    GeometryOf<T> geometry;
    const int one = geometry.add_body({.name = "disc 1", .mass = m_1, .position = {{{0}, {1}, {}}}});
    const int two = geometry.add_body({.name = "disc 2", .mass = m_2, .position = {{{2}, {3}, {}}}});
    geometry.add_shape({.kind = ShapeKind::sphere, .size = {r_ob, 0, 0}, .name = "obstacle"});
    const int first = geometry.add_shape({.kind = ShapeKind::sphere, .body = one, .size = {r_1, 0, 0}});
    const int second = geometry.add_shape({.kind = ShapeKind::sphere, .body = two, .size = {r_2, 0, 0}});
    geometry.pairs = {{0, first, second}};  // whose gap is another: f_c is a difference of squares
    return geometry;
  }
};

constexpr const char* kSource = "Nurkanovic, Frey, Pozharskiy, Diehl, FESD-J, section 5.2";

template <class T>
struct Discs : DiscsWithDrag<T, false> {
  static constexpr SceneText text{"discs", "two discs swap places around an obstacle", kSource,
                                  "a contact that must close, stay closed while it turns, and open"};
};

template <class T>
struct DiscsPrintedDrag : DiscsWithDrag<T, true> {
  static constexpr SceneText text{"discs_printed_drag", "two discs, drag as printed in the paper", kSource,
                                  "a drag that is singular at one velocity"};
};

const bool discs_registered = register_control_problem<Discs>() && register_control_problem<DiscsPrintedDrag>();

}  // namespace
}  // namespace ricochet
