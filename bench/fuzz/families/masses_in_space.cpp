#include <fmt/format.h>

#include "bench/fuzz/families.h"

namespace ricochet {

// Masses with q = (x, y, z) each above the ground z = 0, beside a wall y = -w, joined by springs or hung on them, and
// spheres to each other.
void draw_masses_in_space(SceneDraw& draw) {
  const int n = draw.integer(1, 4);
  const auto at = [](int i, int d) { return SceneDraw::q(3 * i + d); };
  std::string place = "0";
  for (int i = 0; i < n; ++i) {
    const std::string m = draw.number(fmt::format("m{}", i), 0.2, 3);
    if (i > 0) place = plus(place, draw.number(fmt::format("x{}", i), 0.3, 1));
    const std::string y0 = draw.number(fmt::format("y{}", i), -0.4, 0.4);
    const std::string z0 = draw.clearance(fmt::format("z{}", i), 0.5, 50);
    const std::string vx = draw.velocity(fmt::format("vx{}", i), 2), vy = draw.velocity(fmt::format("vy{}", i), 2);
    const std::string vz = draw.chance(50) ? "0" : draw.velocity(fmt::format("vz{}", i), 2);
    draw.coordinate(place, vx, m);
    draw.coordinate(y0, vy, m);
    const int z = draw.coordinate(z0, vz, m);
    draw.gravity(z, m);
  }
  const auto all = [](int i) { return std::vector{3 * i, 3 * i + 1, 3 * i + 2}; };
  if (draw.chance(40)) {
    const std::string k = draw.number("k0", 5, 100), length = draw.number("L0", 0.2, 0.6);
    const std::string height = draw.number("h0", 0.6, 1.2);
    draw.spring({}, all(0), k, length, {"-0.3", "0.1", height});
  }
  for (int i = 1; i < n; ++i) {
    if (!draw.chance(50)) continue;
    const std::string k = draw.number(fmt::format("k{}", i), 5, 100);
    const std::string length = draw.number(fmt::format("L{}", i), 0.2, 0.8);
    draw.spring(all(i - 1), all(i), k, length);
  }
  for (int i = 0; i < n; ++i) {
    const std::string e = draw.restitution(fmt::format("e{}", i)), name = fmt::format("ground{}", i);
    if (draw.chance(65)) {
      const std::string mu = draw.number(fmt::format("mu{}", i), 0.02, 0.9);
      draw.contact(name, at(i, 2), e, {mu, {{{3 * i, "1"}}, {{3 * i + 1, "1"}}}});
    } else {
      draw.contact(name, at(i, 2), e);
    }
    if (draw.chance(25)) {
      const std::string w = draw.number(fmt::format("w{}", i), 0.4, 0.8),
                        e_w = draw.restitution(fmt::format("ew{}", i));
      const std::string gap = fmt::format("{}+{}", at(i, 1), w);
      if (draw.chance(40)) {
        const std::string mu = draw.number(fmt::format("muw{}", i), 0.02, 0.9);
        draw.contact(fmt::format("wall{}", i), gap, e_w, {mu, {{{3 * i, "1"}}, {{3 * i + 2, "1"}}}});
      } else {
        draw.contact(fmt::format("wall{}", i), gap, e_w);
      }
    }
  }
  for (int i = 1; i < n; ++i) {
    if (!draw.chance(35)) continue;
    const std::string e = draw.restitution(fmt::format("es{}", i));
    std::string squares;
    for (int d = 0; d < 3; ++d) squares = plus(squares, fmt::format("({}-{})**2", at(i, d), at(i - 1, d)));
    draw.contact(fmt::format("spheres{}{}", i - 1, i), fmt::format("sqrt({})-0.1", squares), e);
  }
  draw.end_time(0.3, 1);
}

}  // namespace ricochet
