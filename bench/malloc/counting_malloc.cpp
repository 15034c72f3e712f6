// A malloc that counts, for bench/allocations.h: in place of the library's in the programs that it is linked into. So
// those of Eigen, and of plugins, are counted, too. A program with a sanitizer has one of its own, and goes without.
#include <cstddef>

#include "bench/allocations.h"

namespace {

thread_local bool counting = false;
thread_local long allocations = 0;

const bool is_registered = ricochet::register_allocation_counter(
    [] {
      allocations = 0;
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
  if (counting) ++allocations;
  return __libc_malloc(size);
}
}
