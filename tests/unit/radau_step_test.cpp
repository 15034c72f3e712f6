// Implicit steps of event-driven runs: their order, what lies between their ends, and stiff scenes.
#include "methods/event_driven/radau_step.h"

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <cmath>
#include <numbers>

#include "methods/registry.h"
#include "methods/runge_kutta/tableau_argument.h"
#include "problems/input_error.h"
#include "tests/test_data.h"

namespace ricochet {
namespace {

Solution solve_event_driven(const Problem& problem, const std::string& formula, double tolerance) {
  Settings settings;
  settings.tolerance = tolerance;
  return make_method("event_driven:" + formula)->solve(problem, settings);
}

std::string radau(int n_s) {
  return "radau-iia:" + std::to_string(n_s);
}

/// Steps from the initial state of a problem without contacts.
struct RadauSteps {
  RadauSteps(const Problem& problem, int n_s)
      : tableau(tableau_argument(radau(n_s))), dynamics(problem, counters), step(tableau, problem.n_q(), dynamics) {
    dynamics.set_modes({}, problem.info().q0.data(), problem.info().v0.data());
    step.start(1e-12);
    begin(problem.info().q0, problem.info().v0);
  }

  void begin(const Vector& q, const Vector& v) {
    step.ends.q0 = q;
    step.ends.v0 = v;
    dynamics.accelerate(q.data(), v.data(), step.ends.a0.data());
  }

  Counters counters;
  ButcherTableau tableau;
  ModeDynamics dynamics;
  RadauStep step;
};

std::unique_ptr<Problem> braked_pendulum() {
  return read_scene_text(R"json({"q0": [2], "v0": [1.5], "T": 2, "M": [["2+sin(q[0])"]],
      "f": ["-9*sin(q[0])-0.5*v[0]-0.5*cos(q[0])*v[0]*v[0]"], "contacts": []})json",
                         "braked pendulum");
}

class Radau : public testing::TestWithParam<int> {};

INSTANTIATE_TEST_SUITE_P(Stages, Radau, testing::Values(3, 5));

Matrix made_up(Eigen::Index rows, Eigen::Index columns, double shift) {
  return Matrix::NullaryExpr(rows, columns, [&](Eigen::Index i, Eigen::Index k) {
    return std::sin(shift + 3 * static_cast<double>(i) + 1.7 * static_cast<double>(k));
  });
}

/// (1) of radau_system.h, by its blocks.
TEST_P(Radau, SystemIsSolvedByTheEigenvaluesOfTheTableau) {
  constexpr int kN = 4;
  constexpr double kH = 0.3;
  const ButcherTableau tableau = tableau_argument(radau(GetParam()));
  const Matrix a_q = 5 * made_up(kN, kN, 0.1), a_v = made_up(kN, kN, 0.7), r = made_up(kN, tableau.n_s, 1.3);
  RadauSystem system(tableau, kN);
  ASSERT_TRUE(system.factorize(kH, a_q, a_v));
  EXPECT_EQ(system.h(), kH);
  Matrix dw(kN, tableau.n_s);
  system.solve(r, dw);
  const Matrix by_blocks = dw * tableau.A.inverse().transpose() / kH - a_v * dw - kH * a_q * dw * tableau.A.transpose();
  EXPECT_LT((by_blocks - r).cwiseAbs().maxCoeff(), 1e-11) << "rounding, times a condition of some hundred";

  const double g = system.real_eigenvalue();
  EXPECT_NEAR((tableau.A - g * Matrix::Identity(tableau.n_s, tableau.n_s)).determinant(), 0, 1e-14);
  Vector x = r.col(0);
  system.solve_real(x);
  EXPECT_LT((x / (kH * g) - a_v * x - kH * g * a_q * x - r.col(0)).cwiseAbs().maxCoeff(), 1e-12);
}

/// (2) of radau_error.h: the formula is exact for polynomials of degree n_s - 1.
TEST_P(Radau, ErrorWeightsFulfilTheirOrderConditions) {
  const ButcherTableau tableau = tableau_argument(radau(GetParam()));
  const double g = RadauSystem(tableau, 1).real_eigenvalue();
  const Vector d = tableau.A.transpose() * RadauError(tableau, g, 1).weights();
  for (int k = 1; k <= tableau.n_s; ++k)
    EXPECT_NEAR(d.dot(Vector(tableau.c.array().pow(k - 1))), k == 1 ? -g : 0, 1e-12) << k;
}

