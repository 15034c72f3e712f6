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
// The coordinates are (x - v_belt t, y, t): the mass relative to the belt, and the clock that moves the belt. In these
// the slip velocity is that of the first coordinate, and no friction force can slow the belt down. In stick the mass
// moves with x' = v_belt until the spring and the load exceed mu m g.
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

  Vec<T, 3> q0() const { return {0, 0, 0}; }
  Vec<T, 3> v0() const { return {-v_belt, 0, 1}; }
  T end_time() const { return duration; }

  Vec<T, 3> mass() const { return {m, m, 1}; }
  Vec<T, 3> force(const Vec<T, 3>& q, const Vec<T, 3>& v) const {
    using std::sin;
    const T x = q[0] + v_belt * q[2], x_dot = v[0] + v_belt;
    return {-k * x - c * x_dot + F * sin(Omega * q[2]), -m * g, 0};
  }
  std::array<Contact<T>, 1> contacts() const { return {{{"belt", 0, mu}}}; }
  Vec<T, 1> gap(const Vec<T, 3>& q) const { return {q[1]}; }
  std::array<std::array<Vec<T, 3>, 1>, 1> tangents(const Vec<T, 3>&) const { return {{{{{1, 0, 0}}}}}; }
};

const bool registered = register_scene<BeltOscillator>();

}  // namespace
}  // namespace ricochet
