// Proven motions with infinitely many impacts of a contact with friction.
#include <arb.h>
#include <fmt/format.h>
#include <gtest/gtest.h>

#include "problems/registry.h"
#include "problems/scene_file/scene_file.h"
#include "reference/certified/ball.h"
#include "reference/certified/certified_motion.h"

namespace ricochet::reference::certified {
namespace {

bool contains(const CertifiedNumber& number, const char* value) {
  constexpr slong kBits = 400;
  Ball ball, exact;
  arb_set_str(ball.get(), number.text.c_str(), kBits);
  arb_set_str(exact.get(), value, kBits);
  Magnitude radius;
  mag_set_d(radius.get(), number.radius);
  ball.widen(radius.get());
  return arb_overlaps(ball.get(), exact.get()) != 0;
}

/// A point mass with e = 1/2 that falls for 0.4 s and bounces until 1.2 s, in space or, without `v_y`, in the plane.
CertifiedMotion bounces(const std::string& v_x, const std::string& f_x, const std::string& mu, const std::string& v_y,
                        const std::string& f_y, int digits) {
  Options options;
  options.digits = digits;
  const bool in_space = !v_y.empty();
  const std::string scene =
      in_space ? fmt::format(R"({{"q0": ["0", "0", "0.7848"], "v0": ["{}", "{}", "0"], "T": "1.4",
                "M": [["1", "0", "0"], ["0", "1", "0"], ["0", "0", "1"]], "f": ["{}", "{}", "-9.81"],
                "contacts": [{{"name": "floor", "gap": "q[2]", "mu": "{}", "e": "0.5",
                               "Jt": [["1", "0", "0"], ["0", "1", "0"]]}}]}})",
                             v_x, v_y, f_x, f_y, mu)
               : fmt::format(R"({{"q0": ["0", "0.7848"], "v0": ["{}", "0"], "T": "1.4", "M": [["1", "0"], ["0", "1"]],
                "f": ["{}", "-9.81"],
                "contacts": [{{"name": "floor", "gap": "q[1]", "mu": "{}", "e": "0.5", "Jt": [["1", "0"]]}}]}})",
                             v_x, f_x, mu);
  return certified_motion(*read_scene_text(scene, "scene"), options);
}

/// Each flight of length tau moves the mass by F tau^2 / 2, each impact sticks: 7 F h / (3 g) together.
TEST(CertifiedAccumulation, ImpactsThatStickHaveTheirClosedForm) {
  for (const int digits : {4, 12, 30}) {
    const auto plane = bounces("0", "3", "0.5", "", "", digits);
    ASSERT_EQ(plane.grade, Grade::proven) << plane.reason;
    EXPECT_TRUE(contains(plane.q[0], "0.56")) << plane.q[0].text;
    const auto space = bounces("0", "1.8", "0.5", "0", "-2.4", digits);
    ASSERT_EQ(space.grade, Grade::proven) << space.reason;
    EXPECT_TRUE(contains(space.q[0], "0.336")) << space.q[0].text;
    EXPECT_TRUE(contains(space.q[1], "-0.448")) << space.q[1].text;
    for (const CertifiedMotion* motion : {&plane, &space}) {
      EXPECT_GE(motion->decimals(), digits);
      EXPECT_EQ(motion->events.back().kind, "zeno_end");
      EXPECT_EQ(motion->modes, std::vector<std::string>{"stick"});
      for (const auto& v : motion->v) EXPECT_TRUE(contains(v, "0"));
    }
  }
}

/// Friction takes mu g T from the speed 9, in the direction (0.6, -0.8).
TEST(CertifiedAccumulation, ImpactsThatSlipInSpaceHaveTheirClosedForm) {
  for (const int digits : {4, 12, 30}) {
    const auto motion = bounces("5.4", "0", "0.1", "-7.2", "0", digits);
    ASSERT_EQ(motion.grade, Grade::proven) << motion.reason;
    EXPECT_EQ(motion.events.back().kind, "zeno_end");
    EXPECT_EQ(motion.modes, std::vector<std::string>{"slip"});
    EXPECT_TRUE(contains(motion.v[0], "4.57596")) << motion.v[0].text;  // 0.6 (9 - 0.981 T)
    EXPECT_TRUE(contains(motion.v[1], "-6.10128")) << motion.v[1].text;
  }
}

/// F > mu g (1 + e) / 2: a flight gains more speed than friction takes. A closed contact would brake, F < mu g.
/// After the first impact, which sticks, the flights last 0.8 s and bring 0.8 F - 0.4 g mu (1 + e) = 0.257.
TEST(CertifiedAccumulation, ImpactsThatCannotStickHaveTheirClosedForm) {
  const auto plane = bounces("0", "4", "0.5", "", "", 12);
  ASSERT_EQ(plane.grade, Grade::proven) << plane.reason;
  EXPECT_EQ(plane.modes, std::vector<std::string>{"slip+"});
  EXPECT_TRUE(contains(plane.v[0], "0.076")) << plane.v[0].text;  // 0.257 - 0.2 (mu g - F)
  const auto space = bounces("0", "2.4", "0.5", "0", "3.2", 12);
  ASSERT_EQ(space.grade, Grade::proven) << space.reason;
  EXPECT_EQ(space.modes, std::vector<std::string>{"slip"});
  EXPECT_TRUE(contains(space.v[0], "0.0456")) << space.v[0].text;
  EXPECT_TRUE(contains(space.v[1], "0.0608")) << space.v[1].text;
}

/// The law allows sticking and slip of the same flights at F = mu g (1 + e) / 2.
TEST(CertifiedAccumulation, ImpactsOnTheConeAreOpen) {
  for (const char* v_y : {"", "0"}) {
    const auto motion = bounces("0", "3.67875", "0.5", v_y, "0", 12);
    EXPECT_EQ(motion.grade, Grade::open);
    EXPECT_FALSE(motion.reason.empty());
    EXPECT_TRUE(motion.q.empty());
  }
}

/// The ball rolls at the end, with (5 v + 2 R omega) / 7.
TEST(CertifiedAccumulation, ThrownBallEndsRolling) {
  const auto motion = certified_motion(*make_problem("ball_3d"));
  ASSERT_EQ(motion.grade, Grade::proven) << motion.reason;
  EXPECT_GE(motion.decimals(), 30);
  EXPECT_EQ(motion.events.back().kind, "zeno_end");
  EXPECT_TRUE(motion.v[0].text.starts_with("0.928571428571428571428571428571")) << motion.v[0].text;   // 13/14
  EXPECT_TRUE(motion.v[1].text.starts_with("-0.214285714285714285714285714285")) << motion.v[1].text;  // -3/14
}

}  // namespace
}  // namespace ricochet::reference::certified
