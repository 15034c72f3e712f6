#pragma once

#include <cstdint>
#include <list>
#include <optional>

#include "methods/elements/element_solver.h"
#include "methods/elements/switch_solver.h"
#include "methods/fesd/element_gaps.h"
#include "methods/fesd/element_loads.h"
#include "methods/fesd/element_map.h"
#include "methods/fesd/force_division.h"
#include "methods/fesd/search_budget.h"
#include "methods/fesd/sign_conditions.h"
#include "methods/fesd/step_buffers.h"
#include "methods/fesd/step_failure.h"

namespace ricochet {

/// Solves and checks a run: neighbouring elements of equal length with the modes of the first, whose start is known.
/// The length is given, or the switch at the right end of the last element determines it. Results are in the buffers.
class ElementRunSolver {
 public:
  struct Options {
    double tolerance;  ///< of Newton's method
    FrictionPolygon polygon;
    double gap_tolerance;  ///< of SignConditions [m]
    bool between_stages;   ///< sign conditions have to hold between the stages, too
  };

  /// All arguments but the options must outlive this object.
  ElementRunSolver(const Problem& problem, const ButcherTableau& tableau, const Options& options, ContactScales& scales,
                   ElementStartSolver& start_solver, StepBuffers& buffers, Counters& counters);

  void set_tolerance(double tolerance) {
    element_solver_.set_tolerance(tolerance);
    switch_solver_.set_tolerance(tolerance);
  }
  /// Tolerance of the signs between the stages, which Options::between_stages checks.
  void set_motion_tolerance(double tolerance) {
    if (loads_between_) loads_between_->set_tolerance(tolerance);
  }
  /// A new run of the method.
  void restart() {
    element_solver_.restart();
    if (gaps_between_) gaps_between_->restart();
    if (loads_between_) loads_between_->restart();
  }
  void begin_step() {
    if (loads_between_) loads_between_->begin_step();
  }
  /// ElementLoads::shortest() of this step.
  double shortest_load() const { return loads_between_ ? loads_between_->shortest() : 0; }

  /// Solves `count` elements of length h. @return the first failure; the time of its violation is from the start of the
  /// run
  StepFailure equal_elements(int first, int count, double h);

  /// Solves `count` elements up to the switch that they would pass, or up to an earlier one that the solution shows.
  /// @return whether all sign conditions hold up to there  @param remaining  upper bound of their total length [s]
  bool run_to_switch(int first, int count, Violation violation, double remaining, SearchBudget& budget);

  /// Solves `count` elements of length h with a switch of the contact at their end, without the equation of the switch.
  /// @return whether all sign conditions hold up to there
  bool run_to_time(int first, int count, double h, SwitchKind kind, int contact, SearchBudget& budget);

  /// Advances the right end of an element by up to n elements of length h in which nothing happens, as long as they have
  /// an ElementMap. The rest of the element stays as it is.
  /// @param group  only whole groups of so many elements count: steps
  /// @return how many elements
  std::int64_t skip_elements(Element& from, double h, std::int64_t n, int group);

 private:
  ElementMap* map_for(Element& element, double h);
  void record_states(const Element& element, double H);
  void first_guess(int element, double h);
  void stretch(int first, int count, int solved, double before, double h);
  Violation check_element(int element, bool is_first);
  int just_broken(int element) const;
  Violation after_failed_newton(int element);
  StepFailure solve_element(int element);
  void prepare(int first, int count);
  Violation check_run(int first, int count);
  Switch switch_for(int first, const Violation& violation);
  bool ends_at_tip(int element, const Switch& end) const;
  bool opens(int element, const Switch& end);
  bool solve_run(int first, int count, Switch& end, double remaining);
  bool bracket_switch(int first, int count, const Switch& end, double remaining);
  double switch_value(int first, int count, const Switch& end, double h);
  std::span<Element> run(int first, int count);

  const Problem& problem_;
  const ButcherTableau& tableau_;
  const FrictionPolygon polygon_;
  ContactScales& scales_;
  StepBuffers& buffers_;
  ElementStartSolver& start_solver_;
  ElementSystem elements_;
  ElementSolver element_solver_;
  SwitchSolver switch_solver_;
  SignConditions sign_conditions_;
  ForceDivision force_division_;
  std::optional<ElementGaps> gaps_between_;  // with Options::between_stages
  std::optional<ElementLoads> loads_between_;
  const bool regular_A_;
  Vector gap_;
  Element scratch_;  // of one function at a time

  std::list<ElementMap> maps_;  // of the last mode sets and lengths, newest first
  Vector x_, group_start_;      // 2 n_q: states (q, v)
  Vector largest_;              // 2 n_q: |q|, |v| of the states that skip_elements() has gone through
  Vector J_n_, J_t_;            // packed
};

}  // namespace ricochet
