// Rolling and drilling friction at a contact (problems/derivatives/rolling_friction.h), against closed forms: a disc that
// rolls, rests on a slope, falls and bounces, a sphere that spins, a press that lifts a disc and lets it fall.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>

#include "methods/registry.h"
#include "problems/derivatives/symbolic_problem.h"
#include "problems/input_error.h"
#include "problems/levers.h"
#include "problems/variables.h"
#include "tests/ground_truth/method_run.h"
#include "tests/test_data.h"

namespace ricochet {
namespace {

constexpr double kM = 2, kR = 0.4, kG = 9.81, kMuR = 0.02;  // of rolling_disc.json
constexpr double kWhole = 1.5 * kM * kR * kR;               // moment of inertia about the contact [kg m2]

std::unique_ptr<Problem> disc(ParameterChanges changes) {
  return read_scene_file(test_data("rolling_disc.json"), changes);
}

/// On the ground, rolling without slip.
ParameterChanges rolling(double v) {
  return {{"height", 0}, {"v_x", v}, {"omega", v / kR}};
}

const std::vector<MethodRun> kExactRollingRuns = {{"fesd_adaptive:radau-iia:4", 0, 1e-11, 1e-10},
                                                  {"fesd:radau-iia:4,elements=as_needed", 300, 0, 1e-10},
                                                  {"event_driven", 0, 1e-12, 1e-10},
                                                  {"cvode", 0, 1e-14, 1e-10},
                                                  {"ida", 0, 1e-13, 1e-9},
                                                  {"arkode", 0, 1e-13, 1e-9}};

void expect_rolling_end(const Problem& problem, const MethodRun& how, const Vector& q, const Vector& v) {
  const Solution s = run_as(problem, how);
  ASSERT_TRUE(s.succeeded()) << how.method << ": " << s.message;
  EXPECT_LE((s.q.head(q.size()) - q).cwiseAbs().maxCoeff(), how.error) << how.method;
  EXPECT_LE((s.v.head(v.size()) - v).cwiseAbs().maxCoeff(), how.error) << how.method;
}

void expect_rolling_end(const Problem& problem, const Vector& q, const Vector& v) {
  for (const MethodRun& how : kExactRollingRuns) expect_rolling_end(problem, how, q, v);
}

TEST(RollingFriction, DiscStopsAndRests) {
  const auto problem = disc(rolling(0.7));
  const double a = kMuR * kG / (kR * 1.5), x = 0.7 * 0.7 / (2 * a);
  expect_rolling_end(*problem, Vector{{x, kR, x / kR}}, Vector::Zero(3));
  for (const MethodRun& how : kExactRollingRuns) {
    const Solution s = run_as(*problem, how);
    ASSERT_EQ(s.events.size(), 1u) << how.method;
    EXPECT_EQ(s.events[0].kind, EventKind::slip_to_stick) << how.method;
    EXPECT_NEAR(s.events[0].t, 0.7 / a, 1e-9) << how.method;
    EXPECT_EQ(problem->info().contacts[static_cast<std::size_t>(s.events[0].contact)].name, "rolling") << how.method;
  }
  const ProblemInfo& info = problem->info();
  EXPECT_EQ(info.n_mechanical(), 3);
  EXPECT_EQ(info.n_q, 4);
  EXPECT_EQ(info.n_c(), 2);
  EXPECT_TRUE(has_levers(info));
}

TEST(RollingFriction, DiscRestsOrRollsOnASlope) {
  const auto on_slope = [](double alpha) {
    ParameterChanges changes = rolling(0);
    changes["alpha"] = alpha;
    changes["mu"] = 0.9;
    return disc(changes);
  };
  const double limit = std::atan(kMuR / kR);
  expect_rolling_end(*on_slope(0.99 * limit), Vector{{0, kR, 0}}, Vector::Zero(3));
  for (const double alpha : {1.01 * limit, 0.1, 0.5}) {
    const double a = kG * (std::sin(alpha) - kMuR / kR * std::cos(alpha)) / 1.5;
    expect_rolling_end(*on_slope(alpha), Vector{{4.5 * a, kR, 4.5 * a / kR}}, Vector{{3 * a, 0, 3 * a / kR}});
  }
}

TEST(RollingFriction, SphereStopsSpinningAndRolling) {
  const auto problem = read_scene_file(test_data("spinning_sphere.json"));
  const double R = 0.2, I = 0.4 * R * R;  // over m
  const double a = 0.01 * kG / (R * 1.4), t_roll = 1 / a, x = 0.5 / a;
  const double b = 0.003 * kG / I, t_spin = 4 / b, angle = 8 / b;
  ASSERT_LT(std::max(t_roll, t_spin), 5);
  const Vector q{{0.6 * x, 0.8 * x, R, -0.8 * x / R, 0.6 * x / R, angle}};
  for (const MethodRun& how : kExactRollingRuns) {
    expect_rolling_end(*problem, how, q, Vector::Zero(6));
    const Solution s = run_as(*problem, how);
    ASSERT_EQ(s.events.size(), 2u) << how.method;
    EXPECT_NEAR(s.events[0].t, std::min(t_roll, t_spin), 1e-9) << how.method;
    EXPECT_NEAR(s.events[1].t, std::max(t_roll, t_spin), 1e-9) << how.method;
  }
}

/// The impulse in an impact is the bound, and the disc rolls on; or it holds the disc, with less than the bound.
TEST(RollingFriction, ImpulseOfAnImpactIsBoundedByItsNormalImpulse) {
  for (const double mu_r : {0.02, 0.5}) {
    const double e = 0, height = 0.3, Lambda_n = (1 + e) * kM * std::sqrt(2 * kG * height);
    const double spin = kM * kR * kR / 2 * 5 + kM * kR * 0.3;  // angular momentum about the contact
    const double Lambda_r = -std::min(mu_r * Lambda_n, spin), omega = (spin + Lambda_r) / kWhole;
    const double Lambda_x = kM * (kR * omega - 0.3);
    ASSERT_LE(std::abs(Lambda_x), 0.5 * Lambda_n) << "the ground holds the disc";
    const auto problem = disc({{"mu_r", mu_r}, {"e", e}});
    for (const MethodRun& how : kExactRollingRuns) {
      const Solution s = run_as(*problem, how);
      ASSERT_TRUE(s.succeeded()) << how.method << ": " << s.message;
      ASSERT_FALSE(s.events.empty());
      const Event& impact = s.events[0];
      EXPECT_EQ(impact.kind, EventKind::impact);
      EXPECT_NEAR(impact.t, std::sqrt(2 * height / kG), 1e-10) << how.method;
      EXPECT_NEAR(impact.Lambda_n[0], Lambda_n, 1e-9) << how.method;
      EXPECT_NEAR(impact.Lambda_n[1], Lambda_n, 1e-9) << how.method;
      EXPECT_NEAR(impact.Lambda_t[0], Lambda_x, 1e-9) << how.method;
      EXPECT_NEAR(impact.Lambda_t[1], Lambda_r, 1e-9) << how.method;
      EXPECT_NEAR(impact.v_plus[2], omega, 1e-9) << how.method;
    }
  }
}

/// Flights at constant spin; every impact takes mu_r Lambda_n of the angular momentum. At rest after all of them.
struct BouncingDisc {
  double t_rolling = 0, t_stop = 0, x = 0, phi = 0;

