// Slip in space that begins from rest, where sticking ends, or where it turns back: closed forms, and remainders of its
// direction.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>

#include "problems/scene_file/scene_file.h"
#include "reference/certified/certified_motion.h"
#include "reference/certified/taylor_step.h"

namespace ricochet::reference::certified {
namespace {

CertifiedMotion slip_of(const std::string& scene, int digits = 30, double order_per_bit = 0.35,
                        Reading reading = Reading::decimal) {
  Options options;
  options.max_seconds = 60;
  options.digits = digits;
  options.order_per_bit = order_per_bit;
  options.reading = reading;
  return certified_motion(*read_scene_text(scene, "scene"), options);
}

/// Whether a number differs from `digits` by its radius and the last digit at most.
bool is_close(const CertifiedNumber& number, const std::string& digits) {
  constexpr slong kBits = 400;
  Ball value, expected, last(1.0);
  arb_set_str(value.get(), number.text.c_str(), kBits);
  arb_set_str(expected.get(), digits.c_str(), kBits);
  for (auto k = digits.find('.') + 1; k < digits.size(); ++k) arb_div_ui(last.get(), last.get(), 10, kBits);
  arb_sub(value.get(), value.get(), expected.get(), kBits);
  return Magnitude(value).upper() <= 1.0001 * (number.radius + last.nearest());
}

/// A block on a floor that pushes with `weight`, pulled by `fx` and `fy`.
std::string pulled_block(const std::string& fx, const std::string& fy, const std::string& weight = "9.81") {
  return fmt::format(R"({{"q0": ["0", "0", "0"], "v0": ["0", "0", "0"], "T": "2",
      "M": [["1", "0", "0"], ["0", "1", "0"], ["0", "0", "1"]], "f": ["{}", "{}", "-{}"],
      "contacts": [{{"name": "floor", "gap": "q[2]", "mu": "0.3", "Jt": [["1", "0", "0"], ["0", "1", "0"]]}}]}})",
                     fx, fy, weight);
}

/// A body whose forces are chosen so that v_t = s^2 (1, c s) after s = 0, with lambda_n = 5 and s = t - 1/4. Its mass
/// matrix couples all directions, so that the normal force depends on the direction of friction.
std::string coupled_body(double c) {
  const auto total = [&](const char* x, const char* y) {
    return fmt::format("{}*2*q[3]+{}*3*({:.3f})*q[3]*q[3]", x, y, c);
  };
  const std::string length = fmt::format("sqrt(1+({0:.3f})*({0:.3f})*q[3]*q[3])", c);
  return fmt::format(
      R"({{"q0": ["0", "0", "0", "-0.25"], "v0": ["0", "0", "0", "1"], "T": "1.25",
      "M": [["2", "0.3", "0.4", "0"], ["0.3", "1.5", "0.2", "0"], ["0.4", "0.2", "1", "0"], ["0", "0", "0", "1"]],
      "f": ["{0}+2/{3}", "{1}+2*({4:.3f})*q[3]/{3}", "{2}-5", "0"],
      "contacts": [{{"name": "plane", "gap": "q[2]", "mu": "0.4",
                    "Jt": [["1", "0", "0", "0"], ["0", "1", "0", "0"]]}}]}})",
      total("2", "0.3"), total("0.3", "1.5"), total("0.4", "0.2"), length, c);
}

TEST(SlipStart, MotionAfterStickingHasItsClosedForm) {
  for (const double c : {-1.5, 0.0, 0.75}) {
    const auto motion = slip_of(coupled_body(c));
    ASSERT_EQ(motion.grade, Grade::proven) << motion.reason;
    EXPECT_GE(motion.decimals(), 30);
    EXPECT_EQ(motion.no_certificate, "slip in space begins from rest");
    ASSERT_EQ(motion.events.size(), 1u);
    EXPECT_EQ(motion.events[0].kind, "stick_to_slip");
    EXPECT_EQ(motion.events[0].modes, std::vector<std::string>{"slip"});
    EXPECT_NEAR(std::stod(motion.events[0].time.text), 0.25, motion.events[0].time.radius);
    EXPECT_NEAR(std::stod(motion.q[0].text), 1. / 3, 1e-16);
    EXPECT_NEAR(std::stod(motion.q[1].text), c / 4, motion.q[1].radius + 1e-16);
    EXPECT_NEAR(std::stod(motion.v[0].text), 1, motion.v[0].radius);
    EXPECT_NEAR(std::stod(motion.v[1].text), c, motion.v[1].radius);
  }
}

