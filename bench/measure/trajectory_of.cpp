#include "bench/measure/trajectory_of.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <set>

#include "reports/drawing/scene_drawing.h"

namespace ricochet {
namespace {

// Numbers of points in a picture: a line with more points than pixels shows nothing more.
constexpr std::size_t kPoints = 2000, kPointsOfAPiece = 96;

}  // namespace

Trajectory trajectory_of(const Problem& problem, const std::string& method, const std::string& setting,
                         const Solution& solution) {
  Trajectory trajectory{problem.info().id, method, setting, {}, {}, {}, {}};
  const int n = problem.info().n_mechanical();
  const Motion& motion = solution.motion;
  Vector q, v;
  const auto add = [&](double t) {
    trajectory.t.push_back(t);
    trajectory.q.emplace_back(q.begin(), q.begin() + n);
    trajectory.v.emplace_back(v.begin(), v.begin() + n);
  };
  const std::size_t pieces = motion.n_pieces();
  const std::size_t parts = pieces == 0 ? 1 : std::clamp<std::size_t>(kPoints / pieces, 1, kPointsOfAPiece);
  for (std::size_t piece = 0; piece < pieces; ++piece) {
    const double begin = motion.begin_of(piece), end = motion.end_of(piece);
    for (std::size_t k = 0; k <= parts; ++k) {
      const double s = static_cast<double>(k) / static_cast<double>(parts);
      motion.within(piece, s, q, v);
      add(k == parts ? end : begin + s * (end - begin));
    }
  }
  if (problem.info().geometry) trajectory.picture = scene_svg(problem, solution);
  std::ranges::replace(trajectory.picture, '\n', ' ');  // a row of results is one line without control characters
  return trajectory;
}

std::string trajectory_csv(const Problem& problem, const Solution& solution, int n) {
  const int n_q = problem.info().n_mechanical();
  std::string text = "t";
  for (const char* name : {"q", "v"}) {
    for (int k = 0; k < n_q; ++k) text += fmt::format(",{}[{}]", name, k);
  }
  text += '\n';
  const Motion& motion = solution.motion;
  Vector q, v;
  const auto add = [&](double t, Motion::Side side) {
    motion.at(t, q, v, side);
    text += fmt::format("{}", t);
    for (const Vector* x : {&q, &v}) {
      for (int k = 0; k < n_q; ++k) text += fmt::format(",{}", (*x)[k]);
    }
    text += '\n';
  };
  std::set<double> events, times;
  for (const Event& event : solution.events) events.insert(std::min(event.t, solution.t));
  times = events;
  for (int k = 0; k < n; ++k) times.insert(solution.t * k / n);
  times.insert(solution.t);
  for (const double t : times) {
    if (events.contains(t)) add(t, Motion::Side::before);
    add(t, Motion::Side::after);
  }
  return text;
}

}  // namespace ricochet