  BouncingDisc(double e, double height) {
    const double T = 20;
    double V = std::sqrt(2 * kG * height), t = std::sqrt(2 * height / kG), spin = kM * kR * kR / 2 * 5 + kM * kR * 0.3;
    x = 0.3 * t;
    phi = 5 * t;
    double omega = 0;
    while (V > 1e-12 && t < T) {
      spin -= kMuR * (1 + e) * kM * V;
      omega = spin / kWhole;
      V *= e;
      const double flight = 2 * V / kG;
      t += flight;
      x += kR * omega * flight;
      phi += omega * flight;
    }
    const double deceleration = kMuR * kM * kG / kWhole;
    t_rolling = t;
    t_stop = t + omega / deceleration;
    const double turn = omega * omega / (2 * deceleration);
    x += kR * turn;
    phi += turn;
  }
};

TEST(RollingFriction, BouncingDiscLosesSpinInImpactsOnly) {
  const BouncingDisc hand(0.7, 0.3);
  ASSERT_LT(hand.t_stop, 3);
  ASSERT_GT(hand.t_stop, hand.t_rolling + 0.1);
  const auto problem = disc({});
  for (const MethodRun& how : {MethodRun{"fesd_adaptive:radau-iia:4", 0, 1e-11, 1e-9},
                               {"event_driven", 0, 1e-12, 1e-9},
                               {"cvode", 0, 1e-14, 1e-9},
                               {"arkode", 0, 1e-13, 1e-9}})
    expect_rolling_end(*problem, how, Vector{{hand.x, kR, hand.phi}}, Vector::Zero(3));
}

/// As the disc, with two elements at one contact: each takes its part of an angular momentum in every impact. The sphere
/// rolls without slip from the start. Event location may not pass the end of the impacts of three contacts.
TEST(RollingFriction, BouncingSphereLosesBothSpinsInImpacts) {
  const double R = 0.2, e = 0.5, height = 0.2, I = 0.4 * R * R;  // over m
  const auto angle_at_rest = [&](double omega, double mu, double inertia) {
    double V = std::sqrt(2 * kG * height), angle = omega * V / kG;
    for (; V > 1e-12; V *= e) {
      omega -= mu * (1 + e) * V / inertia;
      angle += omega * 2 * e * V / kG;
    }
    EXPECT_GT(omega, 1) << "it turns after the impacts";
    return angle + omega * omega * inertia / (2 * mu * kG);
  };
  const double roll = angle_at_rest(1 / R, 0.01, 1.4 * R * R), spin = angle_at_rest(4, 0.003, I);
  const Vector q{{0.6 * R * roll, 0.8 * R * roll, R, -0.8 * roll, 0.6 * roll, spin}};
  const auto problem = read_scene_file(test_data("spinning_sphere.json"), {{"e", e}, {"height", height}});
  for (const MethodRun& how : {MethodRun{"fesd_adaptive:radau-iia:4", 0, 1e-11, 1e-9},
                               {"fesd:radau-iia:4,elements=as_needed", 300, 0, 1e-9},
                               {"moreau_jean", 50000, 0, 2e-3}})
    expect_rolling_end(*problem, how, q, Vector::Zero(6));
  for (const char* method : {"event_driven", "cvode"}) {
    const Solution s = run_as(*problem, {method, 0, 1e-12});
    if (s.succeeded()) EXPECT_LE((s.q.head(6) - q).cwiseAbs().maxCoeff(), 1e-8) << method;
  }
}

TEST(RollingFriction, TimeSteppingIsOfFirstOrder) {
  const BouncingDisc hand(0, 0.3);
  const auto problem = disc({{"e", 0}});
  const auto error = [&](const std::string& method, int steps) {
    const Solution s = run_as(*problem, {method.c_str(), steps, 0});
    EXPECT_TRUE(s.succeeded()) << method << ": " << s.message;
    return std::max(std::abs(s.q[0] - hand.x), std::abs(s.q[2] - hand.phi));
  };
  // The time of the impact is known to one step, so that an error of about omega h is allowed, 15 / steps here.
  for (const char* method :
       {"moreau_jean", "moreau_jean,solver=pgs", "moreau_jean,solver=newton", "moreau_jean,solver=interior_point",
        "moreau_jean,solver=staggered", "moreau_jean,solver=admm", "moreau_jean,solver=lemke", "anitescu_potra",
        "stewart_trinkle", "schatzman_paoli", "generalized_alpha", "rattle", "d1_minus"}) {
    for (const int steps : {1000, 8000}) EXPECT_LE(error(method, steps), 15.0 / steps) << method << " " << steps;
  }
  for (const char* method : {"event_capturing", "extrapolated_moreau"}) {
    const bool is_adaptive = std::string(method) == "extrapolated_moreau";
    const Solution s = run_as(*problem, {method, is_adaptive ? 0 : 4000, is_adaptive ? 1e-8 : 0});
    ASSERT_TRUE(s.succeeded()) << method << ": " << s.message;
    EXPECT_NEAR(s.q[0], hand.x, 1e-6) << method;
  }
}

/// The load of a press lifts the disc and lets it fall again. Whatever the flight, the normal forces and impulses have
/// the impulse of the load, I(T) = m g (b T + sin(w T) / w), if the disc lies on the ground at T.
TEST(RollingFriction, ContactOpensAndCloses) {
  const double b = 0.5, w = 4, T = 3.5, omega = 12;
  const std::string text = fmt::format(
      R"~({{"params": {{"m": "{}", "R": "{}", "g": "{}"}}, "q0": ["0", "R", "0"], "v0": ["{}*R", "0", "{}"], "T": "{}",
           "M": [["m", "0", "0"], ["0", "m", "0"], ["0", "0", "m*R**2/2"]], "f": ["0", "-m*g*({}+cos({}*t))", "0"],
           "contacts": [{{"name": "ground", "gap": "q[1]-R", "mu": "0.9", "Jt": [["1", "0", "-R"]]}}],
           "friction": [{{"name": "rolling", "Jt": [["0", "0", "1"]],
                         "contact": "ground", "coefficient": "{}"}}]}})~",
      kM, kR, kG, omega, omega, T, b, w, kMuR);
  const auto problem = read_scene_text(text, "scene");
  EXPECT_EQ(problem->info().n_mechanical(), 3);
  const double impulse = kM * kG * (b * T + std::sin(w * T) / w), end = omega - kMuR * impulse / kWhole;
  ASSERT_GT(end, 1);
  const Solution first = run_as(*problem, kExactRollingRuns[2]);
  ASSERT_TRUE(first.succeeded()) << first.message;
  const auto count = [&](EventKind kind) {
    return std::ranges::count_if(first.events, [&](const Event& e) { return e.kind == kind && e.contact == 0; });
  };
  EXPECT_EQ(count(EventKind::detach), 2);
  EXPECT_EQ(count(EventKind::impact), 2);
  Vector q = first.q.head(3), v(3);
  q[1] = kR;
  v << kR * end, 0, end;
  for (const MethodRun& how : kExactRollingRuns)
    expect_rolling_end(*problem, {how.method, how.steps, how.tolerance, 1e-8}, q, v);
}

