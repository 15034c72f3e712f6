// Friction without a normal contact (problems/derivatives/friction_elements.h), against closed forms and proven states:
// an oscillator with Coulomb friction, a pendulum with a dry hinge, a clutch, a brake beside a contact, two elements on
// one coordinate, a puck; and the same friction as a jump of the force.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "methods/registry.h"
#include "problems/derivatives/symbolic_problem.h"
#include "problems/input_error.h"
#include "problems/scene_file/scene_writer.h"
#include "problems/variables.h"
#include "tests/ground_truth/method_run.h"
#include "tests/test_data.h"

namespace ricochet {
namespace {

std::unique_ptr<Problem> parsed_elements(const std::string& text) {
  return read_scene_text(text, "scene");
}

std::unique_ptr<Problem> element_scene(const std::string& name) {
  return read_scene_file(test_data(name + ".json"));
}

double element_error(const Solution& s, const Vector& q, const Vector& v) {
  return std::max((s.q.head(q.size()) - q).cwiseAbs().maxCoeff(), (s.v.head(v.size()) - v).cwiseAbs().maxCoeff());
}

void expect_element_end(const Problem& problem, const std::vector<MethodRun>& runs, const Vector& q, const Vector& v) {
  for (const MethodRun& how : runs) {
    const Solution s = run_as(problem, how);
    ASSERT_TRUE(s.succeeded()) << problem.info().id << " " << how.method << ": " << s.message;
    EXPECT_LE(element_error(s, q, v), how.error) << problem.info().id << " " << how.method;
    EXPECT_EQ(s.q.size(), problem.n_q());
  }
}

const std::vector<MethodRun> kExactElementRuns = {{"fesd_adaptive:radau-iia:4", 0, 1e-11, 1e-10},
                                                  {"fesd:radau-iia:4", 300, 0, 1e-10},
                                                  {"event_driven", 0, 1e-12, 1e-10},
                                                  {"cvode", 0, 1e-14, 1e-10}};

/// Half swings are cosines about F/k and -F/k: |q| at the turns is A, A - 2 F/k, A - 4 F/k, ..., until it is below F/k.
double coulomb_resting_place(double A, double F, double k) {
  double q = A;
  while (std::abs(q) > F / k) q = q > 0 ? 2 * F / k - q : -2 * F / k - q;
  return q;
}

TEST(FrictionElements, OscillatorStopsWhereItsAmplitudeFits) {
  const auto problem = element_scene("coulomb_oscillator");
  const double q = coulomb_resting_place(1.05, 1, 10);
  EXPECT_NEAR(q, -0.05, 1e-15);
  expect_element_end(*problem, kExactElementRuns, Vector::Constant(1, q), Vector::Zero(1));
  expect_element_end(*problem, {{"moreau_jean", 60000, 0, 1e-7}, {"anitescu_potra", 60000, 0, 1e-7}},
                     Vector::Constant(1, q), Vector::Zero(1));
  const Solution s = run_as(*problem, kExactElementRuns[0]);
  ASSERT_EQ(s.events.size(), 5u) << "four turns, and the end";
  for (std::size_t k = 0; k < s.events.size(); ++k) {
    EXPECT_NEAR(s.events[k].t, static_cast<double>(k + 1) * std::numbers::pi / std::sqrt(10), 1e-10);
    EXPECT_EQ(s.events[k].kind, k < 4 ? EventKind::slip_reversal : EventKind::slip_to_stick);
    EXPECT_NEAR(std::abs(s.events[k].q[0]), std::abs(1.05 - 0.2 * static_cast<double>(k + 1)), 1e-10);
  }
  const ProblemInfo& info = problem->info();
  EXPECT_EQ(info.n_mechanical(), 1);
  EXPECT_EQ(info.n_q, 2);
  ASSERT_EQ(info.n_c(), 1);
  EXPECT_TRUE(info.contacts[0].is_friction_element);
  EXPECT_EQ(info.contacts[0].name, "guide");
}

/// The same motion if the friction is a jump of the force, however it is written.
TEST(FrictionElements, JumpOfTheForceIsOne) {
  for (const char* f :
       {"-k*q[0]-F*sign(v[0])", "-k*q[0]+F*sign(-2*v[0])", "-k*q[0]-if(v[0]>0, F, -F)", "-k*q[0]+if(v[0]<0, F, -F)",
        "-k*q[0]-F/2*sign(v[0])-if(3*v[0]>0, F/2, -F/2)", "-k*q[0]-F*abs(v[0])*0-F*sign(v[0])"}) {
    const auto problem = parsed_elements(fmt::format(
        R"({{"params": {{"k": "10", "F": "1"}}, "q0": ["1.05"], "v0": ["0"], "T": "6", "M": [["1"]], "f": ["{}"]}})",
        f));
    EXPECT_EQ(problem->info().n_friction_elements, 1) << f;
    EXPECT_FALSE(problem->info().structure.force_jumps) << f;
    expect_element_end(*problem, {kExactElementRuns[0], kExactElementRuns[3]}, Vector::Constant(1, -0.05),
                       Vector::Zero(1));
  }
}

/// The bound bends where the slip reverses. Half swings about F/k and -F/k are damped by 0.3 v: r of the distance remains.
TEST(FrictionElements, BoundMayBend) {
  const auto problem = parsed_elements(R"~({"q0": ["1.05"], "v0": ["0"], "T": "6", "M": [["1"]], "f": ["-10*q[0]"],
    "friction": [{"name": "hinge", "Jt": [["1"]], "bound": "1+0.3*abs(v[0])"}]})~");
  const double r = std::exp(-0.15 * std::numbers::pi / std::sqrt(10 - 0.15 * 0.15));
  double size = 1.05, sign = 1;
  for (; size > 0.1; sign = -sign) size = (size - 0.1) * r - 0.1;
  expect_element_end(*problem,
                     {{"fesd_adaptive:radau-iia:4", 0, 1e-12, 1e-10}, kExactElementRuns[2], kExactElementRuns[3]},
                     Vector::Constant(1, sign * size), Vector::Zero(1));
}

TEST(FrictionElements, JumpMayBeUnequalOnBothSides) {
  // v' = -1.5 -+ 0.5 from v = 1: down to zero in 1/2 s, and then below; the mean -1.5 exceeds the bound 0.5.
  const auto problem =
      parsed_elements(R"~({"q0": ["0"], "v0": ["1"], "T": "1", "M": [["1"]], "f": ["if(v[0] > 0, -2, -1)"]})~");
  EXPECT_EQ(problem->info().n_friction_elements, 1);
  expect_element_end(*problem, kExactElementRuns, Vector::Constant(1, 0.25 - 0.125), Vector::Constant(1, -0.5));
}

TEST(FrictionElements, OtherJumpsStayForces) {
  const auto elements = [](const std::string& first, const std::string& second) {
    const std::string text = fmt::format(
        R"({{"q0": ["0", "1"], "v0": ["1", "0"], "T": "1", "M": [["1", "0"], ["0", "1"]], "f": ["{}", "{}"]}})", first,
        second);
    return parsed_elements(text)->info().n_friction_elements;
  };
  EXPECT_EQ(elements("-sign(v[0]-v[1])", "sign(v[0]-v[1])"), 1);
  EXPECT_EQ(elements("-sign(v[0]-v[1])", "-sign(v[1]-v[0])"), 1) << "the same jump";
  EXPECT_EQ(elements("-sign(v[0])", "-2*sign(v[1])"), 2);
  EXPECT_EQ(elements("-q[1]*sign(v[0]*q[1])", "0"), 1) << "F = 1 where J = q[1]";
  EXPECT_EQ(elements("-sign(v[0]-v[1])", "0.9*sign(v[0]-v[1])"), 0) << "no common F";
  EXPECT_EQ(elements("sign(v[0])", "0"), 0) << "it pushes away from v = 0";
  EXPECT_EQ(elements("-v[0]*abs(v[0])", "0"), 0) << "no jump";
  EXPECT_EQ(elements("-v[0]**2*sign(v[0])", "0"), 0) << "no jump";
  EXPECT_EQ(elements("-v[0]**2*sign(v[0])", "-sign(v[1])"), 1) << "the second jumps";
  EXPECT_EQ(elements("-sign(v[0]**3)", "0"), 0) << "not affine in v";
  EXPECT_EQ(elements("-sign(q[0]-0.3)", "0"), 0) << "no velocity";
  EXPECT_EQ(elements("-sign(v[0])*sign(q[0]-0.3)", "0"), 0) << "F jumps";
}

TEST(FrictionElements, DrySignStops) {
  const auto problem =
      parsed_elements(R"~({"params": {"mu": "0.3", "g": "9.81"}, "q0": ["0"], "v0": ["1"], "T": "1", "M": [["1"]],
    "f": ["-mu*g*sign(v[0])"], "contacts": [{"name": "far", "gap": "q[0]+10", "e": "0.5"}]})~");
  EXPECT_FALSE(problem->info().structure.force_jumps);
  expect_element_end(*problem, kExactElementRuns, Vector::Constant(1, 1 / (2 * 0.3 * 9.81)), Vector::Zero(1));
}

