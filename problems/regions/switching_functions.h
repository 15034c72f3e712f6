#pragma once

#include <span>
#include <string>
#include <vector>

#include "problems/derivatives/symbolic_problem.h"

/// @file
/// The switching functions of a scene, and its formulas in one region.
///
/// Every |x|, sign(x) and choose(x, a, b) (real_functions.h) whose x depends on the state gives a switching function
///
///     psi_k(q, v, t) = x                                                                                         (1)
///
/// A region is a sign sigma_k = +-1 for each of them. In a region the formulas are smooth:
///
///     |x| = sigma_k x,   sign(x) = sigma_k,   choose(x, a, b) = a if sigma_k > 0, else b                         (2)
///
/// They are evaluated so on both sides of psi_k = 0, so that no stage, no iteration and no derivative mixes two
/// branches. Arguments that differ by a factor share one psi_k. An argument with branches inside is a psi_k of the
/// region of these. The last psi_k of a scene with "until" is that formula, which ends the run.
///
/// See Acary, Brogliato, *Numerical Methods for Nonsmooth Dynamical Systems* (2008), chapter 2, and Stewart, *A high
/// accuracy method for solving ODEs with discontinuous right-hand side*, Numer. Math. 58 (1990), for regions.

namespace ricochet {

/// A model whose branches are symbols.
struct SwitchedModel {
  SymbolicModel model;                ///< with (2) in terms of `signs`
  std::vector<GiNaC::symbol> signs;   ///< sigma_k
  std::vector<GiNaC::ex> functions;   ///< psi_k, in terms of the state and of signs that come before
  std::vector<SwitchInfo> described;  ///< of each psi_k
};

/// The switching functions of a normalized() `model`, and the model in terms of their signs.
SwitchedModel with_switching_functions(const SymbolicModel& model);

/// The formulas of one region. @param signs  sigma_k, each 1 or -1; 0 where the motion slides on psi_k = 0 (sliding.h)
/// @throws InputError as sliding_region()
SymbolicModel in_region(const SwitchedModel& switched, std::span<const int> signs);

}  // namespace ricochet
