#pragma once

#include <memory>
#include <string>

#include "methods/method.h"
#include "problems/problem.h"

namespace ricochet {

/// Registers a benchmark that repeats runs of one solver. Items are elements or steps; counters, allocations and their
/// bytes are per run.
/// @param counts_elements  items are elements instead of steps
void register_method_benchmark(const std::string& name, std::shared_ptr<const Method> method,
                               std::shared_ptr<const Problem> problem, const Settings& settings, bool counts_elements);

}  // namespace ricochet
