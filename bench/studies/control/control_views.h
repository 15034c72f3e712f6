#pragma once

#include <string>
#include <vector>

#include "bench/control/control_run.h"
#include "problems/control/optimal_control_problem.h"
#include "reports/chart.h"
#include "reports/figures.h"
#include "reports/table.h"

/// @file
/// Tables and figures of the runs of a control experiment.

namespace ricochet {

/// One line per run: size, work, claim and truth.
Table control_table(const std::vector<ControlRun>& runs);
/// Runs that were not solved, or not replayed, with the reason.
Table control_failures(const std::vector<ControlRun>& runs);

/// Claimed and replayed motion, velocities, controls, contact forces and impulses of the runs of one problem, side by
/// side.
Chart control_chart(const std::vector<ControlRun>& runs, const std::string& file);
/// Cost over iterations of the runs of one problem that report it.
Chart progress_chart(const std::vector<ControlRun>& runs, const std::string& file);
/// The claimed motion with its forces, for a problem with a geometry: in twelve frames, and as an animation.
Figure draw_frames(const FigureFolder& folder, const OptimalControlProblem& problem, const ControlRun& run,
                   const std::string& name);
Figure draw_scene(const FigureFolder& folder, const OptimalControlProblem& problem, const ControlRun& run,
                  const std::string& name);

}  // namespace ricochet
