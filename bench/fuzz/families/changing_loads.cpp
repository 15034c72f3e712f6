#include <fmt/format.h>

#include "bench/fuzz/families.h"

namespace ricochet {

// Blocks that rest on the ground, q = (x, y) each, under loads that change with time: the weight and a pull upwards
// that swings, grows, acts late or is a short pulse, so that a contact opens, and a pull sideways, so that one with
// friction slips. The second block may stand on the first.
void draw_changing_loads(SceneDraw& draw) {
  const int n = draw.integer(1, 2);
  const bool is_stacked = n == 2 && draw.chance(50);
  const auto course = [&](const std::string& name, double largest) {
    const std::string a = draw.number("A" + name, 0.2 * largest, largest), w = draw.number("w" + name, 1, 8);
    switch (draw.integer(0, 4)) {
      case 0:
        return fmt::format("{}*sin({}*t)", a, w);
      case 1:
        return fmt::format("{}*(1-cos({}*t))/2", a, w);
      case 2:
        return fmt::format("{}*t**{}", a, draw.integer(1, 3));
      case 3:  // late and short
        return fmt::format("{}*exp(-({}*(t-1))**2*9)", a, w);
      default: {  // shorter than the steps of what rests
        const std::string duration = draw.number("d" + name, 0.001, 0.03), at = draw.number("t" + name, 0.2, 1);
        return fmt::format("{}*exp(-((t-{})/{})**2)", a, at, duration);
      }
    }
  };
  for (int i = 0; i < n; ++i) {
    const std::string m = draw.number(fmt::format("m{}", i), 0.2, 3);
    const int x = draw.coordinate(fmt::format("{}", i), "0", m);
    const int y = draw.coordinate("0", "0", m);
    draw.gravity(y, m);
    if (draw.chance(80)) draw.force(y, fmt::format("{}*{}", m, course(fmt::format("y{}", i), 25)));
    if (draw.chance(60)) draw.force(x, fmt::format("{}*{}", m, course(fmt::format("x{}", i), 8)));
  }
  for (int i = 0; i < n; ++i) {
    const std::string e = draw.restitution(fmt::format("e{}", i));
    const bool stands_on_other = is_stacked && i == 1;
    const std::string gap = stands_on_other ? "q[3]-q[1]" : SceneDraw::q(2 * i + 1);
    if (draw.chance(60)) {
      SceneDraw::Friction friction{draw.number(fmt::format("mu{}", i), 0.05, 0.9), {{{2 * i, "1"}}}, {}};
      if (stands_on_other) friction.tangents.front().emplace_back(0, "-1");
      draw.contact(fmt::format("ground{}", i), gap, e, friction);
    } else {
      draw.contact(fmt::format("ground{}", i), gap, e);
    }
  }
  draw.end_time(0.5, 2);
}

}  // namespace ricochet
