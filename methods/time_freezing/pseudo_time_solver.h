#pragma once

#include "methods/linear_algebra/small_lu.h"
#include "methods/time_freezing/pseudo_time_end.h"
#include "methods/time_freezing/pseudo_time_equations.h"

namespace ricochet {

/// Newton's method for the equations of an element (pseudo_time_equations.h), with the factors of an earlier element as
/// long as they contract.
class PseudoTimeSolver {
 public:
  /// All references must outlive this object. @param tolerance  relative size of the last correction
  PseudoTimeSolver(const Problem& problem, const ButcherTableau& tableau, const AuxiliaryDynamics& auxiliary,
                   double tolerance, Counters& counters);
  PseudoTimeSolver(const PseudoTimeSolver&) = delete;

  /// The regions of the next elements.
  void set_regions(const Regions& regions);

  /// An element that ends when the clock has moved by dt [s]: (9). The element has its left end, and w, s, beta, tau and h
  /// as first guess. @return false where Newton's method fails; the unknowns are then of no use
  bool solve_to_clock(PseudoTimeElement& e, double dt);
  /// An element of given length, while time is frozen.
  bool solve_length(PseudoTimeElement& e, double length);

 private:
  bool solve(PseudoTimeElement& e, double dt);
  void factorize();
  double apply_correction(PseudoTimeElement& e, double dt, double& size) const;

  const ProblemInfo& info_;
  const ButcherTableau& tableau_;
  const double tolerance_;
  Counters& counters_;
  HeldContacts held_;
  PseudoTimeEquations equations_;
  PseudoTimeEnd end_;
  PseudoTimeWorkspace work_;
  SmallLu lu_;
  Vector x_;  // correction
  bool has_factors_ = false, is_redundant_ = false;
};

}  // namespace ricochet
