#include <fmt/format.h>

#include "bench/fuzz/families.h"

// Forces that bend or jump (problems/regions/switching_functions.h), and friction without a normal contact
// (problems/derivatives/friction_elements.h).

namespace ricochet {
namespace {

/// Draws the names of a term's numbers: unique, so that each stands once.
class TermNumbers {
 public:
  explicit TermNumbers(SceneDraw& draw) : draw_(draw) {}
  std::string operator()(double low, double high) { return draw_.number(fmt::format("c{}", ++count_), low, high); }

 private:
  SceneDraw& draw_;
  int count_ = 0;
};

/// A force on coordinate k that is not smooth. @param other  a second coordinate, or k
std::string bending_term(SceneDraw& draw, TermNumbers& number, int k, int other) {
  const std::string q = SceneDraw::q(k), v = SceneDraw::v(k);
  switch (draw.integer(0, 13)) {
    case 0: {  // a spring on one side
      const std::string stiffness = number(5, 200), place = number(-0.3, 0.3);
      return fmt::format("-{}*max({}-{},0)", stiffness, q, place);
    }
    case 1: {
      const std::string stiffness = number(5, 100), place = number(-0.2, 0.3);
      return fmt::format("-{}*min({}+{},0)", stiffness, q, place);
    }
    case 2: {  // quadratic drag
      const std::string drag = number(0.1, 3);
      return fmt::format("-{}*{}*abs({})", drag, v, v);
    }
    case 3: {  // Hunt and Crossley's bumper, which does not pull
      const std::string stiffness = number(20, 400), place = number(-0.2, 0.4), damping = number(0.1, 1.5);
      return fmt::format("-max({}*max({}-{},0)*(1+{}*{}),0)", stiffness, q, place, damping, v);
    }
    case 4: {  // the same with a square
      const std::string stiffness = number(50, 900), place = number(-0.2, 0.3), damping = number(0.1, 1);
      return fmt::format("-{}*max({}-{},0)**2*(1+{}*{})", stiffness, q, place, damping, v);
    }
    case 5: {  // dead zone
      const std::string stiffness = number(1, 60), half = number(0.05, 0.3);
      return fmt::format("-{}*(max({}-{},0)+min({}+{},0))", stiffness, q, half, q, half);
    }
    case 6: {  // limited spring
      const std::string stiffness = number(2, 40), limit = number(0.1, 0.4);
      return fmt::format("-{}*max(min({},{}),-{})", stiffness, q, limit, limit);
    }
    case 7: {  // two stiffnesses
      const std::string place = number(-0.3, 0.3), one = number(1, 80), two = number(1, 80);
      return fmt::format("-if({}<{},{}*({}-{}),{}*({}-{}))", q, place, one, q, place, two, q, place);
    }
    case 8: {  // a damper on one side
      const std::string damping = number(0.1, 3);
      return fmt::format("-{}*max({},0)", damping, v);
    }
    case 9: {
      const std::string slope = number(-4, 4), place = number(-0.3, 0.3);
      return fmt::format("{}*abs({}-{})", slope, q, place);
    }
    case 10: {  // jumps in time
      const std::string at = number(0.1, 1.8), before = number(-3, 3), after = number(-3, 3);
      return fmt::format("if(t<{},{},{})", at, before, after);
    }
    case 11: {
      const std::string size = number(0.3, 3), frequency = number(3, 12), phase = number(0, 3);
      return fmt::format("{}*sign(sin({}*t+{}))", size, frequency, phase);
    }
    case 12: {  // jumps in position, and crosses: the velocity does not jump
      const std::string place = number(-0.3, 0.3), below = number(-2, 2), above = number(-2, 2);
      return fmt::format("if({}<{},{},{})", q, place, below, above);
    }
    default: {  // a limited pull towards the other mass, or home
      const std::string limit = number(0.2, 3), slope = number(1, 30);
      const std::string distance = other == k ? q : fmt::format("({}-{})", q, SceneDraw::q(other));
      return fmt::format("-min({},{}*abs({}))*sign({})", limit, slope, distance, distance);
    }
  }
}

}  // namespace

// One or two masses on a line, q = (x) or (x_0, x_1), under springs and forces that bend or jump. Two may be coupled
// with backlash 2 s,
//
//   F = -k (max(x_0 - x_1 - s, 0) + min(x_0 - x_1 + s, 0))
//
// Each may have a wall. Or one mass in the plane, q = (x, y), above rough ground.
void draw_corners(SceneDraw& draw) {
  TermNumbers number(draw);
  const int n = draw.chance(55) ? 1 : 2;
  const bool is_in_plane = n == 2 && draw.chance(40);
  const std::string m = draw.number("m0", 0.5, 2);
  for (int k = 0; k < n; ++k) {
    const std::string mass = k == 0 || is_in_plane ? m : draw.number("m1", 0.5, 2);
    const std::string place = draw.clearance(fmt::format("x{}", k), 0.6), v = draw.velocity(fmt::format("v{}", k), 2);
    draw.coordinate(place, v, mass);
  }
  for (int k = 0; k < n; ++k) {
    if (draw.chance(80)) {
      const std::string stiffness = number(1, 30);
      draw.force(k, fmt::format("-{}*{}", stiffness, SceneDraw::q(k)));
    }
    const int terms = draw.integer(k == 0 ? 1 : 0, 3);
    for (int i = 0; i < terms; ++i) draw.force(k, bending_term(draw, number, k, n == 2 && !is_in_plane ? 1 - k : k));
  }
  if (n == 2 && !is_in_plane && draw.chance(50)) {
    const std::string stiffness = number(5, 100), slack = number(0.01, 0.2);
    const std::string backlash = fmt::format("{}*(max(q[0]-q[1]-{},0)+min(q[0]-q[1]+{},0))", stiffness, slack, slack);
    draw.force(0, "-" + backlash);
    draw.force(1, backlash);
  }
  if (is_in_plane) {
    draw.gravity(1, m);
    draw.contact_with_chance("ground", "q[1]", "e", 70, {"mu", 0.05, 0.8}, {{{0, "1"}}});
  }
  for (int k = 0; k < (is_in_plane ? 1 : n); ++k) {
    if (!draw.chance(55)) continue;
    const std::string room = draw.clearance(fmt::format("w{}", k), 0.8), e = draw.restitution(fmt::format("e{}", k));
    draw.contact(fmt::format("wall{}", k), fmt::format("{}+{}", SceneDraw::q(k), room), e);
  }
  draw.end_time(0.5, 2);
}

namespace {

/// The largest friction of an element: constant, or a function of time, position or slip `s`. Positive.
std::string friction_bound(SceneDraw& draw, TermNumbers& number, const std::string& x, const std::string& s) {
  const std::string f = number(0.2, 4);
  switch (draw.integer(0, 7)) {
    case 0: {  // pressed by a force that swings
      const std::string share = number(0.1, 0.9), frequency = number(1, 9);
      return fmt::format("{}*(1+{}*sin({}*t))", f, share, frequency);
    }
    case 1: {  // of the place
      const std::string growth = number(0.5, 5);
      return fmt::format("{}*(1+{}*{}**2)", f, growth, x);
    }
    case 2: {  // Stribeck's curve
      const std::string drop = number(0.1, 1), speed = number(0.1, 1);
      return fmt::format("{}*(1+{}*exp(-({}/{})**2))", f, drop, s, speed);
    }
    case 3: {  // bends where the slip vanishes
      const std::string damping = number(0.1, 2);
      return fmt::format("{}+{}*abs({})", f, damping, s);
    }
    case 4: {  // bends elsewhere
      const std::string growth = number(1, 20), place = number(-0.3, 0.3);
      return fmt::format("{}+{}*max({}-{},0)", f, growth, x, place);
    }
    default:
      return f;
  }
}

/// The velocity of what an element rubs on, with the opposite sign; empty if it rests.
std::vector<std::string> friction_drive(SceneDraw& draw, TermNumbers& number) {
  switch (draw.integer(0, 5)) {
    case 0:
      return {number(-1, 1)};
    case 1: {
      const std::string speed = number(0.2, 1), frequency = number(1, 9);
      return {fmt::format("{}*sin({}*t)", speed, frequency)};
    }
    case 2: {  // it reverses at once
      const std::string at = number(0.2, 1.5), before = number(-1, 1), after = number(-1, 1);
      return {fmt::format("if(t<{},{},{})", at, before, after)};
    }
    default:
      return {};
  }
}

/// Dry friction against the slip velocity s = sum_k J_k v_k, J_k = 1 or -1: an element, or a force -F sign(s), or a force
/// with another friction in each direction.
void add_friction(SceneDraw& draw, TermNumbers& number, const std::string& name, const SceneDraw::Direction& tangent) {
  std::string slip, place;
  for (const auto& [k, entry] : tangent) {
    const std::string sign = entry.starts_with('-') ? "-" : "";
    slip = plus(slip, sign + SceneDraw::v(k));
    place = plus(place, sign + SceneDraw::q(k));
  }
  if (draw.chance(60)) {
    const std::string bound = friction_bound(draw, number, fmt::format("({})", place), fmt::format("({})", slip));
    const auto drive = friction_drive(draw, number);
    draw.friction_element(name, {tangent}, bound, drive);
    return;
  }
  std::string force;
  if (draw.chance(70)) {
    const std::string bound = draw.chance(60)
                                  ? number(0.2, 4)
                                  : friction_bound(draw, number, fmt::format("({})", place), fmt::format("({})", slip));
    if (draw.chance(25)) slip += "-" + number(0.05, 1);
    force = fmt::format("({})*sign({})", bound, slip);
  } else {
    const std::string forwards = number(0.2, 4), backwards = number(0.2, 4);
    force = fmt::format("if({}>0,{},-{})", slip, forwards, backwards);
  }
  for (const auto& [k, entry] : tangent) draw.force(k, (entry.starts_with('-') ? "" : "-") + force);
}

/// Masses on a line with springs, guides, brakes between neighbours, and walls.
void draw_rubbing_masses(SceneDraw& draw, TermNumbers& number) {
  const int n = draw.integer(1, 3);
  for (int k = 0; k < n; ++k) {
    const std::string m = draw.number(fmt::format("m{}", k), 0.3, 2);
    const std::string place = draw.clearance(fmt::format("x{}", k), 0.6), v = draw.velocity(fmt::format("v{}", k), 2);
    draw.coordinate(place, v, m);
  }
  int frictions = 0;
  for (int k = 0; k < n; ++k) {
    if (draw.chance(75)) {
      const std::string stiffness = number(2, 60);
      draw.force(k, fmt::format("-{}*{}", stiffness, SceneDraw::q(k)));
    }
    if (draw.chance(50)) {
      const std::string push = number(0.5, 6), frequency = number(1, 9);
      draw.force(k, fmt::format("{}*sin({}*t)", push, frequency));
    }
    if (draw.chance(60) || n == 1) {
      add_friction(draw, number, fmt::format("guide{}", k), {{k, "1"}});
      ++frictions;
    }
    if (k > 0 && draw.chance(50)) {
      const std::string stiffness = number(2, 60);
      draw.force(k, fmt::format("-{}*({}-{})", stiffness, SceneDraw::q(k), SceneDraw::q(k - 1)));
      draw.force(k - 1, fmt::format("{}*({}-{})", stiffness, SceneDraw::q(k), SceneDraw::q(k - 1)));
    }
    if (k > 0 && (draw.chance(50) || frictions == 0)) {
      add_friction(draw, number, fmt::format("brake{}", k), {{k, "1"}, {k - 1, "-1"}});
      ++frictions;
    }
  }
  for (int k = 0; k < n; ++k) {
    if (!draw.chance(40)) continue;
    const std::string room = draw.clearance(fmt::format("w{}", k), 0.8), e = draw.restitution(fmt::format("e{}", k));
    draw.contact(fmt::format("wall{}", k), fmt::format("{}+{}", SceneDraw::q(k), room), e);
  }
}

/// A block above the ground, q = (x, y), with a brake along rough ground, or in a vertical guide above smooth ground: on
/// rough ground the guide would share the load with it, which leaves the friction of the ground undetermined.
void draw_braked_block(SceneDraw& draw, TermNumbers& number) {
  const std::string m = draw.number("m", 0.3, 2), height = draw.clearance("y0", 0.5, 40);
  const std::string vx = draw.velocity("vx", 2), vy = draw.velocity("vy", 1.5);
  draw.coordinate("0", vx, m);
  draw.coordinate(height, vy, m);
  draw.gravity(1, m);
  const std::string push = number(0.5, 8), frequency = number(1, 9);
  draw.force(0, fmt::format("{}*sin({}*t)", push, frequency));
  const bool is_guided = draw.chance(35);
  if (is_guided) add_friction(draw, number, "guide", {{1, "1"}});
  if (!is_guided || draw.chance(50)) add_friction(draw, number, "brake", {{0, "1"}});
  draw.contact_with_chance("ground", "q[1]", "e", is_guided ? 0 : 75, {"mu", 0.05, 0.8}, {{{0, "1"}}});
}

/// A puck in the plane, q = (x, y), under an element of two directions.
void draw_rubbing_puck(SceneDraw& draw, TermNumbers& number) {
  const std::string m = draw.number("m", 0.3, 2);
  const std::string vx = draw.velocity("vx", 2), vy = draw.velocity("vy", 2);
  draw.coordinate("0", vx, m);
  draw.coordinate("0", vy, m);
  for (int k = 0; k < 2; ++k) {
    const std::string stiffness = number(0, 30), push = number(-4, 4), frequency = number(1, 9);
    draw.force(k, fmt::format("{}*cos({}*t)-{}*{}", push, frequency, stiffness, SceneDraw::q(k)));
  }
  const std::string bound = draw.chance(50) ? number(0.3, 4) : friction_bound(draw, number, "q[0]", "v[0]");
  std::vector<std::string> drives;
  if (draw.chance(40)) drives = {number(-1, 1), "0"};
  draw.friction_element("ground", {{{0, "1"}}, {{1, "1"}}}, bound, drives);
  if (draw.chance(40)) {
    const std::string room = draw.clearance("w", 0.5), e = draw.restitution("e");
    draw.contact("wall", fmt::format("q[0]+{}", room), e);
  }
}

/// A pendulum of one or two point masses with dry hinges, before a wall.
void draw_dry_pendulum(SceneDraw& draw, TermNumbers& number) {
  const int n = draw_point_masses_on_rods(draw);
  const bool has_hinge = n == 1 || draw.chance(60);
  if (has_hinge) add_friction(draw, number, "hinge", {{0, "1"}});
  if (n == 2 && (!has_hinge || draw.chance(60))) add_friction(draw, number, "knee", {{1, "1"}, {0, "-1"}});
  if (draw.chance(40)) {
    const std::string room = draw.clearance("room", 0.6), e = draw.restitution("e");
    draw.contact("stop", fmt::format("a0+{}-q[0]", room), e);
  }
}

}  // namespace

// Friction elements and forces -F sign(v), whose bounds may depend on time, place and velocity and whose counterpart may
// move: guides, brakes between masses, a puck, and dry hinges; with and without contacts. Some bounds are larger in stick.
void draw_dry_friction(SceneDraw& draw) {
  TermNumbers number(draw);
  const int kind = draw.integer(1, 100);
  if (kind <= 45)
    draw_rubbing_masses(draw, number);
  else if (kind <= 65)
    draw_braked_block(draw, number);
  else if (kind <= 80)
    draw_rubbing_puck(draw, number);
  else
    draw_dry_pendulum(draw, number);
  draw.end_time(0.5, 2);
  if (draw.chance(25)) draw.static_friction(1.02, 2.5);  // last: other scenes are those of before
}

}  // namespace ricochet
