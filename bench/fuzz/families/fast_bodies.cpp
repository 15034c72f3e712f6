#include <fmt/format.h>

#include "bench/fuzz/families.h"

namespace ricochet {

// Fast discs without gravity, q = (x, y) each, which fly at up to 30 m/s past or against round posts, each other, and a
// washboard y = -0.3 + A sin(w x) with bumps of centimetres. A flight is much longer than a contact is deep.
void draw_fast_bodies(SceneDraw& draw) {
  const int n = draw.integer(1, 3);
  const auto x = [](int i) { return SceneDraw::q(2 * i); };
  const auto y = [](int i) { return SceneDraw::q(2 * i + 1); };
  const auto apart = [](const std::string& dx, const std::string& dy, const std::string& radii) {
    return fmt::format("sqrt(({})**2+({})**2)-({})", dx, dy, radii);
  };
  for (int i = 0; i < n; ++i) {
    const std::string m = draw.number(fmt::format("m{}", i), 0.2, 3), r = draw.number(fmt::format("r{}", i), 0.02, 0.1);
    const std::string y0 = draw.number(fmt::format("y{}", i), 0.3, 0.4);
    const std::string speed = draw.number(fmt::format("vx{}", i), 3, 30),
                      vy = draw.number(fmt::format("vy{}", i), -0.6, 0.3);
    draw.coordinate(fmt::format("{}*3", i), i % 2 == 0 ? speed : "-" + speed, m);
    draw.coordinate(y0, vy, m);
  }
  const int posts = draw.integer(n == 1 ? 1 : 0, 2);
  for (int k = 0; k < posts; ++k) {
    const std::string place = draw.number(fmt::format("px{}", k), 1, 8),
                      height = draw.number(fmt::format("py{}", k), 0, 0.7),
                      radius = draw.number(fmt::format("pr{}", k), 0.02, 0.1);
    for (int i = 0; i < n; ++i) {
      const std::string e = draw.restitution(fmt::format("ep{}{}", k, i));
      // A post in which a disc would start lies 3 m further.
      draw.contact(fmt::format("post{}_{}", k, i),
                   apart(fmt::format("{}-{}-{}", x(i), place, 10 + 2 * k), y(i) + "-" + height,
                         fmt::format("{}+r{}", radius, i)),
                   e);
    }
  }
  for (int j = 1; j < n; ++j) {
    const std::string e = draw.restitution(fmt::format("ed{}", j));
    draw.contact(fmt::format("discs{}", j),
                 apart(fmt::format("{}-{}", x(j), x(j - 1)), fmt::format("{}-{}", y(j), y(j - 1)),
                       fmt::format("r{}+r{}", j - 1, j)),
                 e);
  }
  if (draw.chance(50)) {
    const std::string a = draw.number("A", 0.02, 0.15), w = draw.number("w", 1, 8), e = draw.restitution("ew");
    draw.contact("washboard", fmt::format("{}+0.3-{}*sin({}*{})", y(0), a, w, x(0)), e);
  }
  draw.end_time(0.5, 2.5);
}

}  // namespace ricochet
