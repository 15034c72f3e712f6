#pragma once

#include <algorithm>
#include <string>
#include <utility>
#include <vector>

/// @file
/// Names of the values of an option.

namespace ricochet {

/// The names of the values of an option, the default first.
template <class Value>
using Names = std::vector<std::pair<std::string, Value>>;

/// Only the names, in the order of `names`.
template <class Value>
std::vector<std::string> list(const Names<Value>& names) {
  std::vector<std::string> all;
  for (const auto& [name, value] : names) all.push_back(name);
  return all;
}

/// The value of `name` in `names`; null for an unknown one.
template <class Value>
const Value* find(const Names<Value>& names, const std::string& name) {
  const auto found = std::ranges::find(names, name, &std::pair<std::string, Value>::first);
  return found == names.end() ? nullptr : &found->second;
}

}  // namespace ricochet
