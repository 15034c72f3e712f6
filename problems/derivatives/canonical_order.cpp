#include "problems/derivatives/canonical_order.h"

#include <algorithm>
#include <sstream>
#include <string_view>

namespace ricochet {
namespace {

std::uint64_t mix(std::uint64_t seed, std::uint64_t value) {
  // splitmix64 finaliser: spreads the structural hash so that a collision of different subexpressions is negligible
  std::uint64_t z = seed ^ (value + 0x9e3779b97f4a7c15ULL + (seed << 6) + (seed >> 2));
  z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9ULL;
  z = (z ^ (z >> 27)) * 0x94d049bb133111ebULL;
  return z ^ (z >> 31);
}

std::uint64_t hash_text(std::string_view text) {
  std::uint64_t h = 0xcbf29ce484222325ULL;
  for (const char c : text) h = (h ^ static_cast<unsigned char>(c)) * 0x100000001b3ULL;
  return h;
}

}  // namespace

std::string printed(const GiNaC::ex& e) {
  std::ostringstream text;
  text << e;
  return text.str();
}

std::vector<GiNaC::ex> CanonicalOrder::sorted(const GiNaC::ex& e) {
  std::vector<GiNaC::ex> operands;
  for (std::size_t i = 0; i < e.nops(); ++i) operands.push_back(e.op(i));
  std::sort(operands.begin(), operands.end(),
            [&](const auto& a, const auto& b) { return shape(a).hash < shape(b).hash; });
  return operands;
}

CanonicalOrder::Shape CanonicalOrder::shape(const GiNaC::ex& e) {
  const auto known = shapes_.find(e);
  if (known != shapes_.end()) return known->second;
  Shape result;
  if (GiNaC::is_a<GiNaC::numeric>(e)) {
    const auto& n = GiNaC::ex_to<GiNaC::numeric>(e);
    result = {hash_text(printed(GiNaC::abs(n))), n.is_negative()};
  } else if (e.nops() == 0) {
    result.hash = hash_text(name_(e));
  } else if (GiNaC::is_a<GiNaC::add>(e)) {
    result.hash = hash_text("+");
    const auto terms = sorted(e);
    result.negative = shape(terms.front()).negative;
    for (const auto& term : terms) {
      result.hash = mix(result.hash, shape(term).hash + (shape(term).negative != result.negative));
    }
  } else if (GiNaC::is_a<GiNaC::mul>(e)) {
    int n_factors = 0;
    for (const auto& factor : sorted(e)) {
      result.negative = result.negative != shape(factor).negative;
      if (factor.is_equal(-1)) continue;  // -x has the shape of x
      const std::uint64_t hash = shape(factor).hash;
      result.hash = n_factors++ == 0 ? hash : mix(result.hash + hash_text("*"), hash);
    }
  } else {  // a power or a function: the sign of an argument belongs to the hash, unless the power is a whole number
    result.hash = hash_text(GiNaC::is_a<GiNaC::function>(e) ? GiNaC::ex_to<GiNaC::function>(e).get_name() : "^");
    const bool is_whole = GiNaC::is_a<GiNaC::power>(e) && e.op(1).info(GiNaC::info_flags::integer);
    for (std::size_t i = 0; i < e.nops(); ++i) {
      const bool drops_sign = is_whole && i == 0;
      result.hash = mix(result.hash, shape(e.op(i)).hash + (!drops_sign && shape(e.op(i)).negative));
    }
    if (is_whole) result.negative = shape(e.op(0)).negative && e.op(1).info(GiNaC::info_flags::odd);
  }
  shapes_.emplace(e, result);
  return result;
}

}  // namespace ricochet
