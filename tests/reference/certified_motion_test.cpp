// Proven motions: closed forms, the stored ground truth, and grades.
#include "reference/certified/certified_motion.h"

#include <arb.h>
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <nlohmann/json.hpp>
#include <random>

#include "problems/registry.h"
#include "problems/scene_file/scene_file.h"
#include "problems/scene_file/scene_writer.h"
#include "reference/certified/ball.h"
#include "reference/certified/scene_formulas.h"
#include "tests/reference/decimal_balls.h"

namespace ricochet::reference::certified {
namespace {

constexpr slong kIntervalBits = 400;

/// A value of Arb by its own functions.
template <class... Arguments>
Ball value_of(void (*function)(arb_t, const arb_t, slong), const Ball& x) {
  Ball result;
  function(result.get(), x.get(), kIntervalBits);
  return result;
}

CertifiedMotion motion_of(const std::string& scene, const Options& options = {}) {
  return certified_motion(*read_scene_text(scene, "scene"), options);
}

CertifiedMotion motion_of_problem(const std::string& id, const ParameterChanges& changes = {}, Options options = {}) {
  return certified_motion(*make_problem(id, changes), options);
}

/// A point mass with a `force` and contacts in one coordinate.
std::string point_mass(const std::string& force, const std::string& q0, const std::string& v0, const std::string& T,
                       const std::string& contacts = "[]") {
  return fmt::format(R"({{"q0": ["{}"], "v0": ["{}"], "T": "{}", "M": [["1"]], "f": ["{}"], "contacts": {}}})", q0, v0,
                     T, force, contacts);
}

const Precision kExact{kIntervalBits, 1};

TEST(CertifiedMotion, ParabolaIsExact) {
  const auto motion = motion_of(point_mass("-9.81", "0.3", "2", "0.7"));
  ASSERT_EQ(motion.grade, Grade::proven) << motion.reason;
  EXPECT_TRUE(arb_overlaps(interval(motion.q[0]).get(), decimal_ball("-0.70345").get()));  // 0.3 + 1.4 - 9.81 0.49 / 2
  EXPECT_TRUE(arb_overlaps(interval(motion.v[0]).get(), decimal_ball("-4.867").get()));
  EXPECT_GE(motion.decimals(), 30);
}

/// As a decimal it would be 0.3333333333333333. Somebody who changes it gives a decimal.
TEST(CertifiedMotion, ParameterIsTheNumberThatItsFormulaStates) {
  const std::string scene =
      R"({"params": {"a": "1/3"}, "q0": ["0"], "v0": ["0"], "T": "1", "M": [["1"]], "f": ["6*a"], "contacts": []})";
  const auto expect = [](const Problem& problem, const char* position) {
    const auto motion = certified_motion(problem);
    ASSERT_EQ(motion.grade, Grade::proven) << motion.reason;
    EXPECT_LT(motion.q[0].radius, 1e-30);
    EXPECT_TRUE(arb_overlaps(interval(motion.q[0]).get(), decimal_ball(position).get())) << motion.q[0].text;
  };
  expect(*read_scene_text(scene, "scene"), "1");
  expect(*read_scene_text(scene_text(*read_scene_text(scene, "scene")), "copy"), "1");
  expect(*read_scene_text(scene, "scene", {{"a", 0.25}}), "0.75");
}

/// q = cos(omega t), v = -omega sin(omega t), omega = 10, for 100 rad.
TEST(CertifiedMotion, OscillatorContainsItsClosedForm) {
  for (const bool form : {false, true}) {
    Options options;
    options.mean_value_form = form;
    const auto motion = motion_of(point_mass("-100*q[0]", "1", "0", "10"), options);
    ASSERT_EQ(motion.grade, Grade::proven) << motion.reason;
    EXPECT_TRUE(arb_contains(interval(motion.q[0]).get(), value_of(arb_cos, Ball(100.0)).get()));
    const Ball v = kExact.mul(Ball(-10.0), value_of(arb_sin, Ball(100.0)));
    EXPECT_TRUE(arb_contains(interval(motion.v[0]).get(), v.get()));
    EXPECT_GE(motion.decimals(), 30);
  }
}

/// v' = -log(1 + v) and others, against what differentiates to them: q = log(1 + t), v = 1 / (1 + t) = exp(-q).
TEST(CertifiedMotion, FunctionsContainTheirClosedForms) {
  const auto motion = motion_of(point_mass("-exp(-2*q[0])", "0", "1", "2"));
  ASSERT_EQ(motion.grade, Grade::proven) << motion.reason;
  EXPECT_TRUE(arb_contains(interval(motion.q[0]).get(), value_of(arb_log, Ball(3.0)).get()));
  const auto tangent = motion_of(point_mass("2*tan(q[0])*v[0]", "0", "1", "0.7"));  // q = tan(t) has q'' = 2 q q'
  ASSERT_EQ(tangent.grade, Grade::proven) << tangent.reason;
  const auto of_log = motion_of(point_mass("-v[0]/(1+t) + log(1+t)/(1+t)", "0", "0", "1"));  // ((1+t) v)' = log(1+t)
  ASSERT_EQ(of_log.grade, Grade::proven) << of_log.reason;
  const Ball v = kExact.sub(value_of(arb_log, Ball(2.0)), Ball(0.5));  // (2 log 2 - 1) / 2
  EXPECT_TRUE(arb_contains(interval(of_log.v[0]).get(), v.get()));
  const auto of_atan = motion_of(point_mass("atan(t)", "0", "0", "1"));  // v = t atan t - log(1 + t^2) / 2
  ASSERT_EQ(of_atan.grade, Grade::proven) << of_atan.reason;
  const Ball half_log = kExact.div(value_of(arb_log, Ball(2.0)), Ball(2.0));
  EXPECT_TRUE(arb_contains(interval(of_atan.v[0]).get(), kExact.sub(value_of(arb_atan, Ball(1.0)), half_log).get()));
}

/// Drop from 1/2: t_1 = sqrt(1/g), then v = e g t_1 and t_2 = t_1 (1 + 2 e), as decimals of e and g.
TEST(CertifiedMotion, BouncesHaveTheirClosedForm) {
  const auto motion =
      motion_of(point_mass("-9.81", "0.5", "0", "0.9", R"([{"name": "floor", "gap": "q[0]", "e": "0.7"}])"));
  ASSERT_EQ(motion.grade, Grade::proven) << motion.reason;
  ASSERT_EQ(motion.events.size(), 2u);
  const Ball g = decimal_ball("9.81"), first = value_of(arb_sqrt, kExact.div(Ball(1.0), g));
  const Ball second = kExact.mul(first, decimal_ball("2.4"));
  EXPECT_TRUE(arb_contains(interval(motion.events[0].time).get(), first.get()));
  EXPECT_TRUE(arb_contains(interval(motion.events[1].time).get(), second.get()));
  const Ball impulse = kExact.mul(decimal_ball("1.7"), kExact.mul(g, first));  // (1 + e) m g t_1
  EXPECT_TRUE(arb_contains(interval(motion.events[0].Lambda_n[0]).get(), impulse.get()));
  EXPECT_EQ(motion.events[0].kind, "impact");
}

/// Random drops and throws: the k-th impact is at t_k = t_1 + 2 sum_{i<=k-1} e^i v_1 / g, v_1 the speed of the first.
TEST(CertifiedMotion, RandomBouncesContainTheirClosedForms) {
  std::mt19937 random(11);
  const auto draw = [&](int low, int high) {
    return low + static_cast<int>(random() % static_cast<unsigned>(high - low));
  };
  Options options;
  options.digits = 12;
  for (int n = 0; n < 30; ++n) {
    const std::string g = fmt::format("{}.{}", draw(1, 30), draw(0, 10)), h = fmt::format("0.{}", draw(1, 1000));
    const std::string v = fmt::format("{}.{}", draw(-3, 4), draw(0, 100)), e = fmt::format("0.{}", draw(50, 75));
    const auto motion = motion_of(
        point_mass("-" + g, h, v, "1.5", R"([{"name": "floor", "gap": "q[0]", "e": ")" + e + "\"}]"), options);
    if (motion.grade == Grade::open) {  // impacts that accumulate with e near 1
      EXPECT_GT(motion.events.size(), 20u) << motion.reason;
      continue;
    }
    const Ball a = decimal_ball(g), v0 = decimal_ball(v);  // v_1^2 = v_0^2 + 2 g h, t_1 = (v_0 + v_1) / g
    Ball speed =
        value_of(arb_sqrt, kExact.add(kExact.mul(v0, v0), kExact.mul(Ball(2.0), kExact.mul(a, decimal_ball(h)))));
    Ball t = kExact.div(kExact.add(v0, speed), a);
    bool has_ended = false;
    for (const auto& event : motion.events) {
      has_ended = event.kind == "zeno_end";
      if (has_ended) {  // t + 2 speed / g (e + e^2 + ...), from the last impact but one
        const Ball factor = kExact.div(decimal_ball(e), kExact.sub(Ball(1.0), decimal_ball(e)));
        const Ball gone = kExact.div(kExact.mul(Ball(2.0), speed), a);
        t = kExact.add(kExact.sub(t, gone), kExact.div(kExact.mul(gone, factor), decimal_ball(e)));
      }
      EXPECT_TRUE(arb_contains(interval(event.time).get(), t.get()))
          << event.kind << " " << g << " " << h << " " << v << " " << e;
      speed = kExact.mul(speed, decimal_ball(e));
      t = kExact.add(t, kExact.div(kExact.mul(Ball(2.0), speed), a));
    }
    if (has_ended) {
      EXPECT_TRUE(arb_contains(interval(motion.q[0]).get(), Ball().get()));
      EXPECT_TRUE(arb_contains(interval(motion.v[0]).get(), Ball().get()));
    } else {
      EXPECT_EQ(kExact.sub(t, decimal_ball("1.5")).sign(), Sign::positive);  // the next one is after the end
    }
  }
}

/// A block that bounces while it slips, and slips on: friction takes mu g T from its velocity, however it bounces.
TEST(CertifiedMotion, ImpactsThatAccumulateInSlipContainTheMotion) {
  for (const int digits : {4, 12, 30}) {
    Options options;
    options.digits = digits;
    const auto motion = motion_of(R"({"q0": ["0", "0.1"], "v0": ["9", "0"], "T": "1", "M": [["1", "0"], ["0", "1"]],
        "f": ["0", "-9.81"],
        "contacts": [{"name": "floor", "gap": "q[1]", "mu": "0.3", "e": "0.5", "Jt": [["1", "0"]]}]})",
                                  options);
    ASSERT_EQ(motion.grade, Grade::proven) << motion.reason;
    EXPECT_EQ(motion.events.back().kind, "zeno_end");
    EXPECT_TRUE(arb_overlaps(interval(motion.v[0]).get(), decimal_ball("6.057").get())) << motion.v[0].text;
    EXPECT_TRUE(arb_contains(interval(motion.v[1]).get(), Ball().get()));
    EXPECT_EQ(motion.modes, std::vector<std::string>{"slip+"});
  }
}

