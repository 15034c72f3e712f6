#pragma once

#include <array>
#include <optional>

#include "problems/impact_hypothesis.h"

namespace ricochet {

/// A single impact with Coulomb friction in the plane, under the impact laws that the literature compares.
///
///   w = (w_n, w_t) = (J_n' v, J_t' v),   w+ = w- + G p,   p = (Lambda_n, Lambda_t)                          (1)
///   G = (a  c),   a, b > 0,   a b > c^2     the Delassus matrix of the contact [1/kg]
///       (c  b)
///
/// Newton:   0 <= p_n _|_ w_n+ + e w_n- >= 0,   p_t in -mu p_n Sgn(w_t+)                                    (2)
///           That is the law of impact_solver.h; for several simultaneous impacts it is called Moreau's.
/// Poisson:  compression by (2) with e = 0, to the impulse p^C and the velocity w^C; then expansion by
///           0 <= p_n^E - e p_n^C _|_ w_n+ >= 0,   p_t^E in -mu p_n^E Sgn(w_t+)                              (3)
///
/// The others follow the impulse while it grows, with Coulomb's law at each instant of the impact (Darboux, Keller):
///
///   dw/dp_n = G (1, -mu s),   s = sign(w_t), while the contact slips                                        (4)
///   dw/dp_n = (a - c^2 / b, 0)               where it has stopped, if |c| <= mu b                           (5)
///   (4) with s = sign(c)                     where it has stopped, otherwise: slip starts anew              (6)
///
/// Compression ends where w_n = 0, at the impulse p_c; the impact ends, for
///
/// Routh:    (Poisson's hypothesis along the path) where p_n = (1 + e) p_c                                   (7)
/// Stronge:  where the normal impulse has returned e^2 of the work of compression:
///           int_{p_c}^{p_f} w_n dp_n = -e^2 int_0^{p_c} w_n dp_n                                            (8)
///
/// What an impact does to the kinetic energy is (p' (w+ + w-)) / 2                                           (9)
///
/// Under (8) it never grows: the normal work is (1 - e^2) times a negative number, the work of friction is negative.
/// Under (2) it may, for the work of friction in (9) takes the mean of slip before and after, and an impulse that
/// opposes the slip after may point along the slip before. Along the path (4)-(6) the force of a jam (a < mu s c)
/// grows until slip stops; (2) and (3) may then have no solution.
///
/// Sources: Kane, Levinson, Dynamics: Theory and Applications (1985); Routh, Dynamics of a System of Rigid Bodies;
/// Keller, Impact with friction, J. Appl. Mech. 53 (1986); Stronge, Impact Mechanics (2000); Glocker, Set-valued Force
/// Laws (2001) for (3), without restitution of the tangential impulse.
inline constexpr std::array kPlanarHypotheses{ImpactHypothesis::newton, ImpactHypothesis::poisson,
                                              ImpactHypothesis::routh, ImpactHypothesis::stronge};

/// Properties of two bodies at their contact.
struct PlanarContact {
  double a, b, c;  ///< of G [1/kg]
  double e;        ///< restitution, 0 <= e <= 1
  double mu;       ///< friction, >= 0
};

/// A pair along normal and tangent: velocities [m/s] or impulses [N s].
struct PlanarPair {
  double n, t;
};

struct PlanarImpact {
  PlanarPair w;  ///< w+
  PlanarPair p;  ///< impulse of the whole impact
};

/// The impact at velocity w- = `w`; nothing happens for w_n >= 0. Nothing is returned where (2) or (3) has no solution.
/// Throws InputError where G is not positive definite, or e or mu is outside its range, and
/// for lzb, which has no friction.
std::optional<PlanarImpact> planar_impact(ImpactHypothesis law, const PlanarContact& contact, PlanarPair w);

/// (9) [J]. @param w  w-
double energy_change(const PlanarImpact& impact, PlanarPair w);

}  // namespace ricochet
