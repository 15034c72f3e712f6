#include "bench/measure/allocations.h"

#include <limits>
#include <stdexcept>

namespace ricochet {
namespace {

struct AllocationCounter {
  void (*begin)() = nullptr;
  Allocations (*end)() = nullptr;
};

AllocationCounter& counter() {
  static AllocationCounter the_counter;
  return the_counter;
}

}  // namespace

bool register_allocation_counter(void (*begin)(), Allocations (*end)()) {
  counter() = {begin, end};
  return true;
}

bool counts_allocations() {
  return counter().begin != nullptr;
}

Allocations allocations_of(const std::function<void()>& work) {
  if (!counts_allocations()) throw std::logic_error("this program does not count allocations");
  counter().begin();
  try {
    work();
  } catch (...) {
    counter().end();
    throw;
  }
  return counter().end();
}

double peak_bytes_of(const std::function<double()>& run) {
  double own_seconds = 0;
  if (!counts_allocations()) return std::numeric_limits<double>::quiet_NaN();
  const Allocations allocations = allocations_of([&] { own_seconds = run(); });
  return own_seconds > 0 ? std::numeric_limits<double>::quiet_NaN() : static_cast<double>(allocations.peak);
}

}  // namespace ricochet
