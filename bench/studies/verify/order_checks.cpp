#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <limits>

#include "bench/experiment/experiment_file.h"
#include "bench/measure/sensitivities.h"
#include "bench/studies/verify/check.h"
#include "methods/registry.h"
#include "problems/input_error.h"
#include "reports/order_fit.h"

// What a fixed-step method claims is an order p: its interval of 95 % must reach
//
//   slope + half width >= p - 0.3,                                                                            (1)
//
// since a window of a decade and a half has that much of the next term. What an error-controlled method claims is its
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
constexpr double kShareOfTime = 0.7;                       // of the time limit; finer runs are left out behind it

/// What the checks of one group have in common.
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

std::string command_of(const OrderCase& c, const Subject& subject, int steps, double tolerance) {
  std::string command = run_command(c.known.choice().arguments(), subject.spec, steps, tolerance);
  for (const auto& name : c.known.sensitivities()) command += " --sensitivity " + name;
  return command;
}

/// The runs of a grid, from the coarsest on, as long as there is time.
class GridOfRuns {
 public:
  GridOfRuns(const OrderCase& c, const Subject& subject)
      : case_(c), subject_(subject), method_(make_method(subject.spec)), begin_(std::chrono::steady_clock::now()) {}

  const Method& method() const { return *method_; }

  /// @return false where no time was left for it
  bool run(int steps, double tolerance) {
    const double left = kShareOfTime * subject_.time_limit -
                        std::chrono::duration<double>(std::chrono::steady_clock::now() - begin_).count();
    if (left <= 0) return false;
    const auto& reference = case_.known.reference();
    Settings settings;
    settings.steps = steps;
    settings.tolerance = tolerance;
    settings.time_limit = left;
    settings.recording = Recording::final_state;
    settings.sensitivities = case_.known.sensitivities();
    const Solution solution = solve_with_sensitivities(*method_, case_.known.problem(), settings);
    Record record;
    record.method = subject_.spec;
    record.steps = steps;
    record.tolerance = tolerance;
    record.status = to_string(solution.status);
    record.message = solution.message;
    record.error = solution.succeeded() ? reference.error_of(solution) : std::nan("");
    record.reference_error = reference.uncertainty;
    record.solution_size = reference.size();
    if (steps > 0) record.h_bar = case_.known.problem().info().end_time / steps;
    if (solution.status == Status::time_limit) return false;
    records_.push_back(std::move(record));
    return true;
  }

  const std::vector<Record>& records() const { return records_; }
  std::vector<const Record*> list() const {
    std::vector<const Record*> list;
    for (const auto& record : records_) list.push_back(&record);
    return list;
  }
  /// ", 2 of 9 runs failed, with 10 steps: ..."; empty when none did.
  std::string failures() const {
    const auto n = std::ranges::count_if(records_, [](const Record& r) { return !r.succeeded(); });
    if (n == 0) return "";
    const auto last = std::find_if(records_.rbegin(), records_.rend(), [](const Record& r) { return !r.succeeded(); });
    return fmt::format("; {} of {} runs failed, the finest with {}: {}", n, records_.size(), last->setting(),
                       last->message);
  }

 private:
  const OrderCase& case_;
  const Subject& subject_;
  std::unique_ptr<Method> method_;
  std::chrono::steady_clock::time_point begin_;
  std::vector<Record> records_;
};

/// The finer half of the runs has a failure.
bool fails_where_it_is_fine(const std::vector<Record>& records) {
  return std::any_of(records.begin() + static_cast<std::ptrdiff_t>(records.size() / 2), records.end(),
                     [](const Record& record) { return !record.succeeded(); });
}

CheckResult observed_order(const OrderCase& c, const Subject& subject, GridOfRuns& runs) {
  const double claimed = c.is_smooth ? subject.info.order_smooth : subject.info.order_impacts;
  int before = 0;
  std::string left_out;
  for (const double n : subject.is_first_order() ? c.grids.first_order : c.grids.high_order) {
    const int steps = subject.steps(n);
    if (steps == before) continue;
    before = steps;
    if (runs.run(steps, 0)) continue;
    left_out = fmt::format("; no time for {} steps and more", steps);
    break;
  }
  const std::string notes = runs.failures() + left_out;
  const std::string command = command_of(c, subject, runs.records().empty() ? before : runs.records().back().steps, 0);
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
  for (const Record& record : runs.records()) least = std::fmin(least, record.error);
  const std::string text = fmt::format("{}{}", order.reason, notes);
  if (least <= order.floor)
    return CheckResult::pass(
        fmt::format("error down to {:.1e}, that of the reference; no order is fitted: {}", least, text), command);
  return CheckResult::fail("no order: " + text, command);
}

CheckResult error_over_tolerance(const OrderCase& c, const Subject& subject, GridOfRuns& runs) {
  std::string left_out;
  for (const double tolerance : c.grids.tolerances) {
    if (runs.run(0, tolerance)) continue;
    left_out = fmt::format("; no time for {:g} and less", tolerance);
    break;
  }
  const std::string notes = runs.failures() + left_out;
  if (runs.records().empty())
    return CheckResult::fail("no run" + notes, command_of(c, subject, 0, c.grids.tolerances.front()));
  const std::string last = command_of(c, subject, 0, runs.records().back().tolerance);
  if (!runs.failures().empty()) return CheckResult::fail("a run failed" + notes, last);
  const double size = std::max(1.0, c.known.reference().size());
  const double floor = kAboveFloor * std::max(c.known.reference().uncertainty, 1e-13 * size);
  double worst = 0, where = 0;
  std::vector<double> tolerances, errors;
  for (const Record& record : runs.records()) {
    if (record.error <= floor) continue;
    tolerances.push_back(record.tolerance);
    errors.push_back(record.error);
    const double ratio = record.error / (record.tolerance * size);
    if (ratio > worst) worst = ratio, where = record.tolerance;
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
  const std::string command = command_of(c, subject, 0, where);
  return holds ? CheckResult::pass(text, command) : CheckResult::fail(text, command);
}

CheckResult check_order(const OrderCase& c, const Subject& subject) {
  GridOfRuns runs(c, subject);
  if (const Support support = runs.method().can_run(c.known.problem().info()); !support.ok)
    return CheckResult::not_applicable(support.reason);
  if (!c.known.sensitivities().empty() && !subject.info.has_sensitivities)
    return CheckResult::not_applicable("it computes no sensitivities");
  try {
    return subject.info.is_adaptive ? error_over_tolerance(c, subject, runs) : observed_order(c, subject, runs);
  } catch (const InputError& error) {  // a method that cannot tell before it runs
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
