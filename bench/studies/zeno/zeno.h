#pragma once

#include <string>
#include <vector>

#include "bench/studies/zeno/zeno_rows.h"
#include "methods/fesd/capture.h"

namespace ricochet {

// Study "zeno": when and how the bouncing of a ball ends. Fields of the experiment: "tableaus": for the captures,
// "restitution": [e], "step_lengths": {"from", "to", "per_decade"}, "methods", "tolerances", "adaptive_methods".

/// The scene "bouncing_ball" with its default height and gravity, exactly. The time between impacts shrinks by e, and
///
///   t_Z = t_0 (1 + e) / (1 - e),   t_0 = sqrt(2 h_0 / g).                                                    (1)
struct ExactBall {
  double h_0 = 0.9, g = 9.81, e = 0.5;

  double t_Z() const;
  /// Above the ground [m].
  double height(double t) const;
  /// Times of the highest points of its flights, from t on [s].
  std::vector<double> highest_after(double t) const;
};

/// kappa and the velocity kept, of single closed elements with v+ = 1 m/s on which ElementSolver is run.
ZenoCapture measure_capture(const std::string& tableau);

/// One run to 1.3 t_Z or a little more. @param H  step length [s], 0 for methods that read the tolerance
ZenoRun measure_rest(const std::string& method, double e, double H, double tolerance);

}  // namespace ricochet
