#include "problems/assembly/scene_parameters.h"

namespace ricochet {
namespace {

// Newton's cradle: n equal balls in a row that touch, without gravity; the first one flies into the others.
//
//      o ->    o o o o       m x_i'' = lambda_i-1 - lambda_i
//                            f_c^i = x_{i+1} - x_i - 2 R
//
// All n - 1 contacts strike at one instant, and which velocities follow is a question of the law: momentum and energy
// leave n - 2 of them open. Law LZB with springs of Hertz (impact_hypothesis.h) sends the last ball off with most of the
// velocity, and the others after it with less; Newton's law, Moreau's for several impacts, with e = 1 sends the first ball
// back and all others forward with the same velocity.
//
// With two balls and e every law has v_1+ = (1 - e) v / 2, v_2+ = (1 + e) v / 2.

template <class T>
struct BallsTouch : ContactScene<T, 2> {
  Vec<T, 1> gap(const Vec<T, 2>& q) const { return {q[1] - q[0] - 2 * this->size}; }
};

template <class T>
struct NewtonsCradle {
  static constexpr SceneText text{"newtons_cradle", "n balls in a row, hit by one of them",
                                  "impact law of Liu, Zhao, Brogliato, Proc. R. Soc. A 464 (2008) 3193-3211",
                                  "simultaneous impacts, whose outcome depends on the impact law"};

  static void assemble(AssemblyOf<T>& cradle, const SceneParametersOf<T>& p) {
    const int n = p.count("n", 2, 20);
    const T m = p.positive("m"), R = p.positive("R");
    const auto pair = cradle.add_kind(BallsTouch<T>{{R, p["e"], 0}});
    for (int i = 0; i < n; ++i) {
      const T x = 2 * R * i - (i == 0 ? p["distance"] : T(0));
      cradle.add_coordinate(m, 0, x, i == 0 ? p["speed"] : T(0));
    }
    for (int i = 0; i + 1 < n; ++i) cradle.add_contact(pair, {i, i + 1}, fmt::format("balls {}, {}", i + 1, i + 2));

    GeometryOf<T> geometry;
    for (int i = 0; i < n; ++i) {
      const int ball =
          geometry.add_body({.name = fmt::format("ball {}", i + 1), .mass = m, .position = {{{i}, {}, {}}}});
      const int shape = geometry.add_shape({.kind = ShapeKind::sphere, .body = ball, .size = {R}});
      if (i > 0) geometry.pairs.push_back({i - 1, shape - 1, shape});
    }
    cradle.set_geometry(std::move(geometry));
    cradle.set_impact_law({.hypothesis = ImpactHypothesis::lzb, .eta = p.value("eta"), .stiffness = {}});
  }
};

const bool newtons_cradle_registered = register_assembled_scene<NewtonsCradle>({{"n", 5, "1"},
                                                                                {"m", 0.1, "kg"},
                                                                                {"R", 0.02, "m"},
                                                                                {"e", 0.95, "1"},
                                                                                {"eta", 1.5, "1"},
                                                                                {"distance", 0.1, "m"},
                                                                                {"speed", 1, "m/s"},
                                                                                {"duration", 0.3, "s"}});

}  // namespace
}  // namespace ricochet
