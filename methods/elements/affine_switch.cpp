#include "methods/elements/affine_switch.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace ricochet {
namespace {

constexpr int kMaxIterations = 30;
// The second length of the first secant, relative: curvature changes the slope by as much, rounding of the values by less
// unless the elements are far shorter than the motion asks for.
constexpr double kFirstSecant = 1e-4;
// A secant as short as this part of h has the slope of the one before, unless its values differ by rounding alone.
constexpr double kShortSecant = 1e-3;
// A length that is not corrected again is to be as accurate as one that is: what the tolerance leaves of h is more.
constexpr double kOfCorrection = 1e-3;

}  // namespace

AffineSwitchSolver::AffineSwitchSolver(ElementSystem& system, SwitchFunction& function, double tolerance)
    : system_(system), function_(function), tolerance_(tolerance) {}

bool AffineSwitchSolver::solve_elements(std::span<Element> run, double h) {
  k_.set(system_.tableau, h);
  for (std::size_t m = 0; m < run.size(); ++m) {
    Element& e = run[m];
    e.h = h;
    if (m > 0) {
      e.q0 = run[m - 1].q1;
      e.v0 = run[m - 1].v1;
    }
    if (!system_.solve_affine(k_, e)) return false;
    system_.set_right_end(k_, e);
    system_.set_end_forces(e);
  }
  return true;
}

/// F of (1) without its zeros at h = 0; NaN where the elements have no solution.
double AffineSwitchSolver::value(std::span<Element> run, const Switch& end, double h) {
  if (!solve_elements(run, h)) return std::numeric_limits<double>::quiet_NaN();
  double result = function_.value(run.back(), end);
  for (int zero = 0; zero < end.zeros_at_start; ++zero) result /= h;
  return result;
}

SwitchResult AffineSwitchSolver::solve(std::span<Element> run, const Switch& end, double max_h) {
  double h = run.front().h, h_before = h * (1 + kFirstSecant), value_before = value(run, end, h_before);
  double slope = 0, previous = 0;
  for (int iteration = 0; iteration < kMaxIterations; ++iteration) {
    const double value_here = value(run, end, h), secant = (value_here - value_before) / (h - h_before);
    const bool is_rounding =
        iteration > 0 && std::abs(h - h_before) <= kShortSecant * h && !(secant / slope > 0.5 && secant / slope < 2);
    if (!is_rounding) slope = secant;
    const double full_dh = value_here == 0 ? 0 : -value_here / slope;
    if (!std::isfinite(full_dh)) return SwitchResult::no_convergence;
    const double dh = std::clamp(full_dh, -0.7 * h, 2 * h), size = std::abs(full_dh) / h;
    const double contraction = iteration == 0 ? 1 : size / previous;
    // In short elements, forces give the time of a switch with a rounding error that is not relative to h; so does a
    // gap that closes slowly.
    const bool stagnates =
        iteration > 3 && contraction > 0.5 &&
        ((std::abs(full_dh) <= 1e-9 * max_h && dh == full_dh) || function_.is_rounding_of_gap(run.back(), end));
    // After a secant step the remaining error is below this correction times the last contraction.
    const bool is_converged =
        size <= tolerance_ || (contraction < 0.1 && size * contraction <= kOfCorrection * tolerance_) || stagnates;
    h_before = h;
    value_before = value_here;
    h += dh;
    if (is_converged) {
      if (h != h_before && !solve_elements(run, h)) return SwitchResult::singular;
      return h <= max_h ? SwitchResult::converged : SwitchResult::left_interval;
    }
    if (h > 4 * max_h || h < 1e-14 * max_h) return SwitchResult::left_interval;
    previous = size;
  }
  return SwitchResult::no_convergence;
}

}  // namespace ricochet
