#pragma once

#include <list>
#include <optional>

#include "methods/elements/element_solver.h"
#include "methods/elements/switch_solver.h"
#include "methods/fesd/element_gaps.h"
#include "methods/fesd/element_loads.h"
#include "methods/fesd/element_map.h"
#include "methods/fesd/force_division.h"
#include "methods/fesd/run_solver.h"
#include "methods/fesd/sign_conditions.h"
#include "methods/fesd/step_buffers.h"

namespace ricochet {

/// A RunSolver for implicit tableaus, by Newton's method or in closed form (methods/elements).
class ElementRunSolver final : public RunSolver {
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

  void set_tolerance(double tolerance) override {
    element_solver_.set_tolerance(tolerance);
    switch_solver_.set_tolerance(tolerance);
  }
  /// Tolerance of the signs between the stages, which Options::between_stages checks.
  void set_motion_tolerance(double tolerance) override {
    if (loads_between_) loads_between_->set_tolerance(tolerance);
  }
  void restart() override {
    element_solver_.restart();
    if (gaps_between_) gaps_between_->restart();
    if (loads_between_) loads_between_->restart();
  }
  void begin_step() override {
    if (loads_between_) loads_between_->begin_step();
  }
  /// ElementLoads::shortest() of this step.
  double shortest_load() const override { return loads_between_ ? loads_between_->shortest() : 0; }

  StepFailure equal_elements(int first, int count, double h) override;
  bool run_to_switch(int first, int count, Violation violation, double remaining, SearchBudget& budget) override;
  bool run_to_time(int first, int count, double h, SwitchKind kind, int contact, SearchBudget& budget) override;
  std::int64_t skip_elements(Element& from, double h, std::int64_t n, int group) override;

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
