#pragma once

#include <memory>
#include <string>
#include <vector>

#include "methods/registry.h"
#include "tests/test_data.h"

namespace ricochet {

/// An example of a registered method on a scene.
struct MethodScenePair {
  std::string method, problem_id;
  int steps = 0;
  std::shared_ptr<const Problem> problem;
};

/// Pairs that run, or pairs that the method declines.
inline std::vector<MethodScenePair> pairs_that(bool run) {
  std::vector<MethodScenePair> pairs;
  const auto problems = all_problems();
  for (const auto& entry : methods()) {
    if (!entry.make) continue;  // not built
    for (const auto& example : entry.examples) {
      const auto method = make_method(example);
      for (const auto& problem : problems) {
        if (method->can_run(problem.problem->info()).ok == run)
          pairs.push_back({example, problem.id, entry.conformance_steps, problem.problem});
      }
    }
  }
  return pairs;
}

}  // namespace ricochet