/// Random blocks on a rough plane that is pulled: slip ends at v / (mu g - F / m), or goes on.
TEST(CertifiedMotion, RandomSlidesContainTheirClosedForms) {
  std::mt19937 random(5);
  const auto draw = [&](int low, int high) {
    return low + static_cast<int>(random() % static_cast<unsigned>(high - low));
  };
  for (int n = 0; n < 60; ++n) {
    const std::string mu = fmt::format("0.{}", draw(10, 90)), F = fmt::format("{}.{}", draw(0, 6), draw(1, 100));
    const std::string v = fmt::format("{}.{}", draw(0, 3), draw(1, 100));
    const auto motion = motion_of(fmt::format(
        R"({{"q0": ["0", "0"], "v0": ["{}", "0"], "T": "1.01", "M": [["1", "0"], ["0", "1"]], "f": ["{}", "-9.81"],
           "contacts": [{{"name": "floor", "gap": "q[1]", "mu": "{}", "Jt": [["1", "0"]]}}]}})",
        v, F, mu));
    ASSERT_EQ(motion.grade, Grade::proven) << motion.reason;
    const Ball brake = kExact.sub(kExact.mul(decimal_ball(mu), decimal_ball("9.81")), decimal_ball(F));
    const Ball stop = kExact.div(decimal_ball(v), brake), end = decimal_ball("1.01");
    const bool stops = brake.sign() == Sign::positive && kExact.sub(end, stop).sign() == Sign::positive;
    ASSERT_EQ(motion.events.size(), stops ? 1u : 0u) << v << " " << F << " " << mu;
    const Ball t = stops ? stop : end;
    if (stops) {
      EXPECT_TRUE(arb_contains(interval(motion.events[0].time).get(), stop.get()));
      EXPECT_EQ(motion.events[0].kind, "slip_to_stick");
    }
    const Ball q =
        kExact.sub(kExact.mul(decimal_ball(v), t), kExact.div(kExact.mul(brake, kExact.mul(t, t)), Ball(2.0)));
    EXPECT_TRUE(arb_overlaps(interval(motion.q[0]).get(), q.get())) << v << " " << F << " " << mu;
  }
}

