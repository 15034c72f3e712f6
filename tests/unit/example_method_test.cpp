// A complete method in forty lines, as CONTRIBUTING.md shows it: symplectic Euler with Newton's law for one contact at
// a time. It is compiled and run here so that the example stays true.
#include <gtest/gtest.h>

#include <Eigen/Cholesky>

#include "methods/registry.h"
#include "problems/input_error.h"
#include "problems/registry.h"

// example begins
namespace ricochet {
namespace {

/// v_{k+1} = v_k + h M^-1 f(q_k, v_k), then Newton's law at a closed contact; q_{k+1} = q_k + h v_{k+1}. Order 1.
class SymplecticEuler final : public Method {
 public:
  explicit SymplecticEuler(const MethodSpec& spec) : id_(spec.text()) {}

  MethodInfo info() const override {
    return {.id = id_, .title = "symplectic Euler", .source = "example", .order_smooth = 1, .order_impacts = 1};
  }
  Support supports(const ProblemInfo& problem) const override {
    return problem.n_c() > 1 || problem.has_friction() ? Support::no("one frictionless contact at most")
                                                       : Support::yes();
  }

 protected:
  Solution do_solve(const Problem& problem, const Settings& settings) const override {
    Solution s;
    s.q = problem.info().q0;
    s.v = problem.info().v0;
    const double h = problem.info().end_time / settings.steps;
    for (; s.counters.steps < settings.steps; ++s.counters.steps) {
      const Eigen::LLT<Matrix> M(problem.mass_matrix(s.q));
      s.v += h * M.solve(problem.force(s.q, s.v));
      if (problem.n_c() == 1 && problem.gap(s.q)[0] <= 0) {
        const Matrix n = problem.normal_jacobian(s.q);
        const Vector Mn = M.solve(problem.force_directions(n));
        const double approach = n.col(0).dot(s.v);
        if (approach < 0) s.v -= (1 + problem.info().contacts[0].eps_r) * approach / n.col(0).dot(Mn) * Mn;
      }
      s.q += h * s.v;
    }
    s.t = problem.info().end_time;
    return s;
  }

 private:
  std::string id_;
};

const bool registered = register_method<SymplecticEuler>({
    .name = "symplectic_euler",
    .usage = "symplectic_euler",
    .summary = "symplectic Euler, one contact",
    .examples = {"symplectic_euler"},
});

}  // namespace
}  // namespace ricochet
// example ends

namespace ricochet {
namespace {

TEST(ExampleMethod, BouncesABall) {
  const auto problem = make_problem("bouncing_ball");
  const auto error = [&](int steps) {
    Settings settings;
    settings.steps = steps;
    const Solution s = make_method("symplectic_euler")->solve(*problem, settings);
    return std::abs(s.q[0] - 0.370977516354263779);  // tests/data/ground_truth.json, P1a_ball_e09
  };
  EXPECT_LE(error(100000), 1e-3) << "order 1: 4e-4 measured";
}

/// It says nothing of options and arguments that it does not know: the registry does.
TEST(ExampleMethod, TakesNoOptions) {
  EXPECT_THROW(make_method("symplectic_euler,theta=1"), InputError);
  EXPECT_THROW(make_method("symplectic_euler:2"), InputError);
}

}  // namespace
}  // namespace ricochet
