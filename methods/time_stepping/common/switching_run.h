#pragma once

#include <algorithm>
#include <string>
#include <vector>

#include "methods/contact_laws/gap_search.h"
#include "methods/method.h"
#include "methods/time_limit.h"
#include "methods/time_stepping/common/moreau_extrapolation.h"
#include "problems/regions/region_problems.h"

namespace ricochet {

/// A run of steps without switches, extrapolated (moreau_extrapolation.h), and of single steps of the least length where
/// contacts switch: the common part of methods that find switches by halving their steps.
class SwitchingRun {
 public:
  /// @param shortest  length of single steps [s]
  SwitchingRun(const Problem& problem, const Settings& settings, const ContactSolverOptions& solver,
               ContactObserver* observer, double shortest);

  /// Calls step() until the end time, or until it is false.
  template <class Step>
  Solution run(Step step) {
    while (!is_over() && can_go_on() && step()) {
    }
    return finish();
  }

  double t() const { return t_; }  ///< [s]
  bool is_over() const { return t_ >= T_ || has_ended_; }

  /// An extrapolated step from here; short by rounding when it would end just before `end`. It switches, too, where a
  /// contact is open at both ends and closed between them.
  /// @param rows, tolerance  of MoreauExtrapolation::step()
  MoreauExtrapolation::Outcome try_step(double h, double end, int rows, double tolerance);
  /// Single steps of the length least() until one of them leaves all modes as they are, or until `end`. @return false when
  /// one failed
  bool switch_modes(double end);
  /// Ends a step of the method: counts it and records it for Recording::grid.
  void end_step();
  /// Ends the run. @return false
  bool fail(Status status, const std::string& why);

  /// Length of single steps [s]: the shortest; twice the last one where switches follow each other with nothing between
  /// them that could be extrapolated, so that such series end.
  double least() const { return t_ < series_end_ + kSeries * single_ ? std::min(2 * single_, longest_) : shortest_; }

  const MoreauExtrapolation& table() const { return table_; }

 private:
  static constexpr double kSeries = 8;

  /// Gaps and their rates at a state.
  struct Gaps {
    Vector gap, rate;  // n_c
  };

  bool can_go_on();
  Solution finish();
  void evaluate(const MoreauExtrapolation::State& state, Gaps& gaps);
  bool has_passed(double h);
  void open_jumped_gaps();
  bool slides_on(int k);
  void between_ends(double h, double s, Vector& q) const;
  void advance(double end);
  void record_piece(double begin, int degree);
  void record_closings(double begin);

  const Problem& problem_;
  const Settings& settings_;
  const double T_, shortest_, longest_;  // [s]; of single steps
  const TimeLimit time_limit_;
  Solution solution_;
  MoreauExtrapolation table_;
  MoreauExtrapolation::State state_, before_;
  Vector J_n_;
  Gaps gaps_before_, gaps_;
  GapSearch gap_search_;
  RegionProblems regions_;
  std::vector<ContactMode> modes_;      // open where a contact is so at both ends of a step
  double t_ = 0, single_, series_end_;  // [s]; of the last series of single steps
  bool has_ended_ = false;              // where ProblemInfo::until vanishes
};

}  // namespace ricochet