/// With numbers as doubles, the motion is that of 0.69999999999999996 and 9.8100000000000005.
TEST(CertifiedMotion, ReadingsDiffer) {
  const std::string scene = point_mass("-9.81", "0.5", "0", "0.9", R"([{"name": "floor", "gap": "q[0]", "e": "0.7"}])");
  Options options;
  options.reading = Reading::rounded;
  const auto rounded = motion_of(scene, options), decimal = motion_of(scene);
  ASSERT_EQ(rounded.grade, Grade::proven) << rounded.reason;
  const Ball first = value_of(arb_sqrt, kExact.div(Ball(1.0), Ball(9.81)));
  EXPECT_TRUE(arb_contains(interval(rounded.events[0].time).get(), first.get()));
  EXPECT_FALSE(arb_overlaps(interval(rounded.events[0].time).get(), interval(decimal.events[0].time).get()));
  const double difference = kExact.sub(interval(rounded.q[0]), interval(decimal.q[0])).nearest();
  EXPECT_LT(std::abs(difference), 1e-15);  // a few ulp of the numbers
}

nlohmann::json stored_cases(const std::string& file) {
  std::ifstream stream(std::string(RICOCHET_REFERENCE_DATA) + "/" + file);
  return nlohmann::json::parse(stream).at("cases");
}

