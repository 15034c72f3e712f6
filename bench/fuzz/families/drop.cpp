#include <fmt/format.h>

#include "bench/fuzz/families.h"

namespace ricochet {

// A block without rotation above a slope of angle a, q = (x, y) along and normal to the slope:
//
//   m x'' = -m g sin(a) + F_x + lambda_t,   m y'' = -m g cos(a) + lambda_n
//
// beside a wall at x = w, and on a spring.
void draw_drop(SceneDraw& draw) {
  const std::string m = draw.number("m", 0.2, 3);
  const std::string y0 = draw.clearance("y0", 0.8), vx0 = draw.velocity("vx0", 2.5), vy0 = draw.velocity("vy0", 2.5);
  const int x = draw.coordinate("0", vx0, m), y = draw.coordinate(y0, vy0, m);
  if (draw.chance(50)) {
    const std::string a = draw.number("a", -0.6, 0.6);
    draw.force(x, fmt::format("-{}*9.81*sin({})", m, a));
    draw.force(y, fmt::format("-{}*9.81*cos({})", m, a));
    draw.potential(fmt::format("{}*9.81*(sin({})*q[0]+cos({})*q[1])", m, a, a));
  } else {
    draw.gravity(y, m);
  }
  if (draw.chance(25)) {
    const std::string F = draw.number("F", -4, 4);
    draw.force(x, F);
    draw.potential(fmt::format("-{}*q[0]", F));
  }
  if (draw.chance(30)) {
    const std::string k = draw.number("k", 5, 200), length = draw.number("L", 0.1, 0.6);
    const std::string anchor = draw.number("anchor", 0.7, 1.2);
    // Beside the block: its force would jump where it passes through its anchor.
    draw.spring({}, {x, y}, k, length, {"0.1", anchor});
  }
  const std::string e = draw.restitution("e");
  if (draw.chance(85)) {
    const std::string mu = draw.number("mu", 0.02, 1.2);
    draw.contact("ground", "q[1]", e, {mu, {{{x, "1"}}}});
  } else {
    draw.contact("ground", "q[1]", e);
  }
  if (draw.chance(30)) {
    const std::string w = draw.clearance("w", 0.5), e_w = draw.restitution("e_w");
    if (draw.chance(60)) {
      const std::string mu = draw.number("mu_w", 0.02, 1.2);
      draw.contact("wall", w + "-q[0]", e_w, {mu, {{{y, "1"}}}});
    } else {
      draw.contact("wall", w + "-q[0]", e_w);
    }
  }
  draw.end_time(0.3, 1.2);
}

}  // namespace ricochet
