#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <limits>

#include "bench/experiment/experiment_file.h"
#include "bench/studies/verify/check.h"
#include "problems/input_error.h"
#include "reports/order_fit.h"

// A fixed-step method claims an order p: its interval of 95 % must reach
//
//   slope + half width >= p - 0.3,                                                                            (1)
//
// since a window of a decade and a half has that much of the next term. An error-controlled method claims its
// tolerance: errors at T, relative to the solution where that is larger than 1, stay below
//
//   error <= 1000 tol,   d log error / d log tol >= 0.7                                                       (2)
//
// a tolerance is of one step, and impacts and friction pass errors on.

namespace ricochet {
namespace {

using nlohmann::json;

constexpr double kSlack = 0.3;                             // (1)
constexpr double kOverTolerance = 1e3, kLeastSlope = 0.7;  // (2)
constexpr double kAboveFloor = 10;                         // as in the window rule of order_fit.h
constexpr double kShareOfTime = 0.7;                       // of the time limit; finer runs are left out after it

/// Data shared by the checks of one group.
struct Grids {
  std::vector<double> first_order, high_order, tolerances;

  explicit Grids(const json& experiment)
      : first_order(logarithmic_grid(experiment.at("first_order_steps"), "first_order_steps")),
        high_order(logarithmic_grid(experiment.at("high_order_steps"), "high_order_steps")),
        tolerances(logarithmic_grid(experiment.at("tolerances"), "tolerances")) {}
};

struct OrderCase {
  KnownProblem known;
  bool is_smooth;  ///< the order that counts is that on smooth motion
  Grids grids;
};

Run planned(const OrderCase& c, const Subject& subject, const Setting& setting) {
  Run run = subject.planned(c.known.choice(), setting);
  run.sensitivities = c.known.sensitivities();
  return run;
}

/// The runs of a grid, from the coarsest on, as long as there is time.
class GridOfRuns {
 public:
  GridOfRuns(const OrderCase& c, const Subject& subject)
      : case_(c), subject_(subject), begin_(std::chrono::steady_clock::now()) {}

  /// @return false where no time was left for it  @throws InputError for a problem that the method declines
  bool run(const Setting& setting) {
    const double left = kShareOfTime * subject_.time_limit -
                        std::chrono::duration<double>(std::chrono::steady_clock::now() - begin_).count();
    if (left <= 0) return false;
    Run run = planned(case_, subject_, setting);
    const Solution solution = measure_run({.problem = case_.known.problem(),
                                           .reference = &case_.known.reference(),
                                           .recording = Recording::final_state,
                                           .time_limit = left},
                                          run);
    if (run.status == "declined") throw InputError(run.message);
    if (solution.status == Status::time_limit) return false;
    run.h_bar = setting.is_tolerance() ? 0 : case_.known.problem().info().end_time / setting.steps;
    records_.push_back(std::move(run));
    return true;
  }

  const std::vector<Run>& records() const { return records_; }
  std::vector<const Run*> list() const {
    std::vector<const Run*> list;
    for (const auto& record : records_) list.push_back(&record);
    return list;
  }
  /// ", 2 of 9 runs failed, with 10 steps: ..."; empty when none did.
  std::string failures() const {
    const auto n = std::ranges::count_if(records_, [](const Run& r) { return !r.succeeded(); });
    if (n == 0) return "";
    const auto last = std::find_if(records_.rbegin(), records_.rend(), [](const Run& r) { return !r.succeeded(); });
    return fmt::format("; {} of {} runs failed, the finest with {}: {}", n, records_.size(), last->setting.value(),
                       last->message);
  }

