// A complete method in forty lines: its do_solve() is the one that README.md prints, which a test below compares. It is
// linked with the conformance tests, which run it as any other: what they ask of a method, an example can give.
#include <gtest/gtest.h>

#include <algorithm>
#include <fstream>
#include <sstream>

#include "problems/input_error.h"
#include "tests/test_data.h"

// example begins
#include "methods/registry.h"
#include "methods/time_stepping/common/explicit_step.h"
#include "methods/time_stepping/common/fixed_step_run.h"

namespace ricochet {
namespace {

/// v_{k+1} = v_k + h M^-1 f(q_k, v_k) + M^-1 (J_n Lambda_n + J_t Lambda_t), contacts with f_c(q_k) <= 0 inelastic, with
/// Coulomb's law; q_{k+1} = q_k + h v_{k+1}. Order 1.
class InelasticStepping final : public Method {
 public:
  explicit InelasticStepping(const MethodSpec& spec) : id_(spec.text()) {}

  MethodInfo info() const override {
    return {.id = id_, .title = "inelastic time stepping", .source = "example", .order_smooth = 1, .order_impacts = 1};
  }
  Support supports(const ProblemInfo& problem) const override {
    const bool bounces = std::ranges::any_of(problem.contacts, [](const auto& contact) { return contact.eps_r > 0; });
    return bounces ? Support::no("it knows no restitution") : Support::yes();
  }

 protected:
  Solution do_solve(const Problem& problem, const Settings& settings) const override {
    FixedStepRun run(problem, settings);  // the state, the contact problem, the loop over the steps
    ExplicitStep free(run);
    const Vector inelastic = Vector::Zero(problem.n_c());
    return run.take_steps([&](Vector& v_plus) {
      v_plus = run.v + free.change(run.q, run.v);  // v_k + h M^-1 f(q_k, v_k)
      run.find_active(run.q);                      // f_c(q_k) <= 0: these carry impulses, with Coulomb's law
      if (run.has_contact_problem() &&
          !(run.prepare_contacts(run.q, free.W) && run.solve_contacts(v_plus, inelastic, {})))
        return false;
      run.q += run.h * v_plus;
      return true;
    });
  }

 private:
  std::string id_;
};

const bool registered = register_method<InelasticStepping>({
    .name = "inelastic_stepping",
    .usage = "inelastic_stepping",
    .summary = "time stepping without restitution",
    .examples = {"inelastic_stepping"},
});

}  // namespace
}  // namespace ricochet
// example ends

namespace ricochet {
namespace {

/// Without blanks, which only lay it out.
std::string code_of(const std::string& path) {
  std::ifstream file(path);
  std::ostringstream text;
  text << file.rdbuf();
  std::string code = text.str();
  std::erase_if(code, [](char c) { return c == ' ' || c == '\n'; });
  return code;
}

TEST(ExampleMethod, IsTheOneOfTheReadme) {
  const std::string readme = code_of(test_data("../../README.md")), begin = "```cpp";
  const auto from = readme.find(begin) + begin.size();
  ASSERT_NE(from, std::string::npos + begin.size());
  const std::string shown = readme.substr(from, readme.find("```", from) - from);
  EXPECT_NE(code_of(__FILE__).find(shown), std::string::npos) << shown;
}

/// From q = 1 m to the floor, where it rests: a step is too long by less than one.
TEST(ExampleMethod, StopsABall) {
  const auto problem = make_problem("bouncing_ball", {{"e", 0}});
  Settings settings;
  settings.steps = 1000;
  const Solution s = make_method("inelastic_stepping")->solve(*problem, settings);
  const double h = problem->info().end_time / settings.steps;
  EXPECT_NEAR(problem->gap(s.q)[0], 0, h * std::sqrt(2 * 9.81 * 1));
  EXPECT_EQ(s.v[0], 0);
}

/// It says nothing of options and arguments that it does not know: the registry does.
TEST(ExampleMethod, TakesNoOptions) {
  EXPECT_THROW(make_method("inelastic_stepping,theta=1"), InputError);
  EXPECT_THROW(make_method("inelastic_stepping:2"), InputError);
}

}  // namespace
}  // namespace ricochet
