#include "problems/control/control_scene.h"
#include "problems/derivatives/real_functions.h"

namespace ricochet {
namespace {

// A car with a turbo, whose force is three times as large above v_turbo, reaches its goal in the shortest time and stops
// there. The optimum in closed form is full throttle to the speed limit, cruising, full brake: with the numbers below
// 2 s to 10 m/s, 1 s to 25 m/s, 6 s there, and the same backwards, T = 12 s. Throttle and cruise change at 3 s and at
// 9 s, on the grid of 8 intervals. The turbo begins at 2 s and ends at 10 s, inside of intervals.
//
//         ____              |
//    u-> |_car|        goal |      q = x,   m x'' = u if x' <= v_turbo, else 3 u                                 (1)
//   ______o__o___________|__|      |u| <= 5 N, x' <= 25 m/s, minimal T with x(T) = goal, x'(T) = 0
//                                  f_c = goal + 1 m - x, a wall that is not reached
template <class T>
struct TurboCar {
  static constexpr SceneText text{
      "turbo_car", "a car whose force jumps with its speed reaches its goal in minimal time",
      "after Nurkanović, Sperl, Albrecht, Diehl, Finite elements with switch detection, Numer. Math. 156 (2024)",
      "a force that jumps with the velocity, whose switching times the optimisation determines"};

  T m{1.0}, v_turbo{10.0}, boost{3.0}, goal_x{205.0}, u_guess{1.0}, duration{20.0};

  void parameters(auto&& visit) {
    visit("m", m, "kg");
    visit("v_turbo", v_turbo, "m/s");
    visit("boost", boost, "1");
    visit("goal", goal_x, "m");
    visit("u_guess", u_guess, "N");
    visit("duration", duration, "s");
  }

  Vec<T, 1> q0() const { return {0}; }
  Vec<T, 1> v0() const { return {0}; }
  T end_time() const { return duration; }
  Vec<T, 1> mass() const { return {m}; }
  Vec<T, 1> force(const Vec<T, 1>&, const Vec<T, 1>&) const { return {0}; }
  Mat<T, 1, 1> input(const Vec<T, 1>&, const Vec<T, 1>& v) const {  // (1)
    return {{{choose(v[0] - v_turbo, boost, T(1))}}};
  }
  Vec<T, 1> control() const { return {u_guess}; }
  std::array<Contact<T>, 1> contacts() const { return {{{"wall"}}}; }
  Vec<T, 1> gap(const Vec<T, 1>& q) const { return {goal_x + 1 - q[0]}; }

  ControlGrid grid() const { return {8, 2, "radau-iia:2"}; }
  ControlBounds<1, 1> bounds() const { return {{-10.0}, {1000.0}, {-5.0}, {25.0}, {-5.0}, {5.0}}; }
  std::array<double, 2> time_bounds() const { return {5, 50}; }
  T running_cost(const Vec<T, 1>&, const Vec<T, 1>&, const Vec<T, 1>&) const { return 1; }
  T terminal_cost(const Vec<T, 1>&, const Vec<T, 1>&) const { return 0; }
  Vec<T, 2> terminal(const Vec<T, 1>& q, const Vec<T, 1>& v) const { return {q[0] - goal_x, v[0]}; }
  std::array<const char*, 2> terminal_names() const { return {"place", "rest"}; }
  Vec<T, 1> goal() const { return {goal_x}; }
  GeometryOf<T> geometry() const {
    const T length = T(2), height = T(1);  // half of them
    GeometryOf<T> geometry;
    geometry.add_shape({.kind = ShapeKind::half_space, .name = "ground"});
    const int car = geometry.add_body({.name = "car", .mass = m, .position = {{{0}, {-1, height}, {}}}});
    const int wall = geometry.add_shape(
        {.kind = ShapeKind::half_space, .position = {goal_x + length + 1, 0, 0}, .angles = {0, 0, quarter_turn<T>()}});
    const int box = geometry.add_shape({.kind = ShapeKind::box, .body = car, .size = {length, height, 0}});
    geometry.pairs = {{0, wall, box}};
    return geometry;
  }
};

const bool turbo_car_registered = register_control_problem<TurboCar>();

}  // namespace
}  // namespace ricochet