 private:
  const OrderCase& case_;
  const Subject& subject_;
  std::chrono::steady_clock::time_point begin_;
  std::vector<Run> records_;
};

/// The finer half of the runs has a failure.
bool fails_where_it_is_fine(const std::vector<Run>& records) {
  return std::any_of(records.begin() + static_cast<std::ptrdiff_t>(records.size() / 2), records.end(),
                     [](const Run& record) { return !record.succeeded(); });
}

CheckResult observed_order(const OrderCase& c, const Subject& subject, GridOfRuns& runs) {
  const double claimed = c.is_smooth ? subject.info.order_smooth : subject.info.order_impacts;
  int before = 0;
  std::string left_out;
  for (const double n : subject.is_first_order() ? c.grids.first_order : c.grids.high_order) {
    const int steps = subject.steps(n);
    if (steps == before) continue;
    before = steps;
    if (runs.run({.steps = steps})) continue;
    left_out = fmt::format("; no time for {} steps and more", steps);
    break;
  }
  const std::string notes = runs.failures() + left_out;
  const Setting last = runs.records().empty() ? Setting{.steps = before} : runs.records().back().setting;
  const std::string command = planned(c, subject, last).command();
  if (fails_where_it_is_fine(runs.records())) return CheckResult::fail("it fails with small steps" + notes, command);
  const ObservedOrder order = observe_order(runs.list());
  if (order.fit) {
    const std::string text =
        fmt::format("order {:.2f} +- {:.2f} with {} to {} steps, {:g} claimed{}", order.fit->slope,
                    order.fit->half_width, order.fit->first_steps, order.fit->last_steps, claimed, notes);
    const bool holds = order.fit->upper() >= claimed - kSlack;  // (1)
    return holds ? CheckResult::pass(text, command) : CheckResult::fail(text, command);
  }
  // Few points between large errors and the floor are what a high order looks like.
  double least = std::numeric_limits<double>::infinity();
  for (const Run& record : runs.records()) least = std::fmin(least, record.error);
  const std::string text = fmt::format("{}{}", order.reason, notes);
  if (least <= order.floor)
    return CheckResult::pass(
        fmt::format("error down to {:.1e}, that of the reference; no order is fitted: {}", least, text), command);
  return CheckResult::fail("no order: " + text, command);
}

CheckResult error_over_tolerance(const OrderCase& c, const Subject& subject, GridOfRuns& runs) {
  std::string left_out;
  for (const double tolerance : c.grids.tolerances) {
    if (runs.run({.tolerance = tolerance})) continue;
    left_out = fmt::format("; no time for {:g} and less", tolerance);
    break;
  }
  const std::string notes = runs.failures() + left_out;
  if (runs.records().empty())
    return CheckResult::fail("no run" + notes,
                             planned(c, subject, {.tolerance = c.grids.tolerances.front()}).command());
  const std::string last = runs.records().back().command();
  if (!runs.failures().empty()) return CheckResult::fail("a run failed" + notes, last);
  const double size = std::max(1.0, c.known.reference().size());
  const double floor = kAboveFloor * std::max(c.known.reference().uncertainty, 1e-13 * size);
  double worst = 0, where = 0;
  std::vector<double> tolerances, errors;
  for (const Run& record : runs.records()) {
    if (record.error <= floor) continue;
    tolerances.push_back(record.setting.tolerance);
    errors.push_back(record.error);
    const double ratio = record.error / (record.setting.tolerance * size);
    if (ratio > worst) worst = ratio, where = record.setting.tolerance;
  }
  if (errors.empty()) return CheckResult::pass("exact to rounding with every tolerance" + notes, last);
  std::string text = fmt::format("error at most {:.2g} times the tolerance, at {:g}", worst, where);
  bool holds = worst <= kOverTolerance;  // (2)
  if (errors.size() >= 3) {
    const double slope = fit_line(tolerances, errors).slope;
    text += fmt::format("; it falls with the tolerance to the power {:.2f}", slope);
    // Errors far below the tolerance need not fall with it.
    holds = holds && (slope >= kLeastSlope || worst <= 1);
  }
  text += notes;
  const std::string command = planned(c, subject, {.tolerance = where}).command();
  return holds ? CheckResult::pass(text, command) : CheckResult::fail(text, command);
}

CheckResult check_order(const OrderCase& c, const Subject& subject) {
  GridOfRuns runs(c, subject);
  if (!c.known.sensitivities().empty() && !subject.info.has_sensitivities)
    return CheckResult::not_applicable("it computes no sensitivities");
  try {
    CheckResult result =
        subject.info.is_adaptive ? error_over_tolerance(c, subject, runs) : observed_order(c, subject, runs);
    result.reason += "; " + c.known.reference().title();
    return result;
  } catch (const InputError& error) {  // a problem that the method declines
    return CheckResult::not_applicable(error.what());
  }
}

}  // namespace

void add_order_checks(const json& experiment, std::vector<Check>& battery) {
  const Grids grids(experiment);
  for (const auto& entry : experiment.at("orders")) {
    const auto c = std::make_shared<OrderCase>(
        OrderCase{KnownProblem(read_problem_choice(entry), entry.value("sensitivities", std::vector<std::string>())),
                  entry.value("is_smooth", false), grids});
    battery.push_back({c->known.sensitivities().empty() ? "order" : "sensitivities", entry.at("check"),
                       [c] { c->known.reference(); },
                       [c](const Subject& subject) { return check_order(*c, subject); }});
  }
}

}  // namespace ricochet
