#pragma once

#include <memory>
#include <string>

#include "methods/complementarity/mpcc/nlp_evaluator.h"
#include "problems/named_values.h"

namespace ricochet {

enum class NlpStatus {
  solved,
  acceptable,  ///< solved only to IpoptOptions::acceptable_factor times the tolerance
  infeasible,  ///< a stationary point of the violation
  iteration_limit,
  time_limit,
  non_finite,
  failed,  ///< see the message
};

inline bool is_solved(NlpStatus status) {
  return status == NlpStatus::solved || status == NlpStatus::acceptable;
}

/// Variables and multipliers of
///
///   L = f + lambda' g - z_L' (x - x_L) - z_U' (x_U - x),   z_L, z_U >= 0.                                     (1)
struct NlpPoint {
  Vector x;         ///< n_variables
  Vector lambda;    ///< n_rows
  Vector z_L, z_U;  ///< n_variables
};

/// Solver of Ipopt's Newton systems.
enum class LinearSolver {
  mumps,  ///< searches for pivots
  ldl,    ///< static order, no search: StaticLdl
};
const Names<LinearSolver>& linear_solver_names();

struct IpoptOptions {
  double tolerance = 1e-10;        ///< of the scaled optimality conditions, and of the violation in the rows' own units
  double acceptable_factor = 100;  ///< a point this much worse is taken when nothing better is found
  int max_iterations = 1000;
  double time_limit = 0;          ///< wall time [s]; 0: no limit
  double barrier = 0.1;           ///< first barrier parameter mu
  bool adaptive_barrier = false;  ///< mu follows the complementarity of the iterates; else it only decreases
  double push = 1e-2;             ///< relative distance by which a start without multipliers moves from bounds
  LinearSolver linear_solver = LinearSolver::mumps;
  bool multipliers_of_fixed = false;  ///< of variables with x_L = x_U: they stay in the problem, with a constraint each
};

struct NlpResult {
  NlpStatus status = NlpStatus::failed;
  std::string message;  ///< what Ipopt says; not on "solved"
  NlpPoint point;
  double objective = 0;
  NamedResidual violation;
  int iterations = 0;
  double seconds = 0, derivative_seconds = 0;
};

/// Solves an `Nlp` with the interior-point method of Ipopt and exact derivatives. Source: Waechter, Biegler, On the
/// implementation of an interior-point filter line-search algorithm for large-scale nonlinear programming, Mathematical
/// Programming 106 (2006). Bounds are kept exactly, nothing is printed.
class IpoptSolver {
 public:
  /// @param nlp  must outlive the solver; bounds may change between solves, blocks may not
  explicit IpoptSolver(const Nlp& nlp);
  ~IpoptSolver();

  /// Solves from the guesses of the variables.
  NlpResult solve(const IpoptOptions& options = {});
  /// @param start  with all multipliers for a warm start, or x alone. @throws InputError for options out of range
  NlpResult solve(const NlpPoint& start, const IpoptOptions& options = {});

  NlpEvaluator& evaluator() { return evaluator_; }
  const NlpEvaluator& evaluator() const { return evaluator_; }

 private:
  struct Application;

  NlpEvaluator evaluator_;
  std::unique_ptr<Application> application_;  // its construction takes as long as a small program
};

}  // namespace ricochet
