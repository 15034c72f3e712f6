#pragma once

#include <fmt/format.h>

#include <string>

#include "problems/control/optimal_control_problem.h"
#include "problems/derivatives/symbolic_problem.h"

namespace ricochet {

/// The plant of an optimal control problem, with a control that can be changed.
class ControlledPlant final : public SymbolicProblem {
 public:
  explicit ControlledPlant(const OptimalControlProblem& problem);
  void set_control(const Eigen::Ref<const Vector>& u) { info_.u = u; }
};

/// The plant of an optimal control problem with an additional coordinate. Its velocity is the running cost so far,
///
///   M = 1,   v_cost' = L(q, v, u),                                                                         (1)
///
/// so that every method integrates the cost as accurately as the motion. The controls are parameters, so that
/// derivatives with respect to them are sensitivities. It is run interval by interval.
class ReplayProblem final : public SymbolicProblem {
 public:
  explicit ReplayProblem(const OptimalControlProblem& problem);
  static std::string control_parameter(int control) { return fmt::format("control_{}", control); }

  /// Starts the next interval at the plant's (q, v), before an impact at this instant, with zero cost.
  void restart(const Vector& q, const Vector& v, const Vector& u, double duration);

  /// The entries of q or v that belong to the plant, and the cost in v.
  Vector of_plant(const Vector& x) const;
  double cost(const Vector& v) const { return v[n_bodies_]; }

 private:
  int n_bodies_;  // coordinates of the plant's bodies; those of friction elements and the clock follow the cost
};

}  // namespace ricochet