/// Two levers are pushed against stops that they touch, with sin a = s and tan b = y/x: cos(b + a) and sin(a - b). The
/// addition theorems prove that the gaps are zero; a stop that is 1e-60 away is not proven to touch.
TEST(CertifiedMotion, SumsOfAnglesTouchExactly) {
  const auto levers = [](const char* distance) {
    return fmt::format(
        R"json({{"params": {{"y": "0.3", "s": "0.4", "x": "sqrt(y/2)-4*s/3"}},
        "q0": ["atan2(y,x)+asin(s)", "asin(s)-atan2(y,x)"],
        "v0": ["0", "0"], "T": "1", "M": [["1", "0"], ["0", "1"]], "f": ["1", "1"], "contacts": [
        {{"name": "first", "gap": "cos(q[0])-(x*sqrt(1-s**2)-y*s)/sqrt(x**2+y**2)+{0}"}},
        {{"name": "second", "gap": "sin(q[1])-(x*s-y*sqrt(1-s**2))/sqrt(x**2+y**2)+{0}"}}]}})json",
        distance);
  };
  const auto touching = motion_of(levers("0"));
  EXPECT_EQ(touching.grade, Grade::proven) << touching.reason;
  EXPECT_EQ(touching.modes, (std::vector<std::string>{"closed", "closed"}));
  EXPECT_NE(motion_of(levers("1e-60")).grade, Grade::proven);
}

/// The start of Andrews' squeezing mechanism closes its loops by formulas, and has the digits that the Test Set for
/// Initial Value Problem Solvers states.
TEST(CertifiedMotion, TheSqueezingMechanismStartsAsPublished) {
  const auto problem = read_scene_file(RICOCHET_REFERENCE_DATA "/../../tests/data/squeezing_mechanism.json");
  SeriesProgram program(kExact);
  const SceneFormulas scene = scene_formulas(*problem, Reading::decimal, program);
  const std::vector<std::string> published = {"-0.0617138900142764496358948458001", "0",
                                              "0.455279819163070380255912382449",   "0.222668390165885884674473185609",
                                              "0.487364979543842550225598953530",   "-0.222668390165885884674473185609",
                                              "1.23054744454982119249735015568"};
  for (std::size_t k = 0; k < published.size(); ++k) {
    const Ball difference = kExact.sub(scene.start[k], decimal_ball(published[k]));
    EXPECT_LE(std::abs(difference.nearest()), 1e-29) << "a unit of the last digits, q " << k;
  }
  for (const auto& contact : scene.contacts) EXPECT_TRUE(contact.gap_is_zero && contact.v_n_is_zero) << contact.name;
}

/// Every stored digit: 45 significant digits are rounded to half a unit of the last one.
void expect_agreement(const CertifiedNumber& number, const std::string& stored, const std::string& what) {
  const Ball difference = kExact.sub(interval(number), decimal_ball(stored));
  EXPECT_LT(Magnitude(difference).upper(), 2e-42) << what << ": " << number.text << ", stored " << stored;
}

