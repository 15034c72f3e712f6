// Friction coefficients that are formulas of the place or the time (problems/derivatives/varying_friction.h), and
// coefficients of restitution that are formulas of the approach speed, against closed forms.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>

#include "methods/registry.h"
#include "problems/derivatives/symbolic_problem.h"
#include "problems/input_error.h"
#include "problems/scene_file/scene_file.h"
#include "problems/scene_file/scene_writer.h"
#include "problems/variables.h"
#include "reference/ground_truth.h"
#include "tests/ground_truth/method_run.h"
#include "tests/test_data.h"

namespace ricochet {
namespace {

/// A point of unit mass in the plane above the ground q[1] = 0, with weight `g` towards it. @param contact  e, mu
std::unique_ptr<Problem> point_on_ground(const std::string& q0, const std::string& v0, const std::string& f,
                                         const std::string& contact, const std::string& T,
                                         const std::string& params = "") {
  return read_scene_text(
      fmt::format(R"~({{"params": {{"g": "9.81"{}}}, "q0": [{}], "v0": [{}], "T": "{}", "M": [["1", "0"], ["0", "1"]],
  "f": [{}], "contacts": [{{"name": "ground", "gap": "q[1]", "Jt": [["1", "0"]], {}}}]}})~",
                  params, q0, v0, T, f, contact),
      "scene");
}

struct FinalState {
  std::vector<double> q, v;
};

double varying_error(const Solution& s, const FinalState& exact) {
  double error = 0;
  for (std::size_t k = 0; k < exact.q.size(); ++k) {
    const auto i = static_cast<Eigen::Index>(k);
    error = std::max({error, std::abs(s.q[i] - exact.q[k]), std::abs(s.v[i] - exact.v[k])});
  }
  return error;
}

void expect_varying_end(const Problem& problem, const std::vector<MethodRun>& runs, const FinalState& exact) {
  for (const MethodRun& how : runs) {
    const Solution s = run_as(problem, how);
    ASSERT_TRUE(s.succeeded()) << how.method << ": " << s.message;
    EXPECT_LE(varying_error(s, exact), how.error) << how.method;
  }
}

const std::vector<MethodRun> kExactVaryingRuns = {{"fesd_adaptive:radau-iia:4", 0, 1e-11, 1e-10},
                                                  {"fesd:radau-iia:4", 300, 0, 1e-10},
                                                  {"event_driven", 0, 1e-12, 1e-10},
                                                  {"event_driven:radau-iia", 0, 1e-12, 1e-10},
                                                  {"cvode", 0, 1e-13, 1e-10}};

/// Slides from q = 0 at speed v_0 on mu = a + b q until it rests.
struct HarmonicSlide {
  double a = 0.2, b = 0.3, g = 9.81, v_0 = 2;
  double w() const { return std::sqrt(g * b); }
  double rest() const { return -a / b + std::hypot(a / b, v_0 / w()); }
  double q(double t) const { return -a / b + a / b * std::cos(w() * t) + v_0 / w() * std::sin(w() * t); }
  double v(double t) const { return v_0 * std::cos(w() * t) - a / b * w() * std::sin(w() * t); }
};

TEST(VaryingFriction, BlockSlidesHarmonicallyAndRests) {
  const auto problem = read_scene_file(test_data("rough_patch.json"));
  const HarmonicSlide exact;
  expect_varying_end(*problem, kExactVaryingRuns, {{exact.rest(), 0}, {0, 0}});
  const ProblemInfo& info = problem->info();
  EXPECT_TRUE(info.contacts[0].mu_varies);
  EXPECT_EQ(info.contacts[0].mu, 1);
  EXPECT_FALSE(info.contacts[0].is_affine);
  EXPECT_DOUBLE_EQ(problem->friction_coefficients(Vector::Constant(2, 0.5))[0], 0.35);
  EXPECT_DOUBLE_EQ(problem->friction_forces(Vector::Constant(2, 0.5), Vector::Constant(1, -2))[0], -0.7);
  const Solution s = run_as(*problem, kExactVaryingRuns[0]);
  ASSERT_EQ(s.events.size(), 1u);
  EXPECT_EQ(s.events[0].kind, EventKind::slip_to_stick);
}

