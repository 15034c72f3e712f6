#pragma once

#include "problems/derivatives/symbolic_problem.h"

/// @file
/// Friction without a normal contact, as at a hinge, in a clutch or a brake: its bound is a formula. A friction element
/// has tangents J_t(q, t), n_t = 1 or 2, drives d(q, t) and a bound F(q, v, t) >= 0 [N, N m]. Its force J_t lambda_t
/// obeys
///
///     |lambda_t| <= F,   lambda_t = -F v_t / |v_t| where v_t = J_t' v + d is not zero                                (1)
///
/// This is Coulomb's law (5) of Problem with mu lambda_n = F. So the element is a contact with one more coordinate z,
/// of a body of mass 1 that F presses on its support and that nothing else touches:
///
///     z'' = -F(q, v, t) + lambda_n,   0 <= lambda_n _|_ z >= 0,   z = z' = 0 at t = 0,   mu = 1,   eps_r = 0         (2)
///
/// If F >= 0 along the motion, z = 0 and lambda_n = F solve (2), and Coulomb's law with lambda_n is (1). M, J_n and
/// impulses do not couple z with other coordinates. So Lambda_n of the element is exactly zero in every impact, and
/// |Lambda_t| <= mu Lambda_n = 0: a finite force has no impulse. Whoever solves (1)-(7) of Problem therefore solves
/// scenes with friction elements: methods, references, sensitivities, proofs and optimal control.
///
/// A static_ratio of the element is mu_static of (10): it sticks while |lambda_t| <= static_ratio F.
///
/// Friction whose bound is the force of a contact is another matter: rolling_friction.h.
///
/// If F becomes negative, (1) has no solution; z rises, and no run ends with success (lifted_friction_element()).
///
/// The order of coordinates is: those of the scene, z of every element, the clock. That of contacts is: those of the
/// scene, elements. The stated scene, SymbolicProblem::model(), has its elements in SymbolicModel::frictions only.
///
/// **Jumps of a force that are dry friction.** Let s be the sign of a switching function psi = J(q, t)' v + d(q, t) that
/// is affine in v, and f+ and f- the force with s = 1 and s = -1. If one F(q, v, t) satisfies
///
///     (f+ - f-) / 2 = -F J,                                                                                         (3)
///
/// then f = (f+ + f-) / 2 - F s J, and Filippov's solution where psi = 0, with s in [-1, 1], is (1) with J_t = J. So the
/// force becomes (f+ + f-) / 2, and the element (J, d, F) is added, if F > 0 at the initial state. A term that does not
/// jump where psi = 0, such as -c v |v|, stays a force; so does one without (3).

namespace ricochet {

/// The `model` with (3): jumps of its force that are dry friction are elements in SymbolicModel::frictions, after those
/// that are stated, and named after their switching function.
SymbolicModel with_jumps_as_friction(SymbolicModel model);

/// The `model` with (2): its elements are contacts and coordinates. SymbolicModel::frictions stays as it is.
/// @throws InputError for a bound that is constant and not positive
SymbolicModel with_friction_coordinates(SymbolicModel model);

}  // namespace ricochet
