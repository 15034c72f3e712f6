#include "bench/studies/questions/gradient_cases.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>

#include "reference/certified/certified_motion.h"

namespace ricochet {
namespace {

std::string scene_file(const std::string& name) {
  return "bench/experiments/scenes/" + name + ".json";
}

// Elastic, without weight: z(T) = R + w (T - t_1), t_1 = (h - R) / w, so z(T) = 2 R + w T - h.
GradientCase ball_flies_down() {
  const std::string file = scene_file("ball_flies_down");
  return {.name = "ball_flies_down",
          .of = "brax#317",
          .title = "a ball at 2.95 m flies down at 5 m/s and bounces, e = 1, R = 0.5 m, T = 1 s, no weight",
          .choice = {.problem = file},
          .entries = {{"d z(T) / d z(0)", 0, "q0:0", -1}, {"d z(T) / d v(0)", 0, "v0:0", -1}}};
}

// Equal masses, elastic, without weight: the balls swap velocities where they meet, so x_1(T) = x_2 - 2 R and
// x_2(T) = x_1 + 2 R + w T.
GradientCase two_balls() {
  const std::string file = scene_file("two_equal_balls");
  return {.name = "two_balls",
          .of = "nimblephysics#97",
          .title = "a ball at 1 m/s hits an equal one at rest, 0.52 m apart, e = 1, R = 0.1 m, T = 1 s, no weight",
          .choice = {.problem = file},
          .entries = {{"d x_1(T) / d x_2(0)", 0, "q0:1", 1},
                      {"d x_1(T) / d x_1(0)", 0, "q0:0", 0},
                      {"d x_2(T) / d x_1(0)", 1, "q0:0", 1},
                      {"d x_2(T) / d x_2(0)", 1, "q0:1", 0}}};
}

// t_1 = sqrt(2 (h - R) / g), v(T) = e g t_1 - g s, z(T) = R + e g t_1 s - g s^2 / 2 with s = T - t_1, d t_1 / d h = 1 /
// (g t_1):  d v(T) / d h = (e + 1) / t_1,  d z(T) / d h = (e s - e t_1 + s) / t_1.
GradientCase ball_falls() {
  const double R = 0.1, h = 1, g = 9.81, e = 0.5, T = 0.6;
  const double t_1 = std::sqrt(2 * (h - R) / g), s = T - t_1;
  return {.name = "ball_falls",
          .of = "brax#73",
          .title = "a ball falls from 1 m and bounces once, e = 0.5, R = 0.1 m, T = 0.6 s",
          .choice = {.problem = "bouncing_ball", .parameters = {{"e", e}, {"duration", T}}},
          .entries = {{"d z(T) / d z(0)", 0, "q0:0", (e * s - e * t_1 + s) / t_1},
                      {"d v(T) / d z(0)", 1, "q0:0", (e + 1) / t_1}}};
}

// It stops at v^2 / (2 mu g).
GradientCase block_stops() {
  const double v = 2, mu = 0.3, g = 9.81;
  return {.name = "block_stops",
          .of = "stick-slip",
          .title = "a block slides at 2 m/s until friction with mu = 0.3 has stopped it, T = 1 s",
          .choice = {.problem = "sliding_block", .parameters = {{"v_x0", v}, {"mu", mu}, {"duration", 1}}},
          .entries = {{"d x(T) / d v(0)", 0, "v0:0", v / (mu * g)},
                      {"d x(T) / d mu", 0, "param:mu", -v * v / (2 * mu * mu * g)}}};
}

}  // namespace

bool take_proven(GradientCase& gradient_case) {
  reference::certified::Options options;
  options.digits = 20;
  options.max_seconds = 2;
  options.with_sensitivities = true;
  const auto motion = certified_motion(*gradient_case.problem, options);
  const auto n_q = static_cast<std::size_t>(gradient_case.problem->n_q());
  std::vector<double> proven;
  for (const GradientEntry& entry : gradient_case.entries) {
    const auto column = std::ranges::find(motion.sensitivities, entry.with_respect,
                                          &reference::certified::CertifiedSensitivity::variable);
    if (column == motion.sensitivities.end() || !column->reason.empty()) return false;
    const auto k = static_cast<std::size_t>(entry.output);
    const auto& number = k < n_q ? column->q.at(k) : column->v.at(k - n_q);
    proven.push_back(std::strtod(number.text.c_str(), nullptr));
  }
  for (std::size_t k = 0; k < proven.size(); ++k) gradient_case.entries[k].exact = proven[k];
  return true;
}

std::vector<GradientCase> gradient_cases() {
  std::vector<GradientCase> cases;
  cases.push_back(two_balls());
  cases.push_back(ball_flies_down());
  cases.push_back(ball_falls());
  cases.push_back(block_stops());
  for (GradientCase& c : cases) c.problem = c.choice.make_problem();
  return cases;
}

}  // namespace ricochet
