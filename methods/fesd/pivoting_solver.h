#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <string>

#include "methods/contact_laws/capture_height.h"
#include "methods/fesd/element_start.h"
#include "methods/fesd/run_solver.h"
#include "methods/fesd/search_budget.h"
#include "methods/fesd/step_buffers.h"
#include "methods/fesd/step_failure.h"
#include "methods/runge_kutta/embedded_tableau.h"

namespace ricochet {

/// Solves the FESD-J equations of a step exactly, by pivoting on the active set instead of a homotopy:
///
/// (a) Start. At the left end of an element the laws of one instant give the impulse and the modes, and alternatives
///     where other modes are possible (element_start.h).
/// (b) Prediction. No switch happens in the rest of the step. Step equilibration then makes all remaining elements
///     equally long, and their stage equations determine everything (run_solver.h).
/// (c) Check. When the sign conditions hold (sign_conditions.h), the step is solved.
/// (d) Switch. Else a switch lies inside, which the broken condition announces. Some number m of the equal elements
///     leads up to it, first the m that changes their length least. The square system of their stage equations, the
///     switch equation at the right end of the m-th, and their common length is solved, and checked like (c).
/// (e) Rest. The elements and the time that remain are searched from (a) on.
/// (f) Pivot. Where (d) or (e) fail, another m is tried, and then another set of alternatives of (a).
///
/// A step is either solved to rounding, or reported as infeasible for this number of elements, within the limits of the
/// search and with the reason. With Options::as_needed an infeasible step is searched again with as many elements as it
/// needs, none longer than H / N_FE.
///
/// Published equations: paper section 3, with the corrections of DIFFERENCES.md. They leave an interval of length O(h)
/// for the time at which a contact breaks or begins to slip (open question 1 there). It is pinned by one more equation,
/// lambda_n(right end) = 0 or the cone reached there. Switches::published does so only if that has a solution, and else
/// takes the latest time of the interval; Switches::published_earliest takes the earliest, the worst that the published
/// equations allow. With two stages a pinned break dips below the gap by O(h^3) at the first stage of the open element,
/// and only Options::gap_tolerance makes it feasible.
class PivotingSolver {
 public:
  enum class Switches : std::uint8_t { pinned, published, published_earliest };

  struct Options {
    int n_fe = 2;            ///< finite elements per step
    bool as_needed = false;  ///< add elements to a step that is infeasible with n_fe
    int max_elements = 64;   ///< of a step, when elements are added
    /// N_FE elements up to each switch and after the last one, if the step has a solution with them. The motion then
    /// changes continuously where a switch crosses the end of an element or of a step. Requires as_needed.
    bool equal_runs = false;
    Switches switches = Switches::pinned;
    int facets = 0;               ///< of the polygon in place of the friction disc in space; 0: the disc itself
    double gap_tolerance = 0;     ///< [m] by which a gap may be negative in the element after a pinned break
    bool between_stages = false;  ///< sign conditions have to hold between the stages, too
    double tolerance = 1e-13;
    /// Elements are explicit steps of this pair (explicit_run.h), which must outlive the solver. Requires
    /// advance_to_switch(). Null: elements of the tableau.
    const EmbeddedTableau* pair = nullptr;
  };

  PivotingSolver(const Problem& problem, const ButcherTableau& tableau, const Options& options, Counters& counters);
  PivotingSolver(const PivotingSolver&) = delete;
  PivotingSolver& operator=(const PivotingSolver&) = delete;

  /// Tolerance of Newton's method from now on, in place of Options::tolerance.
  void set_tolerance(double tolerance) { runs_->set_tolerance(tolerance); }
  /// Tolerance of the motion, for Options::between_stages. From the next start() on, groups of contacts come to rest
  /// (group_capture.h). @throws InputError as CaptureHeight::set()
  void set_motion_tolerance(double tolerance, const CaptureHeight& capture_height) {
    runs_->set_motion_tolerance(tolerance);
    capture_height.set(problem_, tolerance, scales_);
    captures_ = true;
  }
  /// RunSolver::keep_stages() from the next start() on.
  void keep_stages(bool keeps) { runs_->keep_stages(keeps); }
  /// Starts a run at (q, v), v before an impact at this instant. It does not depend on the runs before it.
  void start(const Vector& q, const Vector& v);

  /// Solves the next step, of length H, from the end of the previous step(), which determines the contacts that were
  /// closed.
  Status advance(double H);

  /// Takes up to n further steps of length H in which nothing happens, where the elements are affine maps: of the last
  /// step only the right end is kept. Not after advance_to_switch(). @return how many
  int skip_steps(double H, int n);

