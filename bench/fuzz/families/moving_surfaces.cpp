#include <fmt/format.h>

#include "bench/fuzz/families.h"

namespace ricochet {
namespace {

/// An oscillation that is 0 at t = 0, "A*sin(w*t)" or, starting from rest, "A*(1-cos(w*t))"; amplitude and frequency
/// are drawn.
std::string oscillation(SceneDraw& draw, const std::string& name, double largest) {
  const bool from_rest = draw.chance(50);
  const std::string a = draw.number("A" + name, 0.2 * largest, largest);
  const std::string w = draw.number("omega" + name, 2, 30);
  return from_rest ? fmt::format("{}*(1-cos({}*t))", a, w) : fmt::format("{}*sin({}*t)", a, w);
}

}  // namespace

// Masses in the plane, q = (x, y) each, or in space, q = (x, y, z) each, on a table that shakes up and down or rests,
// with a surface that is a belt of varying speed, perhaps with a jerk, or shakes along x; beside a wall that shakes. The
// first mass may hang on a spring with a driven anchor or, in the plane, on a rod with a driven pivot.
void draw_moving_surfaces(SceneDraw& draw) {
  const int dimensions = draw.chance(70) ? 2 : 3, n = draw.integer(1, 3);
  const auto at = [&](int i, int d) { return dimensions * i + d; };
  const std::string table = draw.chance(70) ? oscillation(draw, "t", 0.03) : "0";
  const bool is_swinging = dimensions == 2 && draw.chance(20);

  std::string place = "0.3";
  for (int i = 0; i < n; ++i) {
    const std::string m = draw.number(fmt::format("m{}", i), 0.2, 3);
    if (i > 0) place = plus(place, draw.number(fmt::format("x{}", i), 0.1, 0.5));
    std::string height = draw.clearance(fmt::format("h{}", i), 0.3, 50);
    std::string vx = draw.velocity(fmt::format("vx{}", i), 1.5);
    if (i == 0 && is_swinging) {  // rests under the pivot, a rod's length away
      height = draw.number("h0", 0.01, 0.3);
      vx = "0";
    }
    draw.coordinate(place, vx, m);
    if (dimensions == 3) draw.coordinate("0", draw.velocity(fmt::format("vy{}", i), 1.5), m);
    const int up = draw.coordinate(height, "0", m);
    draw.gravity(up, m);
    if (draw.chance(30)) {  // quadratic drag
      const std::string c = draw.number(fmt::format("c{}", i), 0.02, 0.5);
      draw.force(up, fmt::format("-{}*{}*abs({})", c, SceneDraw::v(up), SceneDraw::v(up)));
    }
  }
  if (is_swinging) {
    const std::string length = draw.number("l", 0.2, 0.5), pivot = oscillation(draw, "p", 0.05);
    draw.joint("rod", fmt::format("({}-0.3-{})**2+({}-h0-{})**2-{}**2", SceneDraw::q(0), pivot, SceneDraw::q(1), length,
                                  length));
  } else if (draw.chance(40)) {
    const std::string k = draw.number("k", 5, 200), anchor = oscillation(draw, "a", 0.2);
    draw.force(0, fmt::format("-{}*({}-0.3-{})", k, SceneDraw::q(0), anchor));
  }
  for (int i = 1; i < n; ++i) {
    if (!draw.chance(30)) continue;
    const std::string k = draw.number(fmt::format("k{}", i), 5, 100),
                      length = draw.number(fmt::format("L{}", i), 0.1, 0.6);
    draw.spring({at(i - 1, 0)}, {at(i, 0)}, k, length);
  }

  for (int i = 0; i < n; ++i) {
    const int up = at(i, dimensions - 1);
    const std::string name = fmt::format("table{}", i), gap = fmt::format("{}-{}", SceneDraw::q(up), table);
    const std::string e = draw.restitution(fmt::format("e{}", i));
    if (draw.chance(30)) {
      draw.contact(name, gap, e);
      continue;
    }
    SceneDraw::Friction friction{draw.number(fmt::format("mu{}", i), 0.02, 0.9), {{{at(i, 0), "1"}}}, {}};
    if (dimensions == 3) friction.tangents.push_back({{at(i, 1), "1"}});
    if (draw.chance(75)) {
      const std::string belt = draw.velocity(fmt::format("B{}", i), 1);
      const std::string shake = draw.number(fmt::format("C{}", i), 0, 0.8),
                        w = draw.number(fmt::format("w{}", i), 2, 25);
      std::string drive = fmt::format("{}-{}*cos({}*t)", belt, shake, w);
      if (draw.chance(25)) {  // overtakes what slides on it for a moment
        const std::string jerk = draw.number(fmt::format("J{}", i), 0.5, 4),
                          d = draw.number(fmt::format("d{}", i), 0.001, 0.03),
                          t = draw.number(fmt::format("t{}", i), 0.1, 0.8);
        drive += fmt::format("-{}*exp(-((t-{})/{})**2)", jerk, t, d);
      }
      friction.drives.push_back(drive);
      if (dimensions == 3) friction.drives.emplace_back("0");
    }
    draw.contact(name, gap, e, friction);
  }
  if (draw.chance(50)) {
    const std::string e = draw.restitution("ew"), wall = oscillation(draw, "w", 0.05);
    draw.contact("wall", fmt::format("{}-{}", SceneDraw::q(0), wall), e);
  }
  draw.end_time(0.3, 1);
}

}  // namespace ricochet
