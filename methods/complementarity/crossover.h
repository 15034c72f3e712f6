#pragma once

#include "methods/complementarity/ipopt_solver.h"

namespace ricochet {

/// Of a point with multipliers of its biactive variables, weakest first; see (2) to (5).
enum class Stationarity { unknown, W, C, M, S };

const char* to_string(Stationarity stationarity);

/// max over the pairs of min(G, H) at x, and the pair; 0 without pairs.
NamedResidual complementarity(const Mpcc& mpcc, const double* x);

struct CrossoverOptions {
  IpoptOptions ipopt;
  int max_switches = 10;  ///< branches that may be tried besides the first
};

struct CrossoverResult {
  NlpResult branch;  ///< of the branch that the point comes from
  Stationarity stationarity = Stationarity::unknown;
  /// No feasible direction descends; false: not known.
  bool is_b_stationary = false;
  int n_biactive = 0;  ///< pairs that are biactive
  int switches = 0;    ///< branches tried besides the first
  // Totals of all branches.
  int iterations = 0;
  double seconds = 0, derivative_seconds = 0;
};

/// From a solution of a relaxation to a point that is complementary exactly: takes from every pair the side that is
/// smaller there and solves the branch
///
///   min f  subject to  rows, bounds, and for every pair i:  G_i = 0 or H_i = 0,                               (1)
///
/// where a sum is held at zero by its variables. At the solution a pair is biactive when both sums are zero. Let v be a
/// variable of its one side and w of the other, and nu_v, nu_w their multipliers in L = ... - nu_v v - nu_w w. The
/// point is
///
///   W-stationary  for any nu,                                                                                (2)
///   C-stationary  if  nu_v nu_w >= 0,                                                                        (3)
///   M-stationary  if  nu_v, nu_w > 0  or  nu_v nu_w = 0,                                                     (4)
///   S-stationary  if  nu_v, nu_w >= 0                                                                        (5)
///
/// for every such v, w. An S-stationary point, and one without biactive pairs, is B-stationary.
///
/// While a biactive variable that is held at zero has a negative multiplier, the other branch of its pair may descend,
/// and is tried. So are, one by one, the least clear pairs when a branch has no solution.
///
/// Source: Scheel, Scholtes, Mathematical programs with complementarity constraints: stationarity, optimality, and
/// sensitivity, Math. Oper. Res. 25 (2000).
///
/// @param relaxed  near a solution: n_variables and n_rows of the Mpcc, its multipliers start the first branch
CrossoverResult cross_over(const Mpcc& mpcc, const NlpPoint& relaxed, const CrossoverOptions& options);

}  // namespace ricochet
