#pragma once

#include "bench/fuzz/fuzz_scene.h"
#include "problems/problem.h"
#include "reference/certified/certified_motion.h"

namespace ricochet {

/// The motion of a random scene by a proof (reference/certified), in a process of its own.
/// @param options  the wall time is theirs; a process that needs ten times as long and ten seconds more is killed
FuzzTruth prove_scene(const Problem& problem, const reference::certified::Options& options);

}  // namespace ricochet
