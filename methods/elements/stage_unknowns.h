#pragma once

#include "methods/elements/stage_equations.h"

namespace ricochet {

/// Conversions between an element and the unknowns of Newton's method, x_j = (w_j, lambda_j) of active_set.h, stage
/// after stage.
class StageUnknowns {
 public:
  StageUnknowns(const Problem& problem, const ActiveSet& active, int n_s)
      : info_(problem.info()), active_(active), n_s_(n_s) {}

  /// Adds a correction dx to w and lambda of the element.
  /// @param K  as the Newton matrix had it
  /// @return its size as a velocity [m/s]: h max |dw|, and the accelerations by the corrections of the forces, which
  /// (3) may hide in dw
  double correct(const double* dx, double h, const StageDerivatives& K, Element& e) const;

  /// Forces that are not unknowns: those of open contacts, and (7b).
  void set_dependent_forces(Element& e) const;

  /// The forces among the unknowns, in x; its accelerations are not touched.
  void gather_forces(const Element& e, Vector& x) const;

  /// Size of velocities in an element [m/s], with which corrections are compared: |v_0| of the bodies, h |w|, and the
  /// velocity that the load alone would cause in the step, which is all that remains for a body that a contact holds at
  /// rest.
  double velocity_scale(const Element& e, double h, double load) const;

 private:
  void set_friction(const ActiveContact& active, int stage, const double* dx, Element& e) const;

  const ProblemInfo& info_;
  const ActiveSet& active_;
  const int n_s_;
};

}  // namespace ricochet
