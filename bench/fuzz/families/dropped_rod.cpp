#include <fmt/format.h>

#include "bench/fuzz/families.h"

namespace ricochet {

// A uniform rod of length 2 l, q = (x, y, theta) of its centre, J = m l^2 / 3, with both ends above rough ground:
//
//   f_c = y -+ l sin(theta),   v_t = x' +- l sin(theta) theta'
void draw_dropped_rod(SceneDraw& draw) {
  const std::string m = draw.number("m", 0.2, 3), l = draw.number("l", 0.15, 0.8);
  const std::string theta = draw.chance(8) ? draw.constant("th", "0") : draw.number("th", 0.02, 1.5);
  const std::string height = draw.clearance("y0", 0.3, 30);
  const std::string vx = draw.velocity("vx", 1.5), vy = draw.velocity("vy", 1.5), omega = draw.velocity("w", 4);
  draw.coordinate("0", vx, m);
  const int y = draw.coordinate(fmt::format("{}*sin({})+{}", l, theta, height), vy, m);
  draw.coordinate(theta, omega, fmt::format("{}*{}**2/3", m, l));
  draw.gravity(y, m);
  for (const int end : {-1, 1}) {
    const std::string name = end < 0 ? "tip" : "tail", sign = end < 0 ? "-" : "+", opposite = end < 0 ? "" : "-";
    const std::string gap = fmt::format("q[1]{}{}*sin(q[2])", sign, l), e = draw.restitution("e_" + name);
    if (draw.chance(85)) {
      const std::string mu = draw.number("mu_" + name, 0.02, draw.chance(10) ? 1.8 : 1.1);
      draw.contact(name, gap, e, {mu, {{{0, "1"}, {2, fmt::format("{}{}*sin(q[2])", opposite, l)}}}});
    } else {
      draw.contact(name, gap, e);
    }
  }
  draw.end_time(0.2, 0.8);
}

}  // namespace ricochet
