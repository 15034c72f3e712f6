#include <fmt/format.h>

#include "bench/fuzz/families.h"

// Loads and surfaces that depend on time, contacts without a load, and scenes in other units.

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
    const bool stands_on_other = is_stacked && i == 1;
    const std::string gap = stands_on_other ? "q[3]-q[1]" : SceneDraw::q(2 * i + 1);
    SceneDraw::Direction slip{{2 * i, "1"}};
    if (stands_on_other) slip.emplace_back(0, "-1");
    draw.contact_with_chance(fmt::format("ground{}", i), gap, fmt::format("e{}", i), 60,
                             {fmt::format("mu{}", i), 0.05, 0.9}, {slip});
  }
  draw.end_time(0.5, 2);
}

// A block on a rough floor in space, q = (x, y, z), pulled sideways by a load whose direction turns: slip begins, turns
// and stops in space. It starts at rest, at rest under a load at the limit of friction, or sliding.
void draw_turning_loads(SceneDraw& draw) {
  const std::string m = draw.number("m", 0.3, 2), mu = draw.number("mu", 0.1, 0.6);
  const bool is_sliding = draw.chance(30);
  const std::string vx = is_sliding ? draw.velocity("vx", 1.5) : "0", vy = is_sliding ? draw.velocity("vy", 1.5) : "0";
  draw.coordinate("0", vx, m);
  draw.coordinate("0", vy, m);
  const int z = draw.coordinate("0", "0", m);
  draw.gravity(z, m);
  const std::string a = draw.number("a", 1, 8), b = draw.number("b", -8, 8), w = draw.number("w", 0.5, 8);
  switch (draw.integer(0, 3)) {
    case 0:  // ever harder
      draw.force(0, fmt::format("{}*{}*t", m, a));
      draw.force(1, fmt::format("{}*{}*t**2", m, b));
      break;
    case 1:  // a turning direction, ever harder
      draw.force(0, fmt::format("{}*{}*t*cos({}*t)", m, a, w));
      draw.force(1, fmt::format("{}*{}*t*sin({}*t)", m, a, w));
      break;
    case 2:  // from the limit of friction
      draw.force(0, fmt::format("{}*({}*9.81*cos({}*t)+{}*t)", m, mu, w, a));
      draw.force(1, fmt::format("{}*{}*9.81*sin({}*t)", m, mu, w));
      break;
    default:  // on and off
      draw.force(0, fmt::format("{}*{}*sin({}*t)", m, a, w));
      draw.force(1, fmt::format("{}*{}*(1-cos({}*t))/2", m, b, w));
  }
  draw.contact("floor", SceneDraw::q(z), "0", {mu, {{{0, "1"}}, {{1, "1"}}}});
  draw.end_time(0.5, 2);
}

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
    draw.contact_with_chance("jaw", "q[1]", "e", 70, {"mu", 0.1, 0.9}, {{{0, "1"}}});
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

// A scene of another family, all of whose coordinates are lengths, in other units of length, mass and time: powers of
// ten between 1e-9 and 1e9.
void draw_other_units(SceneDraw& draw) {
  switch (draw.integer(0, 3)) {
    case 0:
      draw_drop(draw);
      break;
    case 1:
      draw_column(draw);
      break;
    case 2:
      draw_turning_loads(draw);
      break;
    default:
      draw_changing_loads(draw);
  }
  const int mass = draw.integer(-9, 9), length = draw.integer(-9, 9), time = draw.integer(-3, 3);
  draw.change_units(mass, length, time);
}

}  // namespace ricochet
