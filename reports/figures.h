#pragma once

#include <string>
#include <vector>

#include "reports/record.h"

namespace ricochet {

/// A figure that was drawn.
struct Figure {
  std::string file;  ///< SVG, relative to the report folder
  std::string title, caption;
};

/// Draws with gnuplot (Debian: gnuplot-nox), which writes SVG for log-log plots without further ado. The gnuplot script
/// of each figure stays beside it.
class FigureFolder {
 public:
  /// @throws InputError when the folder cannot be written
  explicit FigureFolder(std::string folder);

  /// Error over step length, one figure per family of methods, with lines of the nominal order. Failed runs are crosses
  /// on the upper frame, runs that replace them open circles.
  std::vector<Figure> order(const Results& results);

  /// CPU time over error, all methods. Failed runs are crosses on the right frame.
  Figure work_precision(const Results& results);

  /// Positions and velocities over time; velocities jump.
  Figure trajectory(const Trajectory& trajectory, const std::string& name);

  /// Claimed and replayed motion, controls and contact forces of the runs of one problem, side by side.
  Figure control(const std::vector<const ControlRun*>& runs, const std::string& name);

  /// Derivatives of each component of the terminal state over the intervals: the reference, and of every other method
  /// the coarsest and the finest.
  Figure control_gradient(const std::vector<ControlGradient>& gradients, const std::string& name);

  /// Error of the rest time over the step length with its bound, a panel per tableau, and kappa over the stages; then
  /// the velocity that Gauss tableaus leave in a ball at rest.
  std::vector<Figure> zeno(const std::vector<ZenoCapture>& captures, const std::vector<ZenoRun>& runs,
                           const std::string& name);

  /// Errors on the (tan(slope), mu) plane, a panel per method, for the last initial speed of the results.
  Figure ramps(const std::vector<RampGrid>& grids, const std::string& name);

  /// What friction polygons do: the stick limit and the direction of slip over the direction of the way down.
  Figure ramp_facets(const std::vector<RampFacets>& facets, const std::string& name);

 private:
  void draw(const std::string& name, const std::string& script) const;

  std::string folder_;
};

/// Whether gnuplot can be run.
bool can_draw();

}  // namespace ricochet