/// A coefficient that depends on the place: mu_r = c x, so that x'' = -k x with k = c g / (1.5 R).
TEST(RollingFriction, CoefficientMayVary) {
  const double c = 0.1, k = c * kG / (1.5 * kR), x_0 = 0.2, v_0 = 0.3, T = 0.4;
  const std::string text = fmt::format(
      R"({{"q0": ["{}", "0.4", "0"], "v0": ["{}", "0", "{}/0.4"], "T": "{}",
           "M": [["2", "0", "0"], ["0", "2", "0"], ["0", "0", "0.16"]], "f": ["0", "-2*9.81", "0"],
           "contacts": [{{"name": "ground", "gap": "q[1]-0.4", "mu": "0.5", "Jt": [["1", "0", "-0.4"]]}}],
           "friction": [{{"name": "rolling", "Jt": [["0", "0", "1"]],
                         "contact": "ground", "coefficient": "{}*q[0]"}}]}})",
      x_0, v_0, v_0, T, c);
  const auto problem = read_scene_text(text, "scene");
  const double w = std::sqrt(k), x = x_0 * std::cos(w * T) + v_0 / w * std::sin(w * T),
               v = -x_0 * w * std::sin(w * T) + v_0 * std::cos(w * T);
  ASSERT_GT(v, 0);
  for (const MethodRun& how : {kExactRollingRuns[0], kExactRollingRuns[2], kExactRollingRuns[3]})
    expect_rolling_end(*problem, how, Vector{{x, kR, (x - x_0) / kR}}, Vector{{v, 0, v / kR}});
  EXPECT_NEAR(problem->friction_coefficients(problem->info().q0)[1], c * x_0, 1e-15);
}

