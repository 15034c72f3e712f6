#include "reference/certified/sha256.h"

#include <fmt/format.h>

#include <array>
#include <bit>
#include <cstdint>

namespace ricochet::reference::certified {
namespace {

using Word = std::uint32_t;

/// The first 32 bits of the fractional part of the square root or cube root of a whole number n < 400, exactly: the
/// whole part of root(n 2^(32 power)) modulo 2^32, by bisection.
Word fraction_of_root(unsigned n, int power) {
  using Wide = unsigned __int128;
  const auto at_most = [&](Wide x) {  // x^power <= n 2^(32 power)
    Wide rest = static_cast<Wide>(n) << (32 * power);
    for (int k = 0; k < power; ++k) rest /= x;
    return rest >= 1;
  };
  Wide low = 1, high = static_cast<Wide>(32) << 32;
  while (high - low > 1) {
    const Wide middle = (low + high) / 2;
    (at_most(middle) ? low : high) = middle;
  }
  return static_cast<Word>(low);
}

struct Constants {
  std::array<Word, 8> start{};   ///< of square roots of the first 8 primes
  std::array<Word, 64> round{};  ///< of cube roots of the first 64 primes
};

Constants make_constants() {
  Constants constants;
  std::size_t found = 0;
  for (unsigned n = 2; found < constants.round.size(); ++n) {
    bool is_prime = true;
    for (unsigned d = 2; d * d <= n; ++d) is_prime = is_prime && n % d != 0;
    if (!is_prime) continue;
    if (found < constants.start.size()) constants.start[found] = fraction_of_root(n, 2);
    constants.round[found++] = fraction_of_root(n, 3);
  }
  return constants;
}

void add_block(std::array<Word, 8>& hash, const unsigned char* block, const std::array<Word, 64>& k) {
  std::array<Word, 64> w;
  for (std::size_t i = 0; i < 16; ++i)
    w[i] = Word{block[4 * i]} << 24 | Word{block[4 * i + 1]} << 16 | Word{block[4 * i + 2]} << 8 | block[4 * i + 3];
  for (std::size_t i = 16; i < 64; ++i) {
    const Word s0 = std::rotr(w[i - 15], 7) ^ std::rotr(w[i - 15], 18) ^ (w[i - 15] >> 3);
    const Word s1 = std::rotr(w[i - 2], 17) ^ std::rotr(w[i - 2], 19) ^ (w[i - 2] >> 10);
    w[i] = w[i - 16] + s0 + w[i - 7] + s1;
  }
  auto [a, b, c, d, e, f, g, h] = hash;
  for (std::size_t i = 0; i < 64; ++i) {
    const Word s1 = std::rotr(e, 6) ^ std::rotr(e, 11) ^ std::rotr(e, 25);
    const Word t1 = h + s1 + ((e & f) ^ (~e & g)) + k[i] + w[i];
    const Word s0 = std::rotr(a, 2) ^ std::rotr(a, 13) ^ std::rotr(a, 22);
    const Word t2 = s0 + ((a & b) ^ (a & c) ^ (b & c));
    h = g, g = f, f = e, e = d + t1, d = c, c = b, b = a, a = t1 + t2;
  }
  const std::array<Word, 8> change{a, b, c, d, e, f, g, h};
  for (std::size_t i = 0; i < 8; ++i) hash[i] += change[i];
}

}  // namespace

std::string sha256(std::string_view text) {
  static const Constants constants = make_constants();
  std::string padded(text);
  padded += '\x80';
  while (padded.size() % 64 != 56) padded += '\0';
  const std::uint64_t bits = 8 * static_cast<std::uint64_t>(text.size());
  for (int shift = 56; shift >= 0; shift -= 8) padded += static_cast<char>(bits >> shift & 0xff);
  std::array<Word, 8> hash = constants.start;
  for (std::size_t k = 0; k < padded.size(); k += 64)
    add_block(hash, reinterpret_cast<const unsigned char*>(padded.data()) + k, constants.round);
  std::string digits;
  for (const Word word : hash) digits += fmt::format("{:08x}", word);
  return digits;
}

}  // namespace ricochet::reference::certified
