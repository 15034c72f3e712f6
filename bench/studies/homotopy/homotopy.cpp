#include "bench/studies/homotopy/homotopy.h"

#include <fmt/format.h>

#include <algorithm>

#include "bench/measure/timing.h"
#include "methods/fesd/pivoting_solver.h"

namespace ricochet {
namespace {

class CpuClock {
 public:
  double milliseconds() const { return 1e3 * (cpu_seconds() - begin_); }

 private:
  double begin_ = cpu_seconds();
};

}  // namespace

PivotingRun run_pivoting(const Problem& problem, const ButcherTableau& tableau, int steps) {
  const ProblemInfo& info = problem.info();
  PivotingRun run;
  run.tableau = tableau;
  run.steps = steps;
  run.q = {info.q0};
  run.v = {info.v0};
  Counters counters;
  PivotingSolver solver(problem, tableau, {.switches = PivotingSolver::Switches::published}, counters);
  solver.start(info.q0, info.v0);
  for (int k = 0; k < steps; ++k) {
    const CpuClock clock;
    run.status = solver.advance(info.end_time / steps);
    if (run.status != Status::success) {
      run.message = fmt::format("step {}: {}", k + 1, solver.failure_message());
      return run;
    }
    run.milliseconds.push_back(clock.milliseconds());
    run.has_impact.push_back(solver.step().Lambda_n.maxCoeff() > 0);
    run.q.push_back(solver.step().last().q1);
    run.v.push_back(solver.step().last().v1);
  }
  return run;
}

HomotopyRun run_homotopy(const Problem& problem, const PivotingRun& pivoting, const StepHomotopy::Options& options,
                         int margin) {
  const int n = static_cast<int>(pivoting.has_impact.size());
  const auto is_chosen = [&](int k) {
    if (margin < 0) return true;
    const auto first = pivoting.has_impact.begin() + std::max(k - margin, 0);
    const auto last = pivoting.has_impact.begin() + std::min(k + margin + 1, n);
    return std::find(first, last, true) != last;
  };
  HomotopyRun run;
  StepHomotopy solver(problem, pivoting.tableau, options, problem.info().end_time / pivoting.steps);
  bool goes_on = false;  // from the step before
  for (int k = 0; k < n; ++k) {
    const auto at = static_cast<std::size_t>(k);
    if (!is_chosen(k)) {
      goes_on = false;
      continue;
    }
    if (!goes_on) solver.start(pivoting.q[at], pivoting.v[at]);
    const CpuClock clock;
    goes_on = solver.advance() == Status::success;
    ++run.steps;
    if (solver.attempts() > 1) ++run.retried;
    if (!goes_on) {
      ++run.failed;
      run.failures.push_back(fmt::format("step {}: {}", k + 1, solver.solution().message));
      continue;
    }
    run.milliseconds[pivoting.has_impact[at]].push_back(clock.milliseconds());
    run.q = solver.step().last().q1;
    run.v = solver.step().last().v1;
    if (k + 1 == n || !is_chosen(k + 1))
      run.distances.push_back(std::max((run.q - pivoting.q[at + 1]).cwiseAbs().maxCoeff(),
                                       (run.v - pivoting.v[at + 1]).cwiseAbs().maxCoeff()));
  }
  run.is_complete = run.failed == 0 && run.steps == pivoting.steps;
  if (n < pivoting.steps) {
    solver.start(pivoting.q.back(), pivoting.v.back());
    run.solves_infeasible = solver.advance() == Status::success;
  }
  return run;
}

}  // namespace ricochet