TEST(RollingFriction, StandsBesideOtherElements) {
  // A brake on the same disc: both torques add up. cvode declines the rest, where two elements hold one angle.
  const double F = 0.1;
  const auto braked = [&](double T) {
    return read_scene_text(fmt::format(R"({{"q0": ["0", "0.4", "0"], "v0": ["0.5", "0", "1.25"], "T": "{}",
           "M": [["2", "0", "0"], ["0", "2", "0"], ["0", "0", "0.16"]], "f": ["0", "-2*9.81", "0"],
           "contacts": [{{"name": "ground", "gap": "q[1]-0.4", "mu": "0.5", "Jt": [["1", "0", "-0.4"]]}}],
           "friction": [{{"name": "brake", "Jt": [["0", "0", "1"]], "bound": "{}"}},
                        {{"name": "rolling", "Jt": [["0", "0", "1"]], "contact": "ground", "coefficient": "0.02"}}]}})",
                                       T, F),
                           "scene");
  };
  const auto problem = braked(1);
  const ProblemInfo& info = problem->info();
  EXPECT_EQ(info.n_friction_elements, 2);
  EXPECT_EQ(info.contacts[1].name, "rolling");
  EXPECT_EQ(info.contacts[2].name, "brake");
  EXPECT_EQ(info.contacts[2].bound, F);
  const double a = (kMuR * kM * kG + F) / kWhole, omega = 1.25 - a, phi = 1.25 - a / 2, turn = 1.25 * 1.25 / (2 * a);
  for (const MethodRun& how : {kExactRollingRuns[0], kExactRollingRuns[2], kExactRollingRuns[3]})
    expect_rolling_end(*problem, how, Vector{{kR * phi, kR, phi}}, Vector{{kR * omega, 0, omega}});
  for (const MethodRun& how : {kExactRollingRuns[0], kExactRollingRuns[2]})
    expect_rolling_end(*braked(2), how, Vector{{kR * turn, kR, turn}}, Vector::Zero(3));
}

