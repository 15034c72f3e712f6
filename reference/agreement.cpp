#include "reference/agreement.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>

#include "reference/scales.h"

namespace ricochet::reference {

std::string Reference::title() const {
  return (is_truth ? "truth " : "reference ") + how.substr(0, std::min(how.find(" by "), how.find(", ")));
}

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
  if (solution.dq.size() > 0) return sensitivity_difference(other, solution);
  const double of_state = final_state_difference(other.q, other.v, solution.q, solution.v);
  return ends_early ? std::max(of_state, std::abs(other.t - solution.t)) : of_state;
}

double Reference::size() const {
  return solution.dq.size() > 0 ? 1 : std::max(solution.q.cwiseAbs().maxCoeff(), solution.v.cwiseAbs().maxCoeff());
}

namespace {

/// Events of a run. Events within 1e-9 of the end time of each other, the size of rounding and integration errors, are
/// in the order of their contacts: rounding decides which of two equal bodies stops first.
std::vector<Event> ordered(std::vector<Event> events, double end_time) {
  for (auto first = events.begin(); first != events.end();) {
    const auto last =
        std::find_if(first, events.end(), [&](const Event& e) { return e.t > first->t + 1e-9 * end_time; });
    std::stable_sort(first, last, [](const Event& a, const Event& b) { return a.contact < b.contact; });
    first = last;
  }
  return events;
}

/// An item on which the runs must agree: an event, or the limit of an accumulation, which has no contact.
struct Step {
  double t;
  int contact;
  EventKind kind;
  const std::vector<ContactMode>* modes;

  bool is_limit() const { return contact < 0; }
};

constexpr double kLimit = 1e-5;  // of the end time: intervals of an accumulation whose impacts are not told apart

/// Combines events in close succession, with two impacts of a contact among them, into one step.
std::vector<Step> steps_of(const std::vector<Event>& events, double end_time) {
  std::vector<Step> steps;
  for (auto first = events.begin(); first != events.end();) {
    auto last = first;
    bool repeats = false;
    while (last + 1 != events.end() && (last + 1)->t - last->t < kLimit * end_time) {
      ++last;
      repeats = repeats || (last->kind == EventKind::impact && std::any_of(first, last, [&](const Event& e) {
                              return e.kind == EventKind::impact && e.contact == last->contact;
                            }));
    }
    if (repeats) {
      steps.push_back({last->t, -1, EventKind::impact, &last->modes});
      first = last + 1;
    } else {
      steps.push_back({first->t, first->contact, first->kind, &first->modes});
      ++first;
    }
  }
  return steps;
}

bool agree(const Step& a, const Step& b, double end_time) {
  if (!a.is_limit() || !b.is_limit()) return a.kind == b.kind && a.contact == b.contact;
  return *a.modes == *b.modes && std::abs(a.t - b.t) <= kLimit * end_time;
}

/// Message about the first difference of two runs, with the contacts.
std::string disagreement(const std::vector<Step>& steps, const std::vector<Step>& others, const ProblemInfo& info) {
  const auto text = [&](const std::vector<Step>& list, std::size_t k) -> std::string {
    if (k >= list.size()) return "no event";
    if (list[k].is_limit()) return fmt::format("the limit of an accumulation at {:.9g} s", list[k].t);
    return fmt::format("{} of contact '{}' at {:.9g} s", to_string(list[k].kind), info.contacts[list[k].contact].name,
                       list[k].t);
  };
  std::size_t k = 0;
  while (k < steps.size() && k < others.size() && agree(steps[k], others[k], info.end_time)) ++k;
  return fmt::format("the integrators disagree on the sequence of events: {} by one is {} by another", text(steps, k),
                     text(others, k));
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
  reference.ends_early = problem.info().until >= 0;
  const Solution others[] = {run(adams, 10 * tolerance), run(bdf, tolerance), run(bdf, 10 * tolerance)};

  const Solution& best = reference.solution;
  const Scales scales(problem);
  const double size = std::max({best.q.cwiseAbs().maxCoeff(), best.v.cwiseAbs().maxCoeff(),
                                scales.position().maxCoeff(), scales.velocity().maxCoeff()});
  const double end_time = problem.info().end_time;
  const auto best_events = ordered(best.events, end_time);
  const auto best_steps = steps_of(best_events, end_time);
  double difference = 0;
  for (const Solution& other : others) {
    const auto other_events = ordered(other.events, end_time);
    const auto other_steps = steps_of(other_events, end_time);
    const bool same_events = std::equal(best_steps.begin(), best_steps.end(), other_steps.begin(), other_steps.end(),
                                        [&](const Step& a, const Step& b) { return agree(a, b, end_time); });
    if (!same_events) {
      throw std::runtime_error(
          fmt::format("reference of {}: {}", problem.info().id, disagreement(best_steps, other_steps, problem.info())));
    }
    const double distance = final_state_difference(best.q, best.v, other.q, other.v);
    if (&other == &others[2]) {
      // The run with the loosest tolerance does not measure the error, but must follow the same motion.
      if (distance > 1e7 * tolerance * size) {
        throw std::runtime_error(
            fmt::format("reference of {}: the run with the loosest tolerance differs from the best by {:.1e}",
                        problem.info().id, distance));
      }
      continue;
    }
    difference = std::max(difference, distance);
    for (std::size_t k = 0; k < best_steps.size(); ++k) {
      if (!best_steps[k].is_limit()) difference = std::max(difference, std::abs(best_steps[k].t - other_steps[k].t));
    }
  }
  double least = tolerance * size;  // a run claims no error below its tolerance
  if (!best.events.empty()) {       // CVODE locates a root to within 100 roundings of t
    least = std::max(least, 100 * std::numeric_limits<double>::epsilon() * best.events.back().t);
  }
  reference.uncertainty = std::max(5 * difference, 10 * least);
  reference.how =
      fmt::format("CVODE with event location, Adams and BDF at {:.0e} and {:.0e}{}", tolerance, 10 * tolerance,
                  problem.info().structure.has_bounds ? "" : ", with steps bounded by the gaps for want of enclosures");
  return reference;
}

}  // namespace ricochet::reference
