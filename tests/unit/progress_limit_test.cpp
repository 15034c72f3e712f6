#include "methods/progress_limit.h"

#include <gtest/gtest.h>

#include <array>

namespace ricochet {
namespace {

TEST(ProgressLimit, EndsARunThatStandsStill) {
  ProblemInfo info;
  info.end_time = 10;
  info.contacts.resize(3);
  info.contacts[0].name = "ground";
  info.contacts[1].name = "wall";
  info.contacts[2].name = "belt";
  ProgressLimit limit(info, 100, 1e-3);  // 10 ms
  EXPECT_FALSE(limit.is_passed(99, 0));
  EXPECT_FALSE(limit.is_passed(100, 0.011));
  EXPECT_FALSE(limit.is_passed(199, 0.012));
  EXPECT_TRUE(limit.is_passed(200, 0.012));
  const std::array<ContactMode, 3> closed{ContactMode::closed, ContactMode::open, ContactMode::stick};
  EXPECT_EQ(limit.message(closed),
            "100 steps move the time by 0.001 s: it is held up by contact 'ground' (closed), 'belt' (stick)");
  const std::array<ContactMode, 3> slips{ContactMode::closed, ContactMode::open, ContactMode::slip};
  EXPECT_EQ(limit.message(slips), "100 steps move the time by 0.001 s: it is held up by contact 'belt' (slip)");
  EXPECT_EQ(limit.message({}), "100 steps move the time by 0.001 s: it is held up by the smooth motion");
}

}  // namespace
}  // namespace ricochet
