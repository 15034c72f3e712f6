#pragma once

#include "problems/problem.h"
#include "problems/solution.h"
#include "reports/metrics.h"

namespace ricochet {

// By how much a motion breaks each law of contact. Impulses are told by methods, forces are not: they follow from the
// motion, so that all methods are measured alike, whatever they solve for.

/// In the impacts that the solution tells, of contact i with the Delassus entry W = J_n' M^-1 J_n, which makes velocities
/// of impulses,
///
///     Signorini              |f_c|  where  Lambda_n > 0                                                     (1)
///     restitution            |min(v_n+ + e v_n-, W Lambda_n)|                                               (2)
///     Coulomb's cone         W max(0, |Lambda_t| - mu Lambda_n)                                             (3)
///     maximum dissipation    |v_t| + Lambda_t' v_t / (mu Lambda_n)                                          (4)
///
/// the largest of all of them.
void measure_impacts(const Problem& problem, const Solution& solution, Metrics& metrics);

/// In contacts that last: those that are closed in the reference motion, between its events. The forces of the motion are
/// the least squares solution, in the norm of M^-1, of
///
///     M(q) a - f(q, v) = sum over closed contacts of J_n lambda_n + J_t lambda_t                            (5)
///     a = v' + (jump of v where the piece of the motion begins) / (length of the piece)                     (6)
///
/// since time stepping has its forces in jumps and others in v'. A jump is left out at an impact that the solution tells,
/// and the piece with it where v is constant: the impulse of such a step has its forces in it.
/// Where contacts are redundant, (5) does not determine the forces, and there is none of (8) to (10).
///
///     Signorini              |f_c|, the largest                                                             (7)
///     pull                   integral of W max(0, -lambda_n)                                                (8)
///     Coulomb's cone         integral of W max(0, |lambda_t| - mu lambda_n)                                 (9)
///     maximum dissipation    integral of |mu lambda_n |v_t| + lambda_t' v_t|                                (10)
///
/// over the time, the sums over contacts.
void measure_contacts(const Problem& problem, const Solution& solution, const Solution& reference, Metrics& metrics);

}  // namespace ricochet
