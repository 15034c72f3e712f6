#pragma once

#include <functional>

#include "methods/fesd/pivoting_solver.h"
#include "methods/method.h"

namespace ricochet {

/// The PivotingSolver of many runs of one problem, with what it counts.
class KeptSolver {
 public:
  /// Problem and tableau have to outlive this.
  KeptSolver(const Problem& problem, const ButcherTableau& tableau, const PivotingSolver::Options& options)
      : problem_(problem), solver_(problem, tableau, options, counters_) {}

  Counters& counters() { return counters_; }

  /// Ready for a run from the initial state of the problem. Its counters are zero, but for the first run: what has been
  /// made once is counted there.
  PivotingSolver& start(double inner_tolerance) {
    if (has_run_) counters_ = {};
    has_run_ = true;
    solver_.set_tolerance(inner_tolerance);
    solver_.start(problem_.info().q0, problem_.info().v0);
    return solver_;
  }

 private:
  const Problem& problem_;
  Counters counters_;
  bool has_run_ = false;
  PivotingSolver solver_;
};

/// A FESD method made ready for one problem.
class PreparedFesd final : public Solver {
 public:
  using Run = std::function<Solution(const Settings&, KeptSolver&)>;

  PreparedFesd(const Problem& problem, const ButcherTableau& tableau, const PivotingSolver::Options& options, Run run)
      : kept_(problem, tableau, options), run_(std::move(run)) {}

  Solution solve(const Settings& settings) override { return run_(settings, kept_); }

 private:
  KeptSolver kept_;
  const Run run_;
};

}  // namespace ricochet
