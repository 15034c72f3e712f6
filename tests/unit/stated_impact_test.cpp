// The law of impacts as a property of the scene: methods honour it as the reference does, which was written apart, or
// decline it.
#include "methods/contact_laws/impact_laws/stated_impact.h"

#include <gtest/gtest.h>

#include <random>

#include "methods/registry.h"
#include "problems/input_error.h"
#include "problems/registry.h"
#include "problems/scene_file/scene_file.h"
#include "problems/scene_file/scene_writer.h"
#include "reference/agreement.h"
#include "reference/stated_impact.h"

namespace ricochet {
namespace {

ProblemInfo scene_of(ImpactHypothesis law, int n_c, int n_t, double e, double mu) {
  ProblemInfo info;
  info.impact_law.hypothesis = law;
  ContactInfo contact;
  contact.name = "contact";
  contact.eps_r = e;
  contact.mu = mu;
  contact.n_t = n_t;
  info.contacts.assign(static_cast<std::size_t>(n_c), contact);
  return info;
}

/// Impulses by both implementations; both may say that there are none.
void compare(const ProblemInfo& info, const Matrix& G, const Vector& w, double tolerance) {
  std::vector<int> contacts;
  for (int i = 0; i < info.n_c(); ++i) contacts.push_back(i);
  Vector r(G.rows());
  const bool is_solved = stated_impact(info, contacts, G, w, r) == LcpStatus::solved;
  const auto reference = reference::stated_impulses(info, contacts, G, w);
  ASSERT_EQ(is_solved, reference.failure.empty()) << reference.failure << "\n" << G << "\nw " << w.transpose();
  if (is_solved) EXPECT_LE((r - reference.r).norm(), tolerance * (1 + r.norm())) << G << "\nw " << w.transpose();
}

TEST(StatedImpacts, OfOneContactInThePlaneAreThoseOfTheReference) {
  std::mt19937 random(7);
  std::uniform_real_distribution<double> part(0, 1), sign(-1, 1);
  for (const auto law : {ImpactHypothesis::poisson, ImpactHypothesis::routh, ImpactHypothesis::stronge}) {
    for (int k = 0; k < 2000; ++k) {
      const double a = 0.5 + part(random), b = 0.5 + part(random), c = 0.95 * sign(random) * std::sqrt(a * b);
      const Matrix G = (Matrix(2, 2) << a, c, c, b).finished();
      const Vector w = (Vector(2) << -0.1 - part(random), sign(random)).finished();
      // Where a contact jams, Poisson's compression may have several solutions: little friction has one.
      const double mu =
          law == ImpactHypothesis::poisson ? 0.5 * part(random) * std::min(1.0, a / std::abs(c)) : part(random);
      compare(scene_of(law, 1, 1, part(random), mu), G, w, 1e-11);  // rounding of some divisions by small slopes
    }
  }
}

TEST(StatedImpacts, OfSeveralContactsWithoutFrictionAreThoseOfTheReference) {
  std::mt19937 random(3);
  std::uniform_real_distribution<double> part(0, 1);
  for (const int n : {2, 3, 5}) {
    // Balls in a row: the first one strikes, the others rest.
    Matrix G = Matrix::Zero(n, n);
    for (int i = 0; i < n; ++i) {
      G(i, i) = 2;
      if (i > 0) G(i, i - 1) = G(i - 1, i) = -1;
    }
    Vector w = Vector::Zero(n);
    w[0] = -1;
    auto info = scene_of(ImpactHypothesis::lzb, n, 0, 0.6 + 0.4 * part(random), 0);
    compare(info, G, w, 1e-9);  // 2000 steps of order 4 against a relative tolerance of 1e-13
    info.impact_law.eta = 1;
    for (int i = 0; i < n; ++i) info.impact_law.stiffness.push_back(1 + part(random));
    compare(info, G, w, 1e-9);
  }
}

TEST(StatedImpacts, OfSeveralContactsHaveNoSolutionByTheLawsOfOne) {
  const ProblemInfo info = scene_of(ImpactHypothesis::stronge, 2, 0, 0.5, 0);
  Vector r(2);
  const std::vector<int> both{0, 1};
  EXPECT_EQ(stated_impact(info, both, Matrix::Identity(2, 2), -Vector::Ones(2), r), LcpStatus::ray);
  EXPECT_NE(why_no_impulse(info).find("stronge"), std::string::npos);
}

Solution run_stated(const Problem& problem, const std::string& method) {
  Settings settings;
  const auto made = make_method(method);
  if (made->info().is_adaptive)
    settings.tolerance = 1e-10;
  else
    settings.steps = 20;
  return made->solve(problem, settings);
}

TEST(StatedImpacts, OfKanesPendulumAreHonouredByEventsElementsAndReference) {
  const auto pendulum = make_problem("kane_pendulum", {{"e", 0.5}, {"mu", 0.5}});
  double newton = 0, stronge = 0;
  for (const auto law :
       {ImpactHypothesis::newton, ImpactHypothesis::poisson, ImpactHypothesis::routh, ImpactHypothesis::stronge}) {
    pendulum->set_impact_law({.hypothesis = law, .stiffness = {}});
    const auto reference = reference::make_reference(*pendulum);
    for (const std::string method : {"event_driven", "fesd:radau-iia:4"}) {
      const Solution s = run_stated(*pendulum, method);
      ASSERT_TRUE(s.succeeded()) << name_of(law) << ": " << s.message;
      ASSERT_GE(s.events.size(), 1u);
      // What the tolerance and 20 steps of order 7 leave.
      EXPECT_LE((s.v - reference.solution.v).lpNorm<Eigen::Infinity>(), 1e-6) << name_of(law) << " " << method;
      const auto& impact = s.events.front();
      const double gain =
          pendulum->kinetic_energy(impact.q, impact.v_plus) / pendulum->kinetic_energy(impact.q, impact.v_minus) - 1;
      if (law == ImpactHypothesis::newton) newton = gain;
      if (law == ImpactHypothesis::stronge) stronge = gain;
    }
  }
  // Kane's puzzle: Newton's law with friction makes energy, Stronge's cannot.
  EXPECT_GT(newton, 0.01);
  EXPECT_LT(stronge, -0.01);
}

TEST(StatedImpacts, OfNewtonsCradleKeepMomentum) {
  for (const double e : {1.0, 0.95, 0.5}) {
    const auto cradle = make_problem("newtons_cradle", {{"e", e}});
    const auto reference = reference::make_reference(*cradle);
    for (const std::string method : {"event_driven", "fesd:radau-iia:3", "fesd_adaptive:radau-iia:3"}) {
      const Solution s = run_stated(*cradle, method);
      ASSERT_TRUE(s.succeeded()) << s.message;
      EXPECT_NEAR(s.v.sum(), 1, 1e-12) << method;  // rounding: v_1 = 1 m/s, equal masses
      EXPECT_LE((s.v - reference.solution.v).lpNorm<Eigen::Infinity>(), 1e-9) << method;  // as of the impulses above
      for (int i = 1; i < 5; ++i) EXPECT_GE(s.v[i] - s.v[i - 1], -1e-9) << "balls " << i << " and " << i + 1;
    }
    if (e == 1) EXPECT_NEAR(reference.solution.v.squaredNorm(), 1, 1e-11);  // no energy is lost
  }
}

TEST(StatedImpacts, AreDeclinedByMethodsThatDoNotHaveThem) {
  const auto cradle = make_problem("newtons_cradle");
  for (const std::string method :
       {"moreau_jean", "anitescu_potra", "rattle", "time_freezing:radau-iia:2", "fesd_homotopy:radau-iia:2"}) {
    const Support support = make_method(method)->can_run(cradle->info());
    EXPECT_FALSE(support.ok) << method;
    EXPECT_NE(support.reason.find("lzb"), std::string::npos) << support.reason;
  }
  cradle->set_impact_law({});
  EXPECT_TRUE(make_method("moreau_jean")->can_run(cradle->info()).ok);
}

TEST(StatedImpacts, HaveNoSensitivities) {
  const auto cradle = make_problem("newtons_cradle");
  Settings settings;
  settings.tolerance = 1e-8;
  settings.sensitivities = {"v0:0"};
  EXPECT_THROW(make_method("event_driven")->solve(*cradle, settings), InputError);
}

const char* const kBall = R"({"q0": ["1"], "v0": ["0"], "T": "1", "M": [["1"]], "f": ["-9.81"],
  "contacts": [{"gap": "q[0]", "e": "0.5"}], "impact_law": )";

TEST(StatedImpacts, AreReadAndWrittenWithAScene) {
  const auto named = read_scene_text(std::string(kBall) + "\"stronge\"}", "ball.json");
  EXPECT_EQ(named->info().impact_law.hypothesis, ImpactHypothesis::stronge);
  const auto stated =
      read_scene_text(std::string(kBall) + R"({"hypothesis": "lzb", "eta": "1.25", "stiffness": ["3"]}})", "ball.json");
  const auto again = read_scene_text(scene_text(*stated), "again.json");
  EXPECT_EQ(again->info().impact_law.hypothesis, ImpactHypothesis::lzb);
  EXPECT_EQ(again->info().impact_law.eta, 1.25);
  EXPECT_EQ(again->info().impact_law.stiffness, std::vector<double>{3});
}

TEST(StatedImpacts, WithAMistakeAreRefusedWithFieldAndRange) {
  const auto message_of = [](const std::string& law) {
    try {
      read_scene_text(std::string(kBall) + law + "}", "ball.json");
    } catch (const InputError& error) {
      return std::string(error.what());
    }
    return std::string();
  };
  for (const auto& [law, part] : {std::pair{"\"strong\"", "stronge"},
                                  {R"({"hypothesis": "lzb", "eta": "0.5"})", "impact_law.eta"},
                                  {R"({"hypothesis": "lzb", "stiffness": ["1", "2"]})", "impact_law.stiffness"},
                                  {R"({"hypothesis": "lzb", "stiffness": ["0"]})", "impact_law.stiffness[0]"}})
    EXPECT_NE(message_of(law).find(part), std::string::npos) << law << ": " << message_of(law);
}

}  // namespace
}  // namespace ricochet
