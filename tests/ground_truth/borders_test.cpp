// Borders of regions that are easily passed too late: found by `ricochet fuzz --family corners` and `--family
// dry_friction`, where methods had ended with success and another motion.
#include <gtest/gtest.h>

#include <cmath>

#include "methods/registry.h"
#include "problems/scene_file/scene_file.h"
#include "tests/ground_truth/method_run.h"

namespace ricochet {
namespace {

void expect_border_end(const std::string& scene, const std::vector<MethodRun>& runs, const Vector& q, const Vector& v,
                       double error) {
  const auto problem = read_scene_text(scene, "scene");
  for (const MethodRun& how : runs) {
    const Solution s = run_as(*problem, how);
    ASSERT_TRUE(s.succeeded()) << how.method << ": " << s.message;
    EXPECT_LE((s.q.head(q.size()) - q).cwiseAbs().maxCoeff(), error) << how.method;
    EXPECT_LE((s.v.head(v.size()) - v).cwiseAbs().maxCoeff(), error) << how.method;
  }
}

const std::vector<MethodRun> kLocating = {{"event_driven", 0, 1e-12},
                                          {"fesd_adaptive:radau-iia:4", 0, 1e-11},
                                          {"fesd_adaptive:gauss:4", 0, 1e-11},
                                          {"cvode", 0, 1e-13},
                                          {"ida", 0, 1e-12},
                                          {"arkode", 0, 1e-12}};

/// The force at q = 1/2 does not jump as long as v = 1, the velocity at the start, and jumps at the border. A fast
/// oscillation makes steps shorter than any tolerance of the border: CVODE, IDA and ARKODE passed it 1 mm late.
TEST(Borders, AreWhereTheyAreNotWhereTheRunBegan) {
  const double t = (std::sqrt(3.0) - 1) / 2, s = 1 - t;  // v = 1 + 2 t until v^2 = 1 + 2 (1/2) 2; then v' = 5 v - 3
  Vector q(2), v(2);
  q << 0.5 + 0.6 * s + (std::sqrt(3.0) - 0.6) / 5 * std::expm1(5 * s), 0.01 * std::cos(2000.0);
  v << 0.6 + (std::sqrt(3.0) - 0.6) * std::exp(5 * s), -20 * std::sin(2000.0);
  expect_border_end(R"json({"q0": [0, 0.01], "v0": [1, 0], "T": 1, "M": [[1, 0], [0, 1]],
      "f": ["2+if(q[0]<0.5,0,5*(v[0]-1))", "-4e6*q[1]"]})json",
                    {{"event_driven", 0, 1e-12}, {"fesd_adaptive:radau-iia:4", 0, 1e-11}, {"cvode", 0, 1e-13}},
                    q.head(1), v.head(1), 1e-8);
}

/// max(max(q, 0) (1 + v), 0): both functions vanish at q = 0. In the region where the outer maximum is zero the inner one
/// makes no difference, but the outer one begins there.
TEST(Borders, OfFunctionsInsideOfEachOther) {
  const std::string scene = R"json({"q0": [0.3633], "v0": [-1.2188], "T": 1.9265, "M": [[0.6589]],
      "f": ["-16.5741*q[0]-max(26.8418*max(q[0]+0.0008,0)*(1+0.5145*v[0]),0)-min(0.4386,29.6948*abs(q[0]))*sign(q[0])-if(q[0]<0.1162,34.9635*(q[0]-0.1162),31.4838*(q[0]-0.1162))"],
      "contacts": [{"name": "wall", "gap": "q[0]+0.0399", "e": 0.4529}]})json";
  // by event_driven and FESD-J, which agree to 1e-12
  expect_border_end(scene, kLocating, Vector::Constant(1, 0.0760771178627), Vector::Constant(1, 0.3743858368629), 1e-8);
}

/// Falls onto the ground with friction: the impact changes the signs of two functions, v[1] and 1 + 0.9 v[0].
TEST(Borders, AnImpactMayPassTwo) {
  const std::string scene = R"json({"q0": [0.5536, 0.1942], "v0": [-0.4569, 0], "T": 0.3,
      "M": [[1.7838, 0], [0, 1.7838]],
      "f": ["-23.9422*q[0]-max(267.2836*max(q[0]+0.003,0)*(1+0.9046*v[0]),0)", "-14.9*q[1]-1.1823*max(v[1],0)-17.5"],
      "contacts": [{"name": "ground", "gap": "q[1]", "e": 0.6697, "mu": 0.5438, "Jt": [["1", "0"]]}]})json";
  const auto problem = read_scene_text(scene, "scene");
  const Solution exact = run_as(*problem, {"event_driven", 0, 1e-13});
  ASSERT_TRUE(exact.succeeded()) << exact.message;
  expect_border_end(scene, kLocating, exact.q, exact.v, 1e-8);
  expect_border_end(scene, {{"fesd:radau-iia:3", 200, 0}, {"fesd:gauss:3", 200, 0}}, exact.q, exact.v, 1e-6);
}

/// The same where the run begins with the impact. q = 0, v = -2: the ball leaves with 1 and rises against v' = -1 - 4 v.
TEST(Borders, AnImpactAtTheStartPassesOne) {
  const double t = 0.2, u = 1.25 * std::exp(-4 * t);  // v = -1/4 + (5/4) exp(-4 t)
  expect_border_end(R"json({"q0": [0], "v0": [-2], "T": 0.2, "M": [[1]], "f": ["-1-4*max(v[0],0)+3*min(v[0],0)"],
      "contacts": [{"name": "ground", "gap": "q[0]", "e": 0.5}]})json",
                    kLocating, Vector::Constant(1, -t / 4 + (1.25 - u) / 4), Vector::Constant(1, -0.25 + u), 1e-9);
}

}  // namespace
}  // namespace ricochet
