// The rule by which an instant leaves contacts closed, and sliding or not: two blocks side by side on the ground.
#include "methods/contact_laws/contacts_after_impact.h"

#include <gtest/gtest.h>

#include "problems/scene_file/scene_file.h"

namespace ricochet {
namespace {

class ContactsAfterImpact : public testing::Test {
 protected:
  ContactsAfterImpact() {
    scales.begin_step(problem->info().q0.data(), v.data(), 0.1, true);
    for (const int i : touching) {  // velocities of some m/s: 1e-12 of them is rounding
      scales.record_approach(i, 1);
      scales.record_slip(i, 1);
    }
    EXPECT_TRUE(law.prepare(problem->info().q0, touching));
  }

  /// The contacts after an instant from `v_minus` to `v`.
  std::vector<ContactAfterImpact> contacts(const Vector& v_minus, SwitchKind cause = SwitchKind::gap_closes,
                                           int switched = -1, bool is_impact = true) {
    std::vector<ContactAfterImpact> list;
    contacts_after_impact(law, scales, touching,
                          {has_modes ? &modes : nullptr, v_minus, v, is_impact, cause, switched, force, stopped}, list);
    return list;
  }

  const std::unique_ptr<Problem> problem = read_scene_text(
      R"({"q0": [0, 0, 1, 0], "v0": [0, 0, 0, 0], "T": 1,
          "M": [[2, 0, 0, 0], [0, 2, 0, 0], [0, 0, 3, 0], [0, 0, 0, 3]], "f": [0, -20, 0, -30],
          "contacts": [{"name": "left", "gap": "q[1]", "e": 0, "mu": 0.3, "Jt": [[1, 0, 0, 0]]},
                       {"name": "right", "gap": "q[3]", "e": 0, "mu": 0.3, "Jt": [[0, 0, 1, 0]]}]})",
      "blocks");
  Counters counters;
  ContactScales scales{*problem};
  ImpactSolver law{*problem, FrictionPolygon(), scales, counters};
  const std::vector<int> touching{0, 1};
  std::vector<ContactMode> modes{ContactMode::stick, ContactMode::stick};
  bool has_modes = true;
  Vector v = Vector::Zero(4);
  const double force[1]{-4};
  std::vector<int> stopped;
};

TEST_F(ContactsAfterImpact, OnlyBodiesThatAnImpactMovesAreStruck) {
  v << 0.5, 0, 0, 0;
  const Vector v_minus = Vector::Zero(4);
  const auto list = contacts(v_minus);
  ASSERT_EQ(list.size(), 2u);
  EXPECT_TRUE(list[0].is_struck);
  EXPECT_FALSE(list[0].rests);
  EXPECT_TRUE(list[0].closed.slides) << "it stuck, but an impact has set it going";
  EXPECT_EQ(list[0].closed.direction[0], 1);
  EXPECT_FALSE(list[1].is_struck);
  EXPECT_TRUE(list[1].rests);
  EXPECT_FALSE(list[1].closed.slides);
  EXPECT_FALSE(contacts(v_minus, SwitchKind::gap_closes, -1, false)[0].is_struck) << "without an impact";
}

TEST_F(ContactsAfterImpact, AContactThatWasOpenSlidesByItsVelocity) {
  modes = {ContactMode::open, ContactMode::open};
  v << -0.2, 0, 1e-14, 0.1;
  const auto list = contacts(v);
  EXPECT_TRUE(list[0].closed.slides);
  EXPECT_EQ(list[0].closed.direction[0], -1);
  EXPECT_FALSE(list[1].closed.slides) << "rounding";
  EXPECT_FALSE(list[0].rests);
  EXPECT_FALSE(list[0].separates);
  EXPECT_TRUE(list[1].separates);
  has_modes = false;  // at the start of a run
  EXPECT_TRUE(contacts(v)[0].closed.slides);
}

TEST_F(ContactsAfterImpact, SlipBeginsAgainstTheForceThatReachedItsCone) {
  const auto list = contacts(v, SwitchKind::cone_reached, 0);
  EXPECT_TRUE(list[0].closed.slides);
  EXPECT_EQ(list[0].closed.direction[0], 1);
  EXPECT_FALSE(list[1].closed.slides);
}

TEST_F(ContactsAfterImpact, SlipThatStopsDoesNotSlide) {
  modes = {ContactMode::slip_positive, ContactMode::slip_positive};
  v << 0.1, 0, 0.1, 0;
  EXPECT_FALSE(contacts(v, SwitchKind::slip_stops, 0)[0].closed.slides);
  EXPECT_TRUE(contacts(v, SwitchKind::slip_stops, 0)[1].closed.slides);
  stopped = {1};
  EXPECT_FALSE(contacts(v, SwitchKind::slip_stops, 0)[1].closed.slides) << "together with the other";
}

TEST_F(ContactsAfterImpact, AContactWhoseForceVanishesIsLeftOut) {
  const auto list = contacts(v, SwitchKind::force_vanishes, 0);
  ASSERT_EQ(list.size(), 1u);
  EXPECT_EQ(list[0].closed.contact, 1);
}

}  // namespace
}  // namespace ricochet
