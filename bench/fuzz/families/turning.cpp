#include <fmt/format.h>

#include "bench/fuzz/families.h"

// Bodies that turn, hang on joints, or fly fast past round obstacles.

namespace ricochet {
namespace {

/// Two discs: with n the unit vector from i to j and t = (n_y, -n_x), slip is t' (v_i - v_j) - r_i w_i - r_j w_j.
SceneDraw::Direction slip_on_each_other(int i, int j) {
  const auto q = [](int k) { return SceneDraw::q(k); };
  const std::string dx = fmt::format("({}-{})", q(3 * j), q(3 * i)),
                    dy = fmt::format("({}-{})", q(3 * j + 1), q(3 * i + 1));
  const std::string distance = fmt::format("sqrt({}**2+{}**2)", dx, dy);
  return {{3 * i, fmt::format("{}/{}", dy, distance)},
          {3 * i + 1, fmt::format("-{}/{}", dx, distance)},
          {3 * i + 2, fmt::format("-r{}", i)},
          {3 * j, fmt::format("-{}/{}", dy, distance)},
          {3 * j + 1, fmt::format("{}/{}", dx, distance)},
          {3 * j + 2, fmt::format("-r{}", j)}};
}

}  // namespace

// Discs with q = (x, y, phi) each and J = m r^2 / 2. On the ground slip is x' + r phi', on the left wall y' - r phi',
// on the right wall y' + r phi'.
void draw_discs(SceneDraw& draw) {
  const int n = draw.integer(1, 3);
  std::string place = "r0+" + draw.clearance("x0", 0.4);
  for (int i = 0; i < n; ++i) {
    const std::string m = draw.number(fmt::format("m{}", i), 0.2, 3),
                      r = draw.number(fmt::format("r{}", i), 0.05, 0.15);
    if (i > 0) place += fmt::format("+r{}+r{}+{}", i - 1, i, draw.clearance(fmt::format("x{}", i), 0.4));
    const std::string height = draw.clearance(fmt::format("y{}", i), 0.5, 45);
    const std::string vx = draw.velocity(fmt::format("vx{}", i), 2.5);
    const std::string vy = draw.chance(50) ? "0" : draw.velocity(fmt::format("vy{}", i), 2);
    const std::string omega = draw.velocity(fmt::format("w{}", i), 15);
    draw.coordinate(place, vx, m);
    const int y = draw.coordinate(fmt::format("{}+{}", r, height), vy, m);
    draw.coordinate("0", omega, fmt::format("{}*{}**2/2", m, r));
    draw.gravity(y, m);
  }
  const auto rough = [&draw](const std::string& name, const std::string& gap, int percent, const std::string& mu,
                             const SceneDraw::Direction& slip) {
    draw.contact_with_chance(name, gap, "e_" + name, percent, {mu, 0.02, 0.9}, {slip});
  };
  for (int i = 0; i < n; ++i) {
    rough(fmt::format("ground{}", i), fmt::format("{}-r{}", SceneDraw::q(3 * i + 1), i), 75,
          fmt::format("mu_ground{}", i), {{3 * i, "1"}, {3 * i + 2, fmt::format("r{}", i)}});
  }
  for (int i = 0; i < n; ++i) {
    for (int j = i + 1; j < n; ++j) {
      const std::string gap = fmt::format("sqrt(({}-{})**2+({}-{})**2)-r{}-r{}", SceneDraw::q(3 * j),
                                          SceneDraw::q(3 * i), SceneDraw::q(3 * j + 1), SceneDraw::q(3 * i + 1), i, j);
      rough(fmt::format("discs{}{}", i, j), gap, 40, fmt::format("mu{}{}", i, j), slip_on_each_other(i, j));
    }
  }
  if (draw.chance(70)) rough("left", "q[0]-r0", 50, "mu_left", {{1, "1"}, {2, "-r0"}});
  if (draw.chance(70)) {
    const int x = 3 * (n - 1);
    const std::string room = draw.clearance("room", 0.4);
    rough("right", fmt::format("{}+{}-{}", place, room, SceneDraw::q(x)), 50, "mu_right",
          {{x + 1, "1"}, {x + 2, fmt::format("r{}", n - 1)}});
  }
  draw.end_time(0.3, 1);
}

// A uniform rod of length 2 l, q = (x, y, theta) of its centre, J = m l^2 / 3, with both ends above rough ground:
//
//   f_c = y -+ l sin(theta),   v_t = x' +- l sin(theta) theta'
void draw_dropped_rod(SceneDraw& draw) {
  const std::string m = draw.number("m", 0.2, 3), l = draw.number("l", 0.15, 0.8);
  const std::string theta = draw.chance(8) ? draw.constant("th", "0") : draw.number("th", 0.02, 1.5);
  const std::string height = draw.clearance("y0", 0.3, 30);
  const std::string vx = draw.velocity("vx", 1.5), vy = draw.velocity("vy", 1.5), omega = draw.velocity("w", 4);
  draw.coordinate("0", vx, m);
  const int y = draw.coordinate(fmt::format("{}*sin({})+{}", l, theta, height), vy, m);
  draw.coordinate(theta, omega, fmt::format("{}*{}**2/3", m, l));
  draw.gravity(y, m);
  for (const int end : {-1, 1}) {
    const std::string name = end < 0 ? "tip" : "tail", sign = end < 0 ? "-" : "+", opposite = end < 0 ? "" : "-";
    const std::string gap = fmt::format("q[1]{}{}*sin(q[2])", sign, l), e = draw.restitution("e_" + name);
    if (draw.chance(85)) {
      const std::string mu = draw.number("mu_" + name, 0.02, draw.chance(10) ? 1.8 : 1.1);
      draw.contact(name, gap, e, {mu, {{{0, "1"}, {2, fmt::format("{}{}*sin(q[2])", opposite, l)}}}});
    } else {
      draw.contact(name, gap, e);
    }
  }
  draw.end_time(0.2, 0.8);
}

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
    draw.contact_with_chance(name, gap, fmt::format("e{}", i), 65, {fmt::format("mu{}", i), 0.02, 0.9},
                             {{{2 * i, "1"}}});
  }
  draw.end_time(0.2, 0.8);
}

