#pragma once

#include "reference/certified/certified_motion.h"
#include "reference/certified/taylor_step.h"

/// @file
/// Attempt: one enclosure of a motion, and the search for the precision that it needs.

namespace ricochet::reference::certified {

/// How one run of HybridMotion ended.
struct Attempt {
  CertifiedMotion motion;
  double log10_radius = -1e9;  ///< at its end
  bool is_undecided = false;   ///< more bits may help
  bool is_out_of_time = false;
  bool accumulates = false;  ///< impacts accumulate at its end
};

/// One run with the precision of the `options`. @param cut  as in HybridMotion
Attempt attempt(const Problem& problem, const Options& options, const TimeLimit& limit, int cut = 0);

/// Runs with rising precision until the digits are proven, or a tie is found that more bits do not decide.
Attempt attempts(const Problem& problem, Options options, const TimeLimit& limit, int cut = 0);

}  // namespace ricochet::reference::certified
