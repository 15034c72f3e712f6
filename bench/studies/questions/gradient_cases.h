#pragma once

#include <memory>
#include <string>
#include <vector>

#include "bench/measure/problem_choice.h"

/// @file
/// Derivatives of a final state through impacts and stops that are known exactly: cases that people named in threads.

namespace ricochet {

/// A derivative of a component of the final state.
struct GradientEntry {
  std::string name;          ///< "d x_1(T) / d x_2(0)"
  int output = 0;            ///< of (q, v), 2 n_q
  std::string with_respect;  ///< "q0:1", "param:mu"
  double exact = 0;
};

/// A case. There is no weight where the title says nothing of it.
struct GradientCase {
  std::string name;   ///< "two_balls"
  std::string of;     ///< the thread that it is from
  std::string title;  ///< what happens, with its numbers
  ProblemChoice choice;
  std::vector<GradientEntry> entries;
  std::unique_ptr<Problem> problem = {};
};

/// Replaces the exact derivatives of a case by proven ones, if a proof takes less than two seconds.
/// @returns whether it does
bool take_proven(GradientCase& gradient_case);

/// All cases. Their numbers are derived in gradient_cases.cpp.
std::vector<GradientCase> gradient_cases();

}  // namespace ricochet
