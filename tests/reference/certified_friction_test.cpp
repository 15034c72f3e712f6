// Coulomb's law of one contact in space, and proven motions with such impacts.
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "problems/registry.h"
#include "problems/scene_file/scene_file.h"
#include "reference/certified/certified_motion.h"
#include "reference/certified/friction_in_space.h"

namespace ricochet::reference::certified {
namespace {

const Precision kPrecision{160, 56};

/// Random contacts: G = B B' + 1/4, which is regular.
class RandomContacts {
 public:
  double number(double low, double high) { return low + (high - low) * static_cast<double>(random_() % 4096) / 4096; }

  ContactInSpace next() {
    double B[3][3];
    for (auto& row : B) {
      for (double& entry : row) entry = number(-1, 1);
    }
    ContactInSpace contact;
    for (int i = 0; i < 3; ++i) {
      for (int j = 0; j < 3; ++j) {
        double sum = i == j ? 0.25 : 0;
        for (int k = 0; k < 3; ++k) sum += B[i][k] * B[j][k];
        contact.G[i][j] = Ball(sum);
      }
    }
    contact.mu = Ball(number(0.01, 0.3));
    return contact;
  }

 private:
  std::mt19937 random_{7};
};

/// r for which `force` leads to the slip velocity `slip`: r = w+ - G force.
void set_right_side(ContactInSpace& contact, const std::array<Ball, 3>& force, const std::array<Ball, 3>& after) {
  for (int i = 0; i < 3; ++i) {
    contact.r[i] = after[i];
    for (int j = 0; j < 3; ++j) contact.r[i] = kPrecision.sub(contact.r[i], kPrecision.mul(contact.G[i][j], force[j]));
  }
}

/// A slip that was prescribed is found, with its impulses, and nothing else.
TEST(FrictionInSpace, PrescribedSlipIsTheOnlySolution) {
  RandomContacts random;
  for (int n = 0; n < 200; ++n) {
    ContactInSpace contact = random.next();
    const double phi = random.number(-3.2, 3.2), s = random.number(0.01, 2), push = random.number(0.1, 3);
    Ball cosine, sine;
    arb_sin_cos(sine.get(), cosine.get(), Ball(phi).get(), kPrecision.bits);
    const Ball friction = -kPrecision.mul(contact.mu, Ball(push));
    const std::array<Ball, 3> force{Ball(push), kPrecision.mul(friction, cosine), kPrecision.mul(friction, sine)};
    set_right_side(contact, force, {Ball(), kPrecision.mul(Ball(s), cosine), kPrecision.mul(Ball(s), sine)});
    const SlipDirections slip = slip_directions(contact, kPrecision);
    ASSERT_TRUE(slip.is_complete) << n;
    ASSERT_EQ(slip.n_proven, 1) << n;
    EXPECT_TRUE(slip.is_stable);
    for (int i = 0; i < 3; ++i) {
      EXPECT_TRUE(arb_overlaps(slip.force[i].get(), force[i].get())) << n;
      EXPECT_LT(slip.force[i].log10_radius(), -35);
    }
    EXPECT_TRUE(arb_overlaps(slip.d[0].get(), cosine.get()) && arb_overlaps(slip.d[1].get(), sine.get()));
    const auto sticking = sticking_force(contact, kPrecision);
    ASSERT_TRUE(sticking);
    EXPECT_EQ(is_inside_cone(*sticking, contact.mu, kPrecision), Sign::negative) << n;
  }
}

/// Impulses inside of the cone: no slip in any direction.
TEST(FrictionInSpace, ContactsThatStickDoNotSlip) {
  RandomContacts random;
  for (int n = 0; n < 200; ++n) {
    ContactInSpace contact = random.next();
    const double phi = random.number(-3.2, 3.2), share = random.number(0, 0.95) * contact.mu.nearest();
    set_right_side(contact, {Ball(1.0), Ball(share * std::cos(phi)), Ball(share * std::sin(phi))}, {});
    const SlipDirections slip = slip_directions(contact, kPrecision);
    EXPECT_TRUE(slip.is_complete) << n;
    EXPECT_EQ(slip.n_proven, 0) << n;
    const auto sticking = sticking_force(contact, kPrecision);
    ASSERT_TRUE(sticking);
    EXPECT_EQ(is_inside_cone(*sticking, contact.mu, kPrecision), Sign::positive) << n;
  }
}

/// On the boundary of the cone, and with a direction known only up to 0.1, nothing is claimed.
TEST(FrictionInSpace, DoubtIsNotDecided) {
  ContactInSpace contact;
  for (int i = 0; i < 3; ++i) contact.G[i][i] = Ball(1.0);
  contact.mu = Ball(0.5);
  contact.r = {Ball(-1.0), Ball(0.5), Ball()};
  EXPECT_EQ(is_inside_cone(*sticking_force(contact, kPrecision), contact.mu, kPrecision), Sign::unknown);
  EXPECT_FALSE(slip_directions(contact, kPrecision).is_complete);
  contact.r[1] = Ball(0.6);
  EXPECT_EQ(slip_directions(contact, kPrecision).n_proven, 1);
  Magnitude wide;
  mag_set_d(wide.get(), 0.2);
  contact.r[1].widen(wide.get());
  const SlipDirections doubtful = slip_directions(contact, kPrecision);
  EXPECT_FALSE(doubtful.is_complete && doubtful.n_proven != 0);
  contact.r[0] = Ball();
  EXPECT_FALSE(slip_directions(contact, kPrecision).is_complete);
}

/// Forces of slip along random directions, in doubles, are within the bounds, and brake at least as stated.
TEST(FrictionInSpace, BoundsHoldForAllDirections) {
  RandomContacts random;
  int n_bounded = 0;
  for (int n = 0; n < 1000; ++n) {
    ContactInSpace contact = random.next();
    contact.r = {Ball(random.number(-2, 0.5)), Ball(random.number(-0.1, 0.1)), Ball(random.number(-0.1, 0.1))};
    const auto bounds = slip_bounds(contact, kPrecision);
    if (!bounds) continue;
    ++n_bounded;
    EXPECT_EQ(slip_directions(contact, kPrecision).n_proven, 0);
    for (int k = 0; k < 20; ++k) {
      const double phi = random.number(-3.2, 3.2), d[2] = {std::cos(phi), std::sin(phi)}, mu = contact.mu.nearest();
      const auto G = [&](int i, int j) { return contact.G[i][j].nearest(); };
      const double push = -contact.r[0].nearest() / (G(0, 0) - mu * (G(0, 1) * d[0] + G(0, 2) * d[1]));
      const double force[3] = {push, -mu * push * d[0], -mu * push * d[1]};
      double braking = 0;
      for (int i = 1; i < 3; ++i)
        braking -= d[i - 1] * (contact.r[i].nearest() + G(i, 0) * force[0] + G(i, 1) * force[1] + G(i, 2) * force[2]);
      EXPECT_GE(braking, bounds->braking.nearest() - 1e-12);
      for (int i = 0; i < 3; ++i) EXPECT_TRUE(arb_contains(bounds->force[i].get(), Ball(force[i]).get())) << i;
    }
  }
  EXPECT_GT(n_bounded, 10);
}

/// With so much friction that D changes sign, slip and sticking both satisfy the law, or neither: as Painleve's rod.
TEST(FrictionInSpace, MuchFrictionAllowsSeveralSolutions) {
  ContactInSpace contact;
  for (int i = 0; i < 3; ++i) contact.G[i][i] = Ball(1.0);
  contact.G[0][1] = contact.G[1][0] = Ball(0.75);
  contact.mu = Ball(2.0);
  contact.r = {Ball(1.0), Ball(5.0), Ball()};  // it moves away, and yet slip towards +x jams
  const SlipDirections slip = slip_directions(contact, kPrecision);
  EXPECT_EQ(slip.n_proven, 1);
  EXPECT_EQ(slip.force[0].sign(), Sign::positive);
}

CertifiedMotion motion_of(const std::string& scene, int digits, double max_seconds = 10) {
  Options options;
  options.max_seconds = max_seconds;
  options.digits = digits;
  return certified_motion(*read_scene_text(scene, "scene"), options);
}

/// (5 v + 2 r omega) / 7, the speed of rolling, after impacts that slip and one that sticks.
TEST(FrictionInSpace, BallWithSpinEndsRolling) {
  const auto motion = motion_of(R"({"params": {"m": "1", "r": "0.1", "g": "9.81", "mu": "0.3", "e": "0.6"},
      "q0": ["0", "0", "0.5", "0", "0", "0"], "v0": ["0.6", "-0.4", "0", "2", "5", "1"], "T": "1.1",
      "M": [["m", "0", "0", "0", "0", "0"], ["0", "m", "0", "0", "0", "0"], ["0", "0", "m", "0", "0", "0"],
            ["0", "0", "0", "2*m*r*r/5", "0", "0"], ["0", "0", "0", "0", "2*m*r*r/5", "0"],
            ["0", "0", "0", "0", "0", "2*m*r*r/5"]],
      "f": ["0", "0", "-m*g", "0", "0", "0"],
      "contacts": [{"name": "floor", "gap": "q[2]-r", "e": "e", "mu": "mu",
                    "Jt": [["1", "0", "0", "0", "-r", "0"], ["0", "1", "0", "r", "0", "0"]]}]})",
                                42);
  ASSERT_EQ(motion.grade, Grade::proven) << motion.reason;
  EXPECT_GE(motion.decimals(), 39);
  EXPECT_EQ(motion.events.size(), 6u);
  EXPECT_TRUE(motion.v[0].text.starts_with("0.571428571428571428571428571428571428")) << motion.v[0].text;   // 4/7
  EXPECT_TRUE(motion.v[1].text.starts_with("-0.342857142857142857142857142857142857")) << motion.v[1].text;  // -12/35
}

