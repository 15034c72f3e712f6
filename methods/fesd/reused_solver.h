#pragma once

#include <functional>

#include "methods/fesd/pivoting_solver.h"
#include "methods/method.h"

namespace ricochet {

/// A PivotingSolver that many runs of one problem share, and its counters.
class ReusedSolver {
 public:
  /// Problem and tableau must outlive this object.
  ReusedSolver(const Problem& problem, const ButcherTableau& tableau, const PivotingSolver::Options& options)
      : problem_(problem), solver_(problem, tableau, options, counters_) {}

  Counters& counters() { return counters_; }

  /// Prepares a run from the initial state of the problem. Its counters start at zero; those of the first run include the
  /// work of the constructor. @param set_options  called before, with the solver
  PivotingSolver& start(double inner_tolerance, const std::function<void(PivotingSolver&)>& set_options = {}) {
    if (has_run_) counters_ = {};
    has_run_ = true;
    solver_.set_tolerance(inner_tolerance);
    if (set_options) set_options(solver_);
    solver_.start(problem_.info().q0, problem_.info().v0);
    return solver_;
  }

 private:
  const Problem& problem_;
  Counters counters_;
  bool has_run_ = false;
  PivotingSolver solver_;
};

/// A FESD method prepared for one problem.
class PreparedFesd final : public Solver {
 public:
  using Run = std::function<Solution(const Settings&, ReusedSolver&)>;

  PreparedFesd(const Problem& problem, const ButcherTableau& tableau, const PivotingSolver::Options& options, Run run)
      : solver_(problem, tableau, options), run_(std::move(run)) {}

  Solution solve(const Settings& settings) override { return run_(settings, solver_); }

 private:
  ReusedSolver solver_;
  const Run run_;
};

}  // namespace ricochet
