#pragma once

#include <string>
#include <vector>

/// @file
/// Rejection of an unknown name, with close matches.

namespace ricochet {

/// Rejects a `name` that is not among the `known` names of this `kind`, "method" or "parameter of bouncing_ball".
/// @throws InputError with the unknown name, close matches (few letters differ, or they begin with it) and all known
/// names
[[noreturn]] void throw_unknown_name(const std::string& kind, const std::string& name,
                                     const std::vector<std::string>& known);

/// The keys of a `map` from names, in its order: what throw_unknown_name() takes as known.
template <class Map>
std::vector<std::string> keys_of(const Map& map) {
  std::vector<std::string> keys;
  for (const auto& [key, value] : map) keys.push_back(key);
  return keys;
}

}  // namespace ricochet
