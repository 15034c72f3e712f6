// Moreau's midpoint rule with step-size adjustment and extrapolation: time stepping with error control.
//
// Between switches the extrapolated steps of moreau_midpoint.h, (1)-(5), of any order up to p: the table has as many rows as the
// tolerance asks for. A step with a switch is halved, down to
//
//   h_min = max(tolerance, 1e-9) T                                                           (6)
//
// and then taken as it is, with order 1. Its error is that of the position of an impact, O(h_min): in proportion to the
// tolerance, as the error of all others. Lengths of steps and the numbers j of rows are those with the least work
//
//   W_j = A_j / H_j,   H_j = 0.94 h (0.65 / e_j)^(1/j),   A_j = j (j + 1) / 2                (7)
//
// e_j the error of T_{j,j-1} in parts of the tolerance, A_j the steps of j rows; one more row is tried when the last is
// the best. Forces are explicit.
//
// Source: Studer, Leine, Glocker, IJNME 76 (2008) 1747-1781; (7): Hairer, Norsett, Wanner, Solving ODEs I, section II.9.
// Differs from the source: 1. orders follow (7), in the source one is chosen; 2. contacts that are closed stay in the
// contact problem whatever their gap is, so that its drift O(h^j) does not open them; 3. friction; 4. h_min by (6), longer
// where switches follow each other with nothing between them (switching_run.h).

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "methods/registry.h"
#include "methods/time_stepping/common/switching_run.h"
#include "methods/time_stepping/common/time_stepping_method.h"

namespace ricochet {
namespace {

using Outcome = MoreauExtrapolation::Outcome;

constexpr double kMaxGrowth = 10, kMinFactor = 0.02;
constexpr double kSafety = 0.94, kAim = 0.65;  // of (7)

double work(int row) {
  return 0.5 * row * (row + 1);
}  // A_j

/// Shortest step relative to the end time: in shorter ones rounding hides the velocity of slip that begins on a curve,
/// and the error control takes it for a switch.
constexpr double kShortest = 1e-9;

class ExtrapolatedMoreau final : public TimeSteppingMethod {
 public:
  explicit ExtrapolatedMoreau(const MethodSpec& spec)
      : TimeSteppingMethod(spec, kTightContactTolerance),
        order_(spec.whole_number("order", 6, 2, MoreauExtrapolation::kMaxRows)) {}

  MethodInfo info() const override {
    return {.id = id_,
            .title = fmt::format("Extrapolated Moreau midpoint rule, to order {}", order_),
            .source = "Studer, Leine, Glocker, IJNME 76 (2008) 1747-1781",
            .order_smooth = static_cast<double>(order_),
            .order_impacts = 1,
            .is_adaptive = true,
            .is_audited = true,
            .has_restitution_of_speed = true,
            .is_allocation_free = true};
  }

  Support supports(const ProblemInfo&) const override { return Support::yes(); }

 protected:
  Solution do_solve(const Problem& problem, const Settings& settings) const override;

 private:
  int order_;
};

/// (7): length and number of rows of the next step.
class OrderControl {
 public:
  OrderControl(double h, int max_rows) : h_(h), rows_(std::min(3, max_rows)), max_rows_(max_rows) {}

  double h() const { return h_; }
  /// One more than it aims at, where the error asks for it.
  int rows() const { return std::min(rows_ + 1, max_rows_); }

  /// After a step of length h, reached or not.
  void adapt(double h, const MoreauExtrapolation& table, bool was_reached) {
    double least = 0;
    int best = 0;
    const int last = table.rows_used();
    for (int j = 2; j <= last; ++j) {
      const double length = length_of(h, j, table.error(j));
      if (best == 0 || work(j) / length < least) {
        least = work(j) / length;
        best = j;
        h_ = length;
      }
    }
    if (best == last && was_reached && last < max_rows_) {
      ++best;
      h_ *= work(best) / work(best - 1);
    }
    rows_ = best;
    if (!was_reached) h_ = std::min(h_, 0.7 * h);
  }
  void shorten(double h) { h_ = std::min(h_, h); }
  void lengthen(double h) { h_ = std::max(h_, h); }

 private:
  static double length_of(double h, int row, double error) {  // H_j
    if (!std::isfinite(error)) return kMinFactor * h;
    return h * std::clamp(kSafety * std::pow(kAim / std::max(error, 1e-30), 1.0 / row), kMinFactor, kMaxGrowth);
  }

  double h_;
  int rows_, max_rows_;
};

Solution ExtrapolatedMoreau::do_solve(const Problem& problem, const Settings& settings) const {
  const double T = problem.info().end_time, tolerance = settings.tolerance;
  SwitchingRun run(problem, settings, solver_, observer_, std::max(tolerance, kShortest) * T);  // (6)
  OrderControl control(0.01 * T * std::sqrt(tolerance), order_);
  // Bisection for a switch: it is before `switched`, and the next step no longer than `limit`.
  constexpr double kNone = std::numeric_limits<double>::infinity();
  double switched = kNone, limit = 0;  // modes are known after a step

  const auto pass_switch = [&] {
    switched = limit = kNone;
    if (!run.switch_modes(T)) return false;
    control.lengthen(2 * run.least());
    run.end_step();
    return true;
  };

  return run.run([&] {
    const double length = std::min({control.h(), limit, T - run.t()});
    if (length <= run.least()) return pass_switch();
    switch (run.try_step(length, T, control.rows(), tolerance)) {
      case Outcome::reached:
        control.adapt(length, run.table(), true);
        limit = switched - run.t();
        if (limit <= 0) switched = limit = kNone;
        run.end_step();
        break;
      case Outcome::switches:
        switched = run.t() + length;
        limit = 0.5 * length;
        break;
      case Outcome::inaccurate:
        control.adapt(length, run.table(), false);
        break;
      case Outcome::failed:
        control.shorten(0.5 * length);
        break;
    }
    return true;
  });
}

const bool registered = register_method<ExtrapolatedMoreau>({
    .name = "extrapolated_moreau",
    .usage = std::string("extrapolated_moreau[,order=6]") + kTightContactSolverUsage + ", with --tolerance",
    .summary = "Moreau's midpoint rule, extrapolated between switches, which "
               "it halves its steps for",
    .examples = {"extrapolated_moreau", "extrapolated_moreau,order=3"},
});

}  // namespace
}  // namespace ricochet
