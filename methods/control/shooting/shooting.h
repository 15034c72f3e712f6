#pragma once

#include <functional>
#include <span>
#include <vector>

#include "methods/control/control_solution.h"
#include "methods/control/shooting/certificate.h"
#include "methods/control/shooting/shooting_program.h"

namespace ricochet {

struct ShootingOptions {
  int max_iterations = 300;
  double time_limit = 120;        ///< [s] of wall time; 0 for none. It is kept to within one rollout
  double Delta = 0.5;             ///< first trust region, relative to half the distance between the bounds of a control
  double feasibility = 1e-9;      ///< largest violation of a constraint in a solution
  double step_tolerance = 1e-12;  ///< a step of this size, relative like Delta, ends the iteration
  std::function<double()> clock = {};  ///< [s], any origin; empty for a steady clock of the wall time
};

/// An iteration of shooting, for progress reports.
struct ShootingIteration {
  int number = 0;
  double cost = 0, violation = 0;  ///< of the motion that it starts from; sum of all violations
  double step = 0, Delta = 0;      ///< size of the step accepted, trust region after it
  bool guarded = false;            ///< the step was held within the sequence of modes
  bool same_sequence = false;      ///< it has not changed
  double seconds = 0;              ///< since the start
};

/// Optimal control over rollouts: the unknowns are the controls alone, and with a free end time the length H of an
/// interval,
///
///   min_u  J(u) = sum_k sum_n sum_j h_n b_j L(q_nj, v_nj, u_k) + E(x_N),   x_k+1 = F(x_k, u_k, H)            (1)
///
/// with the bounds and constraints of optimal_control_problem.h. F is a step of FESD-J of as many elements as it takes,
/// so that every iterate is a motion of the plant. J is piecewise smooth, with one piece for each sequence of modes,
/// switches and impacts.
///
/// Sequential quadratic programming: the motion is linearised through its impacts and switches (linearised_interval.h), the
/// program of a step (shooting_program.h) is solved (horizon_qp.h), and the step is run with the feedback of that
/// program,
///
///   u_k = u_bar_k + du_k + K_k (x_k - x_bar_k - dx_k),   within the bounds of u,                             (2)
///
/// because a motion such as one disc that pushes another is unstable; if that is refused, without the feedback. A motion
/// is accepted if
///
///   phi = J + nu (sum of the violations of all stages + |r|_1)                                               (3)
///
/// falls by a hundredth of what the program predicts; otherwise the trust region shrinks. Where curved constraints spoil
/// a step, it is corrected to second order. A refused step that left the sequence is tried again with the guards of that
/// sequence (guards.h) as constraints. nu grows tenfold while the program leaves a violation that a larger one would
/// remove, and falls a few times where it is far above all multipliers: a large nu makes steps along curved constraints
/// short.
///
/// Where no step is left, the end is examined (certificate.h): a neighbouring piece of J in which it descends is where the
/// iteration goes on. A motion that fails is a refused step. Results are local.
/// Sources: Fletcher, Practical Methods of Optimization (1987), section 14.4, for the trust region with (3); Tassa,
/// Mansard, Todorov, Control-limited differential dynamic programming, ICRA (2014), for (2).
class Shooting {
 public:
  using Progress = std::function<void(const ShootingIteration&)>;

  /// @param problem  must outlive this object
  /// @throws InputError for a plant with formulas that bend or jump, and for options out of range
  Shooting(const OptimalControlProblem& problem, const ButcherTableau& tableau, const ShootingOptions& options);

  /// Solves from the problem's initial state. @param u  n_u x N, moved into the bounds; @param T  [s], first guess if it
  /// is free
  ControlSolution solve(const Matrix& u, double T, const Progress& progress = {});
  /// Solves from the best of several guesses: each takes a few iterations, and the one with the least (3) goes on.
  ControlSolution solve(std::span<const Matrix> guesses, double T, const Progress& progress = {});

  /// Solves the rest of the task of the last solve() after `passed` intervals of the last motion, from the state (q, v) of
  /// the plant before an impact there. Only the remaining intervals are unknowns; a free end time is N times the length
  /// of one of them. The start is the rest of the last motion, with the feedback (2) of its last step or without,
  /// whichever costs less. If the plant can run neither, the solution has no trajectory and the last motion stays.
  /// @param passed  less than the number of intervals of that motion. @param progress  as in solve()
  ControlSolution resolve(int passed, const Vector& q, const Vector& v, const Progress& progress = {});

  /// @param time_limit  of the wall time of the following solves [s]; 0 for none. @throws InputError if it is negative
  void set_time_limit(double time_limit);
  double time_limit() const { return options_.time_limit; }
  long rollouts() const { return runner_.rollouts(); }  ///< so far

 private:
  /// How an iteration ended.
  enum class Outcome : std::uint8_t { accepted, stationary, stalled, out_of_time };

  bool begin(const Matrix& u, double T);
  void restart();
  Outcome iterate(ShootingIteration& report);
  void iterate_until_done(int max_iterations, const Progress& progress);
  void finish(const Progress& progress);
  bool descend(const Certificate& certificate);
  bool try_direction(const Matrix& d, double d_H, double t, double slope);
  bool retreat(const Progress& progress);
  void lower_nu(const HorizonQpSolution& step);
  bool try_step(const HorizonQpSolution& step, bool has_feedback, double predicted, PlantMotion& trial, double& actual);
  static double violation(const PlantMotion& motion);
  double merit(const PlantMotion& motion) const;
  double now() const;
  bool is_out_of_time() const;
  void end_out_of_time();
  ControlSolution result() const;

  const OptimalControlProblem& problem_;
  ShootingOptions options_;
  PlantRunner runner_;
  MotionLineariser lineariser_;
  ShootingProgram program_;

  double start_ = 0;  // [s] of now()
  PlantMotion motion_, trial_, corrected_;
  double nu_ = 1, Delta_ = 1;
  double first_nu_ = 1;
  int lowered_ = 0;  // times that nu_ has fallen
  bool is_linearised_ = false;
  std::vector<Matrix> gains_;  // K of the last step; empty before it
  // Of the last iteration.
  Status status_ = Status::success;
  std::string message_;
  int iterations_ = 0;
  double last_size_ = 0, derivative_seconds_ = 0;
  double retreat_ = 0;  // distance that guarded steps keep from borders
  std::size_t next_retreat_ = 0;
  bool is_examined_ = false;
  Certificate certificate_;  // if it is
};

}  // namespace ricochet
