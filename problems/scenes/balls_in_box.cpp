#include <random>

#include "problems/assembly/assembled_problem.h"
#include "problems/assembly/scene_parameters.h"

namespace ricochet {
namespace {

// n discs fall into a box without friction.
//
//   |  o   o |     q = (x_1, y_1, ...),   m v' = (0, -m g) + contacts
//   | o o o  |     f_c = x - R,   L - R - x,   y - R,   |p_j - p_i| - 2 R of every pair
//   |________|
//
// They start on a grid of pitch 2.5 R, each with a velocity of its own, up to `speed` in each direction.

template <class T>
struct DiscAtWall : ContactScene<T, 1> {
  T at{0.0}, side{1.0};
  void parameters(auto&& visit) {
    ContactScene<T, 1>::parameters(visit);
    visit("at", at, "m");
    visit("side", side, "1");
  }
  Vec<T, 1> gap(const Vec<T, 1>& q) const { return {side * (q[0] - at) - this->size}; }
};

template <class T>
struct DiscAtDisc : ContactScene<T, 4> {
  Vec<T, 1> gap(const Vec<T, 4>& q) const {
    using std::sqrt;
    const T x = q[2] - q[0], y = q[3] - q[1];
    return {sqrt(x * x + y * y) - 2 * this->size};
  }
};

constexpr SceneText kBallsInBoxText{"balls_in_box", "n discs that fall into a box", "Newton restitution, no friction",
                                    "n (n - 1) / 2 + 3 n possible contacts, few of them active, all of those curved"};

std::unique_ptr<Problem> make_balls_in_box(const SceneParameters& p) {
  const int n = p.count("n", 1, 1000);
  const double m = p.positive("m"), R = p.positive("R"), pitch = 2.5 * R;
  const int per_row = static_cast<int>(std::ceil(std::sqrt(n)));
  const double L = per_row * pitch + R / 2;
  auto box = std::make_unique<AssembledProblem>(kBallsInBoxText, p["duration"]);
  const auto left = box->add_kind<DiscAtWall>({{R, p["e"]}, 0, 1});
  const auto right = box->add_kind<DiscAtWall>({{R, p["e"]}, L, -1});
  const auto pair = box->add_kind<DiscAtDisc>({{R, p["e"]}});
  std::mt19937 random(static_cast<unsigned>(p.count("seed", 0, 1000000)));
  // Not std::uniform_real_distribution: its numbers differ between libraries.
  const auto velocity = [&] { return p["speed"] * (2.0 * random() / std::mt19937::max() - 1); };
  for (int i = 0; i < n; ++i) {
    box->add_coordinate(m, 0, R * 1.5 + (i % per_row) * pitch, velocity());
    box->add_coordinate(m, -m * p["g"], R * 1.5 + (i / per_row) * pitch, velocity());
  }
  for (int i = 0; i < n; ++i) {
    box->add_contact(left, {2 * i}, fmt::format("disc {}, left", i + 1));
    box->add_contact(right, {2 * i}, fmt::format("disc {}, right", i + 1));
    box->add_contact(left, {2 * i + 1}, fmt::format("disc {}, floor", i + 1));
  }
  for (int i = 0; i < n; ++i) {
    for (int j = i + 1; j < n; ++j)
      box->add_contact(pair, {2 * i, 2 * i + 1, 2 * j, 2 * j + 1}, fmt::format("discs {}, {}", i + 1, j + 1));
  }
  return box;
}

const bool balls_in_box_registered = register_assembled_scene(kBallsInBoxText,
                                                              {{"n", 3, "1"},
                                                               {"m", 0.1, "kg"},
                                                               {"R", 0.05, "m"},
                                                               {"g", 9.81, "m/s^2"},
                                                               {"e", 0, "1"},
                                                               {"speed", 0.5, "m/s"},
                                                               {"seed", 1, "1"},
                                                               {"duration", 1, "s"}},
                                                              make_balls_in_box);

}  // namespace
}  // namespace ricochet
