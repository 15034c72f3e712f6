#include <fmt/format.h>

#include "bench/fuzz/families.h"

namespace ricochet {

// A pendulum of one or two point masses, angles from the vertical; the tip at (x, y), y upwards from the hinge:
//
//   M = [ (m0 + m1) l0^2,  m1 l0 l1 cos(D); .,  m1 l1^2 ],   D = q_0 - q_1
//   x = l0 sin(q_0) + l1 sin(q_1),   y = -l0 cos(q_0) - l1 cos(q_1)
//
// between walls at some distance from where the tip starts, and above a rough floor.
void draw_pendulum(SceneDraw& draw) {
  const int n = draw.integer(1, 2);
  for (int i = 0; i < n; ++i) {
    draw.number(fmt::format("m{}", i), 0.3, 2.5);
    draw.number(fmt::format("l{}", i), 0.3, 1);
    draw.number(fmt::format("a{}", i), -1.2, 1.2);
    draw.velocity(fmt::format("w{}", i), 3);
  }
  draw.coordinate("a0", "w0", n == 1 ? "m0*l0**2" : "(m0+m1)*l0**2");
  draw.force(0, fmt::format("-{}*9.81*l0*sin(q[0])", n == 1 ? "m0" : "(m0+m1)"));
  draw.potential(fmt::format("-{}*9.81*l0*cos(q[0])", n == 1 ? "m0" : "(m0+m1)"));
  if (n == 2) {
    draw.coordinate("a1", "w1", "m1*l1**2");
    draw.mass(0, 1, "m1*l0*l1*cos(q[0]-q[1])");
    draw.force(0, "-m1*l0*l1*sin(q[0]-q[1])*v[1]**2");
    draw.force(1, "m1*l0*l1*sin(q[0]-q[1])*v[0]**2");
    draw.force(1, "-m1*9.81*l1*sin(q[1])");
    draw.potential("-m1*9.81*l1*cos(q[1])");
  }
  const std::string x = n == 1 ? "l0*sin(q[0])" : "l0*sin(q[0])+l1*sin(q[1])";
  const std::string x0 = n == 1 ? "l0*sin(a0)" : "l0*sin(a0)+l1*sin(a1)";
  const std::string depth = n == 1 ? "l0*cos(q[0])" : "l0*cos(q[0])+l1*cos(q[1])";
  const std::string reach = n == 1 ? "l0" : "l0+l1";
  const auto along = [&](const std::string& function, const std::string& sign) {
    std::vector<std::pair<int, std::string>> entries;
    for (int i = 0; i < n; ++i) entries.emplace_back(i, fmt::format("{}l{}*{}(q[{}])", sign, i, function, i));
    return entries;
  };
  const auto wall = [&](const std::string& name, const std::string& gap) {
    const std::string e = draw.restitution("e_" + name);
    if (draw.chance(40)) {
      const std::string mu = draw.number("mu_" + name, 0.02, 0.9);
      draw.contact(name, gap, e, {mu, {along("sin", "")}});
    } else {
      draw.contact(name, gap, e);
    }
  };
  const bool has_floor = draw.chance(45);
  if (has_floor) {
    // Above the lowest point of the tip by `rise`, and below the place where it starts.
    const std::string rise = draw.number("rise", 0, 0.5), e = draw.restitution("e_floor");
    const std::string start = n == 1 ? "l0*cos(a0)" : "l0*cos(a0)+l1*cos(a1)";
    const std::string gap = fmt::format("{}+{}*({}-({}))-({})", start, rise, reach, start, depth);
    if (draw.chance(60)) {
      const std::string mu = draw.number("mu_floor", 0.02, 0.9);
      draw.contact("floor", gap, e, {mu, {along("cos", "")}});
    } else {
      draw.contact("floor", gap, e);
    }
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

}  // namespace ricochet
