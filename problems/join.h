#pragma once

#include <initializer_list>
#include <vector>

namespace ricochet {

/// The lists one after the other.
template <class T>
std::vector<T> join(std::initializer_list<std::vector<T>> lists) {
  std::vector<T> all;
  for (const auto& list : lists) all.insert(all.end(), list.begin(), list.end());
  return all;
}

}  // namespace ricochet
