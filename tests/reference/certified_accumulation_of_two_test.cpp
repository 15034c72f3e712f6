// Proven motions with infinitely many impacts of two contacts, or of one beside closed ones, against answers of another
// program, closed forms and runs without a proof.
#include <arb.h>
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <memory>
#include <nlohmann/json.hpp>
#include <random>

#include "problems/scene_file/scene_file.h"
#include "reference/certified/computed_motion.h"
#include "tests/reference/decimal_balls.h"
#include "tests/reference/stated_collapses.h"

namespace ricochet::reference::certified {
namespace {

/// Whether the proven ball contains the decimal `text`, up to one unit of the place `decimals`.
bool holds(const CertifiedNumber& number, const std::string& text, int decimals) {
  Ball value = decimal_ball(text);
  Magnitude unit(decimal_ball(fmt::format("1e-{}", decimals)));
  value.widen(unit.get());
  return arb_overlaps(interval(number).get(), value.get()) != 0;
}

std::vector<CertifiedNumber> limits_of(const CertifiedMotion& motion) {
  std::vector<CertifiedNumber> times;
  for (const auto& event : motion.events) {
    if (event.kind == "zeno_end") times.push_back(event.time);
  }
  return times;
}

/// A motion without a proof, of grade `computed`.
CertifiedMotion computed(const Problem& problem) {
  Options options;
  options.max_seconds = 100;
  CertifiedMotion motion;
  take_computed(motion, problem, options, TimeLimit(options.max_seconds));
  return motion;
}

/// Columns of balls, computed event by event in Python with 100 and 160 digits.
class ProvenCollapse : public testing::TestWithParam<const char*> {};

TEST_P(ProvenCollapse, ContainsTheStoredState) {
  const auto stated = stated_collapse(GetParam());
  Options options;
  options.max_seconds = 100;
  const auto motion = certified_motion(*read_scene_file(std::string(kCollapses) + "#" + GetParam()), options);
  ASSERT_EQ(motion.grade, Grade::proven) << motion.reason;
  EXPECT_TRUE(motion.assumptions.empty());
  EXPECT_GE(motion.decimals(), 30);
  constexpr int kStored = 33;  // significant digits of velocities up to 10 m/s
  for (std::size_t k = 0; k < motion.q.size(); ++k) {
    EXPECT_TRUE(holds(motion.q[k], stated["final"]["q"][k], kStored)) << motion.q[k].text;
    EXPECT_TRUE(holds(motion.v[k], stated["final"]["v"][k], kStored)) << motion.v[k].text;
  }
  const auto limits = limits_of(motion);
  ASSERT_EQ(limits.size(), stated["collapses"].size());
  for (std::size_t k = 0; k < limits.size(); ++k)
    EXPECT_TRUE(holds(limits[k], stated["collapses"][k], 18)) << limits[k].text;
}

INSTANTIATE_TEST_SUITE_P(Columns, ProvenCollapse,
                         testing::Values("column_117", "column_468", "column_634", "column_107", "column_449",
                                         "column_652", "two_balls_13"),
                         [](const auto& test) { return std::string(test.param); });

/// The plastic contact of column_634 opens again after the limit, as a run without a proof says.
TEST(CertifiedAccumulationOfTwo, ModesAfterTheLimitAreThoseOfTheRunWithoutAProof) {
  for (const char* id : {"column_117", "column_634", "column_449"}) {
    const auto problem = read_scene_file(std::string(kCollapses) + "#" + id);
    const auto proven = certified_motion(*problem), other = computed(*problem);
    ASSERT_EQ(other.grade, Grade::computed) << other.reason;
    EXPECT_EQ(proven.modes, other.modes);
    const auto modes_of = [](const CertifiedMotion& motion) {
      std::vector<std::vector<std::string>> modes;
      for (const auto& event : motion.events) {
        if (event.kind == "zeno_end") modes.push_back(event.modes);
      }
      return modes;
    };
    EXPECT_EQ(modes_of(proven), modes_of(other));
  }
}

/// Two masses on a rope over a pulley. The heavy one falls 1 m with g/2, and with e = 0 each cycle of 3 v / g leaves a
/// quarter of the speed: rest begins at 2 / sqrt(g) + 4 / sqrt(g).
std::string atwood(const std::string& e_floor, const std::string& e_rope) {
  return fmt::format(R"scene({{"q0": ["1", "1"], "v0": ["0", "0"], "T": "3", "M": [["3", "0"], ["0", "1"]],
      "f": ["-29.43", "-9.81"], "contacts": [{{"name": "floor", "gap": "q[0]", "e": "{}"}},
      {{"name": "rope", "gap": "q[0]+q[1]-2", "e": "{}"}}]}})scene",
                     e_floor, e_rope);
}

