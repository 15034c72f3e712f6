#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "methods/complementarity/mpcc/crossover.h"
#include "methods/complementarity/mpcc/relaxation.h"
#include "problems/solution.h"

namespace ricochet {

enum class SigmaUpdate {
  linear,       ///< sigma_{k+1} = factor sigma_k
  superlinear,  ///< sigma_{k+1} = min(factor sigma_k, sigma_k^power)
};

struct HomotopyOptions {
  std::string relaxation = "scholtes";  ///< a name of relaxations()
  double sigma_0 = 1;
  double sigma_final = 1e-9;
  SigmaUpdate update = SigmaUpdate::linear;
  double factor = 0.1;
  double power = 1.5;
  double tolerance = 1e-10;           ///< of the last step and of the crossover
  double tolerance_per_sigma = 1e-3;  ///< a step is solved to max(tolerance, tolerance_per_sigma sigma),
  double loosest_tolerance = 1e-4;    ///< and at least to this
  double sigma_crossover = 0;         ///< at this sigma and below, a crossover to one branch is tried after every step
  bool warm_multipliers = true;       ///< a step starts from the multipliers of the last one too, not from x alone
  bool adaptive_barrier = false;      ///< see IpoptOptions
  double sigma_warm = 1e-2;           ///< first relaxation parameter of a resolve() whose branch has no solution
  int max_iterations = 1000;          ///< of one step
  double time_limit = 0;              ///< wall time of a solve() [s]; 0: no limit
  double warm_time_limit = 0;         ///< wall time of a resolve() [s]; 0: no limit
  double barrier = 0.1;               ///< first barrier parameter of the first step
  double push = 1e-2;                 ///< the guess is moved inside of its bounds by this, relatively
  bool cross_over = true;  ///< to exact complementarity; false: the end of the last relaxation is the solution
  LinearSolver linear_solver = LinearSolver::mumps;
  int max_branches = 10;  ///< branches that the crossover may try besides the first
  bool descend = true;    ///< the crossover looks for better branches and classifies the point
};

/// One solve of the homotopy.
struct HomotopyStep {
  double sigma = 0;
  NlpStatus status = NlpStatus::failed;
  int iterations = 0;
  double objective = 0;        ///< of the Mpcc, without penalties
  double complementarity = 0;  ///< max over the pairs of min(G, H)
  double violation = 0;        ///< of the Mpcc's rows and bounds
  double seconds = 0, derivative_seconds = 0;
};

struct MpccSolution {
  Status status = Status::inner_solver_failed;
  std::string message;  ///< empty on success
  Vector x;             ///< n_variables of the Mpcc
  double objective = 0;
  double complementarity = 0;  ///< max over the pairs of min(G, H)
  NamedResidual violation;
  Stationarity stationarity = Stationarity::unknown;
  bool is_b_stationary = false;  ///< known to be
  int n_biactive = 0;            ///< pairs of variables
  int switches = 0;              ///< branches that the crossover tried besides the first
  bool kept_branch = false;      ///< resolve() solved the branch of the previous solution, without a homotopy
  std::vector<HomotopyStep> steps;
  // Totals of homotopy and crossover.
  int iterations = 0;
  double seconds = 0, derivative_seconds = 0;

  bool succeeded() const { return status == Status::success; }
};

/// Solves one `Mpcc`, or many that differ in bounds and guesses, through relaxations with sigma_0 > sigma_1 > ..., each
/// from the previous solution, until sigma_final or until the pairs are complementary to the tolerance. A crossover
/// then finds a point with exact complementarity; from sigma_crossover on it is tried after every step. If no branch
/// can be solved, the solution of the last relaxation is returned, with its own status.
class MpccSolver {
 public:
  using Progress = std::function<void(const HomotopyStep&)>;

  /// @param mpcc  must outlive the solver; bounds and guesses may change between solves, blocks and pairs may not
  /// @throws InputError for options out of range, and when a variable of a pair does not have the lower bound 0
  MpccSolver(const Mpcc& mpcc, HomotopyOptions options);

  /// Solves from the guesses of the variables.
  /// @param progress  called after every step
  MpccSolution solve(const Progress& progress = {});

  /// Solves again from the last solution, after small changes of bounds: first its branch, a smooth program near its
  /// solution; if that has no solution, a homotopy from sigma_warm. Better branches are not searched (as with
  /// HomotopyOptions::descend = false), so the solution is optimal among those with the same active pairs. Without an
  /// earlier solution this is solve().
  MpccSolution resolve(const Progress& progress = {});

  /// Evaluations since construction, in the homotopy and in the crossover.
  NlpEvaluator::Work work() const;

  /// Options of the following solves. @throws InputError for options out of range; `relaxation` must not change
  void set_options(HomotopyOptions options);

 private:
  class Run;

  const Mpcc& mpcc_;
  HomotopyOptions options_;
  NlpEvaluator evaluator_;
  const Relaxation& relaxation_;
  RelaxedMpcc relaxed_;
  IpoptSolver solver_;
  std::optional<Crossover> crossover_;   // made when it is needed
  std::optional<CrossoverResult> last_;  // of the last solve that succeeded
};

/// Checked options and a solver for any program.
class Homotopy {
 public:
  using Progress = MpccSolver::Progress;

  /// @throws InputError for options out of range
  explicit Homotopy(HomotopyOptions options);

  /// Solves as MpccSolver does.
  MpccSolution solve(const Mpcc& mpcc, const Progress& progress = {}) const;

 private:
  HomotopyOptions options_;
};

}  // namespace ricochet