/// A thrown point mass whose slip does not turn: mu (1 + e) v_n against it, and a joint beside it that is coupled.
TEST(FrictionInSpace, ImpactWithAJointHasItsClosedForm) {
  const auto motion = motion_of(R"({"q0": ["0", "0", "0.1", "0"], "v0": ["3", "4", "-1", "-1"], "T": "0.2",
      "M": [["1", "0", "0", "0"], ["0", "1", "0", "0"], ["0", "0", "0.5", "0"], ["0", "0", "0", "0.5"]],
      "f": ["0", "0", "0", "0"],
      "contacts": [{"name": "floor", "gap": "q[2]", "e": "0.5", "mu": "0.2",
                    "Jt": [["1", "0", "0", "0"], ["0", "1", "0", "0"]]},
                   {"name": "joint", "gap": "q[2]-q[3]-0.1", "bilateral": true}]})",
                                30);
  ASSERT_EQ(motion.grade, Grade::proven) << motion.reason;
  ASSERT_EQ(motion.events.size(), 1u);  // Lambda_n = 1.5, the slip velocity 5 falls by 0.3
  EXPECT_TRUE(motion.v[0].text.starts_with("2.82")) << motion.v[0].text;
  EXPECT_TRUE(motion.v[1].text.starts_with("3.76")) << motion.v[1].text;
  EXPECT_TRUE(motion.v[3].text.starts_with("0.5")) << motion.v[3].text;
}

