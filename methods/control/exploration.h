#pragma once

#include <vector>

#include "methods/control/rollout.h"

namespace ricochet {

struct ExplorationOptions {
  int rounds = 15;
  int samples = 200;       ///< rollouts of a round
  int elite = 20;          ///< the best of them shape the next round
  double penalty = 100;    ///< of a violation of 1, relative to the cost of the guessed controls
  double smoothing = 0.1;  ///< part of the last round's mean and spread that stays
  unsigned seed = 1;
  int knots = 0;   ///< of the sampled controls, 2 to N; 0: N, but 10 at most
  int starts = 1;  ///< how many of the best controls are kept
};

/// @param n_intervals  of the problem. @throws InputError for options out of range
void check(const ExplorationOptions& options, int n_intervals);

struct ExplorationResult {
  Matrix u;                    ///< n_u x N, the best controls found
  Rollout rollout;             ///< of u
  std::vector<Matrix> starts;  ///< the best controls, u first; fewer than requested if fewer motions were solved
  int rollouts = 0, failed = 0;
  double seconds = 0;
};

/// Searches controls whose motion makes the contacts that matter, by the cross-entropy method: sample the controls at a
/// few knots from independent normal distributions about the guess, interpolate them linearly, run each sample
/// (rollout.h), take mean and spread of the best for the next round.
///
/// With a knot for each of many intervals the samples would be white noise, whose effect on a motion averages out.
///
/// A plant held at rest by dry friction does not react to a small change of its controls. A guess without motion is
/// then a local solution, and a homotopy finds contacts only through its relaxation, which violates the plant. Rollouts
/// obey the plant.
///
/// The first spread is a sixth of the distance between the bounds of a control; 1 if it has none.
///
/// @param n_fe  elements of an interval; a rollout takes more where it needs them
/// @throws InputError for options out of range
/// Source: de Boer, Kroese, Mannor, Rubinstein, A tutorial on the cross-entropy method, Ann. Oper. Res. 134 (2005).
ExplorationResult explore(const OptimalControlProblem& problem, const ButcherTableau& tableau, int n_fe,
                          const ExplorationOptions& options);

/// Controls of N intervals from those at K knots, linearly; the same if K = N. @param knots  n_u x K
Matrix interpolate_knots(const Matrix& knots, Eigen::Index N);

}  // namespace ricochet
