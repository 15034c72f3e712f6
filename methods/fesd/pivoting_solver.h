#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "methods/elements/element_solver.h"
#include "methods/elements/fesd_step.h"
#include "methods/elements/switch_solver.h"
#include "methods/fesd/element_start.h"
#include "methods/fesd/force_division.h"
#include "methods/fesd/gap_minima.h"
#include "methods/fesd/sign_conditions.h"

namespace ricochet {

/// Solves the FESD-J equations of a step exactly, by pivoting on the active set instead of a homotopy.
///
/// At the left end of an element the contact laws decide the impulse and the modes (element_start.h). Predict that no
/// switch happens in the rest of the step; then step equilibration makes all remaining elements equally long and their
/// stage equations determine everything. When a sign condition fails (sign_conditions.h) a switch lies inside: choose
/// how many equal elements m lead up to it, solve the square system of their stage equations, the switch equation at
/// the right end of the m-th, and the common length h (switch_solver.h), and continue there with the
/// elements and the time that remain. Every choice is checked by the sign conditions and taken back when they fail:
/// other m, then the alternative modes of the start. So a step is either solved to rounding, or it is infeasible for
/// this number of elements as far as the search reaches, and says why. With Options::as_needed an infeasible step is
/// searched again with as many elements as it takes, none longer than H / N_FE.
///
/// Published equations: paper section 3, with the corrections of the specification. They leave an interval of length
/// O(h) for the time at which a contact breaks or begins to slip (specification, open question 1). It is pinned by one
/// more equation, lambda_n(right end) = 0 or the cone reached there. Switches::published does so only if that has a
/// solution, and else takes the latest time of the interval; Switches::published_earliest takes the earliest, the worst
/// that the published equations allow. With two stages a pinned break dips below the gap by O(h^3) at the first stage
/// of the open element, and only Options::gap_tolerance makes it feasible.
class PivotingSolver {
 public:
  enum class Switches : std::uint8_t { pinned, published, published_earliest };

  struct Options {
    int n_fe = 2;            ///< finite elements per step
    bool as_needed = false;  ///< add elements to a step that is infeasible with n_fe
    int max_elements = 64;   ///< of a step, when elements are added
    Switches switches = Switches::pinned;
    int facets = 0;               ///< of the polygon in place of the friction disc in space; 0: the disc itself
    double gap_tolerance = 0;     ///< [m] by which a gap may be negative in the element behind a pinned break
    bool between_stages = false;  ///< gaps have to be positive between the stages, too
    double tolerance = 1e-13;
  };

  PivotingSolver(const Problem& problem, const ButcherTableau& tableau, const Options& options, Counters& counters);
  PivotingSolver(const PivotingSolver&) = delete;
  PivotingSolver& operator=(const PivotingSolver&) = delete;

  /// Starts a run at (q, v), v before an impact at this instant.
  void start(const Vector& q, const Vector& v);

  /// Solves the next step, of length H, from where the step() before ended: that one tells which contacts were closed.
  Status advance(double H);

  /// Solves a step of one element that ends after H or where the first switch is, so that step().H may be less than H.
  /// A contact that bounces with at most the normal velocity `capture` [m/s] stays closed if it can: the state changes
  /// by no more than that, and an accumulation of impacts ends.
  /// @param is_accurate  says of an element whether its error would be accepted. No switch is looked for in one that
  /// would not: it comes back as it is, and the caller has to reject() it.
  Status advance_to_switch(double H, double capture, const std::function<bool(const Element&)>& is_accurate);
  /// Whether a contact that bounced was closed by `capture` in the last step.
  bool captured() const { return captured_; }
  /// The largest normal velocity that it had behind its bounce [m/s]; what the state changes by.
  double captured_speed() const { return captured_speed_; }
  /// Forgets the last step, which succeeded; the next one starts where it started.
  void reject();

  const FesdStep& step() const { return *step_; }
  bool has_previous_step() const { return previous_->n_elements > 0; }
  const FesdStep* previous_step() const { return has_previous_step() ? previous_ : nullptr; }  ///< null in the first

  /// Whether a step of another length, or with more elements, might succeed where the last one failed.
  bool depends_on_length() const;
  /// Whether it failed because a closed contact on a curve drifts, with a tableau that has no stage at the right end.
  bool drifts() const { return first_failure_.violation.verdict == Verdict::drifts; }
  /// Whether a switch made the step infeasible, which Options::as_needed could give the elements it needs.
  bool more_elements_may_help() const;
  /// Why advance() failed, with times from the start of the step.
  std::string failure_message() const;

 private:
  /// A prediction that failed: `count` equal elements of length h.
  struct Failure {
    Violation violation;
    double h = 0;
    int count = 0;
  };

  void begin_step(double H);
  Status finish_step(bool solved);
  bool solve_one_element(double H, double capture, const std::function<bool(const Element&)>& is_accurate);
  int first_unresolved_flight(int first, int count) const;
  void make_room(int n_elements);
  bool search(int element, double remaining, int elements_left);
  bool only_closes(int element, unsigned trial) const;
  bool split_at_switch(int element, int count, int most_before, const Violation& violation, double remaining);
  bool split_unpinned(int element, int m, int count, const Violation& violation, double remaining);
  int max_trials() const;
  int elements_for(int element, double remaining, int elements_left) const;
  Switch switch_before(int element) const;
  bool begin_element(int element);
  bool propose_modes(int element, unsigned trial);
  Violation equal_elements(int first, int count, double h);
  Switch switch_for(int first, const Violation& violation);
  bool run_to_switch(int first, int count, Violation violation, double remaining);
  bool solve_run(int first, int count, Switch& end, double remaining);
  bool run_to_time(int first, int count, double h, const Violation& violation);
  bool continue_after(int element, int count, double remaining, int elements_left);
  void prepare_run(int first, int count);
  bool bracket_switch(int first, int count, const Switch& end, double remaining);
  Violation check_element(int element, bool is_first);
  Violation check_run(int first, int count);
  Violation after_failed_newton(int element);
  int just_broken(int element) const;
  void first_guess(int element, double h);
  const Element* left_neighbour(int element) const;
  void note_failure(const Violation& violation, double h, int count);
  std::string describe(const Failure& failure) const;

  const Problem& problem_;
  const Options options_;
  const FrictionPolygon polygon_;
  Counters& counters_;
  ContactScales scales_;
  ElementSystem elements_;
  ElementSolver element_solver_;
  SwitchSolver switch_solver_;
  ElementStartSolver start_solver_;
  SignConditions sign_conditions_;
  ForceDivision force_division_;
  std::optional<GapMinima> gap_minima_;  // with Options::between_stages
  const int n_q_, n_c_, n_s_, capacity_;
  const bool regular_A_;

  FesdStep buffers_[2];
  FesdStep *step_ = &buffers_[0], *previous_ = &buffers_[1];
  std::vector<ElementStart> starts_;
  int trials_ = 0;
  int unresolved_ = -1;   // alternative of a start whose flight was lower than positions are known, or -1
  bool reached_ = false;  // a switch, with all sign conditions fulfilled before it: the modes of the trial are right
  bool captured_ = false;
  double captured_speed_ = 0;
  double longest_ = 0;  // element length that sets the number of elements; 0 when that number is fixed

  Failure first_failure_;    // of the natural prediction, without a switch
  Failure deepest_failure_;  // behind as many switches as the search got

  Vector gap_;
};

}  // namespace ricochet