  /// The bounces that an element has closed instead of following them.
  struct ClosedBounces {
    bool throughout = false;  ///< they stay closed in the whole element, as nothing else was tried or possible
    double speed = 0;         ///< largest normal velocity after one of them [m/s], by which the state changes
  };
  struct ElementStep {
    Status status;
    ClosedBounces closed;
  };
  /// Solves a step of one element that ends after H or where the first switch is, so that step().H may be less than H.
  /// A contact that bounces with at most the normal velocity `rest_speed` [m/s] stays closed if it can: the state
  /// changes by no more than that, and an accumulation of impacts ends.
  /// @param is_accurate  whether the error of an element would be accepted. If not, no switch is searched in it: it is
  /// returned as it is, and the caller must reject() it.
  ElementStep advance_to_switch(double H, double rest_speed, const std::function<bool(const Element&)>& is_accurate);
  /// Forgets the last step, which succeeded; the next one starts where it started.
  void reject();

  /// ElementStartSolver::sunk() at the end of a step of one element.
  int sunk() { return start_solver_.sunk(buffers_.start_of(0), step().last().q1); }
  /// The events of groups at the start of a step of one element.
  const GroupInstant& groups() const { return start_solver_.groups(); }
  /// After a step of one element that failed: closes groups at rest in the next one, if it has not tried that.
  bool settle() { return start_solver_.settle(); }
  /// After a step of one element that failed: lets the contact of its sign condition open and sink, if it may.
  bool let_go() { return failure().announces_switch() && start_solver_.let_go(failure().violation.contact); }

  /// RunSolver::shortest_load() of the last step.
  double shortest_load() const { return runs_->shortest_load(); }
  /// RunSolver::trial() of the last step that was tried.
  std::optional<RunSolver::Trial> trial() const { return runs_->trial(); }

  const FesdStep& step() const { return buffers_.step(); }
  const FesdStep* previous_step() const { return buffers_.previous(); }  ///< null in the first

  /// The first prediction that failed in the last step.
  const StepFailure& failure() const { return failures_.first; }
  /// Whether a switch made the step infeasible, which Options::as_needed could give the elements it needs.
  bool more_elements_may_help() const;
  /// Why advance() failed, with times from the start of the step.
  std::string failure_message() const;
  FailureReason failure_reason() const { return reason_of(failures_, problem_, step()); }  ///< the same as data

 private:
  /// Outcome of an attempt to solve the rest of the step.
  struct Attempt {
    enum class Outcome : std::uint8_t {
      solved,
      refuted,
      reached_the_switch,  ///< with all sign conditions fulfilled before it: the modes are right, the rest has failed
      flight_unresolved    ///< the switch ends a flight lower than the rounding of positions
    };
    Outcome outcome = Outcome::refuted;
    int alternative = -1;  ///< the one that closes the contact of an unresolved flight
  };
  using Outcome = Attempt::Outcome;

  void begin_step(double H);
  Status finish_step(bool is_solved);
  std::optional<ClosedBounces> solve_one_element(double H, double rest_speed,
                                                 const std::function<bool(const Element&)>& is_accurate);
  bool is_flight_of_rounding(const Violation& violation) const;
  unsigned pressed_together(unsigned set);
  int elements_for(int element, double remaining, int elements_left) const;
  LeftEnd left_end(int element);
  bool begin_element(int element);
  bool propose_modes(int element, unsigned trial);
  bool search(int element, double remaining, int elements_left);
  Attempt try_modes(int element, unsigned trial, int count, double remaining);
  Attempt split_at_switch(int element, int count, const Violation& violation, double remaining);
  Attempt run_and_continue(int element, int m, int count, const Violation& violation, double remaining);
  bool split_unpinned(int element, int m, int count, const Violation& violation, double remaining);
  bool continue_after(int element, int m, double remaining, int elements_left);
  int first_unresolved_flight(int first, int count) const;
  int offer_to_stay(int first, int count);

  const Problem& problem_;
  const ButcherTableau tableau_;
  const Options options_;
  Counters& counters_;
  const bool closing_stops_;  // a bounce that is closed ends
  const int capacity_;        // elements of a step at most
  ContactScales scales_;
  StepBuffers buffers_;
  ElementStartSolver start_solver_;
  std::unique_ptr<RunSolver> runs_;
  SearchBudget budget_;
  double longest_ = 0;           // element length that sets the number of elements; 0 when that number is fixed
  bool has_equal_runs_ = false;  // Options::equal_runs, in this search
  bool captures_ = false;        // groups come to rest
  SearchFailures failures_;
};

}  // namespace ricochet
