#pragma once

#include <array>

namespace ricochet {

// Study "friction_ramp": does a block on a ramp stick, and where does it go? Fields of the experiment: "grid", values of
// mu and of tan(slope) from 0 to 1, so that the diagonal is the boundary (2); "v_0": list; "duration"; "methods":
// [{"method", "steps" or "tolerance", "stride": every so many values, 1}], or "all"; "others": {"steps", "tolerance"} of
// the registered methods that "methods" does not name; "facets": {"directions", "load", "methods": [{"method",
// "facets", "steps"}]}.

/// Position and speed of the scene "block_on_ramp" at time t, exactly. While it slips
///
///   x'' = g (sin(slope) - mu cos(slope) sign(x')),                                                           (1)
///
/// and when it has stopped it stays exactly when
///
///   tan(slope) <= mu.                                                                                        (2)
struct ExactRamp {
  double mu = 0.5, tangent = 0.5;  ///< tangent: tan(slope)
  double v_0 = 0, g = 9.81;

  struct State {
    double x = 0, v = 0;
  };
  State at(double t) const;
};

/// Sliding from rest with a regular polygon of `facets` vertices in place of the friction disc; 0: the disc. The force
/// dissipates most, so the acceleration is what the polygon leaves of the load d sin(slope),
///
///   a / g = d sin(slope) - P(d sin(slope)),   P the projection onto mu cos(slope) times the polygon,          (3)
///
/// and the block sticks exactly when the load is in the polygon: with psi the angle from d to the nearest normal of an
/// edge,
///
///   tan(slope) <= mu cos(pi/F) / cos(psi).                                                                   (4)
struct ExactFacets {
  int facets = 0;
  double direction = 0;  ///< of d, from the first vertex [rad]

  double limit() const;                            ///< (4), of tan(slope) / mu
  std::array<double, 2> drift(double load) const;  ///< (3) times 1 / (mu cos(slope)), load = tan(slope) / mu
};

}  // namespace ricochet
