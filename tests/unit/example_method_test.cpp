// A complete method in forty lines, to be copied. The conformance tests, which are linked with it, run it as well.
#include <gtest/gtest.h>

#include <algorithm>

#include "problems/input_error.h"
#include "problems/registry.h"

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
    return {.id = id_,
            .title = "inelastic time stepping",
            .source = "example",
            .order_smooth = 1,
            .order_impacts = 1,
            .is_audited = true};
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

/// The ball falls from q = 1 m and rests on the floor. The error is less than the way of one step.
TEST(ExampleMethod, StopsABall) {
  const auto problem = make_problem("bouncing_ball", {{"e", 0}});
  Settings settings;
  settings.steps = 1000;
  const Solution s = make_method("inelastic_stepping")->solve(*problem, settings);
  const double h = problem->info().end_time / settings.steps;
  EXPECT_NEAR(problem->gap(s.q)[0], 0, h * std::sqrt(2 * 9.81 * 1));
  EXPECT_EQ(s.v[0], 0);
}

/// The registry rejects options and arguments that the method does not list.
TEST(ExampleMethod, TakesNoOptions) {
  EXPECT_THROW(make_method("inelastic_stepping,theta=1"), InputError);
  EXPECT_THROW(make_method("inelastic_stepping:2"), InputError);
}

}  // namespace
}  // namespace ricochet
