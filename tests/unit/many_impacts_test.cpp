#include <gtest/gtest.h>

#include "methods/registry.h"
#include "tests/test_data.h"

namespace ricochet {
namespace {

Solution solve(const Problem& problem, const std::string& method, int steps) {
  Settings settings;
  settings.steps = steps;
  return make_method(method)->solve(problem, settings);
}

struct DiscsCase {
  const char* name;
  double n, duration;
};

/// Discs that fall into a box without friction: impacts that follow each other ever faster.
class DiscsInABox : public testing::TestWithParam<DiscsCase> {
 protected:
  std::unique_ptr<Problem> box_ =
      make_problem("balls_in_box", {{"n", GetParam().n}, {"duration", GetParam().duration}});
};

/// A step of another length cuts the elements elsewhere, but has the same impacts.
TEST_P(DiscsInABox, FindTheSameImpactsWithOtherSteps) {
  const std::string method = "fesd:radau-iia:3,elements=as_needed";
  const Solution coarse = solve(*box_, method, 100), fine = solve(*box_, method, 250);
  ASSERT_TRUE(coarse.succeeded()) << coarse.message;
  ASSERT_TRUE(fine.succeeded()) << fine.message;
  // Of order 5; seen 2.4e-10 m and 7.0e-9 m/s, and four times that for other compilers.
  EXPECT_LT((coarse.q - fine.q).lpNorm<Eigen::Infinity>(), 1e-9);
  EXPECT_LT((coarse.v - fine.v).lpNorm<Eigen::Infinity>(), 3e-8);
}

/// And time stepping approaches them, with order 1: a quarter of the step leaves less than half of the difference.
TEST_P(DiscsInABox, AreWhatTimeSteppingApproaches) {
  const Solution exact = solve(*box_, "fesd:radau-iia:3,elements=as_needed", 100);
  ASSERT_TRUE(exact.succeeded()) << exact.message;
  const auto difference = [&](int steps) {
    const Solution stepped = solve(*box_, "moreau_jean", steps);
    EXPECT_TRUE(stepped.succeeded()) << stepped.message;
    return (exact.q - stepped.q).lpNorm<Eigen::Infinity>();
  };
  const double coarse = difference(5000), fine = difference(20000);
  EXPECT_LT(coarse, 0.02);  // radii are 0.05; seen 4.6e-3
  EXPECT_LT(fine, coarse / 2);
}

// wedge: a disc falls between two and strikes them in turn, at times that accumulate. jump: an impact takes a contact
// away that had pressed others together. tower: two discs bounce against each other in turn, and against the one above.
INSTANTIATE_TEST_SUITE_P(Impacts, DiscsInABox,
                         testing::Values(DiscsCase{"wedge", 5, 0.2}, DiscsCase{"jump", 7, 0.5},
                                         DiscsCase{"tower", 12, 0.2}),
                         [](const auto& test) { return test.param.name; });

}  // namespace
}  // namespace ricochet
