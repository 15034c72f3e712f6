#include "bench/measure/sensitivities.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <utility>

#include "problems/input_error.h"
#include "problems/variables.h"

namespace ricochet {
namespace {

bool has_events_of(const Solution& a, const Solution& b) {
  return std::equal(a.events.begin(), a.events.end(), b.events.begin(), b.events.end(),
                    [](const Event& x, const Event& y) { return x.kind == y.kind && x.contact == y.contact; });
}

/// With fixed steps a solution is smooth until an impact changes its step, so the change is small. The solution of a
/// method that follows a tolerance is rough by about that much, and the change is large against it.
double usual_change(const Method& method, const Settings& settings) {
  return method.info().is_adaptive ? std::min(std::cbrt(settings.tolerance), 0.01) : 1e-7;
}

}  // namespace

Solution solve_with_sensitivities(const Method& method, const Problem& problem, const Settings& settings) {
  return settings.sensitivities.empty() || method.info().has_sensitivities
             ? method.solve(problem, settings)
             : solve_with_differences(method, problem, settings, usual_change(method, settings));
}

Solution solve_with_differences(const Method& method, const Problem& problem, const Settings& settings, double change) {
  std::vector<Eigen::Index> chosen;
  for (const auto& name : settings.sensitivities) chosen.push_back(find_variable(problem.info(), name));
  Settings plain = settings;
  plain.sensitivities.clear();
  Solution solution = method.solve(problem, plain);
  if (!solution.succeeded()) return solution;
  plain.audit = false;
  plain.recording = Recording::events;

  const auto n_theta = static_cast<Eigen::Index>(chosen.size());
  solution.dq.setZero(problem.n_q(), n_theta);
  solution.dv.setZero(problem.n_q(), n_theta);
  for (Event& event : solution.events) event.dt.setZero(n_theta);
  const auto all = variables(problem.info());
  for (Eigen::Index column = 0; column < n_theta; ++column) {
    const Eigen::Index theta = chosen[static_cast<std::size_t>(column)];
    const auto& [name, value] = all[static_cast<std::size_t>(theta)];
    const double delta = change * std::max(std::abs(value), 0.1);
    for (const auto& [place, weight] : {std::pair{1, 8}, {-1, -8}, {2, -1}, {-2, 1}}) {
      const double there = value + place * delta;
      std::unique_ptr<Problem> beside;
      try {
        beside = with_value(problem, theta, there);
      } catch (const InputError& error) {
        throw InputError(fmt::format("sensitivity {} by differences: {}", name, error.what()));
      }
      const Solution other = method.solve(*beside, plain);
      solution.own_seconds += other.own_seconds;
      if (!other.succeeded()) {
        solution.status = other.status;
        solution.message = fmt::format("at {} = {:.17g}: {}", name, there, other.message);
        solution.reason = other.reason;
        return solution;
      }
      const double factor = weight / (12 * delta);
      // The weights add up to zero; differences to the undisturbed solution lose fewer digits.
      solution.dq.col(column) += factor * (other.q - solution.q);
      solution.dv.col(column) += factor * (other.v - solution.v);
      const bool is_alike = has_events_of(other, solution);
      for (std::size_t k = 0; k < solution.events.size(); ++k) {
        solution.events[k].dt[column] +=
            is_alike ? factor * (other.events[k].t - solution.events[k].t) : std::numeric_limits<double>::quiet_NaN();
      }
    }
  }
  return solution;
}

}  // namespace ricochet
