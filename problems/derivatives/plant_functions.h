#pragma once

#include "problems/derivatives/smooth_function.h"
#include "problems/problem.h"

namespace ricochet {

/// The equations of a scene (problem.h, (1)-(5)) as functions with second derivatives, from which a transcription is
/// assembled. Arguments are listed in the order of the inputs. lambda_t and J_t are present only if the scene has
/// friction.
struct PlantFunctions {
  SmoothFunction dynamics;     ///< (q, v, w, lambda_n, lambda_t, u) -> M w - f_v - B_u u - J_n lambda_n - J_t lambda_t
  SmoothFunction gap;          ///< (q) -> f_c
  SmoothFunction slip;         ///< (q, v) -> J_t' v
  SmoothFunction impulse;      ///< (q, v+, v-, Lambda_n, Lambda_t) -> M (v+ - v-) - J_n Lambda_n - J_t Lambda_t
  SmoothFunction restitution;  ///< (q, v+, v-) -> J_n^i' (v+ + eps_r^i v-)
  SmoothFunction normal_velocity;  ///< (q, v) -> J_n' v
  SmoothFunction ahead;            ///< (q, v, h) -> f_c(q + eps h v), eps as given to plant_functions()
};

/// @throws InputError when the problem has no formulas: neither a compiled scene nor a scene file
PlantFunctions plant_functions(const Problem& problem, double eps);

/// The dynamics in a pseudo time tau with dt/dtau = s and w = dv/dtau:
/// (q, v, w, s, Lambda_n, Lambda_t, u) -> M w - s (f_v + B_u u) - J_n Lambda_n - J_t Lambda_t.
/// @throws InputError as plant_functions()
SmoothFunction pseudo_time_dynamics(const Problem& problem);

}  // namespace ricochet
