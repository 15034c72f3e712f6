// Programs as sums of blocks: their assembly, and their solution by the interior-point method.
#include <gtest/gtest-spi.h>
#include <gtest/gtest.h>

#include <limits>
#include <stdexcept>

#include "methods/complementarity/mpcc/ipopt_solver.h"
#include "problems/input_error.h"
#include "tests/macmpec.h"
#include "tests/nlp_blocks.h"
#include "tests/nlp_check.h"

namespace ricochet {
namespace {

/// A function of one variable that is given by its value and two derivatives.
class ScalarBlock : public NlpBlock {
 public:
  using Function = double (*)(double);
  ScalarBlock(int variable, Function f, Function d_f, Function dd_f) : f_(f), d_f_(d_f), dd_f_(dd_f) {
    variables = {variable};
  }
  void evaluate(const double* x, double* values) const override { values[0] = f_(x[0]); }
  void jacobian(const double* x, double* J) const override { J[0] = d_f_(x[0]); }
  void hessian(const double* x, const double* weights, double* H) const override { H[0] = weights[0] * dd_f_(x[0]); }

 private:
  Function f_, d_f_, dd_f_;
};

/// Problem 35 of Hock and Schittkowski, Test examples for nonlinear programming codes (1981).
Nlp hock_schittkowski_35() {
  Nlp nlp;
  for (const char* name : {"x1", "x2", "x3"}) nlp.add_variable(0, kInfinity, 0.5, name);
  nlp.add_block(std::make_unique<QuadraticBlock>(-1, std::vector{0, 1, 2}, 9, Vector{{-8, -6, -4}},
                                                 Matrix{{4, 2, 2}, {2, 4, 0}, {2, 0, 2}}));
  add_terms(nlp, nlp.add_row(-kInfinity, 3, "sum"), 0, {{0, 1}, {1, 1}, {2, 2}});
  return nlp;
}

TEST(NlpEvaluator, SumsBlocksAndFindsTheirStructure) {
  Nlp nlp;
  const int x = nlp.add_variable(0, 1, 0, "x"), y = nlp.add_variable(0, 1, 0, "y"), z = nlp.add_variable(0, 1, 0, "z");
  const int row = nlp.add_row(0, 0, "row");
  add_terms(nlp, row, 1, {{x, 2}, {y, 0, 3}, {z, 0}});  // 1 + 2 x + 3 y^2, z unused
  add_terms(nlp, row, 0, {{y, 5}, {x, 0, 1}});          // x^2 + 5 y
  add_terms(nlp, -1, 0, {{z, 1}});
  NlpEvaluator evaluator(nlp);

  EXPECT_EQ(evaluator.jacobian_pattern().rows, (std::vector{0, 0}));
  EXPECT_EQ(evaluator.jacobian_pattern().columns, (std::vector{x, y}));
  EXPECT_EQ(evaluator.hessian_pattern().rows, (std::vector{x, y}));
  EXPECT_EQ(evaluator.hessian_pattern().columns, (std::vector{x, y}));

  const Vector at{{2, 3, 4}}, lambda{{10}};
  double g = 0;
  evaluator.constraints(at.data(), &g);
  EXPECT_EQ(g, 1 + 4 + 27 + 4 + 15);
  Vector J(2), W(2);
  evaluator.jacobian(at.data(), J.data());
  EXPECT_EQ(J, (Vector{{2 + 4, 18 + 5}}));
  evaluator.hessian(at.data(), 1, lambda.data(), W.data());
  EXPECT_EQ(W, (Vector{{20, 60}}));
  EXPECT_EQ(evaluator.work().jacobians, 1);
  EXPECT_LE(evaluator.work().derivative_seconds, evaluator.work().seconds);
}

TEST(NlpEvaluator, DerivativesAreThoseOfTheFunctions) {
  const auto problem = macmpec::scholtes1();
  expect_derivatives(problem.mpcc.nlp, Vector{{0.3, -0.2, 0.5, 1.1}}, Vector{{-1.7}});
}

void check_a_wrong_derivative() {
  Nlp nlp;
  nlp.add_block(std::make_unique<ScalarBlock>(
      nlp.add_variable(-1, 1, 0, "x"), [](double x) { return x * x; }, [](double x) { return 2 * x; },
      [](double) { return 3.0; }));
  expect_derivatives(nlp, Vector{{0.5}}, Vector(0));
}
TEST(NlpEvaluator, TheCheckFindsAWrongHessian) {
  EXPECT_NONFATAL_FAILURE(check_a_wrong_derivative(), "Lagrangian by x, x");
}

/// max(x - 100, 0)^3: zero wherever the structure is probed.
class DistantPiece : public ScalarBlock {
 public:
  DistantPiece(int variable, bool says_so)
      : ScalarBlock(
            variable, [](double x) { return x < 100 ? 0 : std::pow(x - 100, 3); },
            [](double x) { return x < 100 ? 0 : 3 * std::pow(x - 100, 2); },
            [](double x) { return x < 100 ? 0 : 6 * (x - 100); }),
        says_so_(says_so) {}
  bool is_piecewise() const override { return says_so_; }

