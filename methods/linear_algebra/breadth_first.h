#pragma once

#include <vector>

namespace ricochet {

/// Appends to an order what the edges of a graph reach from one of its members, breadth first: level after level, so
/// that members that are coupled stand close to each other (Cuthill, McKee 1969).
///
/// @param first  may be placed already: then nothing happens
/// @param count  of the members in `order`
/// @param place  per member: where it stands in `order`, or -1
/// @param visit_neighbours(k, visit)  calls visit(l) for every neighbour l of k
/// @return the members in `order` afterwards
template <class VisitNeighbours>
int append_breadth_first(int first, int count, std::vector<int>& order, std::vector<int>& place,
                         VisitNeighbours visit_neighbours) {
  const auto visit = [&](int k) {
    if (place[k] >= 0) return;
    place[k] = count;
    order[count++] = k;
  };
  int next = count;
  visit(first);
  for (; next < count; ++next) visit_neighbours(order[next], visit);
  return count;
}

}  // namespace ricochet