/// A slope whose friction coefficient falls with the time: the block sticks until mu g_n = g_t, and slips then.
TEST(VaryingFriction, CoefficientFallsWithTheTime) {
  const auto smooth =
      point_on_ground(R"~("0", "0")~", R"~("0", "0")~", R"~("3", "-9")~", R"~("mu": "1/2-t/4")~", "1.5");
  const double s = 1.5 - 2.0 / 3;
  expect_varying_end(*smooth, kExactVaryingRuns, {{0.375 * s * s * s, 0}, {1.125 * s * s, 0}});
  const auto jump =
      point_on_ground(R"~("0", "0")~", R"~("0", "0")~", R"~("3", "-9")~", R"~("mu": "if(t<1/2,0.5,0.2)")~", "1.5");
  expect_varying_end(*jump, kExactVaryingRuns, {{0.6, 0}, {1.2, 0}});
}

/// Smooth ground up to 1/2, and rough ground beyond.
TEST(VaryingFriction, CoefficientJumpsWithThePlace) {
  const auto problem =
      point_on_ground(R"~("0", "0")~", R"~("2", "0")~", R"~("0", "-g")~", R"~("mu": "if(q[0]<1/2,1/5,2/5)")~", "1");
  const double at_border = 4 - 0.2 * 9.81;
  expect_varying_end(*problem, kExactVaryingRuns, {{0.5 + at_border / (2 * 0.4 * 9.81), 0}, {0, 0}});
  const auto bend = point_on_ground(R"~("0", "0")~", R"~("2", "0")~", R"~("0", "-g")~",
                                    R"~("mu": "0.1+max(0,q[0]-1/2)*0.3")~", "0.9");
  const double g = 9.81, v_1 = std::sqrt(4 - 2 * 0.1 * g * 0.5), t_1 = (2 - v_1) / (0.1 * g);
  const HarmonicSlide rest{.a = 0.1, .b = 0.3, .v_0 = v_1};
  expect_varying_end(*bend, kExactVaryingRuns, {{0.5 + rest.q(0.9 - t_1), 0}, {rest.v(0.9 - t_1), 0}});
}

/// A belt carries a block along until both have the same velocity: exp(w t) instead of cos(w t).
TEST(VaryingFriction, BeltCarriesABlock) {
  const auto problem = point_on_ground(R"~("0", "0")~", R"~("0", "0")~", R"~("0", "-g")~",
                                       R"~("mu": "0.2+0.3*q[0]", "vt_drive": ["-1"])~", "1");
  const double w = std::sqrt(9.81 * 0.3), c = 2.0 / 3, t_1 = std::asinh(1 / (c * w)) / w;
  expect_varying_end(*problem, kExactVaryingRuns, {{c * (std::cosh(w * t_1) - 1) + 1 - t_1, 0}, {1, 0}});
}

/// In space along a line, where the disc has to have the radius mu lambda_n in all directions.
TEST(VaryingFriction, PuckSlidesAlongALine) {
  const auto problem = read_scene_text(
      R"~({"q0": ["0", "0", "0"], "v0": ["1.2", "1.6", "0"], "T": "1", "M": [["1","0","0"],["0","1","0"],["0","0","1"]],
  "f": ["0", "0", "-9.81"], "contacts": [{"name": "ice", "gap": "q[2]", "mu": "0.2+0.3*(0.6*q[0]+0.8*q[1])",
                                          "Jt": [["1", "0", "0"], ["0", "1", "0"]]}]})~",
      "scene");
  const double rest = HarmonicSlide().rest();
  expect_varying_end(*problem, kExactVaryingRuns, {{0.6 * rest, 0.8 * rest, 0}, {0, 0, 0}});
}

