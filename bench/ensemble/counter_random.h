#pragma once

#include <array>
#include <cstdint>

namespace ricochet {

/// Philox4x32-10: four random words as a function of a counter and a key. Number k of run i is the same for every
/// thread and order of calls and, because only integer arithmetic is used, on every machine.
/// Source: Salmon, Moraes, Dror, Shaw, Parallel random numbers: as easy as 1, 2, 3, SC 2011, section 3.3, table 2.
std::array<std::uint32_t, 4> philox(std::array<std::uint32_t, 4> counter, std::array<std::uint32_t, 2> key);

/// Number `k` of run `run`, uniform in (0, 1): (b + 1/2) 2^-52 with 52 random bits b, so that neither end occurs.
double uniform_number(std::uint64_t seed, std::uint64_t run, std::uint64_t k);

}  // namespace ricochet
