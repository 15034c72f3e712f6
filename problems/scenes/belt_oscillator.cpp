#include "problems/scene.h"

namespace ricochet {
namespace {

// A mass on a spring, carried along by a moving belt and driven by a periodic load.
//
//    |            m x'' = -k x - c x' + F sin(Omega t) + lambda_t
//    |-/\/\-[ ]   m y'' = -m g + lambda_n,   f_c = y,   v_t = x' - v_belt
//    |   ->_____
//         ( o  -> v_belt
//
// q[0] is x, along the belt, and q[1] is y, above it. The belt is a surface that moves by itself: no friction force
// slows it down. In stick the mass moves with v_belt until the spring and the load exceed mu m g.
template <class T>
struct BeltOscillator {
  static constexpr SceneText text{"belt_oscillator", "slip-stick oscillator on a moving belt",
                                  "Coulomb friction oscillator with a periodic load",
                                  "many changes between slip and stick in a contact that never opens"};

  T m{1.0}, g{9.81}, k{100.0}, c{1.0}, mu{0.4}, v_belt{0.2}, F{3.0}, Omega{7.0}, duration{3.0};

  void parameters(auto&& visit) {
    visit("m", m, "kg");
    visit("g", g, "m/s^2");
    visit("k", k, "N/m");
    visit("c", c, "N s/m");
    visit("mu", mu, "1");
    visit("v_belt", v_belt, "m/s");
    visit("F", F, "N");
    visit("Omega", Omega, "rad/s");
    visit("duration", duration, "s");
  }

  Vec<T, 2> q0() const { return {0, 0}; }
  Vec<T, 2> v0() const { return {0, 0}; }
  T end_time() const { return duration; }

  Vec<T, 2> mass() const { return {m, m}; }
  Vec<T, 2> force(const Vec<T, 2>& q, const Vec<T, 2>& v, const T& t) const {
    using std::sin;
    return {-k * q[0] - c * v[0] + F * sin(Omega * t), -m * g};
  }
  std::array<Contact<T>, 1> contacts() const { return {{{"belt", 0, mu}}}; }
  Vec<T, 1> gap(const Vec<T, 2>& q) const { return {q[1]}; }
  std::array<std::array<Vec<T, 2>, 1>, 1> tangents(const Vec<T, 2>&) const { return {{{{{1, 0}}}}}; }
  std::array<std::array<T, 1>, 1> drives(const Vec<T, 2>&, const T&) const { return {{{-v_belt}}}; }

  /// A mass of 20 cm by 10 cm, of which q is the middle of the lower face. The belt runs under it: that is no body.
  GeometryOf<T> geometry() const {
    GeometryOf<T> geometry{.gravity = {0, -g, 0}};
    const int mass = geometry.add_body({.name = "mass", .mass = m, .position = {{{0}, {1}, {}}}});
    const T height = T(1) / 10;
    const int belt = geometry.add_shape({.kind = ShapeKind::half_space});
    const int box = geometry.add_shape(
        {.kind = ShapeKind::box, .body = mass, .size = {height, height / 2, height}, .position = {0, height / 2, 0}});
    geometry.pairs = {{0, belt, box}};
    geometry.links = {{-1, mass, {-5 * height, height / 2, 0}, {-height, height / 2, 0}}};
    return geometry;
  }
};

const bool belt_oscillator_registered = register_scene<BeltOscillator>();

}  // namespace
}  // namespace ricochet
