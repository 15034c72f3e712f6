#pragma once

#include <functional>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "methods/islands/window_plan.h"
#include "methods/method.h"

namespace ricochet {

/// A run of a scene of many bodies, in windows of time. In each window, bodies that cannot meet are integrated apart
/// from each other, with steps of their own: an event advances only the bodies that it may affect, and only contacts that
/// may close are evaluated.
///
///     parts of the scene in [t, t + H]   (window_plan.h)                                                      (1)
///     x_p(t + H) by the method itself, for each part p                                                        (2)
///     q_p in [t, t + H] within the box of (1), else H is halved and (1), (2) are repeated                     (3)
///
/// (3) shows that the contacts that took no part have stayed open. Contacts that were closed at the end of the last window
/// have drifted within the tolerance; their bodies are moved back to where they touch. H is that of H / 2, H and 2 H with the least work (2) of
/// window_plan.h, but not 2 H after a repetition; the rate r there is the mean number of steps per coordinate and second,
/// of the last windows.
///
/// A run ends where one of its parts does. The other parts are taken up to that time.
class IslandRun {
 public:
  /// A Solver of the method for a part of the scene.
  using Prepare = std::function<std::unique_ptr<Solver>(const Problem&)>;

  /// Whether a scene can be divided, and is large enough that it is worth it.
  static bool is_worth_it(const Problem& problem);
  /// Whether a run with these settings can be divided.
  static bool can_divide(const Settings& settings);

  /// The problem must outlive this.
  IslandRun(const Problem& problem, Prepare prepare);

  /// As Solver::solve().
  Solution solve(const Settings& settings);

 private:
  /// A part of the scene, ready to run, and its last run.
  struct Part {
    std::unique_ptr<Problem> problem;
    std::unique_ptr<Solver> solver;
    std::vector<Interval> reached{};
    Solution solution{};
  };

  void begin();
  double choose_length();
  bool run_parts(double H, const Settings& settings);
  void run(const WindowPlan::Part& members, double length, const Settings& settings);
  bool stays_in_box() const;
  bool stop_at_failure(const Settings& settings);
  void stop(Status status, const std::string& message);
  void take(double H, Recording recording);
  void count(double H, bool is_repeated);

  const Problem& problem_;
  const ProblemInfo& info_;
  const Prepare prepare_;
  WindowPlan plan_;
  std::map<WindowPlan::Part, Part> parts_, last_parts_;  // of this window and of the last one

  // Of the present run.
  Solution total_;                  // up to the present state
  std::vector<ContactMode> modes_;  // n_c, there; empty at the start
  double T_ = 0, tolerance_ = 0, H_ = 0, rate_ = 0;
  bool may_grow_ = true;  // H: the last window was not repeated
};

}  // namespace ricochet
