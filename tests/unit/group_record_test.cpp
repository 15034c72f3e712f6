#include "methods/contact_laws/group_record.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>

#include "problems/problem.h"
#include "tests/ground_truth/method_run.h"
#include "tests/test_data.h"

namespace ricochet {
namespace {

constexpr const char* kRecording = "fesd_adaptive:radau-iia:4";

ProblemInfo three_contacts() {
  ProblemInfo info;
  info.end_time = 2;
  info.contacts.resize(3);
  for (int i = 0; i < 3; ++i) info.contacts[static_cast<std::size_t>(i)].name = fmt::format("contact {}", i);
  return info;
}

TEST(GroupRecord, EndsARunThatOnlyRefusesAGroup) {
  const ProblemInfo info = three_contacts();
  GroupRecord record(info);
  Solution solution;
  const GroupInstant refused{.refused = {0, 2}, .rates = {-1e-3, 2.5e-4}};
  double t = 0.5;
  EXPECT_TRUE(record.add(t, refused, solution));
  for (int k = 0; k < 1000; ++k) {  // each moves the time by more than 1e-12 of the end
    t += 3e-12;
    ASSERT_TRUE(record.add(t, refused, solution)) << k;
  }
  int n = 1;
  for (; record.add(t, n % 2 == 0 ? refused : GroupInstant(), solution); ++n) ASSERT_LT(n, 1000);
  EXPECT_EQ(n, 2 * 99);  // the last of the instants that moved the time was the first of the hundred
  EXPECT_EQ(record.message(0), fmt::format("a group of contacts neither comes to rest nor parts, 100 times since t = "
                                          "{:.12g} s: 'contact 0' (-0.001 m/s), 'contact 2' (0.00025 m/s)",
                                          t));
  EXPECT_EQ(record.reason().code, FailureCode::impacts_accumulate);
  EXPECT_EQ(record.reason().contacts, (std::vector<std::string>{"contact 0", "contact 2"}));
  EXPECT_TRUE(solution.captures.empty() && solution.wedges.empty());
}

TEST(GroupRecord, KeepsCapturesAndTheFirstWedgeOfEachContact) {
  const ProblemInfo info = three_contacts();
  GroupRecord record(info);
  Solution solution;
  const GroupInstant captured{.capture = {.n_contacts = 2, .height = 1e-9, .speed = 2e-4}};
  record.add(0.25, captured, solution);
  record.add(0.5, {.wedge = {0, 1}}, solution);
  record.add(0.75, {.wedge = {0, 1}}, solution);
  record.add(1, {.wedge = {1, 2}}, solution);
  record.add(1.25, captured, solution);
  ASSERT_EQ(solution.captures.size(), 2U);
  EXPECT_EQ(solution.captures[1].t, 1.25);
  EXPECT_EQ(solution.captured_height(), 2e-9);
  EXPECT_EQ(solution.captured_speed(), 4e-4);
  ASSERT_EQ(solution.wedges.size(), 2U);
  EXPECT_EQ(solution.wedges[0].t, 0.5);
  EXPECT_EQ(solution.wedges[1].contacts, (std::vector<int>{1, 2}));
  solution.cut_groups(0.5);
  EXPECT_EQ(solution.captures.size(), 1U);
  EXPECT_EQ(solution.wedges.size(), 1U);
}

TEST(Captures, OfDiscsAreRecordedByFesdToo) {
  const auto problem = make_problem("balls_in_box", {{"n", 8.0}, {"e", 0.3}});
  const Solution solution = run_as(*problem, {kRecording, 0, 1e-8});
  ASSERT_TRUE(solution.succeeded()) << solution.message;
  ASSERT_FALSE(solution.captures.empty());
  for (const CapturedGroup& capture : solution.captures) {
    EXPECT_GE(capture.n_contacts, 2);
    EXPECT_LE(capture.height, 4e-8);  // four heights of 1e-8 of a gap that is no larger than 1 m
  }
}

/// Disc 5 falls between discs 1 and 2 and their walls, which are as far apart as the row is wide.
TEST(OpenWedge, IsRecordedOfARowAsWideAsItsBox) {
  const auto problem = make_problem("balls_in_box", {{"n", 5.0}, {"e", 0.3}, {"seed", 1.0}});
  for (const char* method : {"event_driven", kRecording}) {
    const Solution solution = run_as(*problem, {method, 0, 1e-8});
    ASSERT_TRUE(solution.succeeded()) << solution.message;
    ASSERT_FALSE(solution.wedges.empty()) << method;
    std::vector<std::string> names;
    for (const OpenWedge& wedge : solution.wedges) {
      EXPECT_GE(wedge.contacts.size(), 2U);
      for (const int i : wedge.contacts) names.push_back(problem->info().contacts[static_cast<std::size_t>(i)].name);
    }
    const auto has = [&](const char* name) { return std::ranges::count(names, name) > 0; };
    EXPECT_TRUE(has("discs 1, 5") || has("discs 2, 5")) << method;
  }
  // Two discs beside each other in a box for four.
  const auto two = make_problem("balls_in_box", {{"n", 2.0}, {"e", 0.3}});
  EXPECT_TRUE(run_as(*two, {"event_driven", 0, 1e-8}).wedges.empty());
}

}  // namespace
}  // namespace ricochet
