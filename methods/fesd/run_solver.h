#pragma once

#include <cstdint>
#include <optional>

#include "methods/elements/element.h"
#include "methods/fesd/search_budget.h"
#include "methods/fesd/step_failure.h"

namespace ricochet {

/// Solves and checks a run: neighbouring elements of equal length with the modes of the first, whose start is known.
/// The length is given, or the switch at the right end of the last element determines it. Results are in the buffers of
/// the step. Implicit tableaus: element_run.h; explicit ones: explicit_run.h.
class RunSolver {
 public:
  virtual ~RunSolver() = default;

  /// Tolerance of Newton's method from now on.
  virtual void set_tolerance(double /*tolerance*/) {}
  /// Tolerance of the motion.
  virtual void set_motion_tolerance(double /*tolerance*/) {}
  /// A new run of the method.
  virtual void restart() = 0;
  virtual void begin_step() = 0;
  /// How long the load that made the switch of this step acts, if it is shorter than an element [s]; else 0.
  virtual double shortest_load() const = 0;

  /// Solves `count` elements of length h. @return the first failure; the time of its violation is from the start of the
  /// run
  virtual StepFailure equal_elements(int first, int count, double h) = 0;

  /// Solves `count` elements up to the switch that they would pass, or up to an earlier one that the solution shows.
  /// @return whether all sign conditions hold up to there  @param remaining  upper bound of their total length [s]
  virtual bool run_to_switch(int first, int count, Violation violation, double remaining, SearchBudget& budget) = 0;

  /// Solves `count` elements of length h with a switch of the contact at their end, without the equation of the switch.
  /// @return whether all sign conditions hold up to there
  virtual bool run_to_time(int first, int count, double h, SwitchKind kind, int contact, SearchBudget& budget) = 0;

  /// Advances the right end of an element by up to n elements of length h in which nothing happens, as long as they have
  /// an ElementMap. The rest of the element stays as it is.
  /// @param group  only whole groups of so many elements count: steps
  /// @return how many elements
  virtual std::int64_t skip_elements(Element& from, double h, std::int64_t n, int group) = 0;

  /// The element that was tried last, before a switch cut it short.
  struct Trial {
    double h = 0;      ///< [s]; 0: the next length must not be derived from it
    double error = 0;  ///< the embedded estimate, as a part of the tolerance; above 1 its signs have not been checked
  };
  /// None: the tableau has no embedded estimate.
  virtual std::optional<Trial> trial() const { return {}; }
  /// Whether elements keep their values at the stages, for an audit.
  virtual void keep_stages(bool /*keeps*/) {}
};

}  // namespace ricochet
