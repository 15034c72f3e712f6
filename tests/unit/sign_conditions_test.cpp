// Each sign condition is broken by an element that is made for it, and named with the time of the crossing.
#include "methods/fesd/sign_conditions.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>

#include "methods/fesd/element_gaps.h"
#include "problems/scene_file/scene_file.h"

namespace ricochet {
namespace {

constexpr double kStep = 0.3, kFriction = 0.5;
// A crossing is a quotient of sums of a few numbers of the size of 1.
constexpr double kTime = 1e-14;

/// A block in space above the ground, with two stages: at h/3 and h of radau-iia, of which the second is the right end.
class BrokenCondition : public testing::Test {
 protected:
  void SetUp() override { use("radau-iia", 0); }

  void use(const char* family, int facets) {
    tableau = make_tableau(family, 2);
    polygon = FrictionPolygon(facets);
    e.resize(problem->info(), 2);
    e.h = kStep;
    e.facets.assign(1, 0);
    const Vector q = Vector::Ones(3), v = Vector::Zero(3);
    scales.emplace(*problem);
    scales->begin_step(q.data(), v.data(), kStep, true);
    const double J_n = 1;
    scales->record_contact(0, &J_n, 1, 1);
    scales->record_force(0, 1);
    scales->record_slip(0, 1);
    set_gaps(1, 1, 1);
    set_slip({0, 0}, {0, 0}, {0, 0});
    set_forces({0, 0, 0}, {0, 0, 0});
  }

  using Pair = std::array<double, 2>;
  using Triple = std::array<double, 3>;

  void set_gaps(double left, double first, double right) {
    e.q0[2] = left;
    e.q.row(2) << first, right;
    e.q1[2] = right;
  }
  void set_slip(Pair left, Pair first, Pair right) {
    for (int d = 0; d < 2; ++d) {
      e.v0[d] = left[d];
      e.v.row(d) << first[d], right[d];
      e.v1[d] = right[d];
    }
  }
  /// lambda_n and lambda_t at a stage
  void set_forces(Triple first, Triple right) {
    e.lambda_n << first[0], right[0];
    for (int d = 0; d < 2; ++d) e.lambda_t.row(d) << first[d + 1], right[d + 1];
    e.end_lambda_n << right[0];
    e.end_lambda_t << right[1], right[2];
  }
  void close(ContactMode mode) {
    e.modes[0] = mode;
    set_gaps(0, 0, 0);
    set_forces({1, 0, 0}, {1, 0, 0});
  }

  Violation check() { return SignConditions(*problem, tableau, polygon, *scales, 0).check(e, -1); }
  void expect_past(SwitchKind kind, double time, double value) {
    const Violation violation = check();
    EXPECT_TRUE(violation.is_past(kind)) << static_cast<int>(violation.kind) << " "
                                         << properties(violation.passed).name;
    EXPECT_EQ(violation.contact, 0);
    EXPECT_NEAR(violation.time, time * kStep, kTime);
    EXPECT_NEAR(violation.value, value, kTime);
  }

  std::unique_ptr<Problem> problem =
      read_scene_text(fmt::format(R"({{"q0": [0, 0, 1], "v0": [0, 0, 0], "T": 1, "M": [[1, 0, 0], [0, 1, 0], [0, 0, 1]],
        "f": [0, 0, -9.81], "contacts": [{{"name": "ground", "gap": "q[2]", "e": 0, "mu": {},
        "Jt": [[1, 0, 0], [0, 1, 0]]}}]}})",
                                  kFriction),
                      "block in space");
  ButcherTableau tableau;
  FrictionPolygon polygon;
  std::optional<ContactScales> scales;
  Element e;
};

TEST_F(BrokenCondition, NoneWhereAllHold) {
  EXPECT_FALSE(check());
  close(ContactMode::slip);
  set_slip({1, 0}, {0.8, 0.1}, {0.6, 0.2});
  EXPECT_FALSE(check());
  close(ContactMode::stick);
  set_forces({1, 0.3, 0.4}, {1, -0.4, 0.3});
  EXPECT_FALSE(check()) << "on the border of the cone";
}

TEST_F(BrokenCondition, GapThatIsNegative) {
  set_gaps(1, 0.5, -0.5);
  expect_past(SwitchKind::gap_closes, 2.0 / 3, -0.5);
  set_gaps(1, -1, -2);
  expect_past(SwitchKind::gap_closes, 1.0 / 6, -1);
}

TEST_F(BrokenCondition, ForceThatPulls) {
  close(ContactMode::stick);
  set_forces({3, 0, 0}, {-1, 0, 0});
  const Violation violation = check();
  EXPECT_TRUE(violation.is_past(SwitchKind::force_vanishes) || violation.is_past(SwitchKind::cone_reached))
      << "both vanish at once";
  EXPECT_NEAR(violation.time, (1.0 / 3 + 2.0 / 3 * 3 / 4) * kStep, kTime);
  e.modes[0] = ContactMode::slip;
  set_slip({1, 0}, {1, 0}, {1, 0});
  expect_past(SwitchKind::force_vanishes, 5.0 / 6, -1);
}

TEST_F(BrokenCondition, ForceOutsideOfItsCone) {
  close(ContactMode::stick);
  set_forces({2, 0.5, 0}, {2, 0, -1.5});
  expect_past(SwitchKind::cone_reached, 2.0 / 3, -0.5);
}