/// A block that slides straight on: it stops at v / (mu g) = 5/4 s, after v^2 / (2 mu g) = 3.125 m.
TEST(FrictionInSpace, SlipThatEndsHasItsClosedForm) {
  const std::string scene = R"({"q0": ["0", "0", "0"], "v0": ["3", "-4", "0"], "T": "2",
      "M": [["2", "0", "0"], ["0", "2", "0"], ["0", "0", "2"]], "f": ["{0}*0.3", "-{0}*0.4", "-20"],
      "contacts": [{"name": "floor", "gap": "q[2]", "mu": "0.4", "Jt": [["1", "0", "0"], ["0", "1", "0"]]}]})";
  const auto pushed = [&](const std::string& force) {
    std::string text = scene;
    for (auto k = text.find("{0}"); k != std::string::npos; k = text.find("{0}")) text.replace(k, 3, force);
    return text;
  };
  for (const int digits : {4, 12, 30}) {
    const auto motion = motion_of(pushed("0"), digits);
    ASSERT_EQ(motion.grade, Grade::proven) << motion.reason;
    ASSERT_EQ(motion.events.size(), 1u);
    EXPECT_EQ(motion.events[0].kind, "slip_to_stick");
    EXPECT_EQ(motion.modes, std::vector<std::string>{"stick"});
    EXPECT_NEAR(std::stod(motion.events[0].time.text), 1.25, motion.events[0].time.radius + 1e-15);
    EXPECT_NEAR(std::stod(motion.q[0].text), 1.875, motion.q[0].radius + 1e-15);
    EXPECT_NEAR(std::stod(motion.q[1].text), -2.5, motion.q[1].radius + 1e-15);
    EXPECT_LE(motion.q[0].radius, 0.5 * std::pow(10., -digits));
  }
  const auto slower = motion_of(pushed("10"), 12);  // 2.5 m/s^2 forwards: it does not stop before 3.3 s
  ASSERT_EQ(slower.grade, Grade::proven) << slower.reason;
  EXPECT_TRUE(slower.events.empty());
  const auto turning =
      motion_of(pushed("-20"), 12);  // 5 m/s^2 backwards: it stops after 5/9 s and returns with 1 m/s^2
  ASSERT_EQ(turning.grade, Grade::proven) << turning.reason;
  ASSERT_EQ(turning.events.size(), 1u);
  EXPECT_EQ(turning.events[0].kind, "slip_reversal");
  EXPECT_NEAR(std::stod(turning.v[0].text), -0.6 * 13 / 9, 1e-13);
  EXPECT_NEAR(std::stod(turning.q[1].text), -0.8 * (25. / 18 - 169. / 162), 1e-13);
}