/// Compares the final state and the events. Of impacts that accumulate a file lists the first ones and their limit.
void expect_stored_motion(const nlohmann::json& known, CertifiedMotion motion) {
  const std::string id = known["id"];
  for (std::size_t k = 0; k < motion.q.size(); ++k) {
    expect_agreement(motion.q[k], known["final"]["q"][k], id + " q");
    expect_agreement(motion.v[k], known["final"]["v"][k], id + " v");
  }
  const std::size_t n = known["events"].size();
  if (n > 0 && motion.events.back().kind == "zeno_end")
    motion.events.erase(motion.events.begin() + static_cast<std::ptrdiff_t>(n) - 1, motion.events.end() - 1);
  ASSERT_EQ(motion.events.size(), n) << id;
  for (std::size_t k = 0; k < motion.events.size(); ++k) {
    expect_agreement(motion.events[k].time, known["events"][k]["t"], id + " event");
    EXPECT_EQ(motion.events[k].kind, known["events"][k]["kind"]) << id;
    EXPECT_EQ(motion.events[k].contact, known["events"][k]["contact"]) << id;
  }
}

TEST(CertifiedMotion, StoredGroundTruthIsProven) {
  int n_proven = 0;
  for (const auto& known : stored_cases("ground_truth.json")) {
    const std::string id = known["id"];
    Options options;
    options.digits = 42;
    options.max_seconds = 30;
    const auto motion =
        certified_motion(*read_scene_file(std::string(RICOCHET_REFERENCE_DATA) + "/ground_truth.json#" + id), options);
    ASSERT_EQ(motion.grade, Grade::proven) << id << ": " << motion.reason;
    expect_stored_motion(known, motion);
    ++n_proven;
  }
  EXPECT_EQ(n_proven, 16);
}

TEST(CertifiedMotion, StoredMovingScenesAreProven) {
  for (const auto& known : stored_cases("moving_scenes.json")) {
    const std::string id = known["id"];
    Options options;
    options.digits = 42;
    const auto motion =
        certified_motion(*read_scene_file(std::string(RICOCHET_REFERENCE_DATA) + "/moving_scenes.json#" + id), options);
    ASSERT_EQ(motion.grade, Grade::proven) << id << ": " << motion.reason;
    expect_stored_motion(known, motion);
  }
}

/// Runs with other bits, orders and sets enclose the same numbers.
TEST(CertifiedMotion, PrecisionsAgree) {
  for (const char* id :
       {"rocking_block", "pendulum_wall", "belt_oscillator", "stacked_blocks", "pendulum_wall_cartesian"}) {
    const auto coarse = motion_of_problem(id);
    ASSERT_NE(coarse.grade, Grade::open) << id << ": " << coarse.reason;
    for (const auto& [bits, order, form] : {std::tuple(200L, 0.35, false), {190L, 0.22, true}, {220L, 0.55, false}}) {
      Options options;
      options.bits = bits;
      options.order_per_bit = order;
      options.mean_value_form = form;
      const auto fine = motion_of_problem(id, {}, options);
      ASSERT_NE(fine.grade, Grade::open) << id << ": " << fine.reason;
      ASSERT_EQ(fine.events.size(), coarse.events.size());
      for (std::size_t k = 0; k < fine.q.size(); ++k) {
        EXPECT_TRUE(arb_overlaps(interval(coarse.q[k]).get(), interval(fine.q[k]).get())) << id;
        EXPECT_TRUE(arb_overlaps(interval(coarse.v[k]).get(), interval(fine.v[k]).get())) << id;
      }
      for (std::size_t k = 0; k < fine.events.size(); ++k)
        EXPECT_TRUE(arb_overlaps(interval(coarse.events[k].time).get(), interval(fine.events[k].time).get())) << id;
    }
  }
}