// A pendulum of one or two point masses, angles from the vertical:
//
//   M = [ (m0 + m1) l0^2,  m1 l0 l1 cos(D); .,  m1 l1^2 ],   D = q_0 - q_1
int draw_point_masses_on_rods(SceneDraw& draw) {
  const int n = draw.integer(1, 2);
  for (int i = 0; i < n; ++i) {
    draw.number(fmt::format("m{}", i), 0.3, 2.5);
    draw.number(fmt::format("l{}", i), 0.3, 1);
    draw.number(fmt::format("a{}", i), -1.2, 1.2);
    draw.velocity(fmt::format("w{}", i), 3);
  }
  draw.coordinate("a0", "w0", n == 1 ? "m0*l0**2" : "(m0+m1)*l0**2");
  draw.force(0, fmt::format("-{}*9.81*l0*sin(q[0])", n == 1 ? "m0" : "(m0+m1)"));
  if (n == 2) {
    draw.coordinate("a1", "w1", "m1*l1**2");
    draw.mass(0, 1, "m1*l0*l1*cos(q[0]-q[1])");
    draw.force(0, "-m1*l0*l1*sin(q[0]-q[1])*v[1]**2");
    draw.force(1, "m1*l0*l1*sin(q[0]-q[1])*v[0]**2");
    draw.force(1, "-m1*9.81*l1*sin(q[1])");
  }
  return n;
}

// The pendulum of draw_point_masses_on_rods(), with the tip at (x, y), y upwards from the hinge:
//
//   x = l0 sin(q_0) + l1 sin(q_1),   y = -l0 cos(q_0) - l1 cos(q_1)
//
// between walls at some distance from where the tip starts, and above a rough floor.
void draw_pendulum(SceneDraw& draw) {
  const int n = draw_point_masses_on_rods(draw);
  draw.potential(fmt::format("-{}*9.81*l0*cos(q[0])", n == 1 ? "m0" : "(m0+m1)"));
  if (n == 2) draw.potential("-m1*9.81*l1*cos(q[1])");
  const std::string x = n == 1 ? "l0*sin(q[0])" : "l0*sin(q[0])+l1*sin(q[1])";
  const std::string x0 = n == 1 ? "l0*sin(a0)" : "l0*sin(a0)+l1*sin(a1)";
  const std::string depth = n == 1 ? "l0*cos(q[0])" : "l0*cos(q[0])+l1*cos(q[1])";
  const std::string reach = n == 1 ? "l0" : "l0+l1";
  const auto along = [&](const std::string& function, const std::string& sign) {
    SceneDraw::Direction entries;
    for (int i = 0; i < n; ++i) entries.emplace_back(i, fmt::format("{}l{}*{}(q[{}])", sign, i, function, i));
    return entries;
  };
  const auto wall = [&](const std::string& name, const std::string& gap) {
    draw.contact_with_chance(name, gap, "e_" + name, 40, {"mu_" + name, 0.02, 0.9}, {along("sin", "")});
  };
  const bool has_floor = draw.chance(45);
  if (has_floor) {
    // Above the lowest point of the tip by `rise`, and below the place where it starts.
    const std::string rise = draw.number("rise", 0, 0.5);
    const std::string start = n == 1 ? "l0*cos(a0)" : "l0*cos(a0)+l1*cos(a1)";
    const std::string gap = fmt::format("{}+{}*({}-({}))-({})", start, rise, reach, start, depth);
    draw.contact_with_chance("floor", gap, "e_floor", 60, {"mu_floor", 0.02, 0.9}, {along("cos", "")});
  }
  if (!has_floor || draw.chance(60)) {
    const std::string room = draw.clearance("room_right", 0.6);
    wall("right", fmt::format("{}+{}-({})", x0, room, x));
  }
  if (draw.chance(60)) {
    const std::string room = draw.clearance("room_left", 0.6);
    wall("left", fmt::format("{}-({})+{}", x, x0, room));
  }
  draw.end_time(0.5, 2);
}

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
