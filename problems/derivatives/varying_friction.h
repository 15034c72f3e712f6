#pragma once

#include "problems/derivatives/symbolic_problem.h"

/// @file
/// Friction coefficients that are formulas of the place q or of the time. Coulomb's law (5) of Problem with a coefficient
/// mu(q, t) > 0,
///
///     |lambda_t| <= mu lambda_n,   lambda_t = -mu lambda_n v_t / |v_t| where v_t = J_t' v + d is not zero,           (1)
///
/// is the same law with the coefficient 1 for other tangents and drives:
///
///     J_t* = mu J_t,   d* = mu d,   lambda_t* = lambda_t / mu,   v_t* = mu v_t,   mu* = 1                            (2)
///
/// For J_t* lambda_t* = J_t lambda_t, and v_t* has the direction of v_t. The same holds for impulses, at whose instant q
/// is fixed, with Newton's law and the others of impact_hypothesis.h, which are laws of J lambda and of the work
/// v_t' lambda_t = v_t*' lambda_t*. The derivative of J_t* contains that of mu. So whoever solves (1)-(7) of Problem
/// solves scenes with mu(q, t): methods, references, sensitivities, proofs and optimal control.
///
/// With mu <= 0 the law (2) would be that of |mu|. Therefore J_t* has no value there, and no run ends with success:
/// SymbolicProblem::tangent_jacobian() returns NaN, and Method::solve() checks the end and the events of a run.
///
/// The stated scene, SymbolicProblem::model(), keeps mu and J_t.

namespace ricochet {

/// The `model`, normalized(), with (2) for its contacts whose mu varies.
SymbolicModel with_varying_friction(SymbolicModel model);

}  // namespace ricochet