/// Three impacts with friction at places with different coefficients, and an e that falls with the speed.
struct RoughBounce {
  double q = 0, v = 2, g = 9.81, t = 0;
  std::vector<double> Lambda_n, Lambda_t;
  FinalState at(double T, auto&& e, auto&& mu) {
    double rise = 0, height = 0.5;
    for (;;) {
      const double impact = (rise + std::sqrt(rise * rise + 2 * g * height)) / g;
      if (t + impact > T) break;
      t += impact;
      q += v * impact;
      const double approach = g * impact - rise;
      rise = e(approach) * approach;
      Lambda_n.push_back(approach + rise);
      Lambda_t.push_back(-mu(q) * (approach + rise));
      v += Lambda_t.back();
      height = 0;
    }
    const double left = T - t;
    return {{q + v * left, height + rise * left - g * left * left / 2}, {v, rise - g * left}};
  }
};

TEST(VaryingFriction, ImpactsAtDifferentPlaces) {
  const auto problem = point_on_ground(R"~("0", "1/2")~", R"~("2", "0")~", R"~("0", "-g")~",
                                       R"~("mu": "0.05+0.1*q[0]**2", "e": "0.8/(1+0.1*vn)")~", "1.1");
  RoughBounce bounce;
  const FinalState exact = bounce.at(
      1.1, [](double v_n) { return 0.8 / (1 + 0.1 * v_n); }, [](double q) { return 0.05 + 0.1 * q * q; });
  ASSERT_EQ(bounce.Lambda_n.size(), 3u);
  expect_varying_end(*problem, kExactVaryingRuns, exact);
  const Solution s = run_as(*problem, kExactVaryingRuns[2]);
  ASSERT_EQ(s.events.size(), 3u);
  for (std::size_t k = 0; k < 3; ++k) {
    EXPECT_NEAR(s.events[k].Lambda_n[0], bounce.Lambda_n[k], 1e-10);
    EXPECT_NEAR(problem->friction_forces(s.events[k].q, s.events[k].Lambda_t)[0], bounce.Lambda_t[k], 1e-10);
  }
}

/// All laws of impacts: the scaled tangents do not change them. Reference and methods have separate code.
TEST(VaryingFriction, StatedLawsAgreeWithTheReference) {
  for (const char* law : {"newton", "poisson", "routh", "stronge"}) {
    const auto scene = [&](const char* mu) {
      return read_scene_text(
          fmt::format(
              R"~({{"q0": ["0", "0.6", "0.6"], "v0": ["4", "0", "-2"], "T": "0.6", "f": ["0", "-9.81", "0"],
  "M": [["1","0","0"],["0","1","0"],["0","0","1/12"]], "impact_law": "{}",
  "contacts": [{{"name": "tip", "gap": "q[1]-cos(q[2])/2", "e": "0.9-0.05*vn", "mu": "{}",
                "Jt": [["1", "0", "cos(q[2])/2"]]}}]}})~",
              law, mu),
          "scene");
    };
    const auto varying = scene("0.02+0.1*sin(t)"), constant = scene("0.02");
    const Solution s = run_as(*varying, kExactVaryingRuns[2]);
    ASSERT_TRUE(s.succeeded()) << law << ": " << s.message;
    ASSERT_GE(s.events.size(), 1u);
    for (const MethodRun& how : kExactVaryingRuns) {
      const Solution other = run_as(*varying, how);
      ASSERT_TRUE(other.succeeded()) << how.method << " " << law << ": " << other.message;
      EXPECT_LE((other.v - s.v).cwiseAbs().maxCoeff(), 1e-9) << how.method << " " << law;
    }
    // The first impact is that with the coefficient at its instant.
    const auto at_impact = scene(fmt::format("{:.17g}", 0.02 + 0.1 * std::sin(s.events[0].t)).c_str());
    const Solution same = run_as(*at_impact, kExactVaryingRuns[2]);
    EXPECT_LE((same.events[0].v_plus - s.events[0].v_plus.head(3)).cwiseAbs().maxCoeff(), 1e-10) << law;
    const Solution other = run_as(*constant, kExactVaryingRuns[2]);
    EXPECT_GE((other.events[0].v_plus - s.events[0].v_plus.head(3)).cwiseAbs().maxCoeff(), 1e-3) << law;
  }
}

