// Event capturing of higher order: fixed steps of order p between switches, steps of length O(h^p) at them.
//
// Every step of length h = T / N is the extrapolation of Moreau's midpoint rule (moreau_midpoint.h, (1)-(5)) with p
// rows, one more where contacts or joints are curved: they are of index 2, and the error of T_{j,j} is O(h^j) there. Where
// a contact changes its mode within it, it is halved, again and again, down to
//
//   h_min = T max(N^-p, 1e-10)                                                               (6)
//
// and a step of that length is taken as it is, with order 1. After it parts of the step double, up to its end, which
// is always a point of the grid k h. So an impact is known to O(h^p), and the order is p through impacts, too.
//
// Source: Acary, Higher order event capturing time-stepping schemes, Appl. Numer. Math. 62 (2012) 1259-1275; extrapolation
// in place of a Runge-Kutta method: Studer, Leine, Glocker, IJNME 76 (2008) 1747-1781.
// Differs from the source: 1. p rows of extrapolation are the Runge-Kutta method, so that persistent contact and friction
// are part of it; 2. switches are found by halving instead of one division of the step.

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "methods/registry.h"
#include "methods/time_stepping/common/switching_run.h"
#include "methods/time_stepping/common/time_stepping_method.h"

namespace ricochet {
namespace {

using Outcome = MoreauExtrapolation::Outcome;

/// Shortest step relative to the end time: in shorter ones rounding hides velocities that begin.
constexpr double kShortest = 1e-10;

class EventCapturing final : public TimeSteppingMethod {
 public:
  explicit EventCapturing(const MethodSpec& spec)
      : TimeSteppingMethod(spec, kTightContactTolerance), order_(spec.whole_number("order", 3, 2, 5)) {}

  MethodInfo info() const override {
    const auto order = static_cast<double>(order_);
    return {.id = id_,
            .title = fmt::format("Event capturing of order {}", order_),
            .source = "Acary, Appl. Numer. Math. 62 (2012) 1259-1275",
            .order_smooth = order,
            .order_impacts = order,
            .is_adaptive = false,
            .is_audited = true,
            .has_restitution_of_speed = true,
            .is_allocation_free = true};
  }

  Support supports(const ProblemInfo&) const override { return Support::yes(); }

 protected:
  Solution do_solve(const Problem& problem, const Settings& settings) const override {
    const double T = problem.info().end_time, h = T / settings.steps;
    const double shortest = T * std::max(std::pow(settings.steps, -order_), kShortest);  // (6)
    SwitchingRun run(problem, settings, solver_, observer_, shortest);
    const int rows = order_ + (run.table().is_affine() ? 0 : 1);
    int step = 0;
    double length = 0;  // modes are known after a single step
    return run.run([&] {
      const double end = step + 1 == settings.steps ? T : (step + 1) * h;
      if (length <= run.least()) {
        if (!run.switch_modes(end)) return false;
        length = 2 * run.least();
      } else {
        switch (run.try_step(length, end, rows, 0)) {
          case Outcome::reached:
            length *= 2;
            break;
          case Outcome::switches:
          case Outcome::inaccurate:
          case Outcome::failed:
            length = 0.5 * std::min(length, end - run.t());
            break;
        }
      }
      length = std::min(length, h);
      if (run.t() < end) return true;
      ++step;
      run.end_step();
      return true;
    });
  }

 private:
  int order_;
};

const bool registered = register_method<EventCapturing>({
    .name = "event_capturing",
    .usage = std::string("event_capturing[,order=3]") + kTightContactSolverUsage,
    .summary = "steps of order p, halved to their p-th power where contacts switch",
    .examples = {"event_capturing", "event_capturing,order=2"},
});

}  // namespace
}  // namespace ricochet
