#pragma once

#include <span>

#include "problems/regions/switching_functions.h"

/// @file
/// The formulas of a motion that slides on psi_k = 0 for all k of a set K, where the force f jumps: Filippov's solution.
///
/// In K the signs are unknowns s_k in [-1, 1]. A force that is not affine in sigma_k is replaced by the convex
/// combination of its sides, (1 + s_k)/2 f(1) + (1 - s_k)/2 f(-1). With f = f_0 + sum_l c_l s_l, where f_0 and c_l have
/// no sign of K, the motion stays on all psi_k = 0 if
///
///     d psi_k/dt + d psi_k/dq v + y_k' (f_0 + sum_l c_l s_l) = 0,   M y_k = (d psi_k/dv)'                         (1)
///
/// a linear system for s_l(q, v, t). So sliding is one more region: the force is f_0 + sum_l c_l s_l(q, v, t), smooth,
/// and the motion leaves it where
///
///     1 - s_k^2 = 0                                                                                              (2)
///
/// which takes the place of psi_k. Whoever runs a smooth region therefore runs one that slides.
///
/// Contact forces are not part of (1). A contact acts on psi_k if y_k' J_n or y_k' J_t is not identically zero; it must
/// be open while the motion slides.
///
/// Source: Filippov, *Differential Equations with Discontinuous Righthand Sides*, 1988, chapter 2, section 4.

namespace ricochet {

/// The formulas of the region of `signs`, n_s, where zeros are the set K: (1), with (2) in place of psi_k, and
/// SymbolicModel::acting, the contacts that act on K.
/// @throws InputError with psi_k and the reason where (1) does not describe the motion: psi_k depends on q and t only,
/// other formulas than the force have a sign of K, the force has a product of two of them, a joint, a friction element
/// or a control acts on K; and if M couples more than 4 coordinates there
SymbolicModel sliding_region(const SwitchedModel& switched, std::span<const int> signs);

}  // namespace ricochet
