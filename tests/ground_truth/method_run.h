#pragma once

#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "methods/registry.h"
#include "problems/scene_file/scene_file.h"
#include "problems/scene_file/scene_writer.h"

namespace ricochet {

/// A method with its setting, and the error that a test allows it.
struct MethodRun {
  const char* method;
  int steps;
  double tolerance;
  double error = 0;  ///< absolute, of q and v of the bodies
};

inline Solution run_as(const Problem& problem, const MethodRun& how, const std::vector<std::string>& sensitivities = {},
                       Recording recording = Recording::events) {
  Settings settings;
  settings.steps = how.steps;
  settings.tolerance = how.tolerance;
  settings.sensitivities = sensitivities;
  settings.recording = recording;
  return make_method(how.method)->solve(problem, settings);
}

/// The scene as a text is the same problem.
inline void expect_export_reads_back(const Problem& problem, const MethodRun& how) {
  const auto again = read_scene_text(scene_text(problem), "scene");
  EXPECT_EQ(scene_text(*again, {.with_title = false}), scene_text(problem, {.with_title = false})) << problem.info().id;
  const Solution first = run_as(problem, how), second = run_as(*again, how);
  EXPECT_EQ(first.q, second.q) << problem.info().id;
  EXPECT_EQ(first.v, second.v) << problem.info().id;
}

}  // namespace ricochet
