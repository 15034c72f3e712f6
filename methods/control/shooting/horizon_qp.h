#pragma once

#include <functional>
#include <memory>
#include <vector>

#include "problems/problem.h"

/// @file
/// Convex quadratic program over a horizon: linear dynamics, stage costs, inequalities with or without slacks.

namespace ricochet {

/// Terms of one stage k < N of (1) to (5), with z = (dx_k, du_k). Every stage has the same n_x; n_u may differ.
struct HorizonStage {
  Matrix A;             ///< n_x x n_x
  Matrix B;             ///< n_x x n_u
  Vector c;             ///< n_x
  Matrix H;             ///< (n_x + n_u) square, symmetric and positive semidefinite: the caller projects it
  Vector g;             ///< n_x + n_u
  Matrix C;             ///< m x (n_x + n_u), any m
  Vector d;             ///< m
  Vector weight;        ///< m: cost of one unit of slack, > 0; infinity for a hard inequality
  Vector lower, upper;  ///< n_u: hard bounds of du_k, lower <= upper; equal ones fix it, infinite ones are none
};

/// Terms of dx_N.
struct HorizonEnd {
  Matrix H;          ///< n_x square, symmetric and positive semidefinite
  Vector g;          ///< n_x
  Matrix C;          ///< m x n_x, any m
  Vector d, weight;  ///< m, as for a stage
  Matrix E;          ///< p x n_x, any p
  Vector r;          ///< p
  Vector E_weight;   ///< p: cost of one unit of |E dx_N + r|, > 0 and finite
};

/// A component of dx_0 that is an unknown. The first value of a state with dx_k+1,i = dx_k,i is a parameter of the whole
/// horizon, such as a free end time.
struct FreeInitialComponent {
  int index = 0;                ///< of dx_0
  double lower = 0, upper = 0;  ///< hard bounds of dx_0,index, lower <= upper; infinite ones are none
};

/// The program, with sums over all stages and rows:
///
///   min  sum_k (1/2 z_k' H_k z_k + g_k' z_k) + 1/2 dx_N' H_N dx_N + g_N' dx_N
///        + sum weight' s + sum E_weight' |E dx_N + r|                                                         (1)
///   dx_k+1 = A_k dx_k + B_k du_k + c_k,   k = 0 .. N-1                                                        (2)
///   C_k z_k + d_k + s_k >= 0,   s_k >= 0, or s_k = 0 where weight = infinity,   also for k = N with z_N = dx_N  (3)
///   lower_k <= du_k <= upper_k                                                                                (4)
///   dx_0 = the given values, but its free components only within their bounds                                 (5)
struct HorizonQp {
  std::vector<HorizonStage> stages;  ///< N >= 1
  HorizonEnd end;
  Vector dx_0;  ///< n_x; a free component's value is not used
  std::vector<FreeInitialComponent> free = {};

  int n_x() const { return static_cast<int>(dx_0.size()); }
};

enum class QpStatus {
  solved,
  infeasible,       ///< hard inequalities contradict each other, or so nearly that their multipliers have no bound
  iteration_limit,  ///< also of a program without a least value
  not_convex,       ///< H is not positive semidefinite where the controls can move
  non_finite,       ///< a term of the program, or a step, is not a finite number
  interrupted,      ///< by HorizonQpOptions::is_interrupted
};

/// What is wrong with the returned values as a solution of the program as it was given, in its own units.
struct QpResiduals {
  double dynamics = 0;         ///< largest error of (2) and of the given components of (5)
  double inequalities = 0;     ///< largest violation of (3) with its slack, of (4) and of the bounds of (5)
  double stationarity = 0;     ///< largest component of the gradient of the Lagrangian (6)
  double complementarity = 0;  ///< largest product of a multiplier and its distance from zero, of all rows and slacks
};

/// Solution with the multipliers of the Lagrangian
///
///   L = (1) + sum_k lambda_k+1' (A_k dx_k + B_k du_k + c_k - dx_k+1) + lambda_0' (dx_0 given - dx_0)
///       - sum y' (C z + d + s) - sum p' (du - lower) - sum r' (upper - du) - y_E' (E dx_N + r),               (6)
///
///   0 <= y <= weight,  p, r >= 0,  |y_E| <= E_weight.
struct HorizonQpSolution {
  QpStatus status = QpStatus::iteration_limit;
  const char* message = "";    ///< reason, unless solved
  std::vector<Vector> dx;      ///< N + 1, each n_x
  std::vector<Vector> du;      ///< N, each n_u
  std::vector<Matrix> K;       ///< N, each n_u x n_x: gains of u = u_bar + du + K (x - x_bar - dx)
  std::vector<Vector> lambda;  ///< N + 1: lambda_k is the slope of the optimal cost-to-go at dx_k
  std::vector<Vector> y;       ///< N + 1, each m: multipliers of (3)
  std::vector<Vector> slack;   ///< N + 1, each m: s of (3), exactly max(0, -(C z + d)) where it is soft, else 0
  std::vector<Vector> y_lower, y_upper;  ///< N, each n_u: multipliers of (4)
  Vector y_free_lower, y_free_upper;     ///< multipliers of the bounds of the free components, in their order
  Vector y_E;                            ///< p
  double cost = 0;                       ///< quadratic part of (1)
  double penalty = 0;                    ///< the rest of (1)
  QpResiduals residuals;
  int iterations = 0;      ///< one Riccati sweep each
  int factorisations = 0;  ///< of the n_u x n_u matrices of a stage

  bool is_solved() const { return status == QpStatus::solved; }
};

struct HorizonQpOptions {
  /// Residuals at which the iteration ends: dynamics and inequalities relative to 1 + the largest |c|, |d|, |r|, dx_0;
  /// stationarity to 1 + the largest |g|; complementarity, beyond the rounding of the values of the rows, to 1 + |cost|.
  double tolerance = 1e-10;
  int max_iterations = 100;
  /// Gains of the cost and of the inequalities alone. With bounds, a control at its bound has no gain, whether that is a
  /// bound of the plant or a trust region. One more sweep.
  bool gains_without_bounds = false;
  std::function<bool()> is_interrupted = {};  ///< called once per iteration; true ends it
};

/// Primal-dual interior-point method of Mehrotra, predictor and corrector, for (1) to (5). The slack t >= 0 of each row
/// and its multiplier are eliminated. What remains is a problem of (2) with quadratic stage costs, which a Riccati
/// sweep solves exactly: O(N (n_x + n_u)^3) operations per iteration. Sources: Rao, Wright, Rawlings, Application of
/// interior-point methods to model predictive control, J. Optim. Theory Appl. 99 (1998), section 3; Mehrotra, On the
/// implementation of a primal-dual interior point method, SIAM J. Optim. 2 (1992).
///
/// A solver keeps its storage: solve() allocates only if the sizes differ from those of the last program.
class HorizonQpSolver {
 public:
  HorizonQpSolver();
  ~HorizonQpSolver();
  HorizonQpSolver(HorizonQpSolver&&) noexcept;
  HorizonQpSolver& operator=(HorizonQpSolver&&) noexcept;

  /// @return valid until the next call. Unless it is solved, its values are those of the last iterate: finite, except
  /// with QpStatus::non_finite
  /// @throws InputError for matrices of other sizes than stated, crossed bounds, weights that are not positive, no
  /// stage, a component that is free twice, options out of range
  const HorizonQpSolution& solve(const HorizonQp& qp, const HorizonQpOptions& options = {});

 private:
  class Workspace;
  std::unique_ptr<Workspace> workspace_;
};

}  // namespace ricochet
