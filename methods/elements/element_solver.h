#pragma once

#include "methods/elements/element_system.h"

namespace ricochet {

/// Solves the stage equations (3), (4), (7) of stage_equations.h for an element of given length: in closed form where
/// its active set makes them affine (affine_stages.h), else by Newton's method. Factors of the Newton matrix are kept
/// from element to element as long as it contracts.
class ElementSolver {
 public:
  enum class Result : std::uint8_t { converged, no_convergence, singular };

  /// @param tolerance  relative size of the last Newton correction
  ElementSolver(ElementSystem& system, double tolerance);

  void set_tolerance(double tolerance) { tolerance_ = tolerance; }
  /// Starts a new run: discards data of earlier elements.
  void restart();

  /// In: h, q0, v0, modes, and a, lambda_n as first guess. Out: everything else. No allocation, apart from the first
  /// use of an active set.
  Result solve(Element& e);

 private:
  Result solve_affine(const StageCoefficients& k, Element& e);
  Result solve_by_newton(const StageCoefficients& k, Element& e);
  Result finish(const StageCoefficients& k, Element& e);
  bool refresh(const StageCoefficients& k, const Element& e);

  ElementSystem& system_;
  double tolerance_;
  RecentCoefficients coefficients_;
  bool keeps_factors_ = true;  // those of an earlier element contracted when one last needed two iterations
};

}  // namespace ricochet