TEST(VaryingFriction, CoefficientThatIsNotPositiveIsNoSuccess) {
  // It vanishes at 2/3, or is negative around 1/2 only; the last one vanishes on an interval.
  for (const char* mu :
       {"0.2-0.3*q[0]", "0.3+2*if(abs(q[0]-1/2)<0.1,-1,0)", "(q[0]-0.5)**2-0.001", "max(0,0.2-0.3*q[0])"}) {
    const auto problem =
        point_on_ground(R"~("0", "0")~", R"~("2", "0")~", R"~("0", "-g")~", fmt::format(R"~("mu": "{}")~", mu), "0.6");
    for (const MethodEntry& entry : methods()) {
      if (entry.examples.empty()) continue;
      const std::string& name = entry.examples.front();
      if (!make_method(name)->can_run(problem->info()).ok) continue;
      for (const Recording recording : {Recording::final_state, Recording::grid}) {
        try {
          const Solution s = run_as(*problem, {name.c_str(), entry.conformance_steps / 4, 1e-8, 0}, {}, recording);
          EXPECT_FALSE(s.succeeded()) << name << " " << mu;
        } catch (const InputError& declined) {  // a program, whose contacts must be smooth
          EXPECT_NE(std::string(declined.what()).find("mu of 'ground'"), std::string::npos) << name << " " << mu;
        }
      }
    }
    EXPECT_THROW(reference::make_reference(*problem), std::exception) << mu;
  }
}

TEST(VaryingFriction, SensitivitiesMatchDifferences) {
  const auto slide = point_on_ground(R"~("0", "0")~", R"~("2", "0")~", R"~("0", "-g")~", R"~("mu": "a+b*q[0]")~", "0.5",
                                     R"~(, "a": "0.2", "b": "0.3")~");
  const auto bounce = point_on_ground(R"~("0", "1/2")~", R"~("2", "0")~", R"~("0", "-g")~",
                                      R"~("mu": "a+b*q[0]**2", "e": "e0/(1+c*vn)")~", "1.1",
                                      R"~(, "a": "0.05", "b": "0.1", "e0": "0.8", "c": "0.1")~");
  const auto falls = point_on_ground(R"~("0", "0")~", R"~("0", "0")~", R"~("3", "-9")~", R"~("mu": "a-b*t")~", "1.5",
                                     R"~(, "a": "0.5", "b": "0.25")~");
  const std::vector<std::pair<const Problem*, std::vector<std::string>>> cases = {
      {slide.get(), {"q0:0", "v0:0", "param:a", "param:b", "param:g"}},
      {bounce.get(), {"q0:0", "q0:1", "v0:0", "v0:1", "param:a", "param:b", "param:g", "param:e0", "param:c"}},
      {falls.get(), {"param:a", "param:b"}}};
  for (const auto& [problem, names] : cases) {
    for (const MethodRun& how : {kExactVaryingRuns[0], kExactVaryingRuns[1], kExactVaryingRuns[2]}) {
      const Solution s = run_as(*problem, how, names);
      ASSERT_TRUE(s.succeeded()) << how.method << ": " << s.message;
      for (std::size_t k = 0; k < names.size(); ++k) {
        const auto variable = find_variable(problem->info(), names[k]);
        const double at = variables(problem->info())[static_cast<std::size_t>(variable)].value, h = 1e-4;
        const Solution more = run_as(*with_value(*problem, variable, at + h), how),
                       less = run_as(*with_value(*problem, variable, at - h), how);
        const auto i = static_cast<Eigen::Index>(k);
        const Vector dq = (more.q - less.q) / (2 * h), dv = (more.v - less.v) / (2 * h);
        EXPECT_LE((s.dq.col(i) - dq).head(2).cwiseAbs().maxCoeff(), 3e-6) << how.method << " " << names[k];
        EXPECT_LE((s.dv.col(i) - dv).head(2).cwiseAbs().maxCoeff(), 3e-6) << how.method << " " << names[k];
      }
    }
  }
}