/// By `ricochet truth`: 30 digits.
struct ProvenElement {
  const char* scene;
  std::vector<double> q, v;
};

const std::vector<ProvenElement> kProvenElements = {
    {"dry_hinge", {-0.08707790228292443680677408372674793}, {0}},
    {"clutch",
     {4.43409695230583193627625325385798391957475, 2.26872145795019521206533886693334164918924},
     {0.59556760360862057185498174128864308489888, 0.63286124623529245969176674556103984567824}},
    {"brake_and_bounce",
     {-0.47625858325755602746311626475547764652478719, 0.05819400776263219492572256134069734225831994},
     {-1.17907625076805396517211951642382786722463582, -0.11122166019780650422856453221608554811806672}}};

TEST(FrictionElements, MethodsAgreeWithProvenStates) {
  for (const ProvenElement& proven : kProvenElements) {
    const auto n = static_cast<Eigen::Index>(proven.q.size());
    expect_element_end(*element_scene(proven.scene), kExactElementRuns, Eigen::Map<const Vector>(proven.q.data(), n),
                       Eigen::Map<const Vector>(proven.v.data(), n));
  }
}

TEST(FrictionElements, TwoOnOneCoordinateAddUp) {
  const auto problem = parsed_elements(R"({"q0": ["1.05"], "v0": ["0"], "T": "6", "M": [["1"]], "f": ["-10*q[0]"],
    "friction": [{"name": "a", "Jt": [["1"]], "bound": "0.4"}, {"name": "b", "Jt": [["2"]], "bound": "0.3"}]})");
  expect_element_end(*problem, {kExactElementRuns[0], kExactElementRuns[2], kExactElementRuns[3]},
                     Vector::Constant(1, -0.05), Vector::Zero(1));
}