 private:
  bool says_so_;
};

TEST(NlpEvaluator, DerivativesOutsideOfTheStructureAreNotDropped) {
  for (const bool says_so : {false, true}) {
    Nlp nlp;
    nlp.add_block(std::make_unique<DistantPiece>(nlp.add_variable(0, 200, 1, "x"), says_so));
    NlpEvaluator evaluator(nlp);
    const double x = 102;
    double gradient = 0;
    if (says_so) {
      evaluator.gradient(&x, &gradient);
      EXPECT_EQ(gradient, 12);
    } else {
      EXPECT_THROW(evaluator.gradient(&x, &gradient), std::logic_error);
    }
  }
}

TEST(NlpEvaluator, NamesTheWorstViolation) {
  const Nlp nlp = hock_schittkowski_35();
  NlpEvaluator evaluator(nlp);
  EXPECT_EQ(evaluator.worst_violation(Vector{{1, 1, 0.5}}.data()).value, 0);
  const NamedResidual row = evaluator.worst_violation(Vector{{3, -1, 2}}.data());
  EXPECT_EQ(row.value, 3);
  EXPECT_EQ(row.name, "row 'sum'");
  EXPECT_EQ(evaluator.worst_violation(Vector{{3, -1, 0}}.data()).name, "bound of 'x2'");
}

TEST(Ipopt, SolvesHockSchittkowski35) {
  const Nlp nlp = hock_schittkowski_35();
  testing::internal::CaptureStdout();
  const NlpResult result = IpoptSolver(nlp).solve();
  EXPECT_EQ(testing::internal::GetCapturedStdout(), "");
  ASSERT_EQ(result.status, NlpStatus::solved);
  EXPECT_EQ(result.message, "");
  // The tolerance 1e-10 of the optimality conditions, and a Hessian whose smallest eigenvalue is above 0.1.
  EXPECT_NEAR(result.objective, 1.0 / 9, 1e-9);
  EXPECT_LT((result.point.x - Vector{{4.0 / 3, 7.0 / 9, 4.0 / 9}}).norm(), 1e-8);
  EXPECT_NEAR(result.point.lambda[0], 2.0 / 9, 1e-8);
  EXPECT_EQ(result.violation.value, 0);  // bounds are not relaxed
  EXPECT_GT(result.iterations, 0);
  EXPECT_GE(result.seconds, result.derivative_seconds);
  EXPECT_GT(result.derivative_seconds, 0);
}

TEST(Ipopt, WarmStartStaysAtTheSolution) {
  const Nlp nlp = hock_schittkowski_35();
  IpoptSolver solver(nlp);
  const NlpResult cold = solver.solve();
  const NlpResult warm = solver.solve(cold.point, {.barrier = 1e-10});
  EXPECT_EQ(warm.status, NlpStatus::solved);
  EXPECT_LE(warm.iterations, 2);
  EXPECT_GT(cold.iterations, 5);
}

TEST(Ipopt, MultiplierOfAFixedVariable) {
  for (const double sign : {1, -1}) {  // min (x + y)^2 + y^2 / 2 with x = +-1: y = -2 x / 3, f_x = 2 (x + y) = 2 x / 3
    Nlp nlp;
    const int x = nlp.add_variable(sign, sign, 0, "x"), y = nlp.add_variable(-9, 9, 0, "y");
    nlp.add_block(std::make_unique<QuadraticBlock>(-1, std::vector{x, y}, 0, Vector::Zero(2), Matrix{{2, 2}, {2, 3}}));
    const NlpResult result = IpoptSolver(nlp).solve({.multipliers_of_fixed = true});
    ASSERT_EQ(result.status, NlpStatus::solved);
    EXPECT_NEAR(result.point.z_L[x] - result.point.z_U[x], 2 * sign / 3, 1e-8);
  }
}

// x = 0, and three consistent rows for the other two.
TEST(Ipopt, MoreRowsThanFreeVariables) {
  Nlp nlp;
  const int x = nlp.add_variable(0, 0, 0, "x"), y = nlp.add_variable(0, 9, 1, "y"), z = nlp.add_variable(0, 9, 1, "z");
  for (const double slope : {1, 5, 6}) {
    const double value = (1 + slope) / 2;  // at y = z = 1/2
    add_terms(nlp, nlp.add_row(value, value, "row"), 0, {{x, 1}, {y, 1}, {z, slope}});
  }
  add_terms(nlp, -1, 0, {{x, 1}, {y, 0, 1}});
  const NlpResult result = IpoptSolver(nlp).solve({.multipliers_of_fixed = true});
  ASSERT_TRUE(is_solved(result.status)) << result.message;
  EXPECT_LT((result.point.x - Vector{{0, 0.5, 0.5}}).norm(), 1e-8);
}

TEST(Ipopt, BoundsMayChangeBetweenSolves) {
  Nlp nlp = hock_schittkowski_35();
  IpoptSolver solver(nlp);
  nlp.variables[0].upper = 0.5;
  const NlpResult result = solver.solve();
  ASSERT_EQ(result.status, NlpStatus::solved);
  EXPECT_NEAR(result.point.x[0], 0.5, 1e-8);
}

TEST(Ipopt, SaysWhatFailed) {
  Nlp contradiction;
  add_terms(contradiction, -1, 0, {{contradiction.add_variable(-kInfinity, 1, 0, "x"), 1}});
  add_terms(contradiction, contradiction.add_row(3, kInfinity, "floor"), 0, {{0, 1}});
  const NlpResult infeasible = IpoptSolver(contradiction).solve();
  EXPECT_EQ(infeasible.status, NlpStatus::infeasible);
  EXPECT_EQ(infeasible.violation.name, "row 'floor'");
  EXPECT_NEAR(infeasible.violation.value, 2, 1e-6);

  const Nlp nlp = hock_schittkowski_35();
  EXPECT_EQ(IpoptSolver(nlp).solve({.max_iterations = 1}).status, NlpStatus::iteration_limit);
  EXPECT_EQ(IpoptSolver(nlp).solve({.time_limit = 1e-9}).status, NlpStatus::time_limit);

  Nlp undefined;
  undefined.add_block(std::make_unique<ScalarBlock>(
      undefined.add_variable(-1, 1, 0, "x"), [](double) { return std::numeric_limits<double>::quiet_NaN(); },
      [](double) { return 1.0; }, [](double) { return 0.0; }));
  EXPECT_EQ(IpoptSolver(undefined).solve().status, NlpStatus::non_finite);
}

TEST(Ipopt, ExceptionsOfBlocksPassThrough) {
  Nlp nlp;
  nlp.add_block(std::make_unique<ScalarBlock>(
      nlp.add_variable(-1, 1, 0, "x"), [](double) -> double { throw std::domain_error("not here"); },
      [](double) { return 1.0; }, [](double) { return 0.0; }));
  EXPECT_THROW(IpoptSolver(nlp).solve(), std::domain_error);
}

TEST(Ipopt, RejectsOptionsOutOfRange) {
  const Nlp nlp = hock_schittkowski_35();
  IpoptSolver solver(nlp);
  EXPECT_THROW(solver.solve({.tolerance = 0}), InputError);
  EXPECT_THROW(solver.solve({.acceptable_factor = 0.5}), InputError);
  EXPECT_THROW(solver.solve({.max_iterations = -1}), InputError);
  EXPECT_THROW(solver.solve({.time_limit = -1}), InputError);
  EXPECT_THROW(solver.solve({.barrier = 0}), InputError);
}

}  // namespace
}  // namespace ricochet
