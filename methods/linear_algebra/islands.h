#pragma once

#include <span>
#include <vector>

#include "problems/disjoint_sets.h"

namespace ricochet {

/// The *islands* of a graph on the numbers 0, ..., n - 1, its connected components, with lists of their members: of
/// coordinates that a matrix or contacts couple, or of contacts that move the same coordinates. Islands are numbered by
/// their least members, and members ascend. Storage is kept between uses.
class Islands {
 public:
  void reserve(int n);

  /// Takes over the sets that the edges of the graph have joined.
  void assign(DisjointSets& sets);

  int n() const { return static_cast<int>(island_of_.size()); }
  int count() const { return static_cast<int>(begin_.size()) - 1; }
  int of(int k) const { return island_of_[k]; }
  std::span<const int> members(int island) const {
    return {members_.data() + begin_[island], members_.data() + begin_[island + 1]};
  }
  friend bool operator==(const Islands& a, const Islands& b) { return a.island_of_ == b.island_of_; }

 private:
  std::vector<int> island_of_, begin_{0}, members_;
};

}  // namespace ricochet
