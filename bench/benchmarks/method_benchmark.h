#pragma once

#include <memory>
#include <string>

#include "methods/method.h"
#include "problems/problem.h"

namespace ricochet {

/// A benchmark of Google Benchmark: runs of a solver that is kept between them. Its items are elements or steps; counters
/// are those of a run (Counters), allocations and their bytes of one, too.
/// @param counts_elements  instead of steps
void register_method_benchmark(const std::string& name, std::shared_ptr<const Method> method,
                               std::shared_ptr<const Problem> problem, const Settings& settings, bool counts_elements);

}  // namespace ricochet
