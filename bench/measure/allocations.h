#pragma once

#include <cstdint>
#include <functional>

namespace ricochet {

/// Heap allocations, those of Eigen, of other libraries and of plugins among them.
struct Allocations {
  std::int64_t count = 0, bytes = 0;
  std::int64_t peak = 0;  ///< bytes that lived at the same time, at most, above those before
};

/// Whether this program counts allocations, which requires bench/measure/malloc/counting_malloc.cpp.
bool counts_allocations();

/// Allocations of one call in this thread. @throws std::logic_error in a program that does not count them
Allocations allocations_of(const std::function<void()>& work);

/// Heap that lives at the same time in a run, at most, above what was taken before [bytes]. It differs a little from process
/// to process, since malloc hands out free pieces that are larger than what was asked for. NaN for a run in another process,
/// and in a program that does not count allocations. @param run  TimedRun::run, returns what it says of its time
double peak_bytes_of(const std::function<double()>& run);

/// Called by the malloc that counts.
/// @param begin, end  of counting in the calling thread; end returns what was counted
bool register_allocation_counter(void (*begin)(), Allocations (*end)());

}  // namespace ricochet
