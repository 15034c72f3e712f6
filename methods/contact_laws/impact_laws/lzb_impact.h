#pragma once

#include "problems/problem.h"

namespace ricochet {

/// Several simultaneous impacts without friction, by the law of Liu, Zhao and Brogliato (LZB). Contacts are springs in
/// the limit of infinite stiffness, where only ratios of stiffnesses matter. Each returns e_i^2 of the energy that it
/// has stored.
///
///   dw = G dP,   w_i = J_n^i' v,   G = J_n' M^-1 J_n                                                           (1)
///   dE_i = -w_i dP_i while w_i < 0 (compression),   dE_i = -(1 / e_i^2) w_i dP_i otherwise (expansion)         (2)
///   dP_i / dP_j = (K_i / K_j)^(1 / (eta + 1)) (E_i / E_j)^(eta / (eta + 1))        the distributing law        (3)
///
/// E_i counts what compression has stored, and is back at zero when e_i^2 of it has been returned: contact i opens, and
/// may close again. The impact ends when all are open. eta = 1 is a linear spring, eta = 3/2 Hertz's.
///
/// Source: Liu, Zhao, Brogliato, Frictionless multiple impacts in multibody systems I, Proc. R. Soc. A 464 (2008),
/// bistiffness model. Differs from the source: it integrates over the impulse of a primary contact, where (3) is
/// singular at E = 0 and the primary contact may change. With E_i = K_i delta_i^(eta + 1) / (eta + 1) the same curve is
///
///   dP_i = K_i delta_i^eta dt,   d delta_i = -w_i dt in compression, -(w_i / e_i^2) dt in expansion,           (4)
///
/// regular everywhere; t is any parameter, for a common factor of all K changes it alone.
struct LzbLaw {
  Vector K;          ///< stiffnesses, n; their ratios matter [N / m^eta]
  Vector e;          ///< energetic coefficients, n, 0 < e <= 1
  double eta = 1.5;  ///< exponent of the springs, >= 1
};

struct LzbImpact {
  Vector w;  ///< w+, n [m/s]
  Vector P;  ///< impulses, n [N s]
};

/// @param G  n x n, symmetric, positive semidefinite [1/kg]  @param w  w-, n [m/s]
/// @param steps  of (4) per duration of an impact of the stiffest contact alone, roughly; order 4 between events
/// Throws InputError for sizes and values outside their range, std::runtime_error for impacts that do not end.
LzbImpact lzb_impact(const LzbLaw& law, const Matrix& G, const Vector& w, int steps = 2000);

}  // namespace ricochet
