#pragma once

#include <memory>
#include <string>
#include <vector>

#include "bench/control/control_options.h"
#include "methods/control/control_solver.h"

namespace ricochet {

/// A discretised optimal control problem with its first guess.
struct GuessedTranscription {
  std::unique_ptr<Transcription> transcription;
  std::vector<std::string> notes;  ///< steps that were taken for the guess, one line each
};

/// Discretises a problem and makes the guess selected by the options: that of the problem, or the motion under guessed
/// controls, under controls of time stepping (which is solved for this), or under controls of a random search (which
/// takes seconds).
/// @param problem  by options.make_problem(), outlives the transcription  @throws InputError
GuessedTranscription guessed_transcription(const ControlOptions& options, const OptimalControlProblem& problem);

/// First guesses of the controls for shooting: those with which the plant follows a relaxation, the best of a random
/// search, or the control of the problem.
struct GuessedControls {
  std::vector<Matrix> u;           ///< n_u x N / 2^refine each, the best first
  double T = 0;                    ///< [s]
  std::vector<std::string> notes;  ///< as above
};
GuessedControls guessed_controls(const ControlOptions& options);

/// The method that the options select, with its first guess, for a problem.
struct PreparedMethod {
  std::unique_ptr<Transcription> transcription;  ///< null for shooting
  std::unique_ptr<ControlSolver> solver;         ///< refers to the transcription
  std::vector<std::string> notes;                ///< as above
};

/// Callbacks that report every step or iteration of a solve.
struct ControlProgress {
  MpccSolver::Progress homotopy = {};
  Shooting::Progress shooting = {};
};

/// Makes the first guess that the options select, which may take seconds. @param progress  of the solves
/// @param problem  by options.make_problem(), outlives the method  @throws InputError
PreparedMethod prepared_method(const ControlOptions& options, const OptimalControlProblem& problem,
                               const ControlProgress& progress = {});

}  // namespace ricochet
