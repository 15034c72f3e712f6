// Every number of every method on every scene, bit by bit: what a commit that only moves code has to leave as it was.
//
//   numbers > before;  (the change)  numbers > after;  diff before after
//
// Two builds agree only with the same compiler and flags, and without -ffp-contract=off a compiler may contract another
// product in code that has moved (CONTRIBUTING.md, "Moving code").
#include <fmt/core.h>

#include "problems/input_error.h"
#include "tests/method_scene_pairs.h"

namespace ricochet {
namespace {

void print(const char* name, const Vector& x) {
  fmt::print("  {}", name);
  for (const double value : x) fmt::print(" {:a}", value);
  fmt::print("\n");
}

void print(const Counters& c) {
  fmt::print("  counters {} {} {} {} {} {} {} {} {} {} {}\n", c.steps, c.elements, c.force_evaluations,
             c.jacobian_evaluations, c.mass_factorizations, c.matrix_factorizations, c.linear_solves,
             c.complementarity_solves, c.inner_iterations, c.pivots, c.events);
}

void print(const Solution& solution) {
  fmt::print("  {} {:a} {}\n", to_string(solution.status), solution.t, solution.message);
  print("q", solution.q);
  print("v", solution.v);
  for (const Vector& column : std::vector<Vector>(solution.dq.colwise().begin(), solution.dq.colwise().end()))
    print("dq", column);
  for (const Vector& column : std::vector<Vector>(solution.dv.colwise().begin(), solution.dv.colwise().end()))
    print("dv", column);
  print(solution.counters);
  for (const Event& event : solution.events) {
    fmt::print("  {} {} {:a}", to_string(event.kind), event.contact, event.t);
    for (const ContactMode mode : event.modes) fmt::print(" {}", to_string(mode));
    fmt::print("\n");
    print("v+", event.v_plus);
    print("Lambda_n", event.Lambda_n);
    print("Lambda_t", event.Lambda_t);
  }
  for (const Residual& residual : solution.residuals) fmt::print("  {} {:a}\n", residual.name, residual.value);
}

void print_all() {
  for (const MethodScenePair& pair : pairs_that(true)) {
    const auto method = make_method(pair.method);
    Settings settings;
    settings.steps = pair.steps / 4;
    settings.tolerance = 1e-8;
    settings.audit = true;
    fmt::print("{} {}\n", pair.method, pair.problem_id);
    print(method->solve(*pair.problem, settings));
    if (!method->info().has_sensitivities || pair.problem->info().has_bilateral()) continue;
    settings.sensitivities = {"q0:0", "v0:0"};
    try {
      print(method->solve(*pair.problem, settings));
    } catch (const InputError& error) {  // states that cannot vary
      fmt::print("  {}\n", error.what());
    }
  }
}

}  // namespace
}  // namespace ricochet

int main() {
  ricochet::print_all();
}