/// The polynomial of a step is the guess of the next one: exact where the velocity is one.
TEST_P(Radau, GuessContinuesThePolynomial) {
  const ButcherTableau tableau = tableau_argument(radau(GetParam()));
  const auto v = [](double t) { return t * t + 0.5; };
  StepEnds ends;
  ends.resize(1);
  ends.h = 0.4;
  ends.v0[0] = v(0);
  ends.v1[0] = v(ends.h);
  ends.a1[0] = 2 * ends.h;
  Matrix w(1, tableau.n_s);
  for (int i = 0; i < tableau.n_s; ++i) w(0, i) = v(tableau.c[i] * ends.h) - v(0);
  CollocationPolynomial polynomial(tableau.c, 1);
  polynomial.set(ends.h, w);
  CollocationGuess guess(tableau.c, 1);
  guess.keep(ends, polynomial);
  Matrix same(1, tableau.n_s);
  guess.predict(ends, same);
  EXPECT_LT((same - w).cwiseAbs().maxCoeff(), 1e-14) << "taken again, from the same left end";
  ends.advance();
  ends.h = 0.1;
  Matrix next(1, tableau.n_s);
  guess.predict(ends, next);
  for (int i = 0; i < tableau.n_s; ++i)
    EXPECT_NEAR(next(0, i), v(0.4 + 0.1 * tableau.c[i]) - v(0.4), 1e-13) << "from its right end on";
  guess.forget();
  guess.predict(ends, next);
  EXPECT_EQ(next(0, 0), 0.1 * tableau.c[0] * ends.a0[0]) << "without a step before";
}

TEST_P(Radau, HasTheOrderOfItsTableau) {
  const auto problem = braked_pendulum();
  const Solution truth = solve_event_driven(*problem, "verner-9-8", 1e-14);
  const auto error = [&](int n) {
    RadauSteps steps(*problem, GetParam());
    for (int k = 0; k < n; ++k) {
      EXPECT_TRUE(steps.step.take(2.0 / n, nullptr) && steps.step.finish());
      steps.step.ends.advance();
    }
    return (steps.step.ends.q0 - truth.q).norm() + (steps.step.ends.v0 - truth.v).norm();
  };
  const int n = GetParam() == 3 ? 20 : 8, order = 2 * GetParam() - 1;
  const double coarse = error(n), fine = error(2 * n);
  EXPECT_GT(fine, 1e-12) << "above rounding and the tolerance of the iterations";
  EXPECT_GT(std::log2(coarse / fine), order - 0.4) << coarse << " " << fine;
}

/// The polynomial between the ends passes through both, q is its integral, and it is of order n_s + 1.
TEST_P(Radau, IsThePolynomialOfItsStagesBetweenTheEnds) {
  const auto problem = braked_pendulum();
  Vector q(1), v(1), before(1), after(1), ignored(1);
  const auto error = [&](double h) {
    RadauSteps steps(*problem, GetParam()), half(*problem, GetParam());
    const StepEnds& ends = steps.step.ends;
    EXPECT_TRUE(steps.step.take(h, nullptr) && half.step.take(0.5 * h, nullptr));
    ends.interpolate(0, q, v);
    EXPECT_EQ(q, ends.q0);
    EXPECT_EQ(v, ends.v0);
    ends.interpolate(1, q, v);
    EXPECT_EQ(q, ends.q1);
    EXPECT_EQ(v, ends.v1);
    ends.interpolate(1 - 1e-12, q, v);  // with the rounding of coefficients up to 1e3
    EXPECT_NEAR(q[0], ends.q1[0], 1e-12 * std::abs(ends.v1[0]) + 1e-13);
    EXPECT_NEAR(v[0], ends.v1[0], 1e-11);
    constexpr double kDifference = 1e-4;
    ends.interpolate(0.5 - kDifference, before, ignored);
    ends.interpolate(0.5 + kDifference, after, ignored);
    ends.interpolate(0.5, q, v);
    EXPECT_NEAR(after[0] - before[0], 2 * kDifference * h * v[0], 1e-10) << "the cube of the difference";
    return std::abs(v[0] - half.step.ends.v1[0]);
  };
  const double coarse = error(0.4), fine = error(0.2);
  EXPECT_GT(std::log2(coarse / fine), GetParam() + 1 - 0.5) << coarse << " " << fine;
}

