#pragma once

#include "methods/complementarity/mpcc/ipopt_solver.h"

namespace ricochet {

/// The stationarity of a feasible point of an `Mpcc`, weakest first; see (2) to (5).
enum class Stationarity { unknown, W, C, M, S };

const char* to_string(Stationarity stationarity);

/// Decides which multipliers a feasible point x has. Every pair of variables v of G_i and w of H_i is complementary; it
/// is biactive when v = w = 0 and no other pair holds v or w at zero. With multipliers lambda of the active rows and nu
/// of the active bounds and of all variables that a pair holds at zero,
///
///   f'(x) + sum_i lambda_i g_i'(x) - nu = 0,                                                                 (1)
///
/// whose signs are those of an active upper (lower) row, bound. x is
///
///   W-stationary  when (1) has a solution,                                                                   (2)
///   C-stationary  when one has  nu_v nu_w >= 0,                                                              (3)
///   M-stationary  when one has  nu_v, nu_w >= 0  or  nu_v nu_w = 0,                                          (4)
///   S-stationary  when one has  nu_v, nu_w >= 0                                                              (5)
///
/// for every biactive pair. Multipliers need not be unique, so each combination of signs is a separate problem: least
/// squares of (1) over multipliers with these signs. With b biactive pairs, (5) is one combination, (4) are 3^b and (3)
/// 2^b; beyond max_enumerated the result is W, unless it is S.
///
/// Source: Scheel, Scholtes, Mathematical programs with complementarity constraints: stationarity, optimality, and
/// sensitivity, Math. Oper. Res. 25 (2000).
class StationarityTest {
 public:
  static constexpr int max_enumerated = 4;

  /// @param zero  variables, slacks of bounds and rows, and the residual of (1) relative to 1 + |f'(x)| are zero up to
  /// this. At least 10 sqrt(tolerance) of the solves for x and of classify(): values that an interior-point method
  /// returns where variable and multiplier are both zero
  StationarityTest(const Mpcc& mpcc, const Vector& x, double zero);

  /// @param ipopt  for the least squares. `unknown` when (1) has no solution: x is not stationary to the tolerance
  Stationarity classify(const IpoptOptions& ipopt);

  /// (5) alone.
  bool is_S(const IpoptOptions& ipopt);

  struct Biactive {
    int v, w;  ///< variables
  };
  const std::vector<Biactive>& biactive() const { return biactive_; }

 private:
  /// The signs of the two multipliers of a biactive pair.
  enum class Signs { both_positive, v_zero, w_zero, both_negative, any };

  bool exists(const std::vector<Signs>& signs, const IpoptOptions& ipopt);
  bool exists_any(const std::vector<Signs>& choices, const IpoptOptions& ipopt);

  std::vector<Biactive> biactive_;
  Nlp least_squares_;     // over lambda, nu and the residuals of (1)
  std::vector<int> nu_;   // its variable of each variable's multiplier; -1: inactive
  int n_residuals_ = 0;   // which come first
  double tolerance_ = 0;  // of (1)
};

}  // namespace ricochet
