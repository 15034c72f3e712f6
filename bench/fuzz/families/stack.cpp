#include <fmt/format.h>

#include "bench/fuzz/families.h"

namespace ricochet {

// Boxes of height 0.2 m without rotation upon each other, q = (x_0, y_0, x_1, y_1, ...), with friction between them:
// slip of box i on the one below is x_i' - x_{i-1}'. Forces and springs pull sideways.
void draw_stack(SceneDraw& draw) {
  const int n = draw.integer(2, 4);
  const auto x = [](int i) { return 2 * i; };
  const auto y = [](int i) { return 2 * i + 1; };
  std::string height;
  for (int i = 0; i < n; ++i) {
    const std::string m = draw.number(fmt::format("m{}", i), 0.2, 3);
    height = plus(i > 0 ? height + "+0.2" : "", draw.clearance(fmt::format("gap{}", i), 0.3, 50));
    const std::string x0 = draw.number(fmt::format("x{}", i), -0.1, 0.1), vx = draw.velocity(fmt::format("vx{}", i), 2);
    const std::string vy = draw.chance(60) ? "0" : draw.velocity(fmt::format("vy{}", i), 1.5);
    draw.coordinate(x0, vx, m);
    draw.coordinate(height, vy, m);
    draw.gravity(y(i), m);
    if (draw.chance(25)) {
      const std::string F = draw.number(fmt::format("F{}", i), -6, 6);
      draw.force(x(i), F);
      draw.potential(fmt::format("-{}*{}", F, SceneDraw::q(x(i))));
    }
    if (draw.chance(30)) {
      const std::string k = draw.number(fmt::format("k{}", i), 5, 200);
      const std::string anchor = draw.number(fmt::format("a{}", i), -0.5, 0.5);
      draw.spring({}, {x(i)}, k, "0", {anchor});
    }
  }
  for (int i = 0; i < n; ++i) {
    const std::string gap =
        i == 0 ? SceneDraw::q(y(0)) : fmt::format("{}-{}-0.2", SceneDraw::q(y(i)), SceneDraw::q(y(i - 1)));
    const std::string e = draw.restitution(fmt::format("e{}", i));
    const std::string name = i == 0 ? "ground" : fmt::format("box{}", i);
    if (draw.chance(80)) {
      const std::string mu = draw.number(fmt::format("mu{}", i), 0.02, 1);
      SceneDraw::Friction friction{mu, {{{x(i), "1"}}}};
      if (i > 0) friction.tangents[0].emplace_back(x(i - 1), "-1");
      draw.contact(name, gap, e, friction);
    } else {
      draw.contact(name, gap, e);
    }
  }
  draw.end_time(0.3, 1.2);
}

}  // namespace ricochet
