// A malloc that counts, for bench/allocations.h: in place of the library's in the programs that it is linked into. So
// those of Eigen, and of plugins, are counted, too. A program with a sanitizer has one of its own, and goes without.
#include <cstddef>

#include "bench/allocations.h"

namespace {

thread_local bool counting = false;
thread_local ricochet::Allocations allocations;

const bool is_registered = ricochet::register_allocation_counter(
    [] {
      allocations = {};
      counting = true;
    },
    [] {
      counting = false;
      return allocations;
    });

}  // namespace

extern "C" {
void* __libc_malloc(std::size_t size);
void* malloc(std::size_t size) {
  if (counting) {
    ++allocations.count;
    allocations.bytes += static_cast<std::int64_t>(size);
  }
  return __libc_malloc(size);
}
}
