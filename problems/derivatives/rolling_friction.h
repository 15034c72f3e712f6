#pragma once

#include "problems/derivatives/symbolic_problem.h"

/// @file
/// Rolling and drilling friction: friction elements whose bound is the normal force lambda_n of a contact times a
/// coefficient c(q, t) >= 0, in metres for a torque. Forces, and impulses likewise, obey
///
///     |lambda_t| <= c lambda_n,   lambda_t = -c lambda_n v_t / |v_t| where v_t = J_t' v + d is not zero              (1)
///
/// Let the contact have the gap f and the elements i = 1, ..., n. Levers with coordinates theta_i of mass m, which
/// nothing else touches, divide it into n + 1 contacts:
///
///     f_0 = (f + theta_1 + ... + theta_n) / (n + 1),   f_i = (f - theta_i) / (n + 1)
///     m theta_i'' = (lambda_0 - lambda_i) / (n + 1),   theta_i = theta_i' = 0 at t = 0                               (2)
///
/// Contact 0 keeps mu and the tangents; contact i has c as its coefficient and the tangents of element i; all have the
/// same e. With theta = 0, lambda_0 = ... = lambda_n = lambda_n solves (2): normal forces add up to grad f lambda_n, and
/// Coulomb's law of contact i is (1).
///
/// There is no other solution, whatever the friction is. Where f = theta_i = 0 at rest, 0 <= f_j'' _|_ lambda_j >= 0.
/// Let lambda_k be the largest force, and positive, so that f_k'' = 0. If k = 0, no theta_i'' is negative, and f_0'' = 0
/// means f'' = -sum theta_i'' <= 0; but f_i'' >= 0 means f'' >= theta_i'' >= 0: all theta_i'' are zero. If
/// lambda_k > lambda_0, then f'' = theta_k'' < 0; f_0'' >= 0 requires some theta_j'' > 0, and f_j'' < 0. The same holds
/// for impulses by Newton's law for several contacts, with theta_i' = 0 before. Other laws of impacts are those of one
/// contact, or have no friction: a scene with levers requires Newton's.
///
/// So whoever solves (1)-(7) of Problem, with contacts that close and open together, solves scenes with such elements.
/// fail_where_bound_is_negative() checks theta_i = 0 along a run: elsewhere a method has taken contacts one by one.
///
/// m = 1 / sum_k J_k^2 / M_kk at q0, J = grad f, changes no solution. It is of the size of the mass that the contact
/// feels, so that forces are as well conditioned as before.
///
/// The order of coordinates is: those of the scene, theta_i in the order of their elements, z of other elements
/// (friction_elements.h), the clock. That of contacts is: those of the scene, contacts i, other elements.
/// ProblemInfo::n_friction_elements counts all of them; contacts i are no ContactInfo::is_friction_element. The stated
/// scene, SymbolicProblem::model(), has its elements in SymbolicModel::frictions only.

namespace ricochet {

/// The number of levers of the `model`: elements with a contact.
int n_levers(const SymbolicModel& model);

/// The `model`, normalized(), with (2): its elements with a contact are contacts, and no longer in
/// SymbolicModel::frictions. Call it before with_varying_friction().
/// @throws InputError for a coefficient that is constant and negative, or that varies and bends or jumps; for a contact
/// that is bilateral, or whose e depends on the approach speed, which is not that of f_i
SymbolicModel with_rolling_friction(SymbolicModel model);

}  // namespace ricochet
