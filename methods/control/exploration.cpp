#include "methods/control/exploration.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <random>

#include "problems/input_error.h"

namespace ricochet {
namespace {

struct Candidate {
  Matrix u;
  Rollout rollout;
  double score = 0;
};

/// Motions that end early are worse than all others, and the earlier the worse.
bool is_better(const Candidate& a, const Candidate& b) {
  if (a.rollout.n_solved != b.rollout.n_solved) return a.rollout.n_solved > b.rollout.n_solved;
  return a.score < b.score;
}

Matrix first_spread(const OptimalControlProblem::Bounds& bounds, Eigen::Index N) {
  Vector spread(bounds.lower.size());
  for (Eigen::Index c = 0; c < spread.size(); ++c) {
    const double width = bounds.upper[c] - bounds.lower[c];
    spread[c] = std::isfinite(width) ? width / 6 : 1;
  }
  return spread.replicate(1, N);
}

}  // namespace

ExplorationResult explore(const OptimalControlProblem& problem, const ButcherTableau& tableau, int n_fe,
                          const ExplorationOptions& options) {
  if (options.samples < 1) throw InputError("samples", options.samples, "a number >= 1 is required");
  if (options.elite < 1 || options.elite > options.samples)
    throw InputError("elite", options.elite, "a number from 1 to the number of samples is required");
  const auto begin = std::chrono::steady_clock::now();
  const Eigen::Index N = problem.n_intervals;
  std::mt19937 random(options.seed);
  std::normal_distribution<double> normal;
  Matrix mean = problem.plant->info().u.replicate(1, N), spread = first_spread(problem.u, N);
  ExplorationResult result;
  ControlledPlant plant(problem);

  double penalty = 0;
  const auto run = [&](const Matrix& u) {
    Candidate candidate{u, roll_out(problem, plant, tableau, n_fe, u), 0};
    candidate.score = candidate.rollout.cost + penalty * candidate.rollout.violation;
    ++result.rollouts;
    if (candidate.rollout.status != Status::success) ++result.failed;
    return candidate;
  };
  Candidate best = run(mean);
  penalty = options.penalty * (1 + std::abs(best.rollout.cost));
  best.score += penalty * best.rollout.violation;

  std::vector<Candidate> candidates(static_cast<std::size_t>(options.samples));
  for (int round = 0; round < options.rounds; ++round) {
    for (auto& candidate : candidates) {
      const Matrix u = mean + spread.cwiseProduct(Matrix::NullaryExpr(mean.rows(), N, [&] { return normal(random); }));
      candidate = run(u.cwiseMax(problem.u.lower.replicate(1, N)).cwiseMin(problem.u.upper.replicate(1, N)));
    }
    std::ranges::partial_sort(candidates, candidates.begin() + options.elite, is_better);
    if (is_better(candidates.front(), best)) best = candidates.front();
    Matrix elite_mean = Matrix::Zero(mean.rows(), N), variance = elite_mean;
    for (int i = 0; i < options.elite; ++i) elite_mean += candidates[i].u / options.elite;
    for (int i = 0; i < options.elite; ++i) variance += (candidates[i].u - elite_mean).cwiseAbs2() / options.elite;
    mean += (1 - options.smoothing) * (elite_mean - mean);
    spread += (1 - options.smoothing) * (variance.cwiseSqrt() - spread);
  }
  result.u = best.u;
  result.rollout = best.rollout;
  result.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  return result;
}

}  // namespace ricochet
