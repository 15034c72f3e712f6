#include <fmt/format.h>

#include "methods/elements/bilateral_support.h"
#include "methods/elements/smooth_forces.h"
#include "methods/registry.h"
#include "methods/runge_kutta/tableau_argument.h"
#include "methods/time_freezing/time_freezing_run.h"
#include "problems/dense_solve.h"
#include "problems/levers.h"

namespace ricochet {
namespace {

/// Time freezing: impacts as motion of auxiliary dynamics in a pseudo time in which the clock stands still, persistent
/// contact as sliding motion of the Filippov system that is left, and this by finite elements with switch detection. The
/// equations are in pseudo_time_equations.h, pseudo_time_end.h; README.md says what differs from the sources.
class TimeFreezing final : public Method {
 public:
  explicit TimeFreezing(const MethodSpec& spec) : id_(spec.text()), tableau_(tableau_argument(spec)) {
    options_.n_fe = spec.whole_number("n_fe", options_.n_fe, 1, 1000);
    options_.a_n = spec.number("a_n", options_.a_n, 1e-6, 1e9);
    options_.bounce = spec.number("bounce", options_.bounce, 1e-6, 1e3);
  }

  MethodInfo info() const override {
    const auto order = static_cast<double>(tableau_.order);
    return {.id = id_,
            .title = fmt::format("time freezing, {}", tableau_.name),
            .source =
                "Nurkanovic, Albrecht, Brogliato, Diehl, Automatica 158 (2023) 111295; elastic: Nurkanovic, "
                "Sartor, Albrecht, Diehl, IEEE L-CSS 5 (2021) 439-444",
            .order_smooth = order,
            .order_impacts = order};
  }

  Support supports(const ProblemInfo& problem) const override {
    if (const Support forces = can_follow_forces(problem); !forces.ok) return forces;
    if (has_levers(problem))
      return Support::no(
          "Coulomb's law holds at every instant of its impacts, not for the bound and the whole impulse");
    if (!problem.unilateral.empty() && !is_invertible(tableau_.A)) {
      return Support::no(
          fmt::format("the matrix A of tableau {} is singular and does not determine the weights of a sliding motion",
                      tableau_.name));
    }
    for (const int i : problem.unilateral) {
      const auto& contact = problem.contacts[i];
      if (contact.eps_r > 0 && contact.eps_r < kLeastRestitution)
        return Support::no(fmt::format("the restitution of contact '{}' is {}: a spring and a damper have from {} on",
                                       contact.name, contact.eps_r, kLeastRestitution));
    }
    return can_hold_bilateral(tableau_, problem);
  }

 protected:
  Solution do_solve(const Problem& problem, const Settings& settings) const override {
    return TimeFreezingRun(problem, tableau_, options_, settings).run();
  }

 private:
  // The damper of a bounce grows like the logarithm of it.
  static constexpr double kLeastRestitution = 1e-6;

  std::string id_;
  ButcherTableau tableau_;
  TimeFreezingOptions options_;
};

const bool registered = register_method<TimeFreezing>({
    .name = "time_freezing",
    .usage = "time_freezing:TABLEAU:STAGES[,n_fe=1][,a_n=100][,bounce=0.1], or time_freezing:@TABLEAU_FILE",
    .max_arguments = 2,
    .summary = "impacts in frozen time, persistent contact as sliding motion, by switch detection",
    .examples = {"time_freezing:radau-iia:3", "time_freezing:gauss:2"},
});

}  // namespace
}  // namespace ricochet