TEST_F(BrokenCondition, SlipThatTurnsBack) {
  close(ContactMode::slip);
  set_slip({1, 0}, {0, 1}, {0, -1});
  expect_past(SwitchKind::slip_stops, 2.0 / 3, -1);
}

TEST_F(BrokenCondition, SlipPastAnEdgeOfItsPolygon) {
  use("radau-iia", 4);
  close(ContactMode::vertex_slip);
  const auto d = polygon.vertex(0), next = polygon.vertex(1);
  set_forces({1, kFriction * d[0], kFriction * d[1]}, {1, kFriction * d[0], kFriction * d[1]});
  set_slip({-d[0], -d[1]}, {-d[0], -d[1]}, {-next[0], -next[1]});
  const Violation violation = check();
  EXPECT_TRUE(violation.is_past(SwitchKind::slip_turns));
  EXPECT_NEAR(violation.time, 2.0 / 3 * kStep, kTime) << "half way between the vertices";
  EXPECT_EQ(polygon.condition(ContactMode::vertex_slip, 0, violation.facet_condition).facet, 0)
      << "edge 0 lies between vertices 0 and 1";
}

TEST_F(BrokenCondition, ForceBeyondItsEdge) {
  use("radau-iia", 4);
  close(ContactMode::edge_slip);
  const auto n = polygon.normal(0), along = polygon.edge(0);
  const double distance = kFriction * std::sqrt(0.5), half = distance;  // of the edge of a square
  const auto force = [&](double x) {
    return Triple{1, distance * n[0] + x * along[0], distance * n[1] + x * along[1]};
  };
  set_forces(force(0), force(3 * half));
  set_slip({-n[0], -n[1]}, {-n[0], -n[1]}, {-n[0], -n[1]});
  expect_past(SwitchKind::edge_left, 1.0 / 3 + 2.0 / 3 / 3, -2 * half);
  set_forces(force(0), force(0));
  set_slip({-n[0], -n[1]}, {-n[0], -n[1]}, {n[0], n[1]});
  expect_past(SwitchKind::slip_stops, 2.0 / 3, -1);
}

TEST_F(BrokenCondition, DriftAtARightEndThatIsNoStage) {
  use("gauss", 2);
  close(ContactMode::stick);
  e.q1[2] = 1e-3;
  Violation violation = check();
  EXPECT_EQ(violation.kind, Violation::Kind::drift);
  EXPECT_EQ(violation.time, kStep);
  EXPECT_EQ(violation.value, 1e-3);
  e.q1[2] = 0;
  e.v1[1] = 1e-3;
  violation = check();
  EXPECT_EQ(violation.kind, Violation::Kind::drift) << "it creeps";
  EXPECT_EQ(violation.value, 1e-3);
}

/// A gap as a function of s = t/h that is positive at the stages 1/3 and 1, and its rate by s.
template <class Gap, class Rate>
void set_gap(Element& e, const Gap& gap, const Rate& rate) {
  e.q0[2] = gap(0);
  e.q.row(2) << gap(1.0 / 3), gap(1);
  e.q1[2] = gap(1);
  e.v0[2] = rate(0) / kStep;
  e.v.row(2) << rate(1.0 / 3) / kStep, rate(1) / kStep;
  e.v1[2] = rate(1) / kStep;
}

TEST_F(BrokenCondition, GapThatDipsBetweenTheStages) {
  ElementGaps gaps(*problem, tableau, *scales);
  // (s - 0.6) (s - 0.75) (s + 1), which the cubic through the stages is.
  const auto gap = [](double s) { return (s - 0.6) * (s - 0.75) * (s + 1); };
  set_gap(e, gap, [](double s) { return (2 * s - 1.35) * (s + 1) + (s - 0.6) * (s - 0.75); });
  EXPECT_FALSE(check()) << "at the stages there is nothing to see";
  const Violation violation = gaps.check(e);
  EXPECT_TRUE(violation.is_past(SwitchKind::gap_closes));
  EXPECT_EQ(violation.contact, 0);
  EXPECT_NEAR(violation.time, 0.6 * kStep, 1e-13)
      << "a root of a cubic whose terms are a hundred times its slope there";
  EXPECT_LT(violation.value, 0);
  // Its derivative 3 s^2 - 0.7 s - 0.9 vanishes there.
  EXPECT_GE(violation.value, gap((0.7 + std::sqrt(0.49 + 10.8)) / 6) - kTime) << "no lower than the minimum";
  e.modes[0] = ContactMode::slip;
  EXPECT_FALSE(gaps.check(e)) << "a closed contact has no gap";
}

TEST_F(BrokenCondition, ParabolaThatDipsBetweenTheStages) {
  ElementGaps gaps(*problem, tableau, *scales);
  for (const double depth : {-0.01, 0.04}) {
    const auto parabola = [&](double s) { return 9 * (s - 2.0 / 3) * (s - 2.0 / 3) - depth; };
    set_gap(e, parabola, [](double s) { return 18 * (s - 2.0 / 3); });
    const Violation violation = gaps.check(e);
    EXPECT_EQ(violation.is_past(SwitchKind::gap_closes), depth > 0);
    if (depth < 0) continue;
    EXPECT_LT(violation.value, 0);
    EXPECT_GE(violation.value, -depth - kTime);
    EXPECT_NEAR(violation.time, (2 - std::sqrt(depth)) * kStep / 3, 1e-8 * kStep) << "1e-9 of a piece, at most 1/2";
  }
}

}  // namespace
}  // namespace ricochet