TEST(RollingFriction, SensitivitiesMatchDifferences) {
  const auto problem = disc({{"e", 0}, {"mu_r", 0.01}});
  const std::vector<std::string> names = {"param:mu_r", "param:omega", "param:height", "v0:0"};
  for (const MethodRun& how : {kExactRollingRuns[0], kExactRollingRuns[2]}) {
    const Solution s = run_as(*problem, how, names);
    ASSERT_TRUE(s.succeeded()) << how.method << ": " << s.message;
    for (std::size_t k = 0; k < names.size(); ++k) {
      const auto variable = find_variable(problem->info(), names[k]);
      const double at = variables(problem->info())[static_cast<std::size_t>(variable)].value, h = 1e-5;
      const Solution more = run_as(*with_value(*problem, variable, at + h), how),
                     less = run_as(*with_value(*problem, variable, at - h), how);
      const Eigen::Index i = static_cast<Eigen::Index>(k);
      const Vector dq = (more.q - less.q) / (2 * h), dv = (more.v - less.v) / (2 * h);
      EXPECT_LE((s.dq.col(i) - dq).head(3).cwiseAbs().maxCoeff(), 1e-4) << how.method << " " << names[k];
      EXPECT_LE((s.dv.col(i) - dv).head(3).cwiseAbs().maxCoeff(), 1e-4) << how.method << " " << names[k];
    }
  }
}

TEST(RollingFriction, ExportReadsBack) {
  for (const char* name : {"rolling_disc", "spinning_sphere"})
    expect_export_reads_back(*read_scene_file(test_data(std::string(name) + ".json")), kExactRollingRuns[0]);
}

TEST(RollingFriction, MayVanish) {
  const auto problem = disc({{"mu_r", 0}, {"height", 0}, {"v_x", 0.4}, {"omega", 1}});
  expect_rolling_end(*problem, kExactRollingRuns[2], Vector{{1.2, kR, 3}}, Vector{{0.4, 0, 1}});
}

TEST(RollingFriction, ParametersMayChange) {
  const auto problem = disc(rolling(0.7));
  SymbolicProblem& open = *problem->symbolic();
  open.open_parameters();
  std::vector<double> values;
  for (const ParameterInfo& parameter : open.info().parameters)
    values.push_back(parameter.name == "mu_r" ? 0.05 : parameter.value);
  ASSERT_TRUE(open.set_parameters(values));
  const double x = 0.7 * 0.7 * kR * 1.5 / (2 * 0.05 * kG);
  expect_rolling_end(open, kExactRollingRuns[0], Vector{{x, kR, x / kR}}, Vector::Zero(3));
}

