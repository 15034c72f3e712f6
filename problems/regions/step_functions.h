#pragma once

#include <memory>

#include "problems/derivatives/smooth_function.h"
#include "problems/derivatives/symbolic_problem.h"

/// @file
/// The formulas of a scene with step functions in place of the signs of switching_functions.h, for programs with
/// complementarity constraints (the Heaviside form of FESD):
///
///     theta_k = 1 where psi_k > 0,   0 where psi_k < 0,   in [0, 1] where psi_k = 0                              (1)
///     F(theta) = sum over regions sigma of F_sigma prod_k w_k,   w_k = theta_k if sigma_k > 0, else 1 - theta_k  (2)
///
/// (2) is a convex combination of the regions and affine in each theta_k. Where the motion stays on one psi_k = 0 it is
/// Filippov's. A formula that is affine in sigma_k has sigma_k = 2 theta_k - 1; for others the sum is written out,
/// which doubles the formula with each sign.
///
/// (2) is applied to f_v, B_u and bounds of friction elements. M, gaps, tangents and drives must be smooth: their
/// convex combinations would not be the impacts and inertia of either side.
///
/// Source: Nurkanovic, Pozharskiy, Frey, Diehl, Finite elements with switch detection for numerical optimal control of
/// nonsmooth dynamical systems with set-valued step functions, Nonlinear Analysis: Hybrid Systems 54 (2024).

namespace ricochet {

/// A scene with step functions.
struct StepFunctions {
  std::unique_ptr<SymbolicProblem> problem;  ///< (2); its controls are those of the scene, then theta
  SmoothFunction switching;                  ///< (q, v, theta) -> psi_k, with (2) for signs inside of arguments

  /// Number n_s of functions: those of ProblemInfo::switches, but for `until`, which is the last one there.
  int size() const { return switching.n_outputs(); }
  /// Values of theta in {0, 1} at a state, n_s: the side of every psi_k, as its formulas give it; 1 where it is zero.
  Vector sides(const Vector& q, const Vector& v) const;
  /// n_s, sizes of the terms of psi_k in x = (q, v): sum_j |d psi_k / dx_j| (1 + |x_j|), to tell a rounded zero.
  Vector sizes(const Vector& q, const Vector& v, const Vector& theta) const;
};

/// The step functions of a `problem`, for its switching functions without ProblemInfo::until; none if it has no others.
/// @throws InputError for a problem without formulas, for signs in M, a gap, a tangent or a drive, and for formulas that
/// are not affine in more than 4 signs
StepFunctions make_step_functions(const Problem& problem);

}  // namespace ricochet
