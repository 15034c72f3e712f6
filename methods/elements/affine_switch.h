#pragma once

#include <cstdint>
#include <span>

#include "methods/elements/switch_function.h"

namespace ricochet {

enum class SwitchResult : std::uint8_t { converged, no_convergence, singular, left_interval };

/// A run of m equal elements of unknown length that ends with a switch, in closed form: its stages are known for any h
/// (affine_stages.h), so that (12) of switch_solver.h is one equation
///
///   F(h) = switch_function(right end of the m-th element of length h) = 0                                    (1)
///
/// without other unknowns. It is solved by the secant method, whose two first lengths lie close together.
class AffineSwitchSolver {
 public:
  /// @param tolerance  relative size of the last correction of h
  AffineSwitchSolver(ElementSystem& system, SwitchFunction& function, double tolerance);

  void set_tolerance(double tolerance) { tolerance_ = tolerance; }
  /// As SwitchSolver::solve, for elements whose active set the system has and ElementSystem::affine() knows.
  SwitchResult solve(std::span<Element> run, const Switch& end, double max_h);

 private:
  bool solve_elements(std::span<Element> run, double h);
  double value(std::span<Element> run, const Switch& end, double h);

  ElementSystem& system_;
  SwitchFunction& function_;
  double tolerance_;
  StageCoefficients k_;
};

}  // namespace ricochet
