// Elements in closed form against Newton's method on the same equations: every scene whose active set is affine, in
// every mode, at made-up states; velocities across closed contacts included, which the forces have to stop.
#include <gtest/gtest.h>

#include <random>

#include "methods/elements/element_solver.h"
#include "methods/elements/switch_solver.h"
#include "methods/fesd/pivoting_solver.h"
#include "methods/registry.h"
#include "methods/runge_kutta/diagonal_tableau.h"
#include "tests/test_data.h"

namespace ricochet {
namespace {

constexpr int kPolygonFacets = 8;

bool takes_mode(const ContactInfo& contact, ContactMode mode) {
  if (mode == ContactMode::open) return !contact.is_bilateral;
  if (mode == ContactMode::closed) return contact.n_t == 0;
  if (mode == ContactMode::stick) return contact.n_t > 0;
  return contact.n_t == (slip_sign(mode) != 0 ? 1 : 2);
}

ButcherTableau tableau_of(const std::string& name) {
  const auto colon = name.find(':');
  return make_tableau(name.substr(0, colon), std::stoi(name.substr(colon + 1)));
}

bool is_on_facet(ContactMode mode) {
  return mode == ContactMode::vertex_slip || mode == ContactMode::edge_slip;
}

/// Both forms of one element with a mode for one contact, the others open.
struct BothForms {
  BothForms(const SceneMode& of, int contact)
      : problem(*of.problem),
        polygon(is_on_facet(of.mode) ? kPolygonFacets : 0),
        closed(problem, tableau_of(of.tableau), counters, polygon),
        newton(problem, tableau_of(of.tableau), counters, polygon, ElementSystem::Form::newton) {
    const ProblemInfo& info = problem.info();
    e.resize(info, closed.tableau.n_s);
    e.h = 0.02;
    e.q0 = info.q0 + 0.05 * random(info.n_q);
    e.v0 = info.v0 + 0.5 * random(info.n_q);
    if (info.clock >= 0) {
      e.q0[info.clock] = 0.3;
      e.v0[info.clock] = 1;
    }
    if (contact < 0) return;
    e.modes[contact] = of.mode;
    if (is_on_facet(of.mode)) e.facets[contact] = 3;
  }

  Vector random(int n) {
    return Vector::NullaryExpr(n, [&] { return 2.0 * double(engine() % 10001) / 10000.0 - 1; });
  }

  const Problem& problem;
  Counters counters;
  FrictionPolygon polygon;
  ElementSystem closed, newton;
  Element e;

