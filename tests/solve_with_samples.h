#pragma once

#include <gtest/gtest.h>

#include <string>
#include <utility>

#include "methods/registry.h"

namespace ricochet {

/// A run with samples at the ends of its steps. The test fails if the run fails, or if a method that keeps samples has
/// fewer than steps, so that a largest value over the samples is never the largest of none.
inline Solution solve_with_samples(const Problem& problem, const std::string& method, Settings settings) {
  settings.recording = Recording::grid;
  const auto made = make_method(method);
  const MethodInfo info = made->info();
  Solution s = made->solve(problem, settings);
  EXPECT_TRUE(s.succeeded()) << method << ", " << settings.steps << " steps: " << s.message;
  const int least = !info.keeps_samples ? 0 : info.is_adaptive ? 1 : settings.steps;
  EXPECT_GE(s.samples.size(), static_cast<std::size_t>(least)) << method;
  return s;
}

inline Solution solve_with_samples(const Problem& problem, const std::string& method, int steps) {
  Settings settings;
  settings.steps = steps;
  return solve_with_samples(problem, method, std::move(settings));
}

}  // namespace ricochet