TEST(RollingFriction, MethodsWithoutItDecline) {
  const auto problem = disc({{"e", 0}});
  for (const char* method : {"anitescu_convex", "penalty", "sap", "soft_step", "xpbd", "fesd_homotopy:radau-iia:2",
                             "time_freezing:radau-iia:3"}) {
    const Support support = make_method(method)->can_run(problem->info());
    EXPECT_FALSE(support.ok) << method;
    EXPECT_FALSE(support.reason.empty()) << method;
  }
  auto poisson = disc({});
  ImpactLaw law;
  law.hypothesis = ImpactHypothesis::poisson;
  poisson->set_impact_law(law);
  EXPECT_THROW(validate(*poisson), InputError);
}

/// A method that takes the contacts of a lever one by one turns it.
TEST(RollingFriction, LeverThatTurnsIsNoSuccess) {
  const auto problem = disc({});
  Solution s;
  s.q = problem->info().q0;
  s.v = problem->info().v0;
  Solution good = s;
  fail_where_bound_is_negative(*problem, 0, good);
  EXPECT_TRUE(good.succeeded());
  s.v[3] = 1e-3;
  for (const double h : {0.0, 1e-3}) {
    Solution bad = s;
    fail_where_bound_is_negative(*problem, h, bad);
    EXPECT_EQ(bad.status, Status::inner_solver_failed);
    EXPECT_NE(bad.message.find("'rolling'"), std::string::npos) << bad.message;
    Solution before = good;
    before.events.emplace_back();
    before.events[0].t = 1;
    before.events[0].q = s.q;
    before.events[0].v_plus = s.v;
    fail_where_bound_is_negative(*problem, h, before);
    EXPECT_EQ(before.status, Status::inner_solver_failed);
  }
}

TEST(RollingFriction, BadInputIsNamed) {
  const auto message = [](const std::string& element, const std::string& more = "") -> std::string {
    try {
      read_scene_text(
          R"({"params": {"minus": "-1"}, "q0": ["0", "1"], "v0": ["0", "0"], "T": "1", "M": [["1", "0"], ["0", "1"]],
              "f": ["0", "0"], "contacts": [{"name": "floor", "gap": "q[1]"}, {"name": "soft", "gap": "q[1]+1", "e": "vn"},
              {"name": "joint", "gap": "q[0]", "bilateral": true}], "friction": [)" +
              element + "]" + more + "}",
          "scene");
    } catch (const InputError& error) {
      return error.what();
    }
    return "accepted";
  };
  const auto expect = [&](const std::string& fields, const char* part) {
    const std::string element = R"({"name": "roll", "Jt": [["1", "0"]])" + fields + "}";
    EXPECT_NE(message(element).find(part), std::string::npos) << fields << ": " << message(element);
  };
  expect(R"(, "contact": "floor", "coefficient": "0.1")", "accepted");
  expect(R"(, "contact": "floor", "coefficient": "0")", "accepted");
  expect(R"()", "friction[0]");
  expect(R"(, "contact": "floor")", "coefficient");
  expect(R"(, "coefficient": "0.1")", "friction[0].coefficient");
  expect(R"(, "contact": "floor", "coefficient": "0.1", "bound": "1")", "friction[0].bound");
  expect(R"(, "contact": "wall", "coefficient": "0.1")", "floor, soft, joint");
  expect(R"(, "contact": "roll", "coefficient": "0.1")", "friction[0].contact");
  expect(R"(, "contact": "joint", "coefficient": "0.1")", "bilateral");
  expect(R"(, "contact": "soft", "coefficient": "0.1")", "vn");
  expect(R"(, "contact": "floor", "coefficient": "-0.1")", "friction[0].coefficient");
  expect(R"(, "contact": "floor", "coefficient": "minus")", "friction[0].coefficient");
  expect(R"(, "contact": "floor", "coefficient": "v[0]")", "v");
  expect(R"~(, "contact": "floor", "coefficient": "max(q[1], 0.1)")~", "'roll': coefficient");
  expect(R"~(, "contact": "floor", "coefficient": "max(minus, 0.1)")~", "accepted");
  const std::string good = R"({"Jt": [["1", "0"]], "contact": "floor", "coefficient": "0.1"})";
  const std::string law = R"(, "impact_law": {"hypothesis": "poisson"})";
  EXPECT_NE(message(good, law).find("newton is required"), std::string::npos) << message(good, law);
}

}  // namespace
}  // namespace ricochet
