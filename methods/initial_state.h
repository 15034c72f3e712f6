#pragma once

#include <memory>
#include <string>

#include "problems/problem.h"

namespace ricochet {

/// A problem with a corrected initial state, and the correction.
struct ProjectedProblem {
  std::unique_ptr<Problem> problem;
  std::string note;  ///< one line: which contact was violated, by how much, what moved most; empty: nothing was
};

/// Moves the initial state of a scene that starts in penetration, as measured ones do, to the nearest one without,
///
///   q0 <- arg min ||q - q0||_M  subject to  f_c(q) >= 0, and f_c(q) = 0 where bilateral      (1)
///   v0 <- v0 - M^-1 G (G' M^-1 G)^-1 G' v0,   G: J_n of the bilateral constraints there      (2)
///
/// (1) by the linearised steps of position_projection.h, so that on curved gaps the position is the nearest one to
/// second order in the penetration. A velocity into a closed contact stays: it is an impact at t = 0.
///
/// @param problem  accepted by validate() of problems/initial_state.h
/// @throws InputError when (1) finds no position, or for a problem that is not made of formulas
ProjectedProblem project_initial_state(std::unique_ptr<Problem> problem);

}  // namespace ricochet