TEST(CertifiedAccumulationOfTwo, RopeThatSlackensHasItsClosedForm) {
  Ball end = decimal_ball("9.81");
  arb_rsqrt(end.get(), end.get(), kTextBits);
  arb_mul_si(end.get(), end.get(), 6, kTextBits);
  for (const int digits : {4, 12, 30}) {
    Options options;
    options.digits = digits;
    const auto motion = certified_motion(*read_scene_text(atwood("0", "0"), "scene"), options);
    ASSERT_EQ(motion.grade, Grade::proven) << motion.reason;
    EXPECT_GE(motion.decimals(), digits);
    EXPECT_TRUE(holds(motion.events.back().time, decimal(end, 80).text, 70)) << motion.events.back().time.text;
    EXPECT_TRUE(holds(motion.q[0], "0", 70)) << motion.q[0].text;
    EXPECT_TRUE(holds(motion.q[1], "2", 70)) << motion.q[1].text;
    for (const auto& v : motion.v) EXPECT_TRUE(holds(v, "0", 70)) << v.text;
  }
}

/// A ball falls on another, which falls on the floor.
std::unique_ptr<Problem> column(double m_0, double m_1, const std::string& spring, const std::string& e_floor,
                                const std::string& e_balls) {
  return read_scene_text(fmt::format(R"scene({{"q0": ["0.2", "0.9"], "v0": ["0", "-1"], "T": "2",
      "M": [["{0:.3f}", "0"], ["0", "{1:.3f}"]], "f": ["-{0:.3f}*9.81+{2}", "-{1:.3f}*9.81-({2})"],
      "contacts": [{{"name": "floor", "gap": "q[0]", "e": "{3}"}},
                   {{"name": "balls", "gap": "q[1]-q[0]-0.2", "e": "{4}"}}]}})scene",
                                     m_0, m_1, spring, e_floor, e_balls),
                         "scene");
}

/// Without losses at one contact the lemma does not apply, although the impacts seem to accumulate.
TEST(CertifiedAccumulationOfTwo, ElasticContactIsNotProven) {
  Options options;
  options.may_compute = false;
  const auto lossy = certified_motion(*column(0.5, 2, "0", "0.8", "0.1"), options);
  EXPECT_EQ(lossy.grade, Grade::proven) << lossy.reason;
  const auto elastic = certified_motion(*column(0.5, 2, "0", "1", "0.1"), options);
  EXPECT_EQ(elastic.grade, Grade::open);
  EXPECT_GE(elastic.events.size(), 16u);
}

/// A ball bounces on another that lies on the floor: rest begins at sqrt(2 h / g) (1 + e) / (1 - e).
TEST(CertifiedAccumulationOfTwo, BounceOnARestingBallHasItsClosedForm) {
  Ball end = decimal_ball("9.81");
  arb_rsqrt(end.get(), end.get(), kTextBits);
  arb_mul_si(end.get(), end.get(), 3, kTextBits);
  for (const int digits : {4, 12, 30}) {
    Options options;
    options.digits = digits;
    const auto motion = certified_motion(
        *read_scene_text(
            R"scene({"q0": ["0", "0.5"], "v0": ["0", "0"], "T": "2", "M": [["1", "0"], ["0", "1"]], "f": ["-9.81", "-9.81"],
      "contacts": [{"name": "ball", "gap": "q[1]-q[0]", "e": "0.5"}, {"name": "floor", "gap": "q[0]"}]})scene",
            "scene"),
        options);
    ASSERT_EQ(motion.grade, Grade::proven) << motion.reason;
    EXPECT_EQ(motion.events.back().kind, "zeno_end");
    EXPECT_EQ(motion.modes, (std::vector<std::string>{"closed", "closed"}));
    EXPECT_TRUE(holds(motion.events.back().time, decimal(end, 80).text, 70)) << motion.events.back().time.text;
    for (const auto& v : motion.v) EXPECT_TRUE(holds(v, "0", 70)) << v.text;
  }
}

