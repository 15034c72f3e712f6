// The option capture_height, and what captures remove with smaller and smaller heights.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "problems/input_error.h"
#include "problems/problem.h"
#include "problems/scene_file/scene_file.h"
#include "tests/ground_truth/method_run.h"
#include "tests/test_data.h"

namespace ricochet {
namespace {

constexpr const char* kCapturing = "fesd_adaptive:radau-iia:4";

std::string rejection(const Problem& problem, const std::string& method) {
  try {
    run_as(problem, {method.c_str(), 0, 1e-8});
  } catch (const InputError& error) {
    return error.what();
  }
  return "accepted";
}

struct Settled {
  const char* method;
  int n;
  double e;
};

class CapturesOfDiscs : public testing::TestWithParam<Settled> {};

/// A quarter of the height removes less than half. With e = 0.8 impacts multiply what a capture has changed, so that
/// other groups come to rest: the sum halves in the mean of three quarters.
TEST_P(CapturesOfDiscs, RemoveLessWhereTheHeightIsLess) {
  const auto& [method, n, e] = GetParam();
  const auto problem = make_problem("balls_in_box", {{"n", static_cast<double>(n)}, {"e", e}});
  std::vector<double> sums;
  for (const double height : {4e-7, 1e-7, 2.5e-8, 6.25e-9}) {
    const Solution solution = run_as(*problem, {fmt::format("{},capture_height={}", method, height).c_str(), 0, 1e-9});
    ASSERT_TRUE(solution.succeeded()) << solution.message;
    double t = 0;
    for (const CapturedGroup& capture : solution.captures) {
      EXPECT_GE(capture.t, t);
      t = capture.t;
      EXPECT_GE(capture.n_contacts, 2);
      EXPECT_LE(capture.height, 4 * height);  // of bounces one height, of gaps that have sunk up to four
      EXPECT_GT(capture.speed + capture.height, 0);
    }
    EXPECT_LE(t, problem->info().end_time);
    sums.push_back(solution.captured_height());
  }
  EXPECT_GT(sums.back(), 0);
  EXPECT_LE(sums[3], sums[0] / 8);
  for (std::size_t k = 1; k < sums.size() && e < 0.5; ++k) EXPECT_LE(sums[k], 0.5 * sums[k - 1]) << k;
}

INSTANTIATE_TEST_SUITE_P(Counts, CapturesOfDiscs,
                         testing::Values(Settled{"event_driven", 5, 0.3}, Settled{"event_driven", 5, 0.8},
                                         Settled{"event_driven", 12, 0.3}),
                         [](const auto& info) {
                           return fmt::format("{}WithE{:.0f}", info.param.n, 100 * info.param.e);
                         });

TEST(CaptureHeight, IsRejectedOutsideItsRange) {
  const auto discs = make_problem("balls_in_box", {{"n", 5.0}});
  for (const std::string method : {"event_driven", kCapturing}) {
    for (const char* height : {"0", "-1e-9", "nan"}) {
      const std::string why = rejection(*discs, method + ",capture_height=" + height);
      EXPECT_NE(
          why.find(fmt::format("capture_height = {}: a height above 0 m and up to a tenth of the smallest radius is "
                               "required",
                               height)),
          std::string::npos)
          << why;
    }
    EXPECT_EQ(
        rejection(*discs, method + ",capture_height=0.0051"),
        "capture_height = 0.0051: a height above 0 m and up to 0.005 m, a tenth of the smallest radius, is required");
  }
  EXPECT_NE(rejection(*discs, "fesd:radau-iia:3,capture_height=1e-9").find("capture_height"), std::string::npos);
}

TEST(CaptureHeight, OfASceneWithoutRadiiIsBoundedByItsGaps) {
  // |q| + H |v| + H^2 |w| = 1 + 0.2 * 3 + 0.04 * 10 = 2 m, and twice that of the other.
  const auto problem = read_scene_text(R"({"q0": ["1", "2"], "v0": ["3", "6"], "T": "2", "M": [["1", "0"], ["0", "1"]],
      "f": ["-10", "-20"], "contacts": [{"name": "floor", "gap": "q[0]", "e": "0"}, {"name": "ground", "gap": "q[1]", "e": "0"}]})",
                                       "scene");
  EXPECT_EQ(rejection(*problem, "event_driven,capture_height=0.19"), "accepted");
  EXPECT_EQ(
      rejection(*problem, "event_driven,capture_height=0.21"),
      "capture_height = 0.21: a height above 0 m and up to 0.2 m, a tenth of the smallest size of a gap, is required");
}

TEST(CaptureHeight, ChangesNothingOfASingleContact) {
  const auto problem = make_problem("bouncing_ball", {});
  const Solution with = run_as(*problem, {"event_driven,capture_height=1e-9", 0, 1e-8}),
                 without = run_as(*problem, {"event_driven", 0, 1e-8});
  ASSERT_TRUE(with.succeeded() && without.succeeded());
  EXPECT_EQ(with.q, without.q);
  EXPECT_EQ(with.v, without.v);
  EXPECT_TRUE(with.captures.empty());
}

}  // namespace
}  // namespace ricochet
