#pragma once

#include <memory>
#include <string>
#include <vector>

#include "problems/problem.h"
#include "problems/solution.h"

/// @file
/// What a method is: Method, its Settings, and Solver for many runs of one problem.

namespace ricochet {

/// How much of a run is recorded; each level includes the one before. Events are always counted. n contacts that close
/// at once are n events of n numbers.
enum class Recording {
  final_state,  ///< Solution::q and v
  events,       ///< Solution::events, with the state at each
  grid,         ///< Solution::samples, the states at the ends of steps
  motion        ///< Solution::motion, the states between them
};

class UntilWatch;  // methods/regions/until_run.h

/// How a run is discretised and how exactly its inner problems are solved: three separate kinds of settings.
struct Settings {
  // Discretisation. A fixed-step method reads `steps`, an error-controlled one `tolerance`.
  int steps = 0;         ///< N_sim, steps of equal length H = T / N_sim
  double tolerance = 0;  ///< relative local error; the absolute one is the same number in SI units

  // Inner solvers.
  double inner_tolerance = 1e-13;  ///< relative size of the last Newton correction
  double event_tolerance = 1e-13;  ///< relative width of the interval that brackets an event

  double time_limit = 0;                    ///< wall time [s]; 0: no limit
  Recording recording = Recording::events;  ///< what of the run is kept
  /// Variables of the derivatives Solution::dq, dv and Event::dt: "q0:0", "v0:0" for a component of the initial
  /// values, "param:NAME" for a parameter, which the initial values may depend on.
  std::vector<std::string> sensitivities;
  bool stays_in_region =
      false;                    ///< end where a step leaves the region of the problem: Solution::exit; set by RegionRun
  UntilWatch* until = nullptr;  ///< called after each step: whether the run ends there; set by Method
  /// The same, of methods with static friction, which have events; set by Method.
  EndsRun ends = nullptr;
  /// n_q intervals, which the run extends by bounds of the coordinates along each step; set by IslandRun.
  std::vector<Interval>* reached = nullptr;
  double begin = 0;    ///< time of the whole at which a part of it begins [s], for messages; set by IslandRun
  bool audit = false;  ///< evaluate every equation of the method after each step: Solution::residuals
};

/// Properties that a method claims, for reports; tests compare its orders with measured ones.
struct MethodInfo {
  std::string id;                  ///< as on the command line, "fesd:radau-iia:3,n_fe=2"
  std::string title;               ///< its name in the literature
  std::string source;              ///< publication with equation numbers
  double order_smooth = 0;         ///< on smooth motion
  double order_impacts = 0;        ///< of the final state, through impacts
  bool is_adaptive = false;        ///< steered by Settings::tolerance instead of Settings::steps
  bool has_sensitivities = false;  ///< reads Settings::sensitivities
  bool is_audited = false;         ///< reads Settings::audit: it evaluates its own equations after each step
  bool keeps_samples = true;       ///< reads Recording::grid; an integrator with steps of its own may not
  /// Impact laws that it supports; it declines scenes with another law.
  std::vector<ImpactHypothesis> impact_laws{ImpactHypothesis::newton};
  /// It evaluates coefficients of restitution that depend on the approach speed, ContactInfo::restitution(); it declines
  /// scenes with them otherwise.
  bool has_restitution_of_speed = false;
  /// Its events are located, so that Method can run scenes with a mu_static, piece by piece (StaticFrictionRun); other
  /// methods decline them.
  bool has_static_friction = false;
  /// It ends runs where they leave their region, and follows formulas that bend or jump region by region (RegionRun).
  /// Other methods evaluate the branch that holds at each point.
  bool has_regions = false;
  /// It chooses its steps and locates events, so that Method can run bodies that do not meet apart from each other
  /// (IslandRun). It has a Solver of its own, extends Settings::reached and records Recording::motion.
  bool has_islands = false;
  /// It ends runs itself where ProblemInfo::until vanishes. For other methods, Method does that.
  bool ends_runs = false;
  /// A step allocates no memory: what a run allocates depends on its events, not on its steps.
  bool is_allocation_free = false;
};

/// Whether a method can run a problem, or why not.
struct Support {
  bool ok = true;      ///< it can
  std::string reason;  ///< a phrase, "one frictionless contact at most"; empty when it can

  static Support yes() { return {}; }                                     ///< The method can.
  static Support no(std::string why) { return {false, std::move(why)}; }  ///< It cannot, because of `why`.
};

/// A method prepared for one problem: data that all runs share are computed once. For one thread.
class Solver {
 public:
  virtual ~Solver() = default;

  /// As Method::solve(). Between runs the initial state, the control and the end time of the problem may change; for
  /// other parameters another Solver is needed. Runs are independent: to the last bit, the result depends on the
  /// initial state of this run and on the one that the solver was made with. Counters cover this run; factors of
  /// constant matrices that exist already are not counted again.
  /// @throws InputError for `settings` out of range
  virtual Solution solve(const Settings& settings) = 0;
};

/// A numerical method for complementarity Lagrangian systems. It accesses a problem only through `Problem`.
class Method {
 public:
  virtual ~Method() = default;

  virtual MethodInfo info() const = 0;                             ///< Name, source and orders.
  virtual Support supports(const ProblemInfo& problem) const = 0;  ///< Whether it can run `problem`, or why not.

  /// Whether it can run `problem`, or why not: checks the impact law, as for all methods, then supports().
  Support can_run(const ProblemInfo& problem) const;

  /// Integrates `problem` from t = 0 to end_time, as `settings` say. Numerical failure is a status with a message and
  /// the state reached so far.
  /// @throws InputError for settings out of range, or a problem that can_run() declines
  Solution solve(const Problem& problem, const Settings& settings) const;

  /// For many runs of one `problem`. Method and problem must outlive the solver.
  /// @throws InputError for a problem that can_run() declines
  std::unique_ptr<Solver> prepare(const Problem& problem) const;

 protected:
  /// The method itself, which solve() calls with a `problem` that it supports and checked `settings`. Throws only
  /// InputError and std::bad_alloc. May return more events than requested; solve() drops the surplus.
  virtual Solution do_solve(const Problem& problem, const Settings& settings) const = 0;
  /// A solver that keeps storage between runs of `problem`, and whose solve() does what do_solve() does; null where a
  /// method has none.
  virtual std::unique_ptr<Solver> do_prepare(const Problem& problem) const;

 private:
  class CheckedSolver;
  void require_support(const ProblemInfo& problem) const;
};

}  // namespace ricochet
