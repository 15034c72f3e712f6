// Sensitivities of proven motions: closed forms, differences of proven motions, and what has no derivative.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <nlohmann/json.hpp>

#include "problems/registry.h"
#include "problems/scene_file/scene_file.h"
#include "problems/scene_file/scene_writer.h"
#include "reference/certified/sensitivities.h"
#include "tests/reference/decimal_balls.h"

namespace ricochet::reference::certified {
namespace {

using nlohmann::json;

const Precision kSums{400, 1};

CertifiedMotion proven_motion_of(const Problem& problem, int digits, bool with_sensitivities) {
  Options options;
  options.digits = digits;
  options.with_sensitivities = with_sensitivities;
  options.max_seconds = 60;
  return certified_motion(problem, options);
}

CertifiedMotion motion_with_sensitivities(const std::string& scene) {
  return proven_motion_of(*read_scene_text(scene, "scene"), 25, true);
}

const CertifiedSensitivity& column_of(const CertifiedMotion& motion, const std::string& variable) {
  return *std::ranges::find(motion.sensitivities, variable, &CertifiedSensitivity::variable);
}

/// A decimal text as a quotient of whole numbers, which formulas keep exactly.
std::string quotient(const std::string& text) {
  const auto point = text.find('.');
  if (point == std::string::npos || text.find_first_not_of("-0123456789.") != std::string::npos) return text;
  return fmt::format("{}{}/1{}", text.substr(0, point), text.substr(point + 1),
                     std::string(text.size() - point - 1, '0'));
}

/// The proven motion of the scene, to 60 digits, whose variable is larger by `sign` 10^-15.
CertifiedMotion moved(const Problem& problem, const std::string& variable, const std::string& sign) {
  json scene = json::parse(scene_text(problem));
  json& content = scene.contains("problem") ? scene["problem"] : scene;
  const auto colon = variable.find(':');
  const std::string group = variable.substr(0, colon), name = variable.substr(colon + 1);
  json& entry = group == "param" ? content["params"][name] : content[group][std::stoul(name)];
  entry = fmt::format("({}) {} 1/10**15", quotient(entry), sign);
  return proven_motion_of(*read_scene_text(scene.dump(), "scene"), 60, false);
}

/// Differences over 2e-15 are the derivatives to about 30 digits.
void expect_differences(const Problem& problem) {
  SCOPED_TRACE(problem.info().id);
  constexpr double kThird = 1e-24;  // of third derivatives times the square of the change
  const CertifiedMotion motion = proven_motion_of(problem, 25, true);
  ASSERT_LE(motion.grade, Grade::assumed) << motion.reason;
  ASSERT_EQ(motion.no_sensitivities, "");
  int n = 0;
  for (const auto& column : motion.sensitivities) {
    if (!column.reason.empty()) continue;
    const CertifiedMotion more = moved(problem, column.variable, "+"), less = moved(problem, column.variable, "-");
    ASSERT_LE(std::max(more.grade, less.grade), Grade::assumed) << column.variable << more.reason << less.reason;
    const auto compare = [&](const auto& own, const auto& a, const auto& b) {
      for (std::size_t k = 0; k < own.size(); ++k, ++n) {
        const Ball twice = kSums.sub(interval(a[k]), interval(b[k]));
        const Ball slope = kSums.mul(twice, decimal_ball("5e14")), error = kSums.sub(slope, interval(own[k]));
        EXPECT_LE(Magnitude(error).upper(), kThird * (1 + Magnitude(slope).upper())) << column.variable << " " << k;
        EXPECT_LE(own[k].radius, 1e-20 * (1 + Magnitude(slope).upper()));
      }
    };
    compare(column.q, more.q, less.q);
    compare(column.v, more.v, less.v);
  }
  EXPECT_GT(n, 0);
}

/// Impacts of one corner while the other opens, slip that ends, begins and reverses, impacts of moving bodies, contacts
/// that depend on time, redundant contacts.
TEST(CertifiedSensitivities, AreDifferencesOfProvenMotions) {
  for (const char* id : {"rocking_block", "belt_oscillator", "ball_row", "disc_in_chute", "stacked_blocks"})
    expect_differences(*make_problem(id));
  for (const char* file : {"rising_table.json", "impact_oscillator.json"})
    expect_differences(*read_scene_file(std::string(RICOCHET_TEST_DATA "/") + file));
}

/// Derivatives that another program found by differences over 1e-16, to some 30 digits.
TEST(CertifiedSensitivities, AreThoseOfTheGroundTruth) {
  const std::string path = RICOCHET_REFERENCE_DATA "/ground_truth.json";
  std::ifstream file(path);
  const json stored = json::parse(file);
  int n_columns = 0;
  for (const auto& known : stored.at("cases")) {
    const std::string id = known["id"];
    if (known["sensitivities"].empty()) continue;
    const auto motion = proven_motion_of(*read_scene_file(path + "#" + id), 32, true);
    if (id == "P7a_slide3d_to_stick") {
      EXPECT_EQ(motion.no_sensitivities, "slip_to_stick within a window: plane");
      continue;
    }
    ASSERT_EQ(motion.no_sensitivities, "") << id;
    for (const auto& stated : known["sensitivities"]) {
      const auto& column = column_of(motion, stated["wrt"]);
      ASSERT_EQ(column.reason, "") << id << column.variable;
      const double unit = std::pow(10, 1 - stated["certified_decimals"].get<int>());  // of significant digits
      const auto compare = [&](const auto& own, const json& texts) {
        for (std::size_t k = 0; k < own.size(); ++k) {
          const Ball known_one = decimal_ball(texts[k]), error = kSums.sub(interval(own[k]), known_one);
          EXPECT_LE(Magnitude(error).upper(), unit * std::max(1.0, Magnitude(known_one).upper()))
              << id << column.variable << own[k].text;
        }
      };
      compare(column.q, stated["dq"]);
      compare(column.v, stated["dv"]);
      ++n_columns;
    }
  }
  EXPECT_GT(n_columns, 20);
}

/// A ball falls from h and bounces: z(T) = e w s - g s^2 / 2, w = sqrt(2 g h), s = T - w / g.
TEST(CertifiedSensitivities, OfABallAreItsClosedForm) {
  const auto motion =
      motion_with_sensitivities(R"({"params": {"g": "10", "h": "1/5", "e": "1/2", "T": "7/20"}, "q0": ["h"],
      "v0": ["0"], "T": "T", "M": [["1"]], "f": ["-g"], "contacts": [{"gap": "q[0]", "e": "e"}]})");
  ASSERT_EQ(motion.grade, Grade::proven) << motion.reason;  // w = 2, s = 3/20
  const auto expect = [&](const char* variable, const char* z, const char* v) {
    const auto& column = column_of(motion, variable);
    ASSERT_EQ(column.reason, "");
    EXPECT_TRUE(arb_overlaps(interval(column.q[0]).get(), decimal_ball(z).get())) << variable << column.q[0].text;
    EXPECT_TRUE(arb_overlaps(interval(column.v[0]).get(), decimal_ball(v).get())) << variable << column.v[0].text;
    EXPECT_LT(std::max(column.q[0].radius, column.v[0].radius), 1e-25);
  };
  expect("param:h", "0.625", "7.5");  // e w_h s + (e w - g s) s_h, e w_h - g s_h with w_h = 5, s_h = -1/2
  expect("q0:0", "0.625", "7.5");
  expect("param:e", "0.3", "2");          // w s, w
  expect("param:T", "-0.5", "-10");       // v(T), -g
  expect("param:g", "-0.00875", "-0.2");  // w_g = 1/10, s_g = 1/100
  EXPECT_EQ(column_of(motion, "v0:0").reason, "");
}

struct Refusal {
  const char *scene, *reason;
};

/// Where the motion has no derivative, or none that is proven, there are no numbers.
TEST(CertifiedSensitivities, AreRefusedWhereTheMotionIsNotSmooth) {
  for (const auto& [scene, reason] : {
           Refusal{R"({"q0": ["0"], "v0": ["-1"], "T": "1", "M": [["1"]], "f": ["0"],
                       "contacts": [{"gap": "q[0]", "e": "1/2"}]})",
                   "an impact at t = 0"},
           Refusal{
               R"({"q0": ["1", "2"], "v0": ["0", "0"], "T": "3/5", "M": [["1", "0"], ["0", "1"]], "f": ["-10", "-20"],
                       "contacts": [{"gap": "q[0]", "e": "1/2"}, {"gap": "q[1]", "e": "1/2"}]})",
               "simultaneous impacts"},
           Refusal{R"({"q0": ["0"], "v0": ["0"], "T": "1", "M": [["1"]], "f": ["-t"], "contacts": [{"gap": "q[0]"}]})",
                   "it vanishes to a higher order"},
           // the wall does not push the floor, but it would if it were inclined
           Refusal{
               R"({"params": {"a": "0"}, "q0": ["0", "0"], "v0": ["1", "0"], "T": "2", "M": [["1", "0"], ["0", "1"]],
                       "f": ["0", "-1"], "contacts": [{"gap": "q[1]"}, {"gap": "1 - q[0] + a*q[1]", "e": "1/2"}]})",
               "contacts exchange no momentum for these parameters only"},
           Refusal{R"({"q0": ["0", "0"], "v0": ["1", "0"], "T": "2", "M": [["1", "0"], ["0", "1"]],
                       "f": ["0", "-1"], "contacts": [{"gap": "q[1]"}, {"gap": "1 - q[0] + q[1]**2", "e": "1/2"}]})",
                   "the law of an impact does not hold strictly"},
           // one of two contacts that stick is redundant, unless a moves the other
           Refusal{R"({"params": {"a": "0"}, "q0": ["0", "0", "0", "0"], "v0": ["0", "0", "0", "1"], "T": "1",
                       "M": [["1", "0", "0", "0"], ["0", "1", "0", "0"], ["0", "0", "1", "0"], ["0", "0", "0", "1"]],
                       "f": ["0", "-10", "-10", "0"], "contacts": [
                       {"gap": "q[1]", "mu": "1/2", "Jt": [["1", "0", "0", "0"]]},
                       {"gap": "q[2]", "mu": "1/2", "Jt": [["1", "0", "0", "a"]]}]})",
                   "redundant contacts, which may depend on these parameters"},
           // no weight
           Refusal{R"({"params": {"g": "0"}, "q0": ["0"], "v0": ["0"], "T": "1", "M": [["1"]], "f": ["-g"],
                       "contacts": [{"gap": "q[0]"}]})",
                   "for these parameters only"},
       }) {
    const auto motion = motion_with_sensitivities(scene);
    EXPECT_EQ(motion.grade, Grade::proven) << scene << motion.reason;
    EXPECT_TRUE(motion.no_sensitivities.find(reason) != std::string::npos) << scene << motion.no_sensitivities;
    EXPECT_TRUE(motion.sensitivities.empty());
  }
}

/// A bead in a bowl y = x^2, where it rests on the bottom: to the side it falls, to second order of the change.
TEST(CertifiedSensitivities, AreRefusedForVariablesThatChangeAContact) {
  const auto motion =
      motion_with_sensitivities(R"({"params": {"mu": "0", "e": "0", "g": "10"}, "q0": ["0", "0"], "v0": ["0", "0"],
      "T": "1", "M": [["1", "0"], ["0", "1"]], "f": ["0", "-g"], "contacts": [{"gap": "q[1] + q[0]**2",
      "Jt": [["1", "0"]], "e": "e", "mu": "mu"}]})");
  ASSERT_EQ(motion.grade, Grade::proven) << motion.reason;
  ASSERT_EQ(motion.no_sensitivities, "");
  for (const char* variable : {"q0:0", "q0:1", "v0:1", "param:mu", "param:e"}) {
    EXPECT_NE(column_of(motion, variable).reason, "") << variable;
    EXPECT_TRUE(column_of(motion, variable).q.empty());
  }
  EXPECT_EQ(column_of(motion, "param:g").reason, "");
}

}  // namespace
}  // namespace ricochet::reference::certified