/// The digits are those of another program: the divergent series up to its smallest term, then Taylor's method with 60
/// digits from two times.
TEST(SlipStart, DirectionThatTurnsHasItsDigits) {
  for (const double order_per_bit : {0.25, 0.35, 0.5}) {
    const auto motion = slip_of(pulled_block("3*t", "2*t**2"), 30, order_per_bit);
    ASSERT_EQ(motion.grade, Grade::proven) << motion.reason;
    EXPECT_GE(motion.decimals(), 30);
    EXPECT_TRUE(is_close(motion.q[0], "0.9101386155000369563939177900092019092232")) << motion.q[0].text;
    EXPECT_TRUE(is_close(motion.q[1], "0.9260656087818147900342579240313053233445")) << motion.q[1].text;
    EXPECT_TRUE(is_close(motion.v[0], "2.363972309212457511625186286267938353268")) << motion.v[0].text;
    EXPECT_TRUE(is_close(motion.v[1], "2.725004028309003424870041540941915151994")) << motion.v[1].text;
  }
}

/// 2.943 = 0.3 * 9.81 exactly: the block slips at once if it is pulled harder, and sticks if it is pulled less. Read as
/// doubles, the pull is stronger by 2e-17.
TEST(SlipStart, BlockAtTheLimitSlipsOrSticks) {
  const auto slips = slip_of(pulled_block("2.943+t", "t"));
  ASSERT_EQ(slips.grade, Grade::proven) << slips.reason;
  EXPECT_TRUE(slips.events.empty());
  EXPECT_TRUE(is_close(slips.q[0], "1.42724505147646619214566058588")) << slips.q[0].text;  // of public reports
  EXPECT_TRUE(is_close(slips.q[1], "0.42645317519353907576236205092")) << slips.q[1].text;
  const auto rounded = slip_of(pulled_block("2.943+t", "t"), 30, 0.35, Reading::rounded);
  ASSERT_EQ(rounded.grade, Grade::proven) << rounded.reason;
  EXPECT_NEAR(std::stod(rounded.q[0].text), std::stod(slips.q[0].text), 1e-15);
  EXPECT_FALSE(is_close(rounded.q[0], slips.q[0].text));
  const auto sticks = slip_of(pulled_block("2.943-t/4", "t/8"));
  ASSERT_EQ(sticks.grade, Grade::proven) << sticks.reason;
  EXPECT_EQ(sticks.modes, std::vector<std::string>{"stick"});
  const auto stays = slip_of(pulled_block("2.943", "0"));  // at the limit for ever: a tie
  EXPECT_EQ(stays.grade, Grade::open);
}

/// Blocks that slide against a force of 5, stop after 0.1 s, and return: with M_xz = c the normal force is 10 + c a, so that
/// a = (5 - 3 d) / (1 + 0.3 c d) for slip in the direction d = -1 or 1. Their numbers are known to 40 digits.
TEST(SlipStart, SlipThatTurnsBackHasItsClosedForm) {
  const auto block = [](double c) {
    return fmt::format(R"({{"q0": ["0", "0", "0"], "v0": ["-1", "0", "0"], "T": "0.5",
      "M": [["1", "0", "{0}"], ["0", "2", "0"], ["{0}", "0", "1"]], "f": ["5", "0", "-10"],
      "contacts": [{{"name": "plane", "gap": "q[2]", "mu": "0.3", "Jt": [["1", "0", "0"], ["0", "1", "0"]]}}]}})",
                       c);
  };
  for (const double c : {0.0, -0.5}) {
    const Precision a{400, 10};
    Ball friction(3.0), speed(1.0), half(0.5);
    arb_div_ui(friction.get(), friction.get(), 10, a.bits);
    const auto acceleration = [&](double d) {
      return a.div(Ball(5 - 3 * d), a.add(speed, a.mul(friction, Ball(c * d))));
    };
    const Ball before = acceleration(-1), after = acceleration(1), turn = a.div(speed, before);
    const Ball left = a.sub(half, turn), v = a.mul(after, left);
    const Ball q = a.sub(a.mul(half, a.mul(v, left)), a.mul(half, turn));
    for (const int digits : {8, 30}) {
      if (c != 0 && digits > 8) continue;  // takes seconds
      const auto motion = slip_of(block(c), digits);
      ASSERT_EQ(motion.grade, Grade::proven) << motion.reason;
      EXPECT_GE(motion.decimals(), digits);
      EXPECT_EQ(motion.no_certificate, "slip in space turns back");
      ASSERT_EQ(motion.events.size(), 1u);
      EXPECT_EQ(motion.events[0].kind, "slip_reversal");
      EXPECT_TRUE(is_close(motion.events[0].time, decimal(turn, 60).text)) << motion.events[0].time.text;
      EXPECT_TRUE(is_close(motion.q[0], decimal(q, 60).text)) << motion.q[0].text;
      EXPECT_TRUE(is_close(motion.v[0], decimal(v, 60).text)) << motion.v[0].text;
    }
  }
}