/// A block that is pushed so that q = (t^2 / 2, t^3 / 3): its direction of slip is (1, t) / sqrt(1 + t^2).
TEST(FrictionInSpace, SlipThatBeginsHasItsClosedForm) {
  const auto motion = motion_of(R"scene({"params": {"m": "1.5", "g": "9.81", "mu": "0.4"},
      "q0": ["0", "0", "0", "0"], "v0": ["0", "0", "0", "1"], "T": "0.75",
      "M": [["m", "0", "0", "0"], ["0", "m", "0", "0"], ["0", "0", "m", "0"], ["0", "0", "0", "1"]],
      "f": ["m+mu*m*g/sqrt(1+q[3]*q[3])", "2*m*q[3]+mu*m*g*q[3]/sqrt(1+q[3]*q[3])", "-m*g", "0"],
      "contacts": [{"name": "plane", "gap": "q[2]", "mu": "mu",
                    "Jt": [["1", "0", "0", "0"], ["0", "1", "0", "0"]]}]})scene",
                                30);
  ASSERT_EQ(motion.grade, Grade::proven) << motion.reason;
  EXPECT_GE(motion.decimals(), 30);
  EXPECT_EQ(motion.modes, std::vector<std::string>{"slip"});
  EXPECT_NEAR(std::stod(motion.q[0].text), 0.28125, 1e-16);
  EXPECT_NEAR(std::stod(motion.q[1].text), 0.140625, 1e-16);
  EXPECT_NEAR(std::stod(motion.v[1].text), 0.5625, 1e-16);
}

/// Runs with other bits, orders and steps enclose the same numbers: a mass whose slip turns until it stops, and a ball
/// that slips, bounces and sticks.
TEST(FrictionInSpace, PrecisionsAgree) {
  const char* const spring = R"({"q0": ["-0.0246", "-0.2743", "0"], "v0": ["0.7892", "1.5837", "0"], "T": "2",
      "M": [["0.779", "0", "0"], ["0", "0.779", "0"], ["0", "0", "0.779"]],
      "f": ["-32.303*q[0]", "-32.303*q[1]", "-0.779*9.81"],
      "contacts": [{"name": "g", "gap": "q[2]", "mu": "0.432", "Jt": [["1", "0", "0"], ["0", "1", "0"]]}]})";
  for (const auto& problem : {read_scene_text(spring, "spring"), make_problem("ball_3d", {{"duration", 0.8}})}) {
    const auto exact = certified_motion(*problem);
    ASSERT_EQ(exact.grade, Grade::proven) << exact.reason;
    const auto overlaps = [](const CertifiedNumber& a, const CertifiedNumber& b) {
      Ball x, y;
      arb_set_str(x.get(), a.text.c_str(), 400);
      arb_set_str(y.get(), b.text.c_str(), 400);
      return Magnitude(kPrecision.sub(x, y)).upper() <= 1.0001 * (a.radius + b.radius);
    };
    for (const double order_per_bit : {0.25, 0.45}) {
      Options options;
      options.digits = 12;
      options.order_per_bit = order_per_bit;
      const auto motion = certified_motion(*problem, options);
      ASSERT_EQ(motion.grade, Grade::proven) << motion.reason;
      ASSERT_EQ(motion.events.size(), exact.events.size());
      for (std::size_t k = 0; k < exact.events.size(); ++k)
        EXPECT_TRUE(overlaps(motion.events[k].time, exact.events[k].time)) << k;
      for (std::size_t k = 0; k < exact.q.size(); ++k) {
        EXPECT_TRUE(overlaps(motion.q[k], exact.q[k])) << motion.q[k].text << " " << exact.q[k].text;
        EXPECT_TRUE(overlaps(motion.v[k], exact.v[k])) << motion.v[k].text << " " << exact.v[k].text;
      }
    }
  }
}

/// Down the slope, in the direction 3/10 rad, with g (sin - mu cos) t; a block that sticks is proven to stick.
TEST(FrictionInSpace, BlockOnRampSlipsOrSticks) {
  const auto slips = certified_motion(*make_problem("block_on_ramp_3d"));
  ASSERT_EQ(slips.grade, Grade::proven) << slips.reason;
  const double v = 9.81 * (std::sin(0.6) - 0.5 * std::cos(0.6)) * 0.5;
  EXPECT_NEAR(std::stod(slips.v[0].text), v * std::cos(0.3), 1e-14);
  EXPECT_NEAR(std::stod(slips.v[1].text), v * std::sin(0.3), 1e-14);
  const auto sticks = certified_motion(*make_problem("block_on_ramp_3d", {{"mu", 0.7}}));
  ASSERT_EQ(sticks.grade, Grade::proven) << sticks.reason;
  EXPECT_EQ(sticks.modes, std::vector<std::string>{"stick"});
}

}  // namespace
}  // namespace ricochet::reference::certified
