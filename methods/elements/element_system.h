#pragma once

#include "methods/elements/end_projection.h"
#include "methods/elements/newton_system.h"
#include "methods/elements/stage_unknowns.h"
#include "problems/solution.h"

namespace ricochet {

/// The equations of an element and their Newton system, for one active set at a time: what ElementSolver (given length)
/// and SwitchSolver (unknown length) share. Factors that one of them made are good for the other.
class ElementSystem {
 public:
  /// @param polygon  friction in space; the disc is the default
  ElementSystem(const Problem& problem, const ButcherTableau& tableau, Counters& counters,
                const FrictionPolygon& polygon = FrictionPolygon());
  ElementSystem(const ElementSystem&) = delete;
  ElementSystem& operator=(const ElementSystem&) = delete;

  /// Takes over the active set of an element, and sets the forces in it that are no unknowns.
  void set_active(Element& e);

  /// (5): v_1, q_1 of the element.
  void set_right_end(const StageCoefficients& k, Element& e);

  /// The forces of the last element are not the only ones, since contacts are redundant: the smallest were taken.
  bool is_redundant() const { return newton.is_redundant(); }
  /// Equations of redundant contacts may contradict each other: then Newton's method converges to a compromise, and the
  /// residual in the workspace shows it.
  bool is_consistent(const Element& e, double h) const;

  const Problem& problem;
  const StageTableau tableau;
  Counters& counters;
  ActiveSet active;
  StageEquations equations;
  StageUnknowns unknowns;
  EndProjection end;
  NewtonSystem newton;
  StageWorkspace work;
  EndSystem end_work;
};

}  // namespace ricochet
