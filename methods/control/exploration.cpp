#include "methods/control/exploration.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <random>

#include "problems/input_error.h"

namespace ricochet {
namespace {

/// Knots of a control unless the options state their number.
constexpr int kDefaultKnots = 10;

struct Candidate {
  Matrix knots;
  Rollout rollout;
  double score = 0;
};

/// Motions that end early are worse than all others, and the earlier the worse.
bool is_better(const Candidate& a, const Candidate& b) {
  if (a.rollout.n_solved != b.rollout.n_solved) return a.rollout.n_solved > b.rollout.n_solved;
  return a.score < b.score;
}

Matrix first_spread(const OptimalControlProblem::Bounds& bounds, Eigen::Index n_knots) {
  Vector spread(bounds.lower.size());
  for (Eigen::Index c = 0; c < spread.size(); ++c) {
    const double width = bounds.upper[c] - bounds.lower[c];
    spread[c] = std::isfinite(width) ? width / 6 : 1;
  }
  return spread.replicate(1, n_knots);
}

/// Inserts a candidate among the best so far, which are at most `size`.
void keep_best(std::vector<Candidate>& best, const Candidate& candidate, std::size_t size) {
  if (best.size() == size && !is_better(candidate, best.back())) return;
  best.insert(std::ranges::upper_bound(best, candidate, is_better), candidate);
  if (best.size() > size) best.pop_back();
}

}  // namespace

void check(const ExplorationOptions& options, int n_intervals) {
  if (options.samples < 1) throw InputError("samples", options.samples, "a number >= 1 is required");
  if (options.elite < 1 || options.elite > options.samples)
    throw InputError("elite", options.elite, "a number from 1 to the number of samples is required");
  if (options.knots != 0 && (options.knots < 2 || options.knots > n_intervals))
    throw InputError("knots", options.knots,
                     fmt::format("a number from 2 to the number of control intervals, {}, is required", n_intervals));
  if (options.starts < 1) throw InputError("starts", options.starts, "a number >= 1 is required");
}

Matrix interpolate_knots(const Matrix& knots, Eigen::Index N) {
  const Eigen::Index K = knots.cols();
  if (K == N) return knots;
  Matrix u(knots.rows(), N);
  for (Eigen::Index k = 0; k < N; ++k) {
    const double x = static_cast<double>(k) / static_cast<double>(N - 1) * static_cast<double>(K - 1);
    const auto left = std::min(static_cast<Eigen::Index>(x), K - 2);
    const double part = x - static_cast<double>(left);
    u.col(k) = (1 - part) * knots.col(left) + part * knots.col(left + 1);
  }
  return u;
}

ExplorationResult explore(const OptimalControlProblem& problem, const ButcherTableau& tableau, int n_fe,
                          const ExplorationOptions& options) {
  check(options, problem.n_intervals);
  const auto begin = std::chrono::steady_clock::now();
  const Eigen::Index N = problem.n_intervals,
                     K = options.knots > 0 ? options.knots : std::min(N, Eigen::Index{kDefaultKnots});
  std::mt19937 random(options.seed);
  std::normal_distribution<double> normal;
  Matrix mean = problem.guess(static_cast<int>(K)), spread = first_spread(problem.u, K);
  const Matrix lower = problem.u.lower.replicate(1, K), upper = problem.u.upper.replicate(1, K);
  ExplorationResult result;
  RolloutRunner runner(problem, tableau, n_fe);

  double penalty = 0;
  const auto run = [&](const Matrix& knots) {
    Candidate candidate{knots, runner.run(interpolate_knots(knots, N)), 0};
    candidate.score = candidate.rollout.cost + penalty * candidate.rollout.violation;
    // A motion with a cost that is no number counts as one that ends at once.
    if (!std::isfinite(candidate.score)) candidate.rollout = {.status = Status::non_finite};
    ++result.rollouts;
    if (candidate.rollout.status != Status::success) ++result.failed;
    return candidate;
  };
  Candidate first = run(mean);
  penalty = options.penalty * (1 + std::abs(first.rollout.cost));
  first.score += penalty * first.rollout.violation;
  std::vector<Candidate> best;
  keep_best(best, first, static_cast<std::size_t>(options.starts));

  std::vector<Candidate> candidates(static_cast<std::size_t>(options.samples));
  for (int round = 0; round < options.rounds; ++round) {
    for (auto& candidate : candidates) {
      const Matrix knots =
          mean + spread.cwiseProduct(Matrix::NullaryExpr(mean.rows(), K, [&] { return normal(random); }));
      candidate = run(knots.cwiseMax(lower).cwiseMin(upper));
    }
    std::ranges::partial_sort(candidates, candidates.begin() + options.elite, is_better);
    for (int i = 0; i < std::min(options.elite, options.starts); ++i)
      keep_best(best, candidates[i], static_cast<std::size_t>(options.starts));
    Matrix elite_mean = Matrix::Zero(mean.rows(), K), variance = elite_mean;
    for (int i = 0; i < options.elite; ++i) elite_mean += candidates[i].knots / options.elite;
    for (int i = 0; i < options.elite; ++i) variance += (candidates[i].knots - elite_mean).cwiseAbs2() / options.elite;
    mean += (1 - options.smoothing) * (elite_mean - mean);
    spread += (1 - options.smoothing) * (variance.cwiseSqrt() - spread);
  }
  result.u = interpolate_knots(best.front().knots, N);
  result.rollout = best.front().rollout;
  for (const auto& candidate : best) {
    if (candidate.rollout.status == Status::success) result.starts.push_back(interpolate_knots(candidate.knots, N));
  }
  result.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  return result;
}

}  // namespace ricochet