/// v_t = t^m (1, sin(w t)) with unit mass and mu lambda_n = k, in series of low orders: the direction, along x at the
/// beginning, turns with y = sin(w t), which differs from its polynomial by the remainder at most.
TEST(SlipStart, DirectionIsWithinItsRemainder) {
  constexpr slong kBits = 40;  // validate() wants remainders below 2^(16 - bits)
  struct Case {
    double k, w;
    std::string weight, friction;
  };
  int n_steps = 0;
  for (const Case& of : {Case{1, 1, "10/3", "1"}, Case{0.01, 20, "1/30", "0.01"}}) {
    for (const int m : {1, 2}) {
      const std::string power = m == 1 ? "1" : "2*t", whole = m == 1 ? "t" : "t**2";
      const std::string y = fmt::format("sin({:g}*t)", of.w), length = fmt::format("sqrt(1+{0}*{0})", y);
      const std::string fx = fmt::format("{}+{}/{}", power, of.friction, length);
      const std::string fy =
          fmt::format("{}*{}+{}*{:g}*cos({:g}*t)+{}*{}/{}", power, y, whole, of.w, of.w, of.friction, y, length);
      const auto problem = read_scene_text(pulled_block(fx, fy, of.weight), "scene");
      for (const int order : {2, 3, 4}) {
        for (const double h : {0.0005, 0.001, 0.002, 0.01, 0.02}) {
          const Precision precision{kBits, order};
          SeriesProgram program(precision);
          const SceneFormulas scene = scene_formulas(*problem, Reading::decimal, program);
          const TimeLimit limit(10);
          TaylorStep step(scene, program, limit);
          step.load(scene.start, Ball());
          const ModeMotion motion = mode_motion(scene, {Mode::slip}, program, {{0, {{Ball(1.0), Ball()}, m}}});
          step.load(scene.start, Ball());
          step.expand(motion, order);
          if (!step.validate(motion, h)) continue;
          ++n_steps;
          const Node direction = motion.starts.at(0).y;
          const double rho = mag_get_d(program.rho(direction)), rounding = std::ldexp(of.w * h, 4 - kBits);
          for (int j = 1; j <= 64; ++j) {
            const double t = j / 64. * h;
            double polynomial = 0;
            for (int i = order; i >= 0; --i)
              polynomial = polynomial * t + Ball(program.coefficient(direction, i)).nearest();
            EXPECT_LE(std::abs(polynomial - std::sin(of.w * t)), rho * std::pow(t / h, order + 1) + rounding)
                << of.k << " " << m << " " << order << " " << h << " " << j;
          }
        }
      }
    }
  }
  EXPECT_GE(n_steps, 15);
}

/// Little friction and a load without remainders of its own: the direction's polynomial leaves out the product of slip
/// and turning. A series of high order, on steps where it converges up to rounding, is the truth.
TEST(SlipStart, TurningIsWithinItsRemainder) {
  const auto problem = read_scene_text(pulled_block("0.01+2*t", "0.1*t**2", "1/30"), "scene");
  const auto coefficients = [&](int order, double h, double& rho) {
    const Precision precision{40, order};
    SeriesProgram program(precision);
    const SceneFormulas scene = scene_formulas(*problem, Reading::decimal, program);
    const TimeLimit limit(10);
    TaylorStep step(scene, program, limit);
    step.load(scene.start, Ball());
    const ModeMotion motion = mode_motion(scene, {Mode::slip}, program, {{0, {{Ball(1.0), Ball()}, 2}}});
    step.load(scene.start, Ball());
    step.expand(motion, order);
    const Node y = motion.starts.at(0).y;
    rho = step.validate(motion, h) ? mag_get_d(program.rho(y)) : -1;
    std::vector<double> list;
    for (int i = 0; i <= order; ++i) list.push_back(Ball(program.coefficient(y, i)).nearest());
    return list;
  };
  int n_steps = 0;
  for (const int order : {3, 4, 6}) {
    for (const double h : {5e-5, 1e-4, 2e-4}) {
      double rho = 0, unused = 0, rest = 0;
      const auto all = coefficients(20, h, unused);
      coefficients(order, h, rho);
      if (rho < 0) continue;
      ++n_steps;
      for (int i = 20; i > order; --i) rest += all[i] * std::pow(h, i);
      EXPECT_LE(std::abs(rest), rho) << order << " " << h;
    }
  }
  EXPECT_GE(n_steps, 6);
}

}  // namespace
}  // namespace ricochet::reference::certified
