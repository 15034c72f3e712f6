#include <fmt/format.h>

#include "bench/fuzz/families.h"

namespace ricochet {

// Balls on a vertical line between floor and ceiling. Neighbours touch at a distance of 0.2 m, and springs may join
// them.
void draw_column(SceneDraw& draw) {
  const int n = draw.integer(1, 5);
  std::string place;
  for (int i = 0; i < n; ++i) {
    const std::string m = draw.number(fmt::format("m{}", i), 0.2, 3);
    place = plus(i > 0 ? place + "+0.2" : "", draw.clearance(fmt::format("gap{}", i), 0.5));
    const std::string v0 = draw.velocity(fmt::format("v{}", i), 2.5);
    draw.gravity(draw.coordinate(place, v0, m), m);
  }
  for (int i = 1; i < n; ++i) {
    if (!draw.chance(50)) continue;
    const std::string k = draw.number(fmt::format("k{}", i), 10, 500);
    const std::string length = draw.number(fmt::format("L{}", i), 0.2, 0.6);
    draw.spring({i - 1}, {i}, k, length);
  }
  const std::string e_floor = draw.restitution("e0");
  draw.contact("floor", SceneDraw::q(0), e_floor);
  for (int i = 1; i < n; ++i) {
    const std::string e = draw.restitution(fmt::format("e{}", i));
    draw.contact(fmt::format("balls{}{}", i - 1, i), fmt::format("{}-{}-0.2", SceneDraw::q(i), SceneDraw::q(i - 1)), e);
  }
  if (draw.chance(70)) {
    const std::string room = draw.clearance("room", 0.4), e = draw.restitution("ec");
    draw.contact("ceiling", fmt::format("{}+{}-{}", place, room, SceneDraw::q(n - 1)), e);
  }
  draw.end_time(0.4, 1.2);
}

}  // namespace ricochet
