#include "bench/ensemble/counter_random.h"

namespace ricochet {
namespace {

constexpr int kRounds = 10;
constexpr std::uint64_t kMultipliers[]{0xD2511F53, 0xCD9E8D57};
constexpr std::uint32_t kKeySteps[]{0x9E3779B9, 0xBB67AE85};  // golden ratio, sqrt(3) - 1

std::uint32_t low(std::uint64_t x) {
  return static_cast<std::uint32_t>(x);
}
std::uint32_t high(std::uint64_t x) {
  return static_cast<std::uint32_t>(x >> 32);
}

}  // namespace

std::array<std::uint32_t, 4> philox(std::array<std::uint32_t, 4> x, std::array<std::uint32_t, 2> key) {
  for (int round = 0; round < kRounds; ++round) {
    const std::uint64_t first = kMultipliers[0] * x[0], second = kMultipliers[1] * x[2];
    x = {high(second) ^ x[1] ^ key[0], low(second), high(first) ^ x[3] ^ key[1], low(first)};
    for (int k = 0; k < 2; ++k) key[k] += kKeySteps[k];
  }
  return x;
}

double uniform_number(std::uint64_t seed, std::uint64_t run, std::uint64_t k) {
  // A block of four words has two numbers.
  const auto words = philox({low(run), high(run), low(k / 2), high(k / 2)}, {low(seed), high(seed)});
  const std::size_t at = 2 * (k % 2);
  const std::uint64_t bits = (static_cast<std::uint64_t>(words[at + 1]) << 32 | words[at]) >> 12;
  return (static_cast<double>(bits) + 0.5) * 0x1p-52;
}

}  // namespace ricochet
