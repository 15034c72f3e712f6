#include "methods/method.h"

#include <fmt/format.h>

#include <cmath>

#include "problems/input_error.h"

namespace ricochet {

Solution Method::solve(const Problem& problem, const Settings& settings) const {
  const MethodInfo method = info();
  if (const Support support = supports(problem.info()); !support.ok) {
    throw InputError(fmt::format("method {} cannot run problem {}: {}", method.id, problem.info().id, support.reason));
  }
  const auto require = [](bool ok, const char* field, double value, const char* allowed) {
    if (!ok) throw InputError(field, value, allowed);
  };
  const auto in_unit_interval = [](double x) { return x > 0 && x < 1; };
  if (method.is_adaptive) {
    require(settings.tolerance >= 1e-15 && settings.tolerance < 1, "tolerance", settings.tolerance,
            "a number from 1e-15 to 1 is required");
  } else {
    require(settings.steps >= 1, "steps", settings.steps, "at least one step is required, h = T / steps > 0");
  }
  require(in_unit_interval(settings.inner_tolerance), "inner_tolerance", settings.inner_tolerance,
          "a number between 0 and 1 is required");
  require(in_unit_interval(settings.event_tolerance), "event_tolerance", settings.event_tolerance,
          "a number between 0 and 1 is required");
  if (!settings.sensitivities.empty() && !method.has_sensitivities)
    throw InputError(fmt::format("method {} computes no sensitivities", method.id));
  require(settings.time_limit >= 0, "time_limit", settings.time_limit, "a number of seconds >= 0 is required");

  Solution solution = do_solve(problem, settings);
  if (settings.recording == Recording::final_state) solution.events.clear();
  if (solution.succeeded() && !(solution.q.allFinite() && solution.v.allFinite())) {
    solution.status = Status::non_finite;
    solution.message = "the final state is not finite";
  }
  return solution;
}

}  // namespace ricochet