TEST(FrictionElements, TwoDirectionsBrakeAlongTheSlip) {
  // A puck that slows down along a straight line until it rests; the ground moves with -drive.
  const auto problem =
      parsed_elements(R"({"q0": ["0", "0"], "v0": ["1.5", "1"], "T": "3", "M": [["2", "0"], ["0", "2"]],
    "f": ["0", "0"], "friction": [{"name": "ground", "Jt": [["1", "0"], ["0", "1"]], "bound": "4",
                                   "vt_drive": ["-0.5", "1"]}]})");
  // Slip (1, 2) of length sqrt(5) at a rate of 2 m/s^2, then with the ground, (0.5, -1).
  const double t = std::sqrt(5) / 2;
  Vector q(2), v(2);
  q << 0.5 * 3 + t / 2, -3 + t;
  v << 0.5, -1;
  expect_element_end(*problem, kExactElementRuns, q, v);
}

/// A puck that sticks on moving ground until 0.647 s. While its slip is slow, at 0.680 s, the bound bends; by
/// `ricochet truth`.
TEST(FrictionElements, SlipThatBeginsInSpacePassesABorder) {
  const auto problem = parsed_elements(R"~({"q0": ["0", "0"], "v0": ["0.3618", "0.5230"], "T": "1.6553",
    "M": [["1.7567", "0"], ["0", "1.7567"]],
    "f": ["2.5365*cos(6.8779*t)-12.5070*q[0]", "0.2079*cos(6.6618*t)-3.8142*q[1]"],
    "friction": [{"name": "ground", "Jt": [["1", "0"], ["0", "1"]], "bound": "2.2853+14.2886*max(q[0]+0.2843,0)",
                  "vt_drive": ["0.7398", "0"]}]})~");
  Vector q(2), v(2);
  q << -0.208218294549318686242631290572, 0.0487516379677386347833664;
  v << 0.242483085949828569399342583655, -0.0915189894549710707332359;
  for (const double tolerance : {1e-8, 1e-10, 1e-12})
    expect_element_end(*problem, {{"event_driven", 0, tolerance, 100 * tolerance}}, q, v);  // errors of steps add up
  expect_element_end(*problem, {kExactElementRuns[0], kExactElementRuns[3]}, q, v);
}

TEST(FrictionElements, NegativeBoundIsNoSuccess) {
  // Negative from t = pi/2 on; and for a while only, so that z is zero again at the end.
  for (const char* bound : {"cos(t)", "0.5+cos(t)"}) {
    const auto problem = parsed_elements(fmt::format(
        R"({{"q0": ["0"], "v0": ["9"], "T": "6", "M": [["1"]], "f": ["0"],
             "friction": [{{"name": "brake", "Jt": [["1"]], "bound": "{}"}}]}})",
        bound));
    for (const MethodRun& how : kExactElementRuns) {
      for (const Recording recording : {Recording::final_state, Recording::events, Recording::grid}) {
        const Solution s = run_as(*problem, how, {}, recording);
        EXPECT_EQ(s.status, Status::infeasible) << how.method << " " << bound;
        EXPECT_NE(s.message.find("'brake'"), std::string::npos) << s.message;
      }
    }
    for (const char* method : {"moreau_jean", "anitescu_potra", "rattle"})
      EXPECT_EQ(run_as(*problem, {method, 2000, 0, 0}).status, Status::infeasible) << method << " " << bound;
    EXPECT_THROW(reference::make_reference(*problem), std::exception);
  }
}

