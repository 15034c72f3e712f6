#pragma once

#include <string>

#include "methods/control/shooting/linearised_interval.h"

namespace ricochet {

struct TrackingOptions {
  int window = 6;           ///< intervals that are looked ahead
  int iterations = 4;       ///< Gauss-Newton steps per interval
  double by_control = 0.1;  ///< r of (1): larger values keep the controls nearer to the given ones
};

struct Tracking {
  Matrix u;             ///< n_u x N
  double distance = 0;  ///< largest |W (x_k - y_k)| of the motion under u
  std::string message;  ///< why controls from some interval on are the given ones; empty if all have been adapted
};

/// Controls under which the plant follows given states y_0 .. y_N, such as those of a relaxation, which it cannot follow
/// exactly. Interval by interval, from where the plant is,
///
///   min  sum_j |W (x_j - y_j)|^2 + r^2 b^2 |(u_j - w_j) / s|^2,   lower <= u_j <= upper                       (1)
///
/// over the next intervals j of a window, by Gauss-Newton on motions of the plant with the derivatives of
/// linearised_interval.h; then the first of their controls is kept. w are the given controls, s half the distances between
/// the bounds of a control, or 1. W weights positions by 1 and velocities by the length H of an interval, b is the
/// largest weighted change of a state by a control within one interval, relative to s.
///
/// The look-ahead is what makes a plan usable whose motion is unstable, as when one disc pushes another: controls alone
/// lose the contact after a few intervals.
///
/// @param runner  of the plant @param u  w, n_u x N @param H  [s] @param y  2 n_q x (N + 1); y_0 is the initial state
/// @throws InputError for sizes that do not agree, and for options out of range
Tracking track(PlantRunner& runner, const Matrix& u, double H, const Matrix& y, const TrackingOptions& options);

}  // namespace ricochet
