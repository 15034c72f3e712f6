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
/// of each figure stays beside it. Frames of a motion are SVG of our own.
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

  // Of optimal control: control_figures.cpp.

  /// Claimed and replayed motion, velocities, controls, contact forces and impulses of the runs of one problem, side by
  /// side.
  Figure control(const std::vector<const ControlRun*>& runs, const std::string& name);

  /// Derivatives of each component of the terminal state over the intervals: the reference, and of every other method
  /// the coarsest and the finest.
  Figure control_gradient(const std::vector<ControlGradient>& gradients, const std::string& name);

  /// Twelve frames of the claimed motion: equally spaced in time, those next to an impact at the impact. For a run with
  /// a picture.
  Figure frames(const ControlRun& run, const std::string& name);

  /// Curves on logarithmic axes, a panel per name of a panel.
  Figure growth(const std::vector<GrowthCurve>& curves, const std::string& name, const std::string& title,
                const std::string& x_label, const std::string& y_label);

  /// Cost over CPU time of every random guess, one panel per group. Those without a solution are crosses on the upper
  /// frame.
  Figure seeds(const std::vector<SeedRun>& runs, const std::string& name);
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
  void write(const std::string& file, const std::string& text) const;

  std::string folder_;
};

/// Whether gnuplot can be run.
bool can_draw();

}  // namespace ricochet
