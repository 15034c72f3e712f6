#include <fmt/format.h>

#include "bench/fuzz/families.h"

namespace ricochet {

// Two or three bodies with masses between 1e-4 and 1e4 kg above each other on a line, q = (y_0, ...), falling, standing
// or pressed; the lowest on the ground.
void draw_mass_ratios(SceneDraw& draw) {
  const int n = draw.integer(2, 3);
  std::string place;
  for (int i = 0; i < n; ++i) {
    const int decade = draw.integer(-4, 4);
    const std::string m = draw.constant(fmt::format("m{}", i), fmt::format("1e{}", decade));
    place = plus(place, draw.clearance(fmt::format("h{}", i), 0.3, 40));
    const std::string v0 = draw.chance(50) ? "0" : draw.velocity(fmt::format("v{}", i), 1);
    draw.coordinate(place, v0, m);
    draw.gravity(i, m);
  }
  for (int i = 0; i < n; ++i) {
    const std::string e = draw.restitution(fmt::format("e{}", i));
    draw.contact(fmt::format("contact{}", i), i == 0 ? "q[0]" : fmt::format("q[{}]-q[{}]", i, i - 1), e);
  }
  draw.end_time(0.2, 0.6);
}

}  // namespace ricochet
