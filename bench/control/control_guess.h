#pragma once

#include <memory>
#include <string>
#include <vector>

#include "bench/control/control_options.h"

namespace ricochet {

/// A discretised optimal control problem with its first guess.
struct GuessedTranscription {
  std::unique_ptr<Transcription> transcription;
  std::vector<std::string> notes;  ///< what was done for the guess, a line each
};

/// Discretises a problem and makes the guess that the options ask for: of the problem, the motion under guessed
/// controls, under those of time stepping (which is solved for that), or under those of a random search (which takes
/// seconds).
/// @param problem  by options.make_problem(), outlives the transcription  @throws InputError
GuessedTranscription guessed_transcription(const ControlOptions& options, const OptimalControlProblem& problem);

}  // namespace ricochet
