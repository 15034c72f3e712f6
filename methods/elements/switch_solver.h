#pragma once

#include <span>
#include <vector>

#include "methods/elements/affine_switch.h"
#include "methods/elements/switch_function.h"

namespace ricochet {

/// Newton's method for a run of elements of equal, unknown length, with a switch as the additional equation: the square
/// system of FESD-J for a given active set,
///
///   (3), (4), (7) of stage_equations.h in every element,   each starts where the one before ends,
///   switch_function(right end of the last) = 0.                                                            (12)
///
/// The unknowns of every element are eliminated in turn: they respond linearly to the residual and to h, through the
/// variation of their left end, so that (12) is one equation in h. Where the active set makes (3), (4), (7) affine it is
/// one from the start (affine_switch.h).
class SwitchSolver {
 public:
  using Result = SwitchResult;

  /// @param tolerance  relative size of the last Newton correction
  SwitchSolver(ElementSystem& system, double tolerance);

  /// In: q0, v0 of the first element, modes and guesses of all, h as first guess. Out: the rest. A root with h <= 0 or
  /// h > max_h is refused with left_interval.
  Result solve(std::span<Element> run, const Switch& end, double max_h);

  void set_tolerance(double tolerance) {
    tolerance_ = tolerance;
    affine_.set_tolerance(tolerance);
  }
  SwitchFunction& function() { return function_; }

 private:
  struct Progress {
    bool is_first = false;
    double correction = 0;       // of the unknowns, relative
    double dh = 0, full_dh = 0;  // of the length, and what Newton's method asked for
  };

  Result solve_by_newton(std::span<Element> run, const Switch& end, double max_h);
  void linearize(const Element& e, Matrix& response);
  bool iterate(std::span<Element> run, const Switch& end, double h, Progress& progress, bool& is_contradictory);
  void finish(std::span<Element> run, double h);
  void hand_over(std::span<Element> run, std::size_t m) const;

  ElementSystem& system_;
  SwitchFunction function_;
  AffineSwitchSolver affine_;
  double tolerance_;
  SlipEnd slip_end_;  // of the last element
  StageCoefficients k_;
  Matrix dq_, dv_;                 // n_q x 2: variation of the left end of an element, then of its right end
  Matrix stage_dq_, stage_dv_;     // n_q x 2
  Matrix rhs_;                     // n_s n_unknowns x 2
  Vector correction_;              // n_s n_unknowns
  std::vector<Matrix> responses_;  // per element, n_s n_unknowns x 2
};

}  // namespace ricochet
