#include "methods/control/shooting/refinement.h"

#include <fmt/format.h>

#include <algorithm>

namespace ricochet {
namespace {

/// Time limit of a level that has no time left [s]: it returns its first motion. Zero would be no limit.
constexpr double kNoTime = 1e-9;

}  // namespace

Matrix split_intervals(const Matrix& u) {
  Matrix split(u.rows(), 2 * u.cols());
  for (Eigen::Index k = 0; k < split.cols(); ++k) split.col(k) = u.col(k / 2);
  return split;
}

ControlSolution solve_refined(Shooting& shooting, std::span<const Matrix> guesses, int levels, double T,
                              const Shooting::Progress& progress) {
  int iterations = 0;
  double seconds = 0, derivative_seconds = 0;
  Shooting::Progress numbered;
  if (progress) {
    numbered = [&](ShootingIteration at) {
      at.number += iterations;
      at.seconds += seconds;
      progress(at);
    };
  }
  const double time_limit = shooting.time_limit();
  ControlSolution solution = shooting.solve(guesses, T, numbered);
  for (int level = 0; level < levels && solution.has_plan(); ++level) {
    iterations += solution.iterations;
    seconds += solution.seconds;
    derivative_seconds += solution.derivative_seconds;
    if (time_limit > 0) shooting.set_time_limit(std::max(time_limit - seconds, kNoTime));
    solution = shooting.solve(split_intervals(solution.trajectory.u), solution.trajectory.T, numbered);
  }
  shooting.set_time_limit(time_limit);
  if (solution.status == Status::time_limit)
    solution.message = fmt::format("the time limit of {:g} s was reached", time_limit);
  solution.iterations += iterations;
  solution.seconds += seconds;
  solution.derivative_seconds += derivative_seconds;
  return solution;
}

}  // namespace ricochet
