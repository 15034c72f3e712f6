#include "reference/agreement.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>

#include "reference/scales.h"

namespace ricochet::reference {

int Reference::digits() const {
  return uncertainty > 0 ? static_cast<int>(std::floor(-std::log10(uncertainty))) : 16;
}

double final_state_difference(const Vector& q, const Vector& v, const Vector& q_reference, const Vector& v_reference) {
  return std::max((q - q_reference).cwiseAbs().maxCoeff(), (v - v_reference).cwiseAbs().maxCoeff());
}

double sensitivity_difference(const Solution& solution, const Solution& reference) {
  double worst = 0;
  for (Eigen::Index k = 0; k < reference.dq.cols(); ++k) {
    const auto dq = reference.dq.col(k), dv = reference.dv.col(k);
    const double size = std::max({1.0, dq.cwiseAbs().maxCoeff(), dv.cwiseAbs().maxCoeff()});
    worst = std::max(worst, final_state_difference(solution.dq.col(k), solution.dv.col(k), dq, dv) / size);
  }
  return worst;
}

double Reference::error_of(const Solution& other) const {
  return solution.dq.size() > 0 ? sensitivity_difference(other, solution)
                                : final_state_difference(other.q, other.v, solution.q, solution.v);
}

double Reference::size() const {
  return solution.dq.size() > 0 ? 1 : std::max(solution.q.cwiseAbs().maxCoeff(), solution.v.cwiseAbs().maxCoeff());
}

namespace {

/// Events of a run; those at the same time to rounding and integration error, 1e-9 of the end time, in the order of
/// their contacts. Which of two equal bodies stops first is rounding.
std::vector<Event> ordered(std::vector<Event> events, double end_time) {
  for (auto first = events.begin(); first != events.end();) {
    const auto last =
        std::find_if(first, events.end(), [&](const Event& e) { return e.t > first->t + 1e-9 * end_time; });
    std::stable_sort(first, last, [](const Event& a, const Event& b) { return a.contact < b.contact; });
    first = last;
  }
  return events;
}

}  // namespace

Reference make_reference(const Problem& problem, double tolerance) {
  const auto run = [&](const MakeIntegrator& integrator, double tol) {
    Solution solution = integrate_event_located(problem, {.integrator = integrator, .tolerance = tol});
    if (!solution.succeeded()) {
      throw std::runtime_error(
          fmt::format("reference of {}: {}: {}", problem.info().id, to_string(solution.status), solution.message));
    }
    return solution;
  };
  Reference reference;
  reference.solution = run(adams, tolerance);
  const Solution others[] = {run(adams, 10 * tolerance), run(bdf, tolerance), run(bdf, 10 * tolerance)};

  const Solution& best = reference.solution;
  const Scales scales(problem);
  const double size = std::max({best.q.cwiseAbs().maxCoeff(), best.v.cwiseAbs().maxCoeff(),
                                scales.position().maxCoeff(), scales.velocity().maxCoeff()});
  const auto best_events = ordered(best.events, problem.info().end_time);
  double difference = 0;
  for (const Solution& other : others) {
    const auto other_events = ordered(other.events, problem.info().end_time);
    const bool same_events =
        std::equal(best_events.begin(), best_events.end(), other_events.begin(), other_events.end(),
                   [](const Event& a, const Event& b) { return a.kind == b.kind && a.contact == b.contact; });
    if (!same_events) {
      throw std::runtime_error(
          fmt::format("reference of {}: the integrators disagree on the sequence of events", problem.info().id));
    }
    const double distance = final_state_difference(best.q, best.v, other.q, other.v);
    if (&other == &others[2]) {
      // The loosest run is no measure of the error, but a million tolerances away it has followed another motion.
      if (distance > 1e7 * tolerance * size) {
        throw std::runtime_error(fmt::format("reference of {}: the loosest run ends {:.1e} away from the others",
                                             problem.info().id, distance));
      }
      continue;
    }
    difference = std::max(difference, distance);
    for (std::size_t k = 0; k < best_events.size(); ++k)
      difference = std::max(difference, std::abs(best_events[k].t - other_events[k].t));
  }
  double rounding = 1e-15 * size;
  if (!best.events.empty()) {  // CVODE locates a root to within 100 roundings of t
    rounding = std::max(rounding, 100 * std::numeric_limits<double>::epsilon() * best.events.back().t);
  }
  reference.uncertainty = 3 * std::max(difference, rounding);
  reference.how =
      fmt::format("CVODE with event location, Adams and BDF at {:.0e} and {:.0e}", tolerance, 10 * tolerance);
  return reference;
}

}  // namespace ricochet::reference
