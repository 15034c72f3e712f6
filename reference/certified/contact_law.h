#pragma once

#include "reference/certified/ball_matrix.h"
#include "reference/certified/mode_motion.h"

/// @file
/// ContactLaw: how the impulses of one contact change velocities.

namespace ricochet::reference::certified {

/// The law of one contact that exchanges no momentum with others, with J = (J_n, J_t):
///
///     v+ - v- = M^-1 J' Lambda,    w+ - w- = G Lambda,    G = J M^-1 J'                                          (1)
///
/// The same holds for accelerations and forces.
struct ContactLaw {
  BallMatrix moved;  ///< M^-1 J', n rows of 1 + n_t
  BallMatrix G;      ///< 1 + n_t rows
};

/// The law at the state in the `program`. @throws Undecided if M may be singular
ContactLaw contact_law(const SceneFormulas& scene, int contact, SeriesProgram& program);

/// The derivative of a rate w(q, v, t) along a motion.
Node rate_along(const ModeMotion& motion, Node w, const SceneFormulas& scene, SeriesProgram& program);

/// Derivatives of v_n and v_t of a contact along a motion.
std::vector<Node> contact_rates(const ModeMotion& motion, const ContactFormulas& contact, const SceneFormulas& scene,
                                SeriesProgram& program);

}  // namespace ricochet::reference::certified
