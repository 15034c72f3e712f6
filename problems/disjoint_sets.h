#pragma once

#include <algorithm>
#include <numeric>
#include <span>
#include <utility>
#include <vector>

namespace ricochet {

/// Disjoint sets of the numbers 0, ..., n - 1, each named by its smallest member. They are the connected components of
/// a graph whose edges are joined one after the other (Galler, Fisher, CACM 7, 1964). Storage is reused.
class DisjointSets {
 public:
  DisjointSets() = default;
  explicit DisjointSets(int n) { reset(n); }

  void reserve(int n) { parent_.reserve(static_cast<std::size_t>(n)); }

  /// n sets of one member.
  void reset(int n) {
    parent_.resize(static_cast<std::size_t>(n));
    std::iota(parent_.begin(), parent_.end(), 0);
  }

  int n() const { return static_cast<int>(parent_.size()); }
  /// The name of the set of k.
  int of(int k) {
    while (parent_[k] != k) k = parent_[k] = parent_[parent_[k]];
    return k;
  }

  void join(int k, int l) {
    const int a = of(k), b = of(l);
    parent_[std::max(a, b)] = std::min(a, b);
  }
  /// The edges of a graph.
  void join(const std::vector<std::pair<int, int>>& edges) {
    for (const auto& [k, l] : edges) join(k, l);
  }
  void join(std::span<const int> members) {
    for (const int k : members) join(members.front(), k);
  }
  void join_all() { std::fill(parent_.begin(), parent_.end(), 0); }

 private:
  std::vector<int> parent_;
};

}  // namespace ricochet
