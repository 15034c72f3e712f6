#include <fmt/format.h>

#include "bench/fuzz/families.h"

namespace ricochet {

// Contacts that touch without a load. Either a part lies on a jaw without weight, q = (x, y), may slide, and is pressed
// or lifted later by a force that grows from zero; or balls on a line touch their neighbours, free or on equal springs
// whose forces agree, q = (x_0, ..., x_n-1), and the first one is drawn back or thrown.
void draw_unloaded_contacts(SceneDraw& draw) {
  if (draw.chance(50)) {
    const std::string m = draw.number("m", 0.2, 3);
    const std::string vx = draw.velocity("vx", 2);
    draw.coordinate("0", vx, m);
    draw.coordinate("0", "0", m);
    const std::string press = draw.number("press", 1, 30);
    const int power = draw.integer(1, 3);
    const std::string late = draw.chance(50) ? "0" : draw.number("late", 0.05, 0.4);
    const std::string growing = late == "0" ? fmt::format("t**{}", power) : fmt::format("max(t-{},0)**{}", late, power);
    draw.force(1, draw.chance(70) ? fmt::format("-{}*{}", press, growing) : fmt::format("{}*{}", press, growing));
    if (draw.chance(50)) draw.force(0, draw.number("pull", -4, 4) + "*t");
    const std::string e = draw.restitution("e");
    if (draw.chance(70)) {
      const std::string mu = draw.number("mu", 0.1, 0.9);
      draw.contact("jaw", "q[1]", e, {mu, {{{0, "1"}}}});
    } else {
      draw.contact("jaw", "q[1]", e);
    }
    draw.end_time(0.4, 1.2);
    return;
  }
  const int n = draw.integer(2, 4);
  const bool has_springs = draw.chance(60), is_thrown = draw.chance(50);
  const std::string k = has_springs ? draw.number("k", 10, 80) : "0";
  const std::string back = draw.number("back", 0.05, 0.3), speed = draw.number("speed", 0.5, 2);
  const bool has_equal_masses = draw.chance(60);
  for (int i = 0; i < n; ++i) {
    const std::string m = i > 0 && has_equal_masses ? "m0" : draw.number(fmt::format("m{}", i), 0.3, 2);
    const std::string q0 = i > 0 || is_thrown ? "0" : "-" + back, v0 = i == 0 && is_thrown ? speed : "0";
    draw.coordinate(q0, v0, m);
    if (has_springs) draw.force(i, fmt::format("-{}*{}", k, SceneDraw::q(i)));
  }
  if (!has_springs && !is_thrown) draw.force(0, draw.number("push", 0.5, 3));
  for (int i = 1; i < n; ++i) {
    const std::string e = draw.restitution(fmt::format("e{}", i));
    draw.contact(fmt::format("pair{}", i), fmt::format("{}-{}", SceneDraw::q(i), SceneDraw::q(i - 1)), e);
  }
  draw.end_time(0.4, 1.5);
}

}  // namespace ricochet
