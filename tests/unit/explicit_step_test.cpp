// Steps of event-driven runs: those of their tableau, and the polynomials between their ends.
#include "methods/modes/explicit_step.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <Eigen/LU>

#include "methods/modes/explicit_steps.h"
#include "methods/runge_kutta/embedded_tableau.h"
#include "tests/test_data.h"

namespace ricochet {
namespace {

/// n pendulums that brake each other, without contacts.
std::unique_ptr<Problem> pendulums(int n) {
  std::string q0, v0, M, f;
  for (int i = 0; i < n; ++i) {
    const char* comma = i > 0 ? ", " : "";
    q0 += fmt::format("{}{}", comma, 1 + 0.3 * i);
    v0 += fmt::format("{}{}", comma, 2 - 0.5 * i);
    f += fmt::format("{}\"-{}*sin(q[{}])-0.2*v[{}]*q[{}]\"", comma, i + 1, i, i, (i + 1) % n);
    std::string row;
    for (int j = 0; j < n; ++j) row += fmt::format("{}{}", j > 0 ? ", " : "", i == j ? 1 + i : 0);
    M += fmt::format("{}[{}]", comma, row);
  }
  return read_scene_text(
      fmt::format(R"({{"q0": [{}], "v0": [{}], "T": 1, "M": [{}], "f": [{}], "contacts": []}})", q0, v0, M, f),
      "pendulums");
}

/// (1)-(3) of explicit_step.h with the matrices of the tableau, for few coordinates and more.
TEST(ExplicitSteps, AreThoseOfTheirTableau) {
  for (const std::string& name : embedded_tableau_names()) {
    const EmbeddedTableau t = embedded_tableau(name);
    for (int n = 1; n <= 5; ++n) {
      const auto problem = pendulums(n);
      Counters counters;
      ModeDynamics dynamics(*problem, counters);
      const Vector &q = problem->info().q0, &v = problem->info().v0;
      dynamics.set_modes({}, q.data(), v.data());
      const auto step = make_explicit_step(t, n, dynamics);
      step->ends.q0 = q;
      step->ends.v0 = v;
      const auto acceleration = [&](const Vector& at_q, const Vector& at_v) -> Vector {
        return problem->mass_matrix(at_q).inverse() * problem->force(at_q, at_v);
      };
      step->ends.a0 = acceleration(q, v);
      const double h = 0.3, tolerance = 1e-3;
      ASSERT_TRUE(step->take(h, nullptr) && step->finish());

      Matrix rates = Matrix::Zero(2 * n, t.n_s);
      for (int i = 0; i < t.n_s; ++i) {
        const Vector change = h * rates * t.A.row(i).transpose();
        rates.col(i).head(n) = v + change.tail(n);
        rates.col(i).tail(n) = acceleration(q + change.head(n), v + change.tail(n));
      }
      const Vector change = h * rates * t.b;
      // Rounding of a dozen stages with coefficients up to 50.
      constexpr double kRounding = 1e-13;
      EXPECT_LE((step->ends.q1 - q - change.head(n)).cwiseAbs().maxCoeff(), kRounding) << name << " " << n;
      EXPECT_LE((step->ends.v1 - v - change.tail(n)).cwiseAbs().maxCoeff(), kRounding) << name << " " << n;
      EXPECT_LE((step->ends.a1 - acceleration(step->ends.q1, step->ends.v1)).cwiseAbs().maxCoeff(), kRounding) << name;

      Vector size(2 * n);  // of what the error is relative to
      size << q, v;
      size = (size.cwiseAbs().array() + 1) * tolerance;
      const auto norm = [&](const Vector& weights) {
        return (h * rates * weights).cwiseQuotient(size).norm() / std::sqrt(2 * n);
      };
      double error = norm(t.e);
      if (t.e_2.size() > 0) error *= error / std::hypot(error, 0.1 * norm(t.e_2));
      EXPECT_NEAR(step->error(tolerance), error, kRounding / tolerance) << name << " " << n;
    }
  }
}

/// A polynomial of degree 5 is interpolated exactly, and so is its rate.
TEST(ExplicitSteps, AreQuinticBetweenTheirEnds) {
  const auto q = [](double t) { return 1 + t * (-2 + t * (3 + t * (0.5 + t * (-4 + t * 2)))); };
  const auto v = [](double t) { return -2 + t * (6 + t * (1.5 + t * (-16 + t * 10))); };
  const auto a = [](double t) { return 6 + t * (3 + t * (-48 + t * 40)); };
  const double from = 0.1;
  StepEnds ends;
  ends.resize(1);
  ends.h = 0.7;
  ends.q0 << q(from);
  ends.v0 << v(from);
  ends.a0 << a(from);
  ends.q1 << q(from + ends.h);
  ends.v1 << v(from + ends.h);
  ends.a1 << a(from + ends.h);
  Vector at_q(1), at_v(1);
  for (const double theta : {0.0, 0.2, 0.5, 0.9, 1.0}) {
    ends.interpolate(theta, at_q, at_v);
    EXPECT_NEAR(at_q[0], q(from + theta * ends.h), 1e-14) << theta << ": twenty roundings of terms up to 4";
    EXPECT_NEAR(at_v[0], v(from + theta * ends.h), 1e-13) << theta;
  }
}

}  // namespace
}  // namespace ricochet
