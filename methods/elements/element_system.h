#pragma once

#include <cstdint>

#include "methods/elements/affine_stages.h"
#include "methods/elements/end_projection.h"
#include "methods/elements/mode_map.h"
#include "methods/elements/newton_system.h"
#include "methods/elements/stage_unknowns.h"
#include "problems/solution.h"

namespace ricochet {

/// The equations of an element and their Newton system, for one active set at a time, shared by ElementSolver (given
/// length) and SwitchSolver (unknown length). Each can use the factors of the other.
///
/// There are two ways to solve them: by Newton's method, and in closed form where the active set makes them affine
/// (mode_map.h, affine_stages.h).
class ElementSystem {
 public:
  /// newton: by Newton's method alone, for tests of the closed form.
  enum class Form : std::uint8_t { closed_where_affine, newton };

  /// @param polygon  friction in space; the disc is the default
  ElementSystem(const Problem& problem, const ButcherTableau& tableau, Counters& counters,
                const FrictionPolygon& polygon = FrictionPolygon(), Form form = Form::closed_where_affine);
  ElementSystem(const ElementSystem&) = delete;
  ElementSystem& operator=(const ElementSystem&) = delete;

  /// Starts a new run: discards recorded sizes and factors.
  void restart();
  /// Takes over the active set of an element, and sets the forces in it that are not unknowns.
  void set_active(Element& e);
  /// The map of the active set, where its equations have a closed form; else null.
  const ModeMap* affine() const { return map_; }
  /// The stages of an element in that form. @return false where it is singular
  bool solve_affine(const StageCoefficients& k, Element& e);

  /// (5): v_1, q_1 of the element.
  void set_right_end(const StageCoefficients& k, Element& e);
  /// Element::end_lambda_n, end_lambda_t, see end_projection.h.
  void set_end_forces(Element& e);

  /// Whether the forces of the last element are not unique, because contacts are redundant; the smallest were taken.
  bool is_redundant() const { return !map_ && newton.is_redundant(); }
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
  AffineStages affine_stages;
  NewtonSystem newton;
  StageWorkspace work;
  EndSystem end_work;

 private:
  void take_active_set();

  ModeMaps maps_;
  const ModeMap* map_ = nullptr;
  const Form form_;
};

}  // namespace ricochet
