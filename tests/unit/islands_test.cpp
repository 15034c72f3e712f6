#include "methods/linear_algebra/islands.h"

#include <gtest/gtest.h>

#include "methods/linear_algebra/breadth_first.h"

namespace ricochet {
namespace {

std::vector<int> members(const Islands& islands, int island) {
  const auto list = islands.members(island);
  return {list.begin(), list.end()};
}

TEST(Islands, AreNumberedByTheirLeastMembers) {
  DisjointSets sets(7);
  sets.join({{5, 1}, {6, 3}, {1, 4}});
  Islands islands;
  islands.assign(sets);
  ASSERT_EQ(islands.n(), 7);
  ASSERT_EQ(islands.count(), 4);
  EXPECT_EQ(members(islands, 0), std::vector<int>({0}));
  EXPECT_EQ(members(islands, 1), std::vector<int>({1, 4, 5}));
  EXPECT_EQ(members(islands, 2), std::vector<int>({2}));
  EXPECT_EQ(members(islands, 3), std::vector<int>({3, 6}));
  for (const auto& [k, island] : {std::pair(0, 0), {1, 1}, {2, 2}, {3, 3}, {4, 1}, {5, 1}, {6, 3}})
    EXPECT_EQ(islands.of(k), island) << k;
}

TEST(Islands, ForgetWhatTheyWere) {
  DisjointSets sets(5);
  Islands islands, one;
  islands.assign(sets);
  EXPECT_EQ(islands.count(), 5);
  sets.join_all();
  islands.assign(sets);
  EXPECT_EQ(islands.count(), 1);
  EXPECT_EQ(members(islands, 0), std::vector<int>({0, 1, 2, 3, 4}));
  one.assign(sets);
  EXPECT_TRUE(one == islands);
  sets.reset(0);
  islands.assign(sets);
  EXPECT_EQ(islands.count(), 0);
  EXPECT_FALSE(one == islands);
}

/// A tree and a pair: levels follow each other, and what is placed already stays.
TEST(BreadthFirst, GoesLevelByLevel) {
  const std::vector<std::vector<int>> neighbours{{3, 1}, {0, 5}, {4}, {0, 6}, {2}, {1}, {3}};
  std::vector<int> order(7), place(7, -1);
  const auto visit_neighbours = [&](int k, auto visit) {
    for (const int l : neighbours[k]) visit(l);
  };
  int count = append_breadth_first(0, 0, order, place, visit_neighbours);
  EXPECT_EQ(count, 5);
  count = append_breadth_first(6, count, order, place, visit_neighbours);
  EXPECT_EQ(count, 5);
  count = append_breadth_first(2, count, order, place, visit_neighbours);
  EXPECT_EQ(count, 7);
  EXPECT_EQ(order, std::vector<int>({0, 3, 1, 6, 5, 2, 4}));
  for (int k = 0; k < 7; ++k) EXPECT_EQ(order[place[k]], k);
}

}  // namespace
}  // namespace ricochet
