#pragma once

#include <cstdint>
#include <vector>

#include "methods/complementarity/mpcc/stationarity.h"

namespace ricochet {

/// max over the pairs of min(G, H) at x, and the pair; 0 without pairs.
NamedResidual complementarity(const Mpcc& mpcc, const double* x);

struct CrossoverOptions {
  IpoptOptions ipopt;
  int max_branches = 10;        ///< branches that may be tried besides the first
  bool search_branches = true;  ///< try others if the first has no solution
  bool descend = true;          ///< look for better branches and classify the point; false: any branch that is solved
};

/// The side of a pair that a branch holds at zero.
enum class Side : std::uint8_t { G, H };

struct CrossoverResult {
  NlpResult branch;         ///< of the branch that the point comes from
  std::vector<Side> sides;  ///< of that branch, per pair
  Stationarity stationarity = Stationarity::unknown;
  /// No feasible direction descends; false: not known.
  bool is_b_stationary = false;
  int n_biactive = 0;  ///< pairs of variables
  int switches = 0;    ///< branches tried besides the first
  // Totals of all branches.
  int iterations = 0;
  double derivative_seconds = 0;
};

/// Turns a solution of a relaxation into a point with exact complementarity: holds the smaller side of every pair at
/// zero and solves the branch
///
///   min f  subject to  rows, bounds, and for every pair i:  G_i = 0 or H_i = 0,                               (1)
///
/// where a sum is held at zero by its variables. An S-stationary point, and one without biactive pairs, is
/// B-stationary: no feasible direction descends (stationarity.h). If this is not established, the other branch of a
/// biactive pair whose held variable has a negative multiplier may descend and is tried. If a branch has no solution,
/// the least clear pairs are switched, one by one.
///
class Crossover {
 public:
  /// @param mpcc  must outlive this; bounds may change between runs, blocks and pairs may not
  explicit Crossover(const Mpcc& mpcc);

  /// @param relaxed  near a solution: n_variables and n_rows of the Mpcc, its multipliers start the first branch
  CrossoverResult run(const NlpPoint& relaxed, const CrossoverOptions& options);

  /// Solves the branch of an earlier result again, from its x, after small changes of bounds. It is neither improved
  /// nor classified; there is no solution if the new bounds require another branch.
  CrossoverResult resume(const CrossoverResult& earlier, const IpoptOptions& ipopt);

  /// Evaluations since construction.
  const NlpEvaluator::Work& work() const { return solver_.evaluator().work(); }

 private:
  const Mpcc& mpcc_;
  Nlp program_;
  IpoptSolver solver_;
};

/// The same for one run.
CrossoverResult cross_over(const Mpcc& mpcc, const NlpPoint& relaxed, const CrossoverOptions& options);

}  // namespace ricochet
