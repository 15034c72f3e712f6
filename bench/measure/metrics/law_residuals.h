#pragma once

#include "problems/problem.h"
#include "problems/solution.h"
#include "reports/metrics.h"

namespace ricochet {

// Residuals of a motion in each law of contact. Methods report impulses, but not forces: these follow from the motion
// as it is interpolated between the steps, whatever a method solves for. What is lost by an interpolation of lower
// order than the steps is therefore part of the residuals in persistent contact.

/// In the impacts that the solution tells, of contact i with the diagonal entry W = J_n' M^-1 J_n of the Delassus operator,
/// which makes velocities of impulses,
///
///     Signorini              |f_c|  where  Lambda_n > 0                                                     (1)
///     restitution            |min(v_n+ + e v_n-, W Lambda_n)|, under Newton's hypothesis                    (2)
///     Coulomb's cone         W max(0, |Lambda_t| - mu Lambda_n)                                             (3)
///     maximum dissipation    |v_t| + Lambda_t' v_t / (mu Lambda_n)                                          (4)
///
/// the largest of all of them.
void measure_impacts(const Problem& problem, const Solution& solution, Metrics& metrics);

/// In persistent contact: in unilateral contacts that are closed in the reference motion, between its events. The forces of
/// the motion are the least squares solution, in the norm of M^-1, of
///
///     M(q) a - f(q, v) = sum over closed contacts of J_n lambda_n + J_t lambda_t                            (5)
///     a = v' + (jump of v where the piece of the motion begins) / (length of the piece)                     (6)
///
/// since time stepping has its forces in jumps and others in v'. A jump that is an impact which the solution tells is no
/// part of (6). A step of time stepping that tells an impact is left out, on either side of it: its impulse has the forces
/// in it. So are the bilateral constraints of (5), whose drift is a metric of its own.
///
///     Signorini              |f_c|, the largest                                                             (7)
///     pull                   integral of W max(0, -lambda_n)                                                (8)
///     Coulomb's cone         integral of W max(0, |lambda_t| - mu lambda_n)                                 (9)
///     maximum dissipation    integral of |mu lambda_n |v_t| + lambda_t' v_t|                                (10)
///
/// over the time, the sums over contacts, by Gauss points. Where contacts are redundant at one of them, (5) does not
/// determine the forces, and there is none of (8) to (10).
void measure_persistent_contact(const Problem& problem, const Solution& solution, const Solution& reference,
                                Metrics& metrics);

}  // namespace ricochet
