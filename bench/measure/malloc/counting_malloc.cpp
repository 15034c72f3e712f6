// A malloc that counts, for bench/measure/allocations.h: in place of the library's in the programs that it is linked into. So
// those of Eigen, and of plugins, are counted, too. A program with a sanitizer has one of its own, and goes without.
#include <malloc.h>

#include <algorithm>
#include <cstddef>

#include "bench/measure/allocations.h"

namespace {

thread_local bool counting = false;
thread_local ricochet::Allocations allocations;
thread_local std::int64_t live = 0;  // bytes that were taken and not given back; negative where older ones were

const bool is_registered = ricochet::register_allocation_counter(
    [] {
      allocations = {};
      live = 0;
      counting = true;
    },
    [] {
      counting = false;
      return allocations;
    });

void take(void* block) {
  live += static_cast<std::int64_t>(malloc_usable_size(block));
  allocations.peak = std::max(allocations.peak, live);
}

void give_back(void* block) {
  live -= static_cast<std::int64_t>(malloc_usable_size(block));
}

}  // namespace

extern "C" {
void* __libc_malloc(std::size_t size);
void* __libc_calloc(std::size_t n, std::size_t size);
void* __libc_realloc(void* block, std::size_t size);
void* __libc_memalign(std::size_t alignment, std::size_t size);
void __libc_free(void* block);

void* malloc(std::size_t size) {
  void* block = __libc_malloc(size);
  if (counting) {
    ++allocations.count;
    allocations.bytes += static_cast<std::int64_t>(size);
    take(block);
  }
  return block;
}

// Those below are not counted: they are there for what lives at the same time.

void* calloc(std::size_t n, std::size_t size) {
  void* block = __libc_calloc(n, size);
  if (counting) take(block);
  return block;
}

void* realloc(void* block, std::size_t size) {
  if (counting) give_back(block);
  void* moved = __libc_realloc(block, size);
  if (counting) take(moved != nullptr || size == 0 ? moved : block);
  return moved;
}

void* aligned_alloc(std::size_t alignment, std::size_t size) {
  void* block = __libc_memalign(alignment, size);
  if (counting) take(block);
  return block;
}

void free(void* block) {
  if (counting) give_back(block);
  __libc_free(block);
}
}
