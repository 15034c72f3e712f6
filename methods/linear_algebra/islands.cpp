#include "methods/linear_algebra/islands.h"

namespace ricochet {

void Islands::reserve(int n) {
  for (auto* list : {&island_of_, &begin_, &members_}) list->reserve(static_cast<std::size_t>(n) + 1);
}

void Islands::assign(DisjointSets& sets) {
  const int n = sets.n();
  island_of_.resize(n);
  members_.resize(n);
  begin_.assign(1, 0);
  for (int k = 0; k < n; ++k) {
    const int least = sets.of(k);
    if (least == k) {
      island_of_[k] = count();
      begin_.push_back(0);
    }
    island_of_[k] = island_of_[least];
    ++begin_[island_of_[k] + 1];
  }
  for (int island = 0; island < count(); ++island) begin_[island + 1] += begin_[island];
  // The members are placed from the last one down, each in front of those placed before; begin_[i + 1] so ends where
  // island i begins, and is moved back to where it was.
  for (int k = n - 1; k >= 0; --k) members_[--begin_[island_of_[k] + 1]] = k;
  for (int island = 0; island + 1 < count(); ++island) begin_[island + 1] = begin_[island + 2];
  if (count() > 0) begin_[count()] = n;
}

}  // namespace ricochet
