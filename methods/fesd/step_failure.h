#pragma once

#include <string>

#include "methods/elements/fesd_step.h"
#include "methods/fesd/sign_conditions.h"

namespace ricochet {

/// Why a prediction of the modes is no solution of the step.
struct StepFailure {
  enum class Kind : std::uint8_t {
    none,
    sign_condition,      ///< the stage equations have a solution that breaks the inequality `violation`
    newton_failed,       ///< the stage equations were not solved
    no_motion,           ///< of stages in sequence: the forces of the closed contacts do not determine the motion
    undetermined,        ///< the tableau has a singular A, which does not determine forces of closed contacts
    no_right_stage,      ///< slip in space comes to rest, and the tableau has no stage at the right end
    accumulates,         ///< a contact bounces lower than the error of its gap, and closing it would not stop it
    impacts_accumulate,  ///< impacts at one instant have no end
    no_impulse,          ///< the impact law has no solution
    no_forces,           ///< Painleve's paradox: the load fits no modes,
    indeterminate,       ///< or more than one
  };
  Kind kind = Kind::none;
  Violation violation;  ///< of a sign condition; its contact is the one to blame for every kind, -1 for none
  int element = 0;      ///< of the step
  double h = 0;         ///< the prediction: `count` equal elements of this length [s]
  int count = 0;

  explicit operator bool() const { return kind != Kind::none; }
  /// A switch inside the element would explain it.
  bool announces_switch() const { return violation.kind == Violation::Kind::past_switch; }
  /// A closed contact drifts, with a tableau that has no stage at the right end.
  bool drifts() const { return violation.kind == Violation::Kind::drift; }
  /// A step of another length, or with more elements, might succeed.
  bool depends_on_length() const;
};

/// The refuted predictions that the search for one step keeps.
struct SearchFailures {
  StepFailure first;    ///< of the natural prediction, without a switch
  StepFailure deepest;  ///< after as many switches as the search got

  void note(const StepFailure& failure);
};

/// One sentence about a failure. @param tableau  its name
std::string describe(const StepFailure& failure, const ProblemInfo& problem, const std::string& tableau);

/// Why the search found no solution. @param step  as the search left it; @param elements  how many the step may have
/// @param predictions  how many were tried
std::string describe(const SearchFailures& failures, const Problem& problem, const std::string& tableau,
                     const FesdStep& step, const std::string& elements, int predictions);

/// The same as data.
FailureReason reason_of(const SearchFailures& failures, const Problem& problem, const FesdStep& step);

}  // namespace ricochet
