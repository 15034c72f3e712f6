#include "methods/elements/element_solver.h"

#include <cmath>
#include <limits>

namespace ricochet {
namespace {

constexpr int kMaxNewton = 30;
// Corrections that derivatives of the iterate before have not halved: from here on there is no solution nearby.
constexpr int kMaxStagnations = 4;
// New derivatives and factors take the time of about five iterations and, where Newton's method is quadratic, leave half
// of those that were to come.
constexpr double kIterationsOfRefresh = 10;
// First contractions up to which factors are worth keeping for the next element: by new derivatives, by kept ones.
constexpr double kWorthKeeping = 0.01, kStillWorthKeeping = 0.1;
// Far below anything physical in SI units, and far above subnormal numbers.
constexpr double kVanishing = 1e-250;

/// Rounding errors of a body at rest decay from step to step to subnormal numbers; arithmetic with these takes a
/// hundred times as long.
void clear_vanishing(double* x, Eigen::Index n) {
  for (Eigen::Index k = 0; k < n; ++k) x[k] = std::abs(x[k]) < kVanishing ? 0 : x[k];
}

/// Iterations that reduce a correction by this factor at this contraction.
double remaining_iterations(double factor, double contraction) {
  if (!(contraction < 1)) return std::numeric_limits<double>::infinity();
  return -std::log(factor) / std::log(contraction);
}

}  // namespace

ElementSolver::ElementSolver(ElementSystem& system, double tolerance)
    : system_(system), tolerance_(tolerance), coefficients_(system.tableau) {}

void ElementSolver::restart() {
  system_.restart();
  keeps_factors_ = true;
}

/// Derivatives of this instant and their factors.
bool ElementSolver::refresh(const StageCoefficients& k, const Element& e) {
  system_.equations.derivatives(k, e, system_.work);
  return system_.newton.factorize(k, system_.work.K);
}

ElementSolver::Result ElementSolver::solve(Element& e) {
  system_.set_active(e);
  system_.active.set_slip_end({});
  const StageCoefficients& k = coefficients_.of(e.h);
  return system_.affine() ? solve_affine(k, e) : solve_by_newton(k, e);
}

ElementSolver::Result ElementSolver::solve_affine(const StageCoefficients& k, Element& e) {
  if (!system_.solve_affine(k, e)) return Result::singular;
  return finish(k, e);
}

/// The right end of an element whose stages are known.
ElementSolver::Result ElementSolver::finish(const StageCoefficients& k, Element& e) {
  system_.set_right_end(k, e);
  system_.set_end_forces(e);
  clear_vanishing(e.a.data(), e.a.size());
  clear_vanishing(e.v1.data(), e.v1.size());
  return e.v1.allFinite() ? Result::converged : Result::no_convergence;
}

ElementSolver::Result ElementSolver::solve_by_newton(const StageCoefficients& k, Element& e) {
  StageEquations& equations = system_.equations;
  StageUnknowns& unknowns = system_.unknowns;
  NewtonSystem& newton = system_.newton;
  StageWorkspace& work = system_.work;
  const ProblemInfo& info = system_.problem.info();
  const ActiveSet& active = system_.active;
  const bool starts_slip = active.has_friction() && equations.start_slip(e);
  const bool is_known = newton.recall(k.h) && !starts_slip && (keeps_factors_ || newton.is_constant());
  equations.set_initial_values(e, k.h, work);
  equations.set_stages(k, e, work);
  bool is_fresh = false;
  if (!is_known) {
    if (!refresh(k, e)) return Result::singular;
    is_fresh = true;
  }
  const ProblemInfo::Structure& structure = info.structure;
  const bool is_affine =
      structure.constant_mass && structure.constant_force_jacobian && !active.has_curved() && !active.turns();
  // A predicted correction of dw says little about what (3) is left with.
  const double predicted_tolerance = 0.1 * tolerance_;

  double previous = 0;
  int stagnations = 0;
  for (int iteration = 0; iteration < kMaxNewton; ++iteration) {
    equations.residual(k, e, work);
    if (newton.is_redundant()) unknowns.gather_forces(e, work.x);
    newton.solve(work.r, work.x, work.dx);
    ++system_.counters.inner_iterations;
    const double size = unknowns.correct(work.dx.data(), k.h, work.K, e);
    equations.set_stages(k, e, work);
    if (!std::isfinite(size)) return Result::no_convergence;
    const double scale = unknowns.velocity_scale(e, k.h, work.load);

    bool is_converged = size <= tolerance_ * scale;
    if (is_affine) {
      is_converged = is_converged || size <= 1e-3 * scale;  // one correction is exact, up to rounding of this size
    }
    if (iteration > 0) {
      const double contraction = size / previous;
      if (iteration == 1) keeps_factors_ = contraction <= (is_fresh ? kWorthKeeping : kStillWorthKeeping);
      if (is_fresh && contraction > 0.5 && size > 1e-3 * scale && ++stagnations > kMaxStagnations)
        return Result::no_convergence;
      // Converged if the next correction is predicted to be small, or if rounding keeps corrections from shrinking.
      is_converged = is_converged ||
                     (contraction < 1 && contraction / (1 - contraction) * size <= predicted_tolerance * scale) ||
                     (iteration > 3 && contraction > 0.5 && size <= 1e-9 * scale);
      if (!is_converged && remaining_iterations(size / (tolerance_ * scale), contraction) > kIterationsOfRefresh) {
        if (!refresh(k, e)) return Result::singular;
        is_fresh = true;
      }
    }
    if (is_converged) {
      if (newton.is_redundant()) {
        equations.residual(k, e, work);
        if (!system_.is_consistent(e, k.h)) return Result::no_convergence;
      }
      if (starts_slip) keeps_factors_ = false;  // those of (7d)
      if (!equations.set_slip_in_space(e)) return Result::no_convergence;
      return finish(k, e);
    }
    previous = size;
  }
  return Result::no_convergence;
}

}  // namespace ricochet