 private:
  std::mt19937 engine{11};
};

std::vector<SceneMode> affine_cases() {
  std::vector<SceneMode> list;
  for (const auto& scene : all_problems()) {
    const auto& structure = scene.problem->info().structure;
    if (!structure.constant_mass || !structure.constant_force_jacobian) continue;
    for (const ContactMode mode :
         {ContactMode::open, ContactMode::closed, ContactMode::stick, ContactMode::slip_positive,
          ContactMode::slip_negative, ContactMode::vertex_slip, ContactMode::edge_slip}) {
      const auto takes = [&](const auto& contact) { return takes_mode(contact, mode); };
      if (std::ranges::none_of(scene.problem->info().contacts, takes)) continue;
      for (const char* tableau : {"radau-iia:4", "gauss:3", "gauss:6", "lobatto-iiic:3"})
        list.push_back({scene.id, tableau, mode, scene.problem});
    }
  }
  return list;
}

/// Difference, relative to the larger of the two and of `scale`.
double difference(const Matrix& a, const Matrix& b, double scale = 0) {
  if (a.size() == 0) return 0;
  return (a - b).cwiseAbs().maxCoeff() / std::max({a.cwiseAbs().maxCoeff(), b.cwiseAbs().maxCoeff(), scale, 1e-300});
}

class AffineElements : public testing::TestWithParam<SceneMode> {};

TEST_P(AffineElements, AreThoseOfNewton) {
  const ProblemInfo& info = GetParam().problem->info();
  int compared = 0;
  for (const int i : info.unilateral) {
    if (!takes_mode(info.contacts[i], GetParam().mode)) continue;
    BothForms both(GetParam(), i);
    Element by_newton = both.e, in_closed_form = both.e;
    const bool is_solved = ElementSolver(both.newton, 1e-14).solve(by_newton) == ElementSolver::Result::converged;
    both.closed.set_active(in_closed_form);
    if (!both.closed.affine()) continue;
    ASSERT_TRUE(is_solved);
    ASSERT_EQ(ElementSolver(both.closed, 1e-14).solve(in_closed_form), ElementSolver::Result::converged);
    // Newton's method stops at a correction of 1e-14, and sigma_jk of six stages cancels two digits of the rounding.
    constexpr double kRounding = 1e-12;
    EXPECT_LT(difference(in_closed_form.a, by_newton.a), kRounding);
    EXPECT_LT(difference(in_closed_form.q, by_newton.q), kRounding);
    const double speed = both.e.v0.cwiseAbs().maxCoeff();
    EXPECT_LT(difference(in_closed_form.v, by_newton.v, speed), kRounding);
    EXPECT_LT(difference(in_closed_form.q1, by_newton.q1), kRounding);
    EXPECT_LT(difference(in_closed_form.v1, by_newton.v1, speed), kRounding);
    const double force = by_newton.lambda_n.cwiseAbs().maxCoeff();
    EXPECT_LT(difference(in_closed_form.lambda_n, by_newton.lambda_n), kRounding);
    EXPECT_LT(difference(in_closed_form.lambda_t, by_newton.lambda_t, force), kRounding);
    EXPECT_LT(difference(in_closed_form.end_lambda_n, by_newton.end_lambda_n, force), kRounding);
    EXPECT_LT(difference(in_closed_form.end_lambda_t, by_newton.end_lambda_t, force), kRounding);
    ++compared;
  }
  if (compared == 0) GTEST_SKIP() << "closed contacts are curved, or there are too many coordinates";
}

/// Where a component of the gap, force or slip velocity of a contact vanishes, from a guess that is 0.1 % off:
/// made-up states have many roots.
TEST_P(AffineElements, EndWithTheSameSwitches) {
  using Kind = SwitchKind;
  const ProblemInfo& info = GetParam().problem->info();
  const ContactMode mode = GetParam().mode;
  for (const int i : info.unilateral) {
    if (!takes_mode(info.contacts[i], mode) || is_on_facet(mode)) continue;
    BothForms both(GetParam(), i);
    both.closed.set_active(both.e);
    if (!both.closed.affine()) continue;
    std::vector<Kind> switches = {Kind::force_vanishes};
    if (mode == ContactMode::open) switches = {Kind::gap_closes};
    if (mode == ContactMode::stick) switches.push_back(Kind::cone_reached);
    if (slip_sign(mode) != 0) switches.push_back(Kind::slip_stops);
    for (const Kind kind : switches) {
      for (int count = 1; count <= 2; ++count) {
        std::vector<Element> by_newton(static_cast<std::size_t>(count), both.e), in_closed_form = by_newton;
        for (Element& e : by_newton) e.h = 0.1 / count;
        const Switch end{.kind = kind, .contact = i};
        SwitchSolver newton(both.newton, 1e-14);
        if (newton.solve(by_newton, end, 0.5) != SwitchResult::converged) continue;
        const auto value_at = [&](double h) {
          std::vector<Element> run = by_newton;
          for (std::size_t m = 0; m < run.size(); ++m) {
            run[m].h = h;
            if (m > 0) {
              run[m].q0 = run[m - 1].q1;
              run[m].v0 = run[m - 1].v1;
            }
            ElementSolver(both.newton, 1e-14).solve(run[m]);
          }
          return newton.function().value(run.back(), end);
        };
        // Without gravity a force is zero at any time.
        const double before = value_at(0.9 * by_newton[0].h), after = value_at(1.1 * by_newton[0].h);
        if (before * after >= 0 || std::abs(before - after) < 1e-6) continue;
        for (Element& e : in_closed_form) e.h = 1.001 * by_newton[0].h;
        const auto result = SwitchSolver(both.closed, 1e-14).solve(in_closed_form, end, 0.5);
        ASSERT_EQ(result, SwitchResult::converged) << properties(kind).name;
        // Roots that nearly coincide with others are known to the square root of rounding.
        EXPECT_NEAR(in_closed_form[0].h, by_newton[0].h, 1e-10 * by_newton[0].h) << properties(kind).name;
        EXPECT_EQ(in_closed_form.back().h, in_closed_form.front().h);
        for (Element& e : in_closed_form) e.h = 1.001 * by_newton[0].h;
        EXPECT_EQ(SwitchSolver(both.closed, 1e-14).solve(in_closed_form, end, 0.99 * by_newton[0].h),
                  SwitchResult::left_interval);
      }
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Scenes, AffineElements, testing::ValuesIn(affine_cases()), [](const auto& test) {
  return test_name(test.param.problem_id, test.param.mode, test.param.tableau);
});

/// Where nobody looks at the steps in which nothing happens they are one product each (element_map.h); with samples
/// every element is solved.
TEST(ElementMaps, ChangeNothingButRounding) {
  for (const char* scene : {"two_balls_spring", "bouncing_ball", "sliding_block", "woodpecker_toy", "disc_in_chute",
                            "stacked_blocks", "block_on_ramp", "ball_in_box"}) {
    const auto problem = make_problem(scene);
    for (const char* method : {"fesd:radau-iia:4,elements=as_needed", "fesd:gauss:4,elements=as_needed"}) {
      Settings settings;
      settings.steps = 400;
      const Solution gliding = make_method(method)->solve(*problem, settings);
      settings.recording = Recording::grid;
      const Solution looked_at = make_method(method)->solve(*problem, settings);
      ASSERT_EQ(gliding.status, looked_at.status) << scene << " " << method << gliding.message;
      EXPECT_EQ(gliding.counters.steps, looked_at.counters.steps) << scene << " " << method;
      EXPECT_EQ(gliding.counters.elements, looked_at.counters.elements) << scene << " " << method;
      EXPECT_EQ(kinds(gliding), kinds(looked_at)) << scene << " " << method;
      // 800 roundings, which the spring of two_balls_spring (141 rad/s) and nineteen events of the woodpecker enlarge.
      EXPECT_LT(difference(gliding.q, looked_at.q, 1), 1e-11) << scene << " " << method;
      EXPECT_LT(difference(gliding.v, looked_at.v, 1), 1e-11) << scene << " " << method;
    }
  }
}

/// A block slides to either side, or rests, until it has come to rest: no step before is left out.
TEST(ElementMaps, LeaveOutTheStepsInWhichNothingHappens) {
  const double mu = 0.3, g = 10, H = 1e-4;
  for (const double v : {3.0, -3.0, 0.0}) {
    const auto problem = make_problem("sliding_block", {{"v_x0", v}, {"mu", mu}, {"g", g}, {"duration", 2}});
    Counters counters;
    PivotingSolver solver(*problem, make_tableau("radau-iia", 2), {.as_needed = true}, counters);
    solver.start(problem->info().q0, problem->info().v0);
    ASSERT_EQ(solver.advance(H), Status::success) << solver.failure_message();
    ASSERT_EQ(solver.skip_steps(H, 5000), 5000) << v;
    const double t = 5001 * H, w = v > 0 ? -mu * g : v < 0 ? mu * g : 0, rounding = 5000 * with_rounding(0);
    EXPECT_NEAR(solver.step().last().q1[0] - problem->info().q0[0], v * t + 0.5 * w * t * t, rounding) << v;
    EXPECT_NEAR(solver.step().last().v1[0], v + w * t, rounding) << v;
    const int rest = solver.skip_steps(H, 10000);
    if (v == 0)
      EXPECT_EQ(rest, 10000);
    else
      EXPECT_NEAR(rest, 4998, 1) << "it stops after 1 s";
  }
}

TEST(DiagonalTableau, HasThePowersOfA) {
  for (const std::string& family : tableau_families()) {
    for (int n_s = 2; n_s <= 6; ++n_s) {
      const ButcherTableau tableau = make_tableau(family, n_s);
      ASSERT_TRUE(tableau.diagonal) << tableau.name;
      const DiagonalTableau& diagonal = *tableau.diagonal;
      Vector power = Vector::Ones(n_s);
      for (int p = 0; p <= 3; ++p, power = (tableau.A * power).eval()) {
        for (int j = 0; j < n_s; ++j) {
          double sum = 0;
          for (std::size_t k = 0; k < diagonal.l.size(); ++k) {
            const auto column = static_cast<Eigen::Index>(k);
            sum += (std::complex<double>(diagonal.sigma_re(j, column), diagonal.sigma_im(j, column)) *
                    std::pow(diagonal.l[k], p))
                       .real();
          }
          EXPECT_NEAR(sum, power[j], 1e-13) << tableau.name << ": sigma of six stages are as large as 240";
        }
      }
    }
  }
}

TEST(DiagonalTableau, IsNotThereWhereEigenvaluesCoincide) {
  ButcherTableau sdirk = make_tableau("gauss", 2);
  sdirk.A << 0.25, 0, 0.5, 0.25;
  EXPECT_FALSE(DiagonalTableau(sdirk.A).exists());
}

}  // namespace
}  // namespace ricochet
