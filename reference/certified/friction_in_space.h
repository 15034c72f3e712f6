#pragma once

#include <array>
#include <optional>

#include "reference/certified/ball.h"

/// @file
/// Coulomb's law of one contact in space: all slip directions that satisfy it.

namespace ricochet::reference::certified {

/// One contact in space, whose velocities w = (w_n, w_t) depend on its impulses by
///
///     w+ = r + G Lambda,   w_n+ = 0                                                                             (1)
///
/// For an impact, r_n = (1 + eps_r) w_n- and r_t = v_t-. For the forces of a contact that begins to slip, w+ is the
/// acceleration. G need not be symmetric.
struct ContactInSpace {
  std::array<std::array<Ball, 3>, 3> G;  ///< normal, then two tangents
  std::array<Ball, 3> r;                 ///< w without impulses
  Ball mu;                               ///< Coulomb's friction
};

/// Solutions of Coulomb's law with slip.
struct SlipDirections {
  int n_proven = 0;           ///< directions that satisfy the law strictly
  bool is_complete = false;   ///< all others are refuted
  std::array<Ball, 2> d;      ///< the last one that was proven
  std::array<Ball, 3> force;  ///< its impulses, normal and tangents
  bool is_stable = false;     ///< F' < 0: friction turns other directions towards d
};

/// Finds all d = (cos phi, sin phi) with Lambda_t = -mu Lambda_n d, Lambda_n > 0 and w_t+ = s d, s > 0. With
///
///     b = -r_n,   D(phi) = G_nn - mu G_nt d,   u(phi) = D r_t + b (G_tn - mu G_tt d)                            (2)
///
/// (1) gives Lambda_n = b / D and w_t+ = u / D, so that the directions are the roots of
///
///     F(phi) = d' . u = 0,   where S(phi) = d . u has the sign of D, and D that of b,   d' = (-sin phi, cos phi)   (3)
///
/// The circle is bisected. An arc has no solution if one of these signs is wrong on all of it, or F != 0 by the mean
/// value theorem; if F' != 0 it has a root at most, which the signs of F at its ends and Newton's operator decide.
///
/// @param limit  a direction with w_t+ = 0 exactly, where the contact sticks at the limit of friction: a root of F
///               with S = 0, which is no slip
SlipDirections slip_directions(const ContactInSpace& contact, const Precision& precision,
                               const std::optional<std::array<Ball, 2>>& limit = {});

/// Slip along any direction d, with the forces of (1) and (2).
struct SlipBounds {
  Ball braking;               ///< lower bound of -d . w_t+, positive
  std::array<Ball, 3> force;  ///< contain the forces, of all d
};

/// Bounds for all directions. @returns nothing unless friction brakes slip along each of them, with Lambda_n > 0
std::optional<SlipBounds> slip_bounds(const ContactInSpace& contact, const Precision& precision);

/// The impulses for w+ = 0. @returns nothing if G may be singular
std::optional<std::array<Ball, 3>> sticking_force(const ContactInSpace& contact, const Precision& precision);

/// Whether impulses are inside of Coulomb's cone: Lambda_n > 0 and |Lambda_t| < mu Lambda_n.
Sign is_inside_cone(const std::array<Ball, 3>& force, const Ball& mu, const Precision& precision);

}  // namespace ricochet::reference::certified
