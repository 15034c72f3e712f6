#include <fmt/format.h>

#include "bench/fuzz/families.h"

namespace ricochet {

// A block on a rough floor in space, q = (x, y, z), pulled sideways by a load whose direction turns: slip begins, turns
// and stops in space. It starts at rest, at rest under a load at the limit of friction, or sliding.
void draw_turning_loads(SceneDraw& draw) {
  const std::string m = draw.number("m", 0.3, 2), mu = draw.number("mu", 0.1, 0.6);
  const bool is_sliding = draw.chance(30);
  const std::string vx = is_sliding ? draw.velocity("vx", 1.5) : "0", vy = is_sliding ? draw.velocity("vy", 1.5) : "0";
  draw.coordinate("0", vx, m);
  draw.coordinate("0", vy, m);
  const int z = draw.coordinate("0", "0", m);
  draw.gravity(z, m);
  const std::string a = draw.number("a", 1, 8), b = draw.number("b", -8, 8), w = draw.number("w", 0.5, 8);
  switch (draw.integer(0, 3)) {
    case 0:  // ever harder
      draw.force(0, fmt::format("{}*{}*t", m, a));
      draw.force(1, fmt::format("{}*{}*t**2", m, b));
      break;
    case 1:  // a turning direction, ever harder
      draw.force(0, fmt::format("{}*{}*t*cos({}*t)", m, a, w));
      draw.force(1, fmt::format("{}*{}*t*sin({}*t)", m, a, w));
      break;
    case 2:  // from the limit of friction
      draw.force(0, fmt::format("{}*({}*9.81*cos({}*t)+{}*t)", m, mu, w, a));
      draw.force(1, fmt::format("{}*{}*9.81*sin({}*t)", m, mu, w));
      break;
    default:  // on and off
      draw.force(0, fmt::format("{}*{}*sin({}*t)", m, a, w));
      draw.force(1, fmt::format("{}*{}*(1-cos({}*t))/2", m, b, w));
  }
  draw.contact("floor", SceneDraw::q(z), "0", {mu, {{{0, "1"}}, {{1, "1"}}}});
  draw.end_time(0.5, 2);
}

}  // namespace ricochet
