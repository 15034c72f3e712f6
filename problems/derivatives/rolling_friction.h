#pragma once

#include "problems/derivatives/symbolic_problem.h"

/// @file
/// Rolling and drilling friction: friction elements whose bound is the normal force lambda_n of a contact times a
/// coefficient c(q, t) >= 0, in metres for a torque. Forces, and impulses likewise, obey
///
///     |lambda_t| <= c lambda_n,   lambda_t = -c lambda_n v_t / |v_t| where v_t = J_t' v + d is not zero            (1)
///
/// Let the contact have the gap f and the elements i = 1, ..., n. Levers with coordinates theta_i and the mass matrix
/// m L, which nothing else touches, divide it into n + 1 contacts:
///
///     f_0 = (f + theta_1 + ... + theta_n) / (n + 1),   f_i = (f - theta_i) / (n + 1), theta = theta' = 0 at t = 0  (2)
///     L_ii = 2 / (n + 1),   L_ij = 1 / (n + 1),   m = 1 / sum_k J_k^2 / M_kk at q0, where J = grad f               (3)
///
/// Contact 0 keeps mu and the tangents; contact i has c as its coefficient and the tangents of element i; all have the
/// same e. With theta = 0, lambda_0 = ... = lambda_n = lambda_n solves (2): normal forces add up to J lambda_n, and
/// Coulomb's law of contact i is (1). Forces on the levers and (3) give, with the mean force l,
///
///     (n + 1) f_i'' = f'' + (lambda_i - l) / m,   i = 0, ..., n                                                    (4)
///
/// There is no other solution, whatever the friction is. Where f = theta = 0 at rest, 0 <= f_i'' _|_ lambda_i >= 0. If
/// the largest force lambda_k is positive, f_k'' = 0, so that f'' = -(lambda_k - l) / m. Then f_i'' >= 0 and (4)
/// require lambda_i >= lambda_k of every i. The same holds for impulses by Newton's law for several contacts, with
/// theta' = 0 before. Other laws of impacts are those of one contact, or have no friction: a scene with levers requires
/// Newton's.
///
/// So whoever solves (1)-(7) of Problem, with contacts that close and open together, solves scenes with such elements.
/// fail_where_bound_is_negative() checks theta = 0 along a run: elsewhere a method has taken contacts one by one.
///
/// With (3) the n + 1 contacts have equal Delassus entries, and none couples two of them if M is diagonal: they pass
/// thresholds of methods together, and forces are as well conditioned as before. m changes no solution.
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
