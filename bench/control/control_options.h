#pragma once

#include <memory>
#include <string>
#include <vector>

#include "methods/complementarity/mpcc/homotopy.h"
#include "methods/control/exploration.h"
#include "methods/control/shooting/shooting.h"
#include "methods/control/time_freezing_transcription.h"
#include "methods/control/transcription.h"
#include "methods/mpcc_equations/fesd_equations.h"
#include "problems/control/optimal_control_problem.h"

namespace CLI {
class App;
}

namespace ricochet {

/// The options of `ricochet control`: method, discretisation, guess and solution of an optimal control problem.
struct ControlOptions {
  std::string method = "homotopy";  ///< or "shooting"
  std::string problem;
  std::vector<std::string> changes;
  std::string discretisation = "fesd";
  int intervals = 0;  ///< 0: the default of the problem; likewise the next two
  int elements = 0;
  std::string tableau;
  int steps = 10;  ///< steps of time stepping per interval
  TimeFreezingTranscription::Options freezing;
  std::string impulses = "position_velocity", cone = "exact", cross = "aggregated", equilibration = "objective";
  FesdEquations::Options equations;
  HomotopyOptions homotopy{.sigma_final = 1e-6,
                           .factor = 0.01,
                           .tolerance_per_sigma = 1,
                           .loosest_tolerance = 1e-3,
                           .sigma_crossover = 1e-4,
                           .warm_multipliers = false,
                           .adaptive_barrier = true,
                           .max_iterations = 500,
                           .time_limit = 120,
                           .push = 1e-3};
  bool superlinear = false;
  std::string linear_solver = "mumps";
  bool simulate = false;
  int from_time_stepping = 0;  ///< steps per interval; 0: not used
  ExplorationOptions exploration{.rounds = 0};
  double noise = 0;
  ShootingOptions shooting;
  int refine = 0;           ///< levels of shooting from coarse to fine
  double update_limit = 0;  ///< of the wall time of a second solve [s]; 0: none

  /// Groups of options that one method has only.
  static constexpr const char *kOfHomotopy = "Options of --method homotopy",
                              *kOfShooting = "Options of --method shooting";

  /// Adds the options to `command`. An option of the other method is an InputError, also one that `command` has itself.
  void add(CLI::App& command);
  /// The options of a command line, "two_carts --simulate". @throws InputError
  static ControlOptions parse(const std::string& arguments);

  bool is_shooting() const { return method == "shooting"; }
  bool is_fesd() const { return discretisation == "fesd"; }
  std::unique_ptr<OptimalControlProblem> make_problem() const;  ///< @throws InputError
  /// With the guess of the problem; guessed_transcription() makes the selected guess.
  /// @param made  by make_problem(), outlives the transcription. @throws InputError
  std::unique_ptr<Transcription> make_transcription(const OptimalControlProblem& made) const;
  /// The problem on as many times fewer intervals as `refine` says, on which shooting begins. @throws InputError
  std::unique_ptr<OptimalControlProblem> make_coarse_problem() const;
  HomotopyOptions homotopy_options() const;  ///< with update_limit. @throws InputError with --method shooting
  /// "FESD-J radau-iia:3, 10 intervals of 2 elements"
  std::string describe(const OptimalControlProblem& made) const;
};

}  // namespace ricochet
