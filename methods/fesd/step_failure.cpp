#include "methods/fesd/step_failure.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "methods/contact_laws/impact_laws/stated_impact.h"
#include "methods/fesd/nonunique_motion.h"
#include "methods/modes/mode_dynamics.h"

namespace ricochet {
namespace {

/// @param where  the element, as the end of a sentence
std::string describe(const Violation& violation, const std::string& contact, const std::string& where,
                     const std::string& tableau) {
  if (violation.kind == Violation::Kind::past_switch)
    return fmt::format(fmt::runtime(properties(violation.passed).refusal), contact, violation.value, -violation.value,
                       where);
  if (violation.kind == Violation::Kind::inexact)
    return fmt::format(
        "{} {} too flatly to be located {}", contact,
        violation.passed == SwitchKind::gap_closes ? "closes, or nearly closes," : "nearly stops to slip,", where);
  return fmt::format(
      "{} stays closed, but tableau {} has no stage at the right end and drifts to a gap or slip velocity of {:.3g} "
      "there {}: a curved persistent contact needs a stiffly accurate tableau",
      contact, tableau, violation.value, where);
}

/// Contacts that share their forces in ways that move the bodies differently, where the step fails at a friction cone.
std::vector<std::string> open_contacts(const StepFailure& failure, const Problem& problem, const FesdStep& step) {
  if (!failure.violation.is_past(SwitchKind::cone_reached)) return {};
  const Element& element = step.elements[static_cast<std::size_t>(failure.element)];
  return contacts_of_nonunique_motion(problem, element.q0, element.v0, element.modes);
}

FailureCode code_of(StepFailure::Kind kind) {
  switch (kind) {
    case StepFailure::Kind::accumulates:
    case StepFailure::Kind::impacts_accumulate:
      return FailureCode::impacts_accumulate;
    case StepFailure::Kind::no_impulse:
    case StepFailure::Kind::no_forces:
      return FailureCode::inconsistent;
    case StepFailure::Kind::indeterminate:
      return FailureCode::indeterminate;
    case StepFailure::Kind::none:
    case StepFailure::Kind::sign_condition:
    case StepFailure::Kind::newton_failed:
    case StepFailure::Kind::no_motion:
    case StepFailure::Kind::undetermined:
    case StepFailure::Kind::no_right_stage:
      break;
  }
  return FailureCode::not_stated;
}

}  // namespace

bool StepFailure::depends_on_length() const {
  return code_of(kind) == FailureCode::not_stated;
}

void SearchFailures::note(const StepFailure& failure) {
  if (!first) first = failure;
  if (!deepest || failure.element - failure.count > deepest.element - deepest.count) deepest = failure;
}

std::string describe(const StepFailure& failure, const ProblemInfo& problem, const std::string& tableau) {
  const int i = failure.violation.contact;
  const std::string contact = i < 0 ? "a contact" : "contact '" + problem.contacts[i].name + "'";
  const std::string where =
      fmt::format("in element {} of {} equal ones of {:.6g} s", failure.element + 1, failure.count, failure.h);
  switch (failure.kind) {
    case StepFailure::Kind::sign_condition:
      return describe(failure.violation, contact, where, tableau);
    case StepFailure::Kind::newton_failed:
      return fmt::format("Newton's method on the stage equations did not converge {}", where);
    case StepFailure::Kind::no_motion:
      return fmt::format("{} {}", ModeDynamics::kUndetermined, where);
    case StepFailure::Kind::undetermined:
      return fmt::format("{} stays closed, but the matrix A of tableau {} is singular and does not determine its force",
                         contact, tableau);
    case StepFailure::Kind::no_right_stage:
      return fmt::format(
          "{} comes to rest, but tableau {} has no stage at the right end where both components of its slip velocity "
          "could vanish: slip in space that stops needs a stiffly accurate tableau",
          contact, tableau);
    case StepFailure::Kind::accumulates:
      return fmt::format(
          "the impacts of {} accumulate, it bounces no higher than its gap is known; tableau {} has no stage at the "
          "right end that could stop it",
          contact, tableau);
    case StepFailure::Kind::impacts_accumulate:
      return fmt::format("impacts of {} and its neighbours follow each other at one instant without an end", contact);
    case StepFailure::Kind::no_impulse:
      return fmt::format("the impact law at {} has no solution: {}", contact, why_no_impulse(problem));
    case StepFailure::Kind::no_forces:
      return fmt::format(
          "the contact forces at {} are inconsistent: no active set of the touching contacts fulfils the contact laws "
          "(Painleve)",
          contact);
    case StepFailure::Kind::indeterminate:
      return fmt::format(
          "the contact forces at {} are indeterminate: it may open, and as well press itself against the surface it "
          "slides on (Painleve)",
          contact);
    case StepFailure::Kind::none:
      break;
  }
  return "";
}

std::string describe(const SearchFailures& failures, const Problem& problem, const std::string& tableau,
                     const FesdStep& step, const std::string& elements, int predictions) {
  const StepFailure &first = failures.first, &deepest = failures.deepest;
  const ProblemInfo& info = problem.info();
  if (!first.depends_on_length()) return describe(first, info, tableau);
  std::string message = fmt::format("no solution with {}: {}", elements, describe(first, info, tableau));
  const bool is_other = deepest.element != first.element || deepest.kind != first.kind ||
                        deepest.violation.kind != first.violation.kind ||
                        deepest.violation.passed != first.violation.passed;
  if (is_other) message += fmt::format("; with a switch before it, {}", describe(deepest, info, tableau));
  if (const auto open = open_contacts(first, problem, step); !open.empty())
    message += fmt::format(
        "; Coulomb's law leaves the motion open there, contacts '{}' may share their forces in ways "
        "that move the bodies differently",
        fmt::join(open, "', '"));
  return message + fmt::format(" ({} predictions)", predictions);
}

FailureReason reason_of(const SearchFailures& failures, const Problem& problem, const FesdStep& step) {
  if (auto open = open_contacts(failures.first, problem, step); !open.empty())
    return {FailureCode::indeterminate, std::move(open)};
  const StepFailure& failure = failures.first.depends_on_length() ? failures.deepest : failures.first;
  const int i = failure.violation.contact;
  if (failure.depends_on_length() || i < 0) return {code_of(failure.kind)};
  return {code_of(failure.kind), {problem.info().contacts[i].name}};
}

}  // namespace ricochet
