#pragma once

#include <functional>

namespace ricochet {

/// Whether this program counts allocations: one with bench/malloc/counting_malloc.cpp in it does.
bool counts_allocations();

/// Heap allocations by this thread while `work` runs. @throws std::logic_error in a program that does not count them
long allocations_of(const std::function<void()>& work);

/// Called by the malloc that counts.
/// @param begin, end  of counting in the calling thread; end returns the number
bool register_allocation_counter(void (*begin)(), long (*end)());

}  // namespace ricochet
