#include "problems/names.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <numeric>
#include <utility>

#include "problems/input_error.h"

namespace ricochet {
namespace {

constexpr std::size_t kBegun = 3;  // letters from which on a name may be the beginning of another one

std::size_t edit_distance(const std::string& a, const std::string& b) {
  std::vector<std::size_t> row(b.size() + 1);
  std::iota(row.begin(), row.end(), std::size_t{0});
  for (std::size_t i = 1; i <= a.size(); ++i) {
    std::size_t diagonal = std::exchange(row[0], i);
    for (std::size_t j = 1; j <= b.size(); ++j) {
      const std::size_t substituted = diagonal + (a[i - 1] != b[j - 1]);
      diagonal = std::exchange(row[j], std::min({row[j] + 1, row[j - 1] + 1, substituted}));
    }
  }
  return row.back();
}

}  // namespace

void throw_unknown_name(const std::string& kind, const std::string& name, const std::vector<std::string>& known) {
  // Leading dashes of an option do not count as letters.
  const std::size_t letters = name.size() - std::min(name.find_first_not_of('-'), name.size());
  const std::size_t allowed = 1 + letters / 3;
  std::vector<std::string> near;
  for (const auto& candidate : known) {
    const bool is_begun = letters >= kBegun && candidate.starts_with(name);
    if (is_begun || edit_distance(name, candidate) <= allowed) near.push_back(candidate);
  }
  const std::string hint = near.empty() ? "" : fmt::format("; did you mean {}?", fmt::join(near, " or "));
  throw InputError(
      fmt::format("{} = '{}': unknown{} Known: {}", kind, name, hint.empty() ? "." : hint, fmt::join(known, ", ")));
}

}  // namespace ricochet
