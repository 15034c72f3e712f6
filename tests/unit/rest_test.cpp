// Bodies at rest stay there in every time-stepping method, whatever their restitution is, in any unit of length, and
// whatever else moves.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include "methods/registry.h"
#include "problems/scene_file/scene_file.h"
#include "tests/test_data.h"

namespace ricochet {
namespace {

constexpr int kSteps = 10000;

/// A block on a block on the ground: both slide, soon stick, and rest from then on. Zero heights, so that no coordinate
/// of the lower one gives its gap a size. @param unit  how many of them are 1 m
std::unique_ptr<Problem> two_blocks(double e, double unit, bool has_fast_body) {
  const auto number = [&](double x) { return fmt::format("{:.17g}", x * unit); };
  std::string q0 = fmt::format("{}, 0, {}, {}", number(0.5426), number(0.6), number(0.1)),
              v0 = fmt::format("{}, 0, {}, 0", number(-0.3196), number(-0.4634)),
              f = fmt::format(R"(0, "-2.0353*{0}", 0, "-0.4491*{0}")", number(9.81)),
              M = "[2.0353, 0, 0, 0{0}], [0, 2.0353, 0, 0{0}], [0, 0, 0.4491, 0{0}], [0, 0, 0, 0.4491{0}]",
              tangent = "0", contacts;
  contacts = fmt::format(
      R"({{"name": "ground", "gap": "q[1]", "e": {0}, "mu": 0.31, "Jt": [[1, 0, 0, 0{2}]]}},
         {{"name": "top", "gap": "q[3] - q[1] - {1}", "e": {0}, "mu": 0.27, "Jt": [[-1, 0, 1, 0{2}]]}})",
      e, number(0.1), has_fast_body ? ", 0" : "");
  std::string rows = fmt::format(fmt::runtime(M), has_fast_body ? ", 0" : "");
  if (has_fast_body) {  // a ball that bounces between two walls at 300 m/s
    q0 += ", 0.3";
    v0 += ", 300";
    f += ", 0";
    rows += ", [0, 0, 0, 0, 1]";
    contacts += R"(, {"name": "left", "gap": "q[4]", "e": 1}, {"name": "right", "gap": "1 - q[4]", "e": 1})";
  }
  return read_scene_text(
      fmt::format(R"({{"q0": [{}], "v0": [{}], "T": 0.4741, "M": [{}], "f": [{}], "contacts": [{}]}})", q0, v0, rows, f,
                  contacts),
      "two blocks");
}

Solution run_at_rest(const Problem& problem, const std::string& method) {
  Settings settings;
  settings.steps = kSteps;
  Solution s = make_method(method)->solve(problem, settings);
  EXPECT_TRUE(s.succeeded()) << method << ": " << s.message;
  return s;
}

class Rest : public testing::TestWithParam<const char*> {
 protected:
  std::string method = GetParam();
  bool iterates = method.find("solver=") != std::string::npos;
  /// Of lengths of 1 m, through 10000 steps; or a tolerance of 1e-9 of the largest velocity, slip at 0.46 m/s, for as
  /// long as the run lasts.
  double rounding = iterates ? 1e-9 * 0.4634 * 0.4741 : 1e-13;
};

TEST_P(Rest, LastsForTenThousandSteps) {
  for (const double e : {0.0, 0.5, 1.0}) {
    const auto problem = two_blocks(e, 1, false);
    if (!make_method(method)->can_run(problem->info()).ok) continue;
    const Solution s = run_at_rest(*problem, method);
    EXPECT_EQ(s.events.size(), 2u) << "each contact is pressed once, e = " << e;
    EXPECT_LE(problem->gap(s.q).cwiseAbs().maxCoeff(), rounding) << "e = " << e;
    EXPECT_LE(s.v.cwiseAbs().maxCoeff(), 10 * rounding) << "e = " << e;
  }
}

TEST_P(Rest, DoesNotDependOnTheUnitOfLength) {
  const auto metres = two_blocks(0.5, 1, false), micrometres = two_blocks(0.5, 1e6, false);
  if (!make_method(method)->can_run(metres->info()).ok) GTEST_SKIP() << "no restitution";
  const Solution in_m = run_at_rest(*metres, method), in_um = run_at_rest(*micrometres, method);
  EXPECT_LE((in_um.q * 1e-6 - in_m.q).cwiseAbs().maxCoeff(), 2 * rounding);
  EXPECT_EQ(in_um.events.size(), in_m.events.size());
}

TEST_P(Rest, DoesNotDependOnAnUnrelatedFastBody) {
  const auto alone = two_blocks(0.5, 1, false), beside = two_blocks(0.5, 1, true);
  if (!make_method(method)->can_run(beside->info()).ok) GTEST_SKIP() << "no restitution";
  const Solution one = run_at_rest(*alone, method), other = run_at_rest(*beside, method);
  // What iterates has a tolerance relative to the largest velocity in a contact problem, 600 m/s in an impact.
  EXPECT_LE((other.q.head(4) - one.q).cwiseAbs().maxCoeff(), iterates ? 1e-9 * 600 * 0.4741 : rounding);
}

INSTANTIATE_TEST_SUITE_P(Methods, Rest,
                         testing::Values("moreau_jean", "moreau_jean,theta=1", "moreau_jean,implicit=full",
                                         "moreau_jean,projection=on", "moreau_jean,solver=pgs",
                                         "moreau_jean,solver=newton", "moreau_jean,solver=interior_point",
                                         "moreau_jean,solver=exact", "moreau_jean,solver=admm",
                                         "moreau_jean,solver=staggered", "anitescu_potra",
                                         "anitescu_potra,implicit=linear", "schatzman_paoli", "stewart_trinkle",
                                         "generalized_alpha"),
                         [](const auto& test) { return test_name(test.param); });

}  // namespace
}  // namespace ricochet