/// Twenty radians of an oscillation in one step are no step, in whichever phase it begins: at the tolerance of an
/// amplitude in q, which says nothing of v.
TEST_P(Radau, SeesAnOscillationInEveryPhase) {
  const double omega = 1e4, amplitude = 1;  // of v [m/s]
  const auto problem =
      read_scene_text(R"({"q0": [0], "v0": [1], "T": 1, "M": [[1]], "f": ["-1e8*q[0]"], "contacts": []})", "spring");
  RadauSteps steps(*problem, GetParam());
  double least = INFINITY, most = 0;
  for (int phase = 0; phase < 360; ++phase) {
    const double angle = phase * std::numbers::pi / 180;
    steps.begin(Vector::Constant(1, amplitude / omega * std::sin(angle)),
                Vector::Constant(1, amplitude * std::cos(angle)));
    ASSERT_TRUE(steps.step.take(20 / omega, nullptr));
    const double error = steps.step.error(1e-3);
    least = std::min(least, error);
    most = std::max(most, error);
  }
  EXPECT_GT(least, 5);
  EXPECT_LT(most, 2.5 * least) << "1 + |v_0|, which the error is relative to, makes a factor two";
}

TEST_P(Radau, KeepsTheToleranceOfStiffSprings) {
  for (const double k : {1e4, 1e6, 1e8}) {
    const auto problem = make_problem("two_balls_spring", {{"k", k}});
    const Solution exact = solve_event_driven(*problem, "verner-9-8", 1e-10);
    const double periods = std::sqrt(2 * k) / 10;
    for (const double tolerance : {3e-2, 1e-3, 1e-5, 1e-7}) {
      const Solution s = solve_event_driven(*problem, radau(GetParam()), tolerance);
      ASSERT_TRUE(s.succeeded()) << k << ", " << tolerance << ": " << s.message;
      EXPECT_EQ(s.events.size(), 2u) << k << ", " << tolerance;
      // Errors of a phase add up over the periods; where they reach one, v is wrong by its amplitude at most.
      EXPECT_LE((s.q - exact.q).norm() + (s.v - exact.v).norm(), std::min(8.0, 3 * periods * tolerance))
          << k << ", " << tolerance;
    }
  }
}

/// A spring that is damped away within microseconds binds explicit steps to its rate, in every phase of stick and slip.
TEST_P(Radau, TakesFewStepsWhereAStiffSpringIsDamped) {
  const auto problem = read_scene_file(test_data("../../bench/experiments/scenes/towed_sled.json"));
  const Solution exact = solve_event_driven(*problem, "verner-9-8", 1e-9),
                 binding = solve_event_driven(*problem, "dopri5", 1e-6);
  ASSERT_TRUE(exact.succeeded() && binding.succeeded()) << exact.message << binding.message;
  const auto error = [&](const Solution& s) { return (s.q - exact.q).norm() + (s.v - exact.v).norm(); };
  const Solution s = solve_event_driven(*problem, radau(GetParam()), 1e-7);
  ASSERT_TRUE(s.succeeded()) << s.message;
  EXPECT_EQ(kinds(s), kinds(exact));
  EXPECT_LE(error(s), error(binding));
  EXPECT_LT(300 * s.counters.steps, binding.counters.steps);
  for (std::size_t k = 0; k < s.events.size(); ++k) EXPECT_NEAR(s.events[k].t, exact.events[k].t, 1e-8) << k;
  for (const double tolerance : {1e-4, 1e-6, 1e-8, 1e-10}) {
    const Solution of = solve_event_driven(*problem, radau(GetParam()), tolerance);
    ASSERT_TRUE(of.succeeded()) << tolerance << ": " << of.message;
    EXPECT_EQ(kinds(of), kinds(exact)) << tolerance;
    // 1.3 tolerances were seen, where errors of hundreds of steps add up; 1e-11 is ten times what verner-9-8 has.
    EXPECT_LE(error(of), 3 * tolerance + 1e-11) << tolerance;
  }
}

TEST(RadauStep, StagesAreThreeOrFive) {
  const auto message = [](const char* spec) {
    try {
      make_method(spec);
    } catch (const InputError& e) {
      return std::string(e.what());
    }
    return std::string("no error");
  };
  const auto expect = [&](const char* spec, const char* reason) {
    EXPECT_NE(message(spec).find(reason), std::string::npos) << message(spec);
  };
  expect("event_driven:radau-iia:4", "radau-iia: stages = 4: one of 3, 5 is required");
  expect("event_driven:dopri5:4", "dopri5: argument '4': a pair has none");
  EXPECT_EQ(message("event_driven:radau-iia"), "no error");
}

TEST(RadauStep, HasNoDerivatives) {
  const auto method = make_method("event_driven:radau-iia:5");
  EXPECT_FALSE(method->info().has_sensitivities);
  Settings settings;
  settings.tolerance = 1e-6;
  settings.sensitivities = {"param:k"};
  EXPECT_THROW(method->solve(*make_problem("two_balls_spring"), settings), InputError);
}

}  // namespace
}  // namespace ricochet
