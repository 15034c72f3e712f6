#pragma once

#include <string>
#include <vector>

#include "bench/fuzz/fuzz_scene.h"
#include "bench/fuzz/judge.h"

namespace ricochet {

struct FuzzOptions {
  int scenes = 500;
  int seed = 1;
  double time = 0;                    ///< wall time after which no new scene is started [s]; 0: none
  std::vector<std::string> families;  ///< empty: all
  std::string folder = "out/fuzz";
  double minimise_time = 60;  ///< limit of the wall time for minimising a scene [s]; 0: as it was drawn
  JudgeOptions judge;
  std::string command_line;  ///< for the header

  /// @throws InputError for an unknown family
  void validate() const;
};

/// Judges random scenes, family after family in turn, and returns what was found. A line of `folder`/fuzz_SEED.jsonl is
/// written for each. The scenes on which methods disagree, are wrong or hang, or which fesd_adaptive declines, are
/// minimised and saved beside it. An interrupted run of the same program is continued.
std::vector<FuzzScene> run_fuzz(const FuzzOptions& options);

}  // namespace ricochet
