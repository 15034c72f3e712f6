#include <fmt/format.h>

#include "bench/fuzz/families.h"

namespace ricochet {

// Blocks without rotation in a row, q = (x_0, y_0, x_1, y_1, ...), each above the ground y = 0. Neighbours are 0.2 m
// wide, may be joined by springs along x, and may touch with friction on their sides; walls stand left and right.
void draw_blocks(SceneDraw& draw) {
  const int n = draw.integer(1, 4);
  const auto x = [](int i) { return 2 * i; };
  const auto y = [](int i) { return 2 * i + 1; };
  std::string place = draw.number("x0", 0.1, 0.5);
  for (int i = 0; i < n; ++i) {
    const std::string m = draw.number(fmt::format("m{}", i), 0.2, 3);
    if (i > 0) place += "+0.2+" + draw.clearance(fmt::format("gap{}", i), 0.5);
    const std::string height = draw.clearance(fmt::format("y{}", i), 0.4, 50);
    const std::string vx = draw.velocity(fmt::format("vx{}", i), 2);
    const std::string vy = draw.chance(50) ? "0" : draw.velocity(fmt::format("vy{}", i), 1.5);
    draw.coordinate(place, vx, m);
    draw.coordinate(height, vy, m);
    draw.gravity(y(i), m);
  }
  for (int i = 0; i < n; ++i) {
    const std::string e = draw.restitution(fmt::format("e{}", i)), gap = SceneDraw::q(y(i));
    if (draw.chance(65)) {
      const std::string mu = draw.number(fmt::format("mu{}", i), 0.02, 1);
      draw.contact(fmt::format("ground{}", i), gap, e, {mu, {{{x(i), "1"}}}});
    } else {
      draw.contact(fmt::format("ground{}", i), gap, e);
    }
  }
  for (int i = 1; i < n; ++i) {
    if (draw.chance(45)) {
      const std::string k = draw.number(fmt::format("k{}", i), 5, 400);
      const std::string length = draw.number(fmt::format("L{}", i), 0.2, 0.9);
      draw.spring({x(i - 1)}, {x(i)}, k, length);
    }
    const std::string e = draw.restitution(fmt::format("eb{}", i));
    const std::string gap = fmt::format("{}-{}-0.2", SceneDraw::q(x(i)), SceneDraw::q(x(i - 1)));
    if (draw.chance(20)) {
      const std::string mu = draw.number(fmt::format("mub{}", i), 0.02, 0.8);
      draw.contact(fmt::format("side{}", i), gap, e, {mu, {{{y(i), "1"}, {y(i - 1), "-1"}}}});
    } else {
      draw.contact(fmt::format("side{}", i), gap, e);
    }
  }
  if (draw.chance(60)) {
    const std::string e = draw.restitution("el");
    draw.contact("left", SceneDraw::q(x(0)), e);
  }
  if (draw.chance(60)) {
    const std::string room = draw.clearance("room", 0.4), e = draw.restitution("er");
    draw.contact("right", fmt::format("{}+{}-{}", place, room, SceneDraw::q(x(n - 1))), e);
  }
  draw.end_time(0.4, 1.5);
}

}  // namespace ricochet