FinalState slowing_ball(double T) {
  const double g = 9.81;
  double t = std::sqrt(2 / g), rise = 0.9 * g * t / (1 + 0.1 * g * t);
  while (t + 2 * rise / g < T) {
    t += 2 * rise / g;
    rise = 0.9 * rise / (1 + 0.1 * rise);
  }
  return {{rise * (T - t) - g * (T - t) * (T - t) / 2}, {rise - g * (T - t)}};
}

TEST(VaryingRestitution, SpeedsFollowTheRecursion) {
  const auto problem = read_scene_file(test_data("slowing_ball.json"));
  expect_varying_end(*problem, kExactVaryingRuns, slowing_ball(2.2));
  expect_varying_end(*problem, {{"ida", 0, 1e-12, 1e-8}, {"arkode", 0, 1e-12, 1e-8}}, slowing_ball(2.2));
  const ContactInfo& contact = problem->info().contacts[0];
  EXPECT_EQ(contact.eps_r, ContactInfo::kVaries);
  EXPECT_DOUBLE_EQ(contact.restitution(-2), 0.9 / 1.2);
  EXPECT_NEAR(contact.restitution_slope(-2), 0.9 / (1.2 * 1.2), 1e-15) << "of e0 v / (1 + c v)";
  EXPECT_EQ(contact.restitution(0), 0);
  EXPECT_EQ(contact.restitution(1), 0);
  EXPECT_FALSE(contact.is_elastic());
}

/// Impacts below 1 m/s are plastic, so that a few bounces end at rest.
TEST(VaryingRestitution, SlowImpactsMayBePlastic) {
  const auto problem = read_scene_text(
      R"~({"q0": ["1"], "v0": ["0"], "T": "3", "M": [["1"]], "f": ["-9.81"],
  "contacts": [{"name": "floor", "gap": "q[0]", "e": "if(vn<1,0,0.6)"}]})~",
      "scene");
  expect_varying_end(*problem, kExactVaryingRuns, {{0}, {0}});
  const Solution s = run_as(*problem, kExactVaryingRuns[2]);
  EXPECT_EQ(s.events.size(), 4u) << "at 4.43, 2.66, 1.59 and 0.957 m/s, of which the last does not rebound";
}

/// Every method that runs the scenes converges to their closed forms, time stepping with order 1 through impacts.
TEST(VaryingCoefficients, EveryMethodConvergesOrDeclines) {
  const auto slide = read_scene_file(test_data("rough_patch.json"));
  slide->set_end_time(0.5);
  const HarmonicSlide harmonic;
  const FinalState slid{{harmonic.q(0.5), 0}, {harmonic.v(0.5), 0}};
  const auto ball = read_scene_file(test_data("slowing_ball.json"));
  ball->set_end_time(1.1);
  const FinalState bounced = slowing_ball(1.1);
  int n_slide = 0, n_ball = 0;
  for (const MethodEntry& entry : methods()) {
    if (entry.name == "fesd_homotopy") continue;  // below: its iteration is not robust in many short steps
    for (const std::string& example : entry.examples) {
      const auto method = make_method(example);
      for (const bool slides : {true, false}) {
        const Problem& problem = slides ? *slide : *ball;
        const FinalState& exact = slides ? slid : bounced;
        if (!method->can_run(problem.info()).ok) continue;
        ++(slides ? n_slide : n_ball);
        const MethodInfo info = method->info();
        const auto error = [&](int steps) {
          const Solution s = run_as(problem, {example.c_str(), steps, 1e-8, 0});
          EXPECT_TRUE(s.succeeded()) << example << ": " << s.message;
          return varying_error(s, exact);
        };
        if (info.is_adaptive) {
          EXPECT_LE(error(0), 1e-5) << example << (slides ? " slides" : " bounces");
          continue;
        }
        const double coarse = error(200), fine = error(800);
        const bool is_soft = example.find("stiffness=") != std::string::npos;  // the ground gives way
        EXPECT_LE(fine, is_soft ? 2e-2 : std::max(1e-3, 0.5 * coarse)) << example << (slides ? " slides" : " bounces");
        EXPECT_LE(fine, 4e-2) << example << (slides ? " slides" : " bounces");
      }
    }
  }
  expect_varying_end(*slide, {{"fesd_homotopy:radau-iia:2", 20, 0, 1e-6}}, slid);
  EXPECT_GE(n_slide, 60);
  EXPECT_GE(n_ball, 40);
}

