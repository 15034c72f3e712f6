#include <fmt/format.h>

#include <algorithm>

#include "bench/studies/control/control_views.h"
#include "reports/drawing/scene_drawing.h"

namespace ricochet {
namespace {

Vector vector_of(const std::vector<double>& numbers) {
  return Eigen::Map<const Vector>(numbers.data(), static_cast<Eigen::Index>(numbers.size()));
}

/// The cubic with the positions and velocities of two points of the claimed motion, which has the order of a stage.
///
///   q(s) = q_0 + h v_0 s + (3 d - h (2 v_0 + v_1)) s^2 + (h (v_0 + v_1) - 2 d) s^3,   d = q_1 - q_0,  s = (t - t_0) / h
Vector position(const ControlRun::Motion& motion, double t) {
  const auto after = static_cast<std::size_t>(std::ranges::upper_bound(motion.t, t) - motion.t.begin());
  if (after == motion.t.size()) return vector_of(motion.q.back());
  const std::size_t before = after - 1;
  const Vector q = vector_of(motion.q[before]), v = vector_of(motion.v[before]), d = vector_of(motion.q[after]) - q,
               v_1 = vector_of(motion.v[after]);
  const double h = motion.t[after] - motion.t[before], s = (t - motion.t[before]) / h;
  return q + s * (h * v + s * ((3 * d - h * (2 * v + v_1)) + s * (h * (v + v_1) - 2 * d)));
}

/// The control of the interval, and the forces of the next stage, after the last one those of the last.
SceneForces forces_at(const ControlRun& run, double t) {
  const auto N = run.u.size();
  const auto interval = std::min(static_cast<std::size_t>(t / run.T * static_cast<double>(N)), N - 1);
  const auto stage = std::min(static_cast<std::size_t>(std::ranges::upper_bound(run.force_t, t) - run.force_t.begin()),
                              run.force_t.size() - 1);
  return {vector_of(run.u[interval]), vector_of(run.lambda_n[stage]), vector_of(run.lambda_t[stage])};
}

DrawnMotion motion_of(const OptimalControlProblem& problem, const ControlRun& run) {
  DrawnMotion motion{.end = run.T, .goal = problem.goal};
  motion.q = [&run, n = problem.plant->n_q()](double t) {
    Vector q = Vector::Constant(n, t);  // the clock, where there is one
    const Vector bodies = position(run.claimed, t);
    q.head(bodies.size()) = bodies;
    return q;
  };
  motion.forces = [&run](double t) { return forces_at(run, t); };
  for (const auto& impact : run.impacts) motion.impacts.push_back({impact.t, impact.contact});
  return motion;
}

}  // namespace

Figure draw_frames(const FigureFolder& folder, const OptimalControlProblem& problem, const ControlRun& run,
                   const std::string& name) {
  const SceneFrames frames = scene_frames(*problem.plant, motion_of(problem, run));
  folder.write(name + ".svg", frames.svg);
  return {.file = name + ".svg",
          .title = run.problem + ": frames",
          .caption = fmt::format("{}, as {} claims it. Shaded: where the bodies have to go. Black arrows: controls; "
                                 "purple: forces of contacts, on one scale, the longest {:.3g} N. Rings: impacts.",
                                 run.title, run.discretisation, frames.longest_force),
          .motion = run.claimed};
}

Figure draw_scene(const FigureFolder& folder, const OptimalControlProblem& problem, const ControlRun& run,
                  const std::string& name) {
  folder.write(name + ".svg", scene_svg(*problem.plant, motion_of(problem, run)));
  return {.file = name + ".svg",
          .title = run.problem + ": motion",
          .caption = fmt::format("{}: the motion that {} claims.", run.title, run.discretisation),
          .motion = run.claimed};
}

}  // namespace ricochet
