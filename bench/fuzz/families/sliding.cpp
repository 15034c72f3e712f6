#include <fmt/format.h>

#include "bench/fuzz/families.h"

// Bodies that do not turn, in the plane, in space, or on a line.

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
  draw.contact_with_chance("ground", "q[1]", "e", 85, {"mu", 0.02, 1.2}, {{{x, "1"}}});
  if (draw.chance(30)) {
    const std::string w = draw.clearance("w", 0.5);
    draw.contact_with_chance("wall", w + "-q[0]", "e_w", 60, {"mu_w", 0.02, 1.2}, {{{y, "1"}}});
  }
  draw.end_time(0.3, 1.2);
}

// Blocks without rotation in a row, q = (x_0, y_0, x_1, y_1, ...), each above the ground y = 0. Neighbours are 0.2 m
// wide, may be joined by springs along x, and may touch with friction on their sides; walls stand left and right.
void draw_blocks(SceneDraw& draw) {
  const int n = draw.integer(1, 4);
  const auto x = [](int i) { return 2 * i; };
  const auto y = [](int i) { return 2 * i + 1; };
  std::string place = draw.number("x0", 0.1, 0.5);
  for (int i = 0; i < n; ++i) {
    const std::string m = draw.number(fmt::format("m{}", i), 0.2, 3);
    if (i > 0) place += "+0.2+" + draw.clearance(fmt::format("gap{}", i), 0.5);
    const std::string height = draw.clearance(fmt::format("y{}", i), 0.4, 50);
    const std::string vx = draw.velocity(fmt::format("vx{}", i), 2);
    const std::string vy = draw.chance(50) ? "0" : draw.velocity(fmt::format("vy{}", i), 1.5);
    draw.coordinate(place, vx, m);
    draw.coordinate(height, vy, m);
    draw.gravity(y(i), m);
  }
  for (int i = 0; i < n; ++i) {
    draw.contact_with_chance(fmt::format("ground{}", i), SceneDraw::q(y(i)), fmt::format("e{}", i), 65,
                             {fmt::format("mu{}", i), 0.02, 1}, {{{x(i), "1"}}});
  }
  for (int i = 1; i < n; ++i) {
    if (draw.chance(45)) {
      const std::string k = draw.number(fmt::format("k{}", i), 5, 400);
      const std::string length = draw.number(fmt::format("L{}", i), 0.2, 0.9);
      draw.spring({x(i - 1)}, {x(i)}, k, length);
    }
    const std::string gap = fmt::format("{}-{}-0.2", SceneDraw::q(x(i)), SceneDraw::q(x(i - 1)));
    draw.contact_with_chance(fmt::format("side{}", i), gap, fmt::format("eb{}", i), 20,
                             {fmt::format("mub{}", i), 0.02, 0.8}, {{{y(i), "1"}, {y(i - 1), "-1"}}});
  }
  if (draw.chance(60)) {
    const std::string e = draw.restitution("el");
    draw.contact("left", SceneDraw::q(x(0)), e);
  }
  if (draw.chance(60)) {
    const std::string room = draw.clearance("room", 0.4), e = draw.restitution("er");
    draw.contact("right", fmt::format("{}+{}-{}", place, room, SceneDraw::q(x(n - 1))), e);
  }
  draw.end_time(0.4, 1.5);
}

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
    const std::string name = i == 0 ? "ground" : fmt::format("box{}", i);
    SceneDraw::Direction slip{{x(i), "1"}};
    if (i > 0) slip.emplace_back(x(i - 1), "-1");
    draw.contact_with_chance(name, gap, fmt::format("e{}", i), 80, {fmt::format("mu{}", i), 0.02, 1}, {slip});
  }
  draw.end_time(0.3, 1.2);
}

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
    draw.contact_with_chance(fmt::format("ground{}", i), at(i, 2), fmt::format("e{}", i), 65,
                             {fmt::format("mu{}", i), 0.02, 0.9}, {{{3 * i, "1"}}, {{3 * i + 1, "1"}}});
    if (draw.chance(25)) {
      const std::string w = draw.number(fmt::format("w{}", i), 0.4, 0.8);
      const std::string gap = fmt::format("{}+{}", at(i, 1), w);
      draw.contact_with_chance(fmt::format("wall{}", i), gap, fmt::format("ew{}", i), 40,
                               {fmt::format("muw{}", i), 0.02, 0.9}, {{{3 * i, "1"}}, {{3 * i + 2, "1"}}});
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

// Balls on a vertical line between floor and ceiling. Neighbours touch at a distance of 0.2 m, and springs may join
// them.
void draw_column(SceneDraw& draw) {
  const int n = draw.integer(1, 5);
  std::string place;
  for (int i = 0; i < n; ++i) {
    const std::string m = draw.number(fmt::format("m{}", i), 0.2, 3);
    place = plus(i > 0 ? place + "+0.2" : "", draw.clearance(fmt::format("gap{}", i), 0.5));
    const std::string v0 = draw.velocity(fmt::format("v{}", i), 2.5);
    draw.gravity(draw.coordinate(place, v0, m), m);
  }
  for (int i = 1; i < n; ++i) {
    if (!draw.chance(50)) continue;
    const std::string k = draw.number(fmt::format("k{}", i), 10, 500);
    const std::string length = draw.number(fmt::format("L{}", i), 0.2, 0.6);
    draw.spring({i - 1}, {i}, k, length);
  }
  const std::string e_floor = draw.restitution("e0");
  draw.contact("floor", SceneDraw::q(0), e_floor);
  for (int i = 1; i < n; ++i) {
    const std::string e = draw.restitution(fmt::format("e{}", i));
    draw.contact(fmt::format("balls{}{}", i - 1, i), fmt::format("{}-{}-0.2", SceneDraw::q(i), SceneDraw::q(i - 1)), e);
  }
  if (draw.chance(70)) {
    const std::string room = draw.clearance("room", 0.4), e = draw.restitution("ec");
    draw.contact("ceiling", fmt::format("{}+{}-{}", place, room, SceneDraw::q(n - 1)), e);
  }
  draw.end_time(0.4, 1.2);
}

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
