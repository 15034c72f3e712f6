#pragma once

#include <optional>
#include <string>
#include <vector>

#include "methods/complementarity/homotopy.h"
#include "methods/control/fesd_equations.h"
#include "methods/fesd/pivoting_solver.h"

namespace ricochet {

/// Solves the FESD-J equations of one step after the other as MPCCs (methods/control/fesd_equations.h) by homotopy, as
/// published: every step is a feasibility problem, with the equilibration of the lengths as the only objective. One
/// program serves all steps; initial state and guess change.
///
/// Where a step ends closed is where the next one begins closed: an impact at the right end of a step is one at the
/// left end of the next (correction 7 in methods/fesd/README.md).
///
/// A step that fails is tried again with a guess that has an impact in it, Lambda_n > 0: a free flight up to the time
/// at which a gap is smallest, the impact law there, and a free flight behind it.
class StepHomotopy {
 public:
  enum class Guess {
    cold,       ///< the state at the step's start, everywhere
    ballistic,  ///< constant acceleration, without contact
    pivoting,   ///< the step of the pivoting solver; ballistic where that has failed
  };

  struct Options {
    FesdEquations::Options equations;
    HomotopyOptions homotopy;
    Guess guess = Guess::ballistic;
    int retries = 1;
    double retry_sigma_0 = 0;  ///< of a retry; 0: as always
  };

  /// @param H  length of every step [s]
  StepHomotopy(const Problem& problem, const ButcherTableau& tableau, const Options& options, double H);
  StepHomotopy(const StepHomotopy&) = delete;
  StepHomotopy& operator=(const StepHomotopy&) = delete;

  /// Starts a run at (q, v), v before an impact at this instant.
  void start(const Vector& q, const Vector& v);
  /// Solves the next step.
  Status advance();

  const FesdStep& step() const { return steps_[current_]; }
  const FesdStep* previous_step() const { return n_steps_ > 1 ? &steps_[1 - current_] : nullptr; }
  /// Of the last step, or its last attempt.
  const MpccSolution& solution() const { return solution_; }
  int attempts() const { return attempts_; }  ///< at the last step
  NlpEvaluator::Work work() const { return solver_.work(); }

 private:
  FesdStep cold() const;
  FesdStep ballistic() const;
  FesdStep bounce() const;
  void fly(Stages& element, const Vector& q, const Vector& v, double h) const;
  double time_of_smallest_gap(int& contact) const;
  void accept();

  const Problem& problem_;
  const ProblemInfo& info_;
  const ButcherTableau tableau_;
  const Options options_;
  const double H_;
  Mpcc mpcc_;
  FesdEquations equations_;
  FesdEquations::Point initial_, right_;
  MpccSolver solver_;
  Counters pivoting_counters_;
  std::optional<PivotingSolver> pivoting_;

  Vector q_, v_;
  std::vector<bool> is_closed_;
  FesdStep steps_[2];
  int current_ = 0;
  int n_steps_ = 0, attempts_ = 0;
  MpccSolution solution_;
};

}  // namespace ricochet
