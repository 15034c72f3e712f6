#pragma once

#include <functional>
#include <string>
#include <vector>

#include "methods/control/control_trajectory.h"
#include "methods/control/shooting/stage_constraints.h"
#include "methods/fesd/pivoting_solver.h"
#include "problems/control/replay_problem.h"

namespace ricochet {

/// A constraint that is violated most.
struct WorstConstraint {
  double value = 0;  ///< of the violation, >= 0
  std::string name;  ///< with the interval; empty if nothing is violated
};

/// The motion of a plant under controls that are constant on N intervals of length H, with all that is known of it.
struct PlantMotion {
  Status status = Status::success;
  std::string message;  ///< interval and reason, unless it succeeded
  int n_solved = 0;     ///< intervals

  Matrix u;                     ///< n_u x N
  double H = 0;                 ///< [s]
  Matrix x;                     ///< 2 n_q x (N + 1): (q, v) at the boundaries, before an impact there
  std::vector<FesdStep> steps;  ///< N; only their elements in use are of this motion
  double cost = 0;              ///< (1) of optimal_control_problem.h, by the tableau's quadrature
  double violation = 0;         ///< sum of all violated inequalities over all stages
  Vector terminal;              ///< r at the end
  double worst = 0;             ///< largest violated inequality of a stage
  int worst_interval = -1, worst_row = -1;

  bool succeeded() const { return status == Status::success; }
};

/// Whether two steps go through the same modes, switches and impacts, with the same elements.
bool has_same_sequence(const FesdStep& a, const FesdStep& b);
/// Whether all steps of two motions do: then both are points of one smooth piece of the cost as a function of the controls.
bool has_same_sequence(const PlantMotion& a, const PlantMotion& b);

/// Runs the plant of an optimal control problem by FESD-J, with as many elements as it takes. Motions keep their
/// storage.
class PlantRunner {
 public:
  /// The control of interval k, from the state (q, v) at its start. @param u  n_u, out
  using Policy = std::function<void(int k, const Eigen::Ref<const Vector>& x, Eigen::Ref<Vector> u)>;

  /// @param problem  must outlive this object
  /// @throws InputError for a plant with formulas that bend or jump, which shooting does not differentiate
  PlantRunner(const OptimalControlProblem& problem, const ButcherTableau& tableau);
  PlantRunner(const PlantRunner&) = delete;

  /// Runs N intervals of length H from (q, v), before an impact there; a failure is in the motion.
  void run(const Vector& q, const Vector& v, const Policy& policy, int N, double H, PlantMotion& motion);
  /// With given controls, n_u x N.
  void run(const Vector& q, const Vector& v, const Matrix& u, double H, PlantMotion& motion);

  const OptimalControlProblem& problem() const { return problem_; }
  ControlledPlant& plant() { return plant_; }
  const ButcherTableau& tableau() const { return tableau_; }
  const StageConstraints& constraints() const { return constraints_; }
  WorstConstraint worst(const PlantMotion& motion) const;
  ControlTrajectory trajectory(const PlantMotion& motion) const;
  long rollouts() const { return rollouts_; }

 private:
  void run_intervals(const Policy& policy, int N, PlantMotion& motion);
  void add_interval(int k, PlantMotion& motion);

  const OptimalControlProblem& problem_;
  const ButcherTableau tableau_;
  ControlledPlant plant_;
  const StageConstraints constraints_;
  Counters counters_;
  PivotingSolver solver_;
  long rollouts_ = 0;
  Vector stage_, c_;  // (q, v, u), (1) of stage_constraints.h
};

}  // namespace ricochet
