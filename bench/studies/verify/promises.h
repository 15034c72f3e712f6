#pragma once

#include <string>
#include <vector>

#include "methods/method.h"

namespace ricochet {

/// Whether two vectors have the same size and are equal to the last bit.
bool same_bits(const Vector& a, const Vector& b);

/// A run, and what of the promises that every method makes on every problem it does not keep.
struct PromisedRun {
  Solution solution;
  std::vector<std::string> broken;  ///< sentences; empty: all are kept
};

/// Bounds of rounding errors.
struct PromiseBounds {
  double clock = 1e-13;  ///< of the clock's rate; relative
  /// Between runs that record more or less, relative to the larger of 1 and the state: a run that nobody watches may
  /// take several steps in one piece. 0: the same bits.
  double recording = 0;
};

/// Whatever happens a run ends with a status, a reason unless it succeeded, and a finite state; events are in order, their
/// impulses push; no energy comes from nowhere; the clock is the time; a second run has the same bits; and what is recorded
/// changes nothing.
/// @param settings  its recording is chosen here
PromisedRun run_as_promised(const Method& method, const Problem& problem, Settings settings, PromiseBounds bounds = {});

}  // namespace ricochet
