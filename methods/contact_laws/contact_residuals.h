#pragma once

#include "methods/contact_laws/contact_problem.h"

namespace ricochet {

/// Residuals of impulses r and their velocities w = G r + b in each law of contact_problem.h, the largest over all
/// contacts. Restitution is in b: w_n contains the shift of the impact law, so Signorini's condition includes that law.
/// Under the associated law w_n stands for w_n - mu ||w_t||.
///
/// Source: Le Lidec, Jallet, Montaut, Laptev, Schmid, Carpentier, Contact models in robotics: a comparative analysis,
/// IEEE T-RO 40 (2024), arXiv 2304.06372, who split the laws this way.
struct ContactResiduals {
  double signorini = 0;    ///< |r_n w_n| [J]
  double pull = 0;         ///< -r_n, where negative [N s]
  double approach = 0;     ///< -w_n, where negative [m/s]
  double cone = 0;         ///< ||r_t|| - mu (r_n + p), where positive [N s]
  double dissipation = 0;  ///< |mu (r_n + p) - ||r_t||| ||w_t||, which maximum dissipation makes zero [J]
  double angle = 0;        ///< between r_t and -w_t, of contacts that slip [rad]
};

/// @param r  G.n_rows(); @param w  that belong to it
ContactResiduals residuals_of(const ContactProblem& problem, const Vector& r, const Vector& w);

/// MERIT_1 of FCLib (fclib_merit_local, src/fcmer.c), for a problem without equality constraints:
///
///   ||r - P_K(r - u)|| / (1 + sqrt ||q||),   u = W r + q + mu ||u_t|| e_n                                 (1)
///
/// with q = b, W = G, K the friction cone, norms over all contacts. Its defects:
///
/// - r - u subtracts a velocity from an impulse. With g instead of kg, its ratio to the true distance changes by
///   factors of hundreds (README.md of this folder).
/// - sqrt ||q|| is the root of a norm, which has no meaning; 1 + makes it absolute where ||q|| is small. So (1) is not
///   relative to the problem.
/// - Where it is not implemented, it returns 0, the value of a solution: for problems in the plane, global problems,
///   and MERIT_2. Here (1) also covers contacts in the plane.
/// - CSparse silently skips the product with a W that is not in compressed columns: then u = q. With equality
///   constraints, V is transposed without its values. Neither is reproduced.
/// - The velocities of a solution are not read, so they may be anything.
///
/// Compared with FCLib 3.1.0: equal to 1e-15 for solutions of random problems that are disturbed by 1e-3.
double fclib_merit(const ContactProblem& problem, const Vector& r, const Vector& w);

}  // namespace ricochet