/// Two balls that hit the floor at the same time do not touch each other: each bounces as if it were alone.
TEST(CertifiedMotion, DecoupledImpactsAtOnceAreProven) {
  const auto motion = motion_of(R"({"q0": ["0.5", "0.5"], "v0": ["0", "0"], "T": "0.9", "M": [["1", "0"], ["0", "2"]],
    "f": ["-9.81", "-19.62"],
    "contacts": [{"name": "a", "gap": "q[0]", "e": "0.7"}, {"name": "b", "gap": "q[1]", "e": "0.5"}]})");
  ASSERT_EQ(motion.grade, Grade::proven) << motion.reason;
  ASSERT_GE(motion.events.size(), 4u);
  const auto a = motion_of(point_mass("-9.81", "0.5", "0", "0.9", R"([{"name": "a", "gap": "q[0]", "e": "0.7"}])"));
  const auto b = motion_of(point_mass("-9.81", "0.5", "0", "0.9", R"([{"name": "b", "gap": "q[0]", "e": "0.5"}])"));
  EXPECT_TRUE(arb_overlaps(interval(motion.q[0]).get(), interval(a.q[0]).get()));
  EXPECT_TRUE(arb_overlaps(interval(motion.q[1]).get(), interval(b.q[0]).get()));
  EXPECT_TRUE(arb_overlaps(interval(motion.v[1]).get(), interval(b.v[0]).get()));
  EXPECT_GE(motion.decimals(), 30);
}

/// With few bits the times of the impacts are wide; the boxes contain the motion all the same.
TEST(CertifiedMotion, WideWindowsOfImpactsContainTheMotion) {
  const std::string scene = R"({"q0": ["0.5", "0.5"], "v0": ["0", "0"], "T": "0.32", "M": [["1", "0"], ["0", "2"]],
    "f": ["-9.81", "-19.62"],
    "contacts": [{"name": "a", "gap": "q[0]", "e": "0.7"}, {"name": "b", "gap": "q[1]", "e": "0.5"}]})";
  Options coarse;
  coarse.bits = 40;
  coarse.digits = 4;
  const auto wide = motion_of(scene, coarse), narrow = motion_of(scene);
  ASSERT_EQ(wide.grade, Grade::proven) << wide.reason;
  EXPECT_EQ(wide.bits, 40);
  for (int k = 0; k < 2; ++k) {
    EXPECT_TRUE(arb_contains(interval(wide.q[k]).get(), interval(narrow.q[k]).get()));
    EXPECT_TRUE(arb_contains(interval(wide.v[k]).get(), interval(narrow.v[k]).get()));
  }
}

/// What is not proven says why.
TEST(CertifiedMotion, OpenMotionsStateTheirReason) {
  const std::pair<std::string, const char*> scenes[] = {
      {point_mass("sin(1)**2+cos(1)**2-1", "0", "0", "1", R"([{"name": "floor", "gap": "q[0]"}])"), "modes: "},
      {R"({"q0": ["0.1"], "v0": ["-1"], "T": "1", "M": [["1"]], "f": ["0"], "impact_law": "poisson",
           "contacts": [{"name": "wall", "gap": "q[0]", "e": "1"}]})",
       "impact law poisson"}};
  for (const auto& [scene, reason] : scenes) {
    const auto motion = motion_of(scene);
    EXPECT_EQ(motion.grade, Grade::open) << reason;
    EXPECT_TRUE(motion.reason.find(reason) != std::string::npos) << motion.reason;
    EXPECT_TRUE(motion.q.empty());
  }
}

TEST(CertifiedMotion, TimeLimitIsHonoured) {
  Options options;
  options.digits = 300;
  options.max_seconds = 0.05;
  const auto motion = motion_of_problem("double_pendulum_wall", {}, options);
  EXPECT_EQ(motion.grade, Grade::open);
  EXPECT_TRUE(motion.reason.starts_with("the time limit of 0.05 s is exceeded")) << motion.reason;
  EXPECT_LT(motion.seconds, 1);  // a loaded machine
}

/// Data for certificates: the steps follow each other from 0 to the end.
TEST(CertifiedMotion, StepsAreKept) {
  Options options;
  options.with_steps = true;
  const auto motion = motion_of_problem("bouncing_ball", {}, options);
  ASSERT_EQ(std::ssize(motion.steps), motion.n_steps);
  Ball time;
  for (const auto& step : motion.steps) {
    Ball begin, end;
    ASSERT_EQ(arb_load_str(begin.get(), step.time.c_str()), 0);
    ASSERT_EQ(arb_load_str(end.get(), step.end.c_str()), 0);
    EXPECT_TRUE(arb_overlaps(begin.get(), time.get()));
    time = kExact.add(begin, kExact.mul(end, Ball(step.length)));
    EXPECT_EQ(step.state.size(), 2u);
    EXPECT_EQ(step.remainders.size(), 2u);
    EXPECT_EQ(step.modes, std::vector<std::string>{"open"});
  }
  EXPECT_TRUE(arb_overlaps(time.get(), interval(motion.end_time).get()));
}

}  // namespace
}  // namespace ricochet::reference::certified