TEST(FrictionElements, SensitivitiesMatchDifferences) {
  const auto problem = element_scene("clutch");
  const std::vector<std::string> names = {"q0:0", "v0:0", "v0:1", "param:F", "param:tau", "param:J_2"};
  for (const MethodRun& how : {kExactElementRuns[0], kExactElementRuns[2]}) {
    const Solution s = run_as(*problem, how, names);
    ASSERT_TRUE(s.succeeded()) << how.method << ": " << s.message;
    for (std::size_t k = 0; k < names.size(); ++k) {
      const auto variable = find_variable(problem->info(), names[k]);
      const double at = variables(problem->info())[static_cast<std::size_t>(variable)].value, h = 1e-4;
      const Solution more = run_as(*with_value(*problem, variable, at + h), how),
                     less = run_as(*with_value(*problem, variable, at - h), how);
      const Eigen::Index i = static_cast<Eigen::Index>(k);
      const Vector dq = (more.q - less.q) / (2 * h), dv = (more.v - less.v) / (2 * h);
      EXPECT_LE((s.dq.col(i) - dq).head(2).cwiseAbs().maxCoeff(), 1e-5) << how.method << " " << names[k];
      EXPECT_LE((s.dv.col(i) - dv).head(2).cwiseAbs().maxCoeff(), 1e-5) << how.method << " " << names[k];
    }
  }
}

TEST(FrictionElements, ExportReadsBack) {
  for (const char* name : {"coulomb_oscillator", "dry_hinge", "clutch", "brake_and_bounce"}) {
    const auto problem = element_scene(name);
    expect_export_reads_back(*problem, kExactElementRuns[0]);
  }
}

TEST(FrictionElements, BadInputIsNamed) {
  const auto message = [](const std::string& element) -> std::string {
    try {
      parsed_elements(
          R"({"params": {"zero": "0"}, "q0": ["0", "0"], "v0": ["1", "0"], "T": "1", "M": [["1", "0"], ["0", "1"]],
                "f": ["0", "0"], "contacts": [{"name": "floor", "gap": "q[1]+1"}], "friction": [)" +
          element + "]}");
    } catch (const InputError& error) {
      return error.what();
    }
    return "accepted";
  };
  const auto expect = [&](const std::string& element, const char* part) {
    EXPECT_NE(message(element).find(part), std::string::npos) << element << ": " << message(element);
  };
  EXPECT_EQ(message(R"({"Jt": [["1", "0"]], "bound": "1"})"), "accepted");
  expect(R"({"bound": "1"})", "Jt");
  expect(R"({"Jt": [["1", "0"]]})", "bound");
  expect(R"({"Jt": [["1"]], "bound": "1"})", "friction[0].Jt[0]");
  expect(R"({"Jt": [], "bound": "1"})", "friction[0].Jt");
  expect(R"({"Jt": [["0", "0"]], "bound": "1"})", "friction[0].Jt[0]");
  expect(R"({"Jt": [["1", "0"], ["2", "0"]], "bound": "1"})", "friction[0].Jt[1]");
  expect(R"({"Jt": [["1", "0"]], "bound": "0"})", "friction[0].bound");
  expect(R"({"Jt": [["1", "0"]], "bound": "-1"})", "friction[0].bound");
  expect(R"({"Jt": [["1", "0"]], "bound": "v[1]-v[0]"})", "friction[0].bound");
  expect(R"({"Jt": [["1", "0"]], "bound": "zero"})", "friction 'friction 0': bound");
  expect(R"({"Jt": [["1", "0"]], "bound": "w"})", "w");
  expect(R"({"Jt": [["1", "0"]], "bound": "1", "vt_drive": ["1", "2"]})", "friction[0].vt_drive");
  expect(R"({"Jt": [["1", "0"]], "bound": "1", "mu": "1"})", "mu");
  expect(R"({"name": "floor", "Jt": [["1", "0"]], "bound": "1"})", "contacts[0] has this name");
}

TEST(FrictionElements, ParametersMayChange) {
  const auto problem = parsed_elements(R"~({"params": {"F": "1"}, "q0": ["1.05"], "v0": ["0"], "T": "6", "M": [["1"]],
                                 "f": ["-10*q[0]-F*sign(v[0])"]})~");
  SymbolicProblem& open = *problem->symbolic();
  open.open_parameters();
  ASSERT_TRUE(open.set_parameters(std::vector<double>{2}));
  expect_element_end(open, {kExactElementRuns[0]}, Vector::Constant(1, coulomb_resting_place(1.05, 2, 10)),
                     Vector::Zero(1));
  EXPECT_FALSE(open.set_parameters(std::vector<double>{-0.5})) << "no friction any more";
}

}  // namespace
}  // namespace ricochet
