#pragma once

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "problems/solution.h"

namespace ricochet {

/// A run of a method from the begin of a step to a zero of a function of the state.
struct BorderPiece {
  Solution solution;  ///< the run, or the one that failed
  double length = 0;  ///< of the run [s]
};

/// Searches the length h of a run of a method, from the begin of a step, with
///
///     psi(x(h)) = 0                                                                                           (1)
///
/// by the secant method within the bracket of `exit`. An end that stays loses half of its weight (Illinois method:
/// Dowell, Jarratt, *A modified regula falsi method*, BIT 11 (1971) 168-174). Ends that come from an interpolation
/// give way if the zero lies beyond them.
/// @param exit      the bracket; psi > 0 before the zero
/// @param zero      |psi| that counts as zero
/// @param shortest  bracket that the time can resolve [s]
/// @param run       run(h), the Solution of a run of the length h
/// @param psi       psi(solution)
template <class Run, class Psi>
BorderPiece search_border(const RegionExit& exit, double zero, double shortest, const Run& run, const Psi& psi) {
  constexpr int kMostRuns = 60, kBisections = 12;  // after these every third run bisects
  constexpr double kEdge = 1e-3;                   // of the bracket: a root so near its end may lie beyond it
  double a = exit.inside, b = exit.outside, f_a = exit.psi_inside, f_b = exit.psi_outside;
  BorderPiece best;
  double f_best = std::numeric_limits<double>::infinity();
  bool is_a_known = a == 0, is_b_known = false;
  for (int n = 0; n < kMostRuns; ++n) {
    double h = (a * f_b - b * f_a) / (f_b - f_a);  // the secant
    if (!(h > a && h < b)) h = 0.5 * (a + b);
    if (n > kBisections && n % 3 == 0) h = 0.5 * (a + b);
    if (b - a > shortest) h = std::clamp(h, a + 0.5 * shortest, b - 0.5 * shortest);
    Solution piece = run(h);
    if (!piece.succeeded()) return {std::move(piece), h};
    const double f = psi(piece);
    if (std::abs(f) <= std::abs(f_best)) {
      f_best = f;
      best = {std::move(piece), h};
    }
    if (std::abs(f) <= zero) break;
    const double width = exit.outside - exit.inside;
    if (f > 0) {
      if (is_a_known) f_b *= 0.5;
      a = h;
      f_a = f;
      is_a_known = true;
      if (!is_b_known && b - a < kEdge * width) b = a + width;
    } else {
      if (is_b_known) f_a *= 0.5;
      b = h;
      f_b = f;
      is_b_known = true;
      if (!is_a_known && b - a < kEdge * width) {
        a = std::max(0.0, b - width);
        is_a_known = a == 0;
      }
    }
    if (is_a_known && is_b_known && b - a <= shortest) break;
  }
  return best;
}

}  // namespace ricochet
