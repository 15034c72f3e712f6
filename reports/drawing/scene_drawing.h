#pragma once

#include <functional>
#include <string>
#include <vector>

#include "problems/problem.h"
#include "problems/solution.h"

namespace ricochet {

// A scene as SVG, from its geometry. Down is where gravity points; space is seen from a height of 20 degrees. A surface
// that moves by itself follows the scene's gap.

/// The forces on a scene at an instant [N].
struct SceneForces {
  Vector u, lambda_n, lambda_t;  ///< n_u, n_c, n_lambda_t
};

/// A motion as it is drawn.
struct DrawnMotion {
  struct Impact {
    double t = 0;
    int contact = -1;
  };
  double begin = 0, end = 0;
  std::function<Vector(double t)> q = {};            ///< null: the scene as it starts
  std::function<SceneForces(double t)> forces = {};  ///< null: neither forces nor rings at impacts are drawn
  std::vector<Impact> impacts = {};
  Vector goal = {};  ///< the q where the bodies have to go, drawn faintly; empty for none
};

/// The ways that the centres of the bodies take, and an animation of the motion, which needs no script.
/// @throws InputError for a scene without geometry
std::string scene_svg(const Problem& problem, const DrawnMotion& motion);

/// The motion and the impacts of a solution of the problem; without a motion the scene as it starts.
std::string scene_svg(const Problem& problem, const Solution& solution = {});

struct SceneFrames {
  std::string svg;
  double longest_force = 0;  ///< of the longest arrow [N]
};

/// Twelve frames of a motion: equally spaced in time, those next to an impact at the impact.
/// @throws InputError for a scene without geometry
SceneFrames scene_frames(const Problem& problem, const DrawnMotion& motion);

}  // namespace ricochet
