#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <string>
#include <utility>

#include "methods/registry.h"

namespace ricochet {

/// A run with samples at the ends of its steps. The test fails where the run fails or keeps fewer samples than steps, so
/// that a largest value over the samples is never the largest of none.
inline Solution solve_with_samples(const Problem& problem, const std::string& method, Settings settings) {
  settings.recording = Recording::grid;
  Solution s = make_method(method)->solve(problem, settings);
  EXPECT_TRUE(s.succeeded()) << method << ", " << settings.steps << " steps: " << s.message;
  EXPECT_GE(s.samples.size(), static_cast<std::size_t>(std::max(settings.steps, 1))) << method;
  return s;
}

inline Solution solve_with_samples(const Problem& problem, const std::string& method, int steps) {
  Settings settings;
  settings.steps = steps;
  return solve_with_samples(problem, method, std::move(settings));
}

}  // namespace ricochet