/// Two balls fall on the floor, 1e-60 m apart. The floor is plastic and stays closed: the upper ball bounces with e
/// sqrt(2 g).
TEST(CertifiedAccumulationOfTwo, ContactThatIsPressedStaysClosed) {
  const auto motion = certified_motion(*read_scene_text(
      R"scene({"params": {"d": "1e-60"}, "q0": ["1", "1.2+d"], "v0": ["0", "0"], "T": "1", "M": [["1", "0"], ["0", "1"]],
      "f": ["-9.81", "-9.81"], "contacts": [{"name": "floor", "gap": "q[0]", "e": "0"},
      {"name": "balls", "gap": "q[1]-q[0]-0.2", "e": "0.8"}]})scene",
      "scene"));
  ASSERT_EQ(motion.grade, Grade::proven) << motion.reason;
  Ball v = decimal_ball("19.62");  // 1.8 sqrt(2 g) - g T
  arb_sqrt(v.get(), v.get(), kTextBits);
  arb_mul(v.get(), v.get(), decimal_ball("1.8").get(), kTextBits);
  arb_sub(v.get(), v.get(), decimal_ball("9.81").get(), kTextBits);
  EXPECT_TRUE(holds(motion.v[0], "0", 38)) << motion.v[0].text;
  EXPECT_TRUE(holds(motion.v[1], decimal(v, 80).text, 38)) << motion.v[1].text;
}

/// Two balls collide 1e-40 m above the floor and move down with 4/3 m/s. The lower one bounces with 16/15 m/s, meets
/// the upper one again at once, and both rise with (2 * 16/15 - 4/3) / 3 = 4/15 m/s, until a force takes the upper one
/// away.
TEST(CertifiedAccumulationOfTwo, ContactsThatPartDoNotRest) {
  const auto motion = certified_motion(*read_scene_text(
      R"scene({"params": {"d": "1e-40"}, "q0": ["1+d", "2.7+d"], "v0": ["-1", "-3"], "T": "1.5", "M": [["2", "0"], ["0", "1"]],
      "f": ["0", "1"], "contacts": [{"name": "floor", "gap": "q[0]", "e": "0.8"},
      {"name": "balls", "gap": "q[1]-q[0]-0.2", "e": "0"}]})scene",
      "scene"));
  ASSERT_EQ(motion.grade, Grade::proven) << motion.reason;
  const auto fraction = [](long p, long q) {
    Ball x(static_cast<double>(p));
    arb_div_si(x.get(), x.get(), q, kTextBits);
    return decimal(x, 80).text;
  };
  EXPECT_TRUE(holds(motion.v[0], fraction(4, 15), 38)) << motion.v[0].text;
  EXPECT_TRUE(holds(motion.v[1], fraction(23, 30), 38)) << motion.v[1].text;
  EXPECT_TRUE(holds(motion.q[0], fraction(2, 15), 38)) << motion.q[0].text;
}

/// Wide windows, of few digits, contain what a run without a proof finds.
TEST(CertifiedAccumulationOfTwo, WindowsContainTheLimitOfRandomColumns) {
  std::mt19937 random(7);
  std::uniform_real_distribution<double> mass(0.3, 2), restitution(0.1, 0.5), stiffness(0, 200);
  int n_proven = 0;
  for (int k = 0; k < 24; ++k) {
    const bool is_plastic = k % 2 == 0;
    const std::string e_0 = fmt::format("{:.3f}", restitution(random)),
                      e_1 = is_plastic ? "0" : fmt::format("{:.3f}", restitution(random)),
                      spring = fmt::format("{:.1f}*(q[1]-q[0]-0.3)", is_plastic ? stiffness(random) : 0.0);
    const double m_0 = mass(random), m_1 = mass(random);
    const auto problem = column(m_0, m_1, spring, e_0, e_1);
    Options options;
    options.digits = 4;
    options.may_compute = false;
    const auto proven = certified_motion(*problem, options);
    if (proven.grade != Grade::proven || limits_of(proven).empty()) continue;
    const auto fine = computed(*problem);
    if (fine.grade != Grade::computed) continue;
    ++n_proven;
    const auto coarse_limits = limits_of(proven), fine_limits = limits_of(fine);
    ASSERT_EQ(coarse_limits.size(), fine_limits.size());
    for (std::size_t i = 0; i < fine_limits.size(); ++i)
      EXPECT_TRUE(holds(coarse_limits[i], fine_limits[i].text, 28)) << coarse_limits[i].text;
    for (std::size_t i = 0; i < 2; ++i) {
      EXPECT_TRUE(holds(proven.q[i], fine.q[i].text, 28)) << proven.q[i].text;
      EXPECT_TRUE(holds(proven.v[i], fine.v[i].text, 28)) << proven.v[i].text;
    }
  }
  EXPECT_GE(n_proven, 8);
}

}  // namespace
}  // namespace ricochet::reference::certified
