// Errors of fesd_adaptive in multiples of its tolerance, on random scenes whose forces bend or jump.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <string>
#include <vector>

#include "bench/fuzz/families.h"
#include "methods/registry.h"
#include "problems/scene_file/scene_file.h"
#include "reference/certified/certified_motion.h"
#include "reference/proven.h"

namespace ricochet {
namespace {

/// `ricochet fuzz --family corners` prints the same distribution for any number of scenes.
TEST(Tolerance, IsMetThroughCorners) {
  if (!reference::certified::can_certify()) GTEST_SKIP() << "Arb is not installed";
  constexpr int kScenes = 150, kSeed = 44;
  constexpr double kFew = 100,
                   kMost = 1e4;  // errors of steps add up over a run; beyond the second it is another motion
  const SceneFamily& corners = *std::ranges::find(scene_families(), std::string("corners"), &SceneFamily::name);
  const auto method = make_method("fesd_adaptive:radau-iia:4");
  for (const double tolerance : {1e-6, 1e-8, 1e-10}) {
    int runs = 0, within = 0;
    for (int number = 0; number < kScenes; ++number) {
      const auto problem = read_scene_text(random_scene(corners, kSeed, number).dump(), "scene");
      const auto truth = reference::proven_reference(*problem, 0.5);
      if (!truth) continue;
      Settings settings;
      settings.tolerance = tolerance;
      settings.recording = Recording::final_state;
      const Solution s = method->solve(*problem, settings);
      if (!s.succeeded()) continue;
      const double tolerances = truth->error_of(s) / (tolerance * std::max(1.0, truth->size()));
      ++runs;
      within += tolerances <= kFew ? 1 : 0;
      EXPECT_LE(tolerances, kMost) << "scene " << number << " at " << tolerance;
    }
    EXPECT_GE(runs, kScenes / 2) << "with a proof and a solution";
    EXPECT_GE(within, 0.99 * runs) << "of " << runs << " runs at " << tolerance;
  }
}

}  // namespace
}  // namespace ricochet