TEST(VaryingCoefficients, ExportReadsBack) {
  for (const char* name : {"rough_patch", "slowing_ball"}) {
    const auto problem = read_scene_file(test_data(fmt::format("{}.json", name)));
    expect_export_reads_back(*problem, kExactVaryingRuns[0]);
  }
}

TEST(VaryingCoefficients, ParametersMayChange) {
  const auto slide = read_scene_file(test_data("rough_patch.json"));
  slide->symbolic()->open_parameters();
  ASSERT_TRUE(slide->symbolic()->set_parameters(std::vector<double>{0.1, 0.4, 9.81}));
  expect_varying_end(*slide, kExactVaryingRuns, {{HarmonicSlide{.a = 0.1, .b = 0.4}.rest(), 0}, {0, 0}});
  EXPECT_DOUBLE_EQ(slide->friction_coefficients(Vector::Constant(2, 0.5))[0], 0.3);
  const auto ball = read_scene_file(test_data("slowing_ball.json"));
  ball->symbolic()->open_parameters();
  ASSERT_TRUE(ball->symbolic()->set_parameters(std::vector<double>{0.5, 0.8, 9.81}));
  EXPECT_DOUBLE_EQ(ball->info().contacts[0].restitution(-2), 0.4);
  EXPECT_EQ(ball->info().contacts[0].eps_r, ContactInfo::kVaries);
}

TEST(VaryingCoefficients, BadInputIsNamed) {
  const auto message = [](const std::string& contact, const char* v0 = R"~("1", "0")~") -> std::string {
    try {
      const auto problem = point_on_ground(R"~("0", "1/2")~", v0, R"~("0", "-g")~", contact, "1");
      validate(*problem);
      run_as(*problem, kExactVaryingRuns[2]);
    } catch (const InputError& error) {
      return error.what();
    }
    return "accepted";
  };
  const auto expect = [&](const std::string& contact, const char* part) {
    EXPECT_NE(message(contact).find(part), std::string::npos) << contact << ": " << message(contact);
  };
  EXPECT_EQ(message(R"~("mu": "0.1+q[0]**2", "e": "0.5/(1+vn)")~"), "accepted");
  expect(R"~("mu": "0.1+v[0]**2")~", "v");
  expect(R"~("mu": "0.1+vn")~", "vn");
  expect(R"~("mu": "q[0]")~", "mu");
  expect(R"~("mu": "q[0]-0.1")~", "a formula of q or t > 0 is required");
  expect(R"~("e": "0.5+q[0]")~", "q");
  expect(R"~("e": "0.5*vn")~", "e at the approach speed vn = 3.13");
  expect(R"~("e": "-0.1*vn")~", "a value in [0, 1] is required");
  EXPECT_NE(message(R"~("mu": "0.1", "bilateral": true, "e": "0.5*vn")~").find("bilateral"), std::string::npos);
}

}  // namespace
}  // namespace ricochet
