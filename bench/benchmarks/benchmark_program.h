#pragma once

#include <benchmark/benchmark.h>

#include <cstdint>
#include <string>

#include "bench/measure/allocations.h"

namespace ricochet {

// Code shared by the programs of Google Benchmark. Names of benchmarks are METHOD/SCENE/N or METHOD/SCENE/N/WHAT.

/// Sets a counter. Google Benchmark writes counters beside its own fields: none is to be called iterations.
inline void set_counter(benchmark::State& state, const std::string& name, std::int64_t value) {
  state.counters[name] = static_cast<double>(value);
}

/// Calls `work` once, so that what it keeps has its size, counts the allocations of a second call, and times the others.
/// @param items  of one call
template <class Work>
void measure(benchmark::State& state, std::int64_t items, const Work& work) {
  work();
  const Allocations allocations = allocations_of(work);
  for (auto _ : state) work();
  state.SetItemsProcessed(static_cast<std::int64_t>(state.iterations()) * items);
  set_counter(state, "allocations", allocations.count);
  set_counter(state, "bytes", allocations.bytes);
}

/// Runs what is registered, as the options of Google Benchmark say.
/// @return the exit code: 2 for an option that it does not know
int run_benchmarks(int argc, char** argv);

}  // namespace ricochet
