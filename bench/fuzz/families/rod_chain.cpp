#include <fmt/format.h>

#include "bench/fuzz/families.h"

namespace ricochet {

// Point masses (x_i, y_i) joined by rigid rods, |p_i - p_{i-1}|^2 - l_i^2 = 0, above rough ground; the first one may
// hang on a hinge. Rod i starts at the angle a_i with the angular velocity w_i, so that the state keeps the
// constraints:
//
//   p_i = p_{i-1} + l_i (cos(a_i), sin(a_i)),   v_i = v_{i-1} + l_i w_i (-sin(a_i), cos(a_i))
void draw_rod_chain(SceneDraw& draw) {
  const int n = draw.integer(2, 4);
  const bool hangs = draw.chance(25);
  std::string x = "0", y = hangs ? "1" : draw.clearance("y0", 0.4, 40);
  std::string vx = hangs ? "0" : draw.velocity("vx0", 1.5),
              vy = hangs || draw.chance(50) ? "0" : draw.velocity("vy0", 1.5);
  for (int i = 0; i < n; ++i) {
    const std::string m = draw.number(fmt::format("m{}", i), 0.3, 2.5);
    if (i > 0) {
      const std::string l = draw.number(fmt::format("l{}", i), 0.2, 0.45),
                        a = draw.number(fmt::format("a{}", i), 0, 1.4);
      const std::string w = draw.velocity(fmt::format("w{}", i), 2.5);
      x = plus(x, fmt::format("{}*cos({})", l, a));
      y = plus(y, fmt::format("{}*sin({})", l, a));
      vx = plus(vx, fmt::format("-{}*{}*sin({})", l, w, a));
      vy = plus(vy, fmt::format("{}*{}*cos({})", l, w, a));
    }
    draw.coordinate(x, vx, m);
    draw.gravity(draw.coordinate(y, vy, m), m);
  }
  if (hangs) {
    draw.joint("hinge_x", "q[0]");
    draw.joint("hinge_y", "q[1]-1");
  }
  for (int i = 1; i < n; ++i) {
    const auto part = [&](int d) {
      return fmt::format("({}-{})**2", SceneDraw::q(2 * i + d), SceneDraw::q(2 * (i - 1) + d));
    };
    draw.joint(fmt::format("rod{}", i), fmt::format("{}+{}-l{}**2", part(0), part(1), i));
  }
  for (int i = hangs ? 1 : 0; i < n; ++i) {
    const std::string name = fmt::format("ground{}", i), gap = SceneDraw::q(2 * i + 1);
    const std::string e = draw.restitution(fmt::format("e{}", i));
    if (draw.chance(65)) {
      const std::string mu = draw.number(fmt::format("mu{}", i), 0.02, 0.9);
      draw.contact(name, gap, e, {mu, {{{2 * i, "1"}}}});
    } else {
      draw.contact(name, gap, e);
    }
  }
  draw.end_time(0.2, 0.8);
}

}  // namespace ricochet
