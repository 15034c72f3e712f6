#include <fmt/format.h>

#include "bench/fuzz/families.h"

namespace ricochet {
namespace {

/// Two discs: with n the unit vector from i to j and t = (n_y, -n_x), slip is t' (v_i - v_j) - r_i w_i - r_j w_j.
SceneDraw::Friction rolling_on_each_other(const std::string& mu, int i, int j) {
  const auto q = [](int k) { return SceneDraw::q(k); };
  const std::string dx = fmt::format("({}-{})", q(3 * j), q(3 * i)),
                    dy = fmt::format("({}-{})", q(3 * j + 1), q(3 * i + 1));
  const std::string distance = fmt::format("sqrt({}**2+{}**2)", dx, dy);
  return {mu,
          {{{3 * i, fmt::format("{}/{}", dy, distance)},
            {3 * i + 1, fmt::format("-{}/{}", dx, distance)},
            {3 * i + 2, fmt::format("-r{}", i)},
            {3 * j, fmt::format("-{}/{}", dy, distance)},
            {3 * j + 1, fmt::format("{}/{}", dx, distance)},
            {3 * j + 2, fmt::format("-r{}", j)}}}};
}

void add_contact(SceneDraw& draw, const std::string& name, const std::string& gap, int percent_rough,
                 const SceneDraw::Friction& friction) {
  const std::string e = draw.restitution("e_" + name);
  if (draw.chance(percent_rough)) {
    draw.number(friction.mu, 0.02, 0.9);
    draw.contact(name, gap, e, friction);
  } else {
    draw.contact(name, gap, e);
  }
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
  for (int i = 0; i < n; ++i) {
    add_contact(draw, fmt::format("ground{}", i), fmt::format("{}-r{}", SceneDraw::q(3 * i + 1), i), 75,
                {fmt::format("mu_ground{}", i), {{{3 * i, "1"}, {3 * i + 2, fmt::format("r{}", i)}}}});
  }
  for (int i = 0; i < n; ++i) {
    for (int j = i + 1; j < n; ++j) {
      const std::string gap = fmt::format("sqrt(({}-{})**2+({}-{})**2)-r{}-r{}", SceneDraw::q(3 * j),
                                          SceneDraw::q(3 * i), SceneDraw::q(3 * j + 1), SceneDraw::q(3 * i + 1), i, j);
      add_contact(draw, fmt::format("discs{}{}", i, j), gap, 40,
                  rolling_on_each_other(fmt::format("mu{}{}", i, j), i, j));
    }
  }
  if (draw.chance(70)) add_contact(draw, "left", "q[0]-r0", 50, {"mu_left", {{{1, "1"}, {2, "-r0"}}}});
  if (draw.chance(70)) {
    const int x = 3 * (n - 1);
    const std::string room = draw.clearance("room", 0.4);
    add_contact(draw, "right", fmt::format("{}+{}-{}", place, room, SceneDraw::q(x)), 50,
                {"mu_right", {{{x + 1, "1"}, {x + 2, fmt::format("r{}", n - 1)}}}});
  }
  draw.end_time(0.3, 1);
}

}  // namespace ricochet
