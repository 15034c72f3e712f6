#include <gtest/gtest.h>

#include "methods/registry.h"
#include "problems/scene_file/scene_file.h"
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

/// Elastic balls that fill the room between two walls: impacts without an end, in which no energy is lost. Beside them a
/// plastic ball comes to rest at the same instant.
TEST(ElasticRoom, NeverComesToRest) {
  for (const char* scene : {"elastic_room", "elastic_room_beside_a_ball"}) {
    const auto row = read_scene_file(test_data("elastic_room.json#" + std::string(scene)));
    Settings settings;
    settings.tolerance = 1e-8;
    settings.steps = 100;
    for (const char* method : {"event_driven", "event_driven:radau-iia:5", "fesd_adaptive:radau-iia:4",
                               "fesd_adaptive:gauss:4", "fesd:radau-iia:3"})
      EXPECT_FALSE(make_method(method)->solve(*row, settings).succeeded()) << scene << ", " << method;
    const std::string message = make_method("event_driven")->solve(*row, settings).message;
    EXPECT_NE(message.find("impacts accumulate, 10000 of them at this instant"), std::string::npos) << message;
  }
}

class SeveralContacts : public testing::TestWithParam<const char*> {};

/// Impacts of two and of three contacts accumulate, at distances down to a 1e-10 of the steps before them. Methods that
/// pass them by different rules agree on what follows.
TEST_P(SeveralContacts, AccumulateToOneMotion) {
  const auto problem = read_scene_file(test_data(GetParam()));
  Settings settings;
  settings.tolerance = 1e-10;
  const Solution fesd = make_method("fesd_adaptive:radau-iia:4")->solve(*problem, settings);
  ASSERT_TRUE(fesd.succeeded()) << fesd.message;
  for (const char* method : {"fesd_adaptive:radau-iia:3", "fesd_adaptive:gauss:4", "event_driven:prince-dormand-8-7",
                             "event_driven:dopri5", "event_driven:radau-iia:5"}) {
    const Solution other = make_method(method)->solve(*problem, settings);
    ASSERT_TRUE(other.succeeded()) << other.message;
    // FESD-J ends an accumulation by an error of a tolerance, and later impacts multiply it by 1e2; seen 3e-8.
    EXPECT_LE((other.q - fesd.q).lpNorm<Eigen::Infinity>(), 1e-7) << method;
  }
}

INSTANTIATE_TEST_SUITE_P(Scenes, SeveralContacts, testing::Values("discs_in_a_corner.json", "balls_with_springs.json"),
                         [](const auto& test) { return std::string(test.param).substr(0, 5); });

}  // namespace
}  // namespace ricochet
