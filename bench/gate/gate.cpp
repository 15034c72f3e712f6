#include "bench/gate/gate.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <set>

#include "problems/input_error.h"
#include "reports/order_fit.h"

namespace ricochet {
namespace {

struct Counter {
  const char* name;
  std::int64_t Counters::*member;
  bool is_of_matrices = false;  ///< renewed by a decision of Newton's method
};

constexpr Counter kCounters[] = {
    {"steps", &Counters::steps},
    {"elements", &Counters::elements},
    {"force evaluations", &Counters::force_evaluations},
    {"Jacobian evaluations", &Counters::jacobian_evaluations, true},
    {"mass factorizations", &Counters::mass_factorizations},
    {"matrix factorizations", &Counters::matrix_factorizations, true},
    {"linear solves", &Counters::linear_solves},
    {"complementarity solves", &Counters::complementarity_solves},
    {"inner iterations", &Counters::inner_iterations},
    {"pivots", &Counters::pivots},
    {"events", &Counters::events},
};
static_assert(sizeof(Counters) == std::size(kCounters) * sizeof(std::int64_t), "every counter is held");

/// a of equation (1).
double allowance(const Run& then, bool is_of_derivatives) {
  return (is_of_derivatives ? GateRules::kRoundingOfDerivatives : GateRules::kRounding) * then.solution_size +
         2 * then.reference_error;
}

bool is_error_controlled(const Run& run) {
  return run.setting.is_tolerance();
}

/// The run beside its baseline.
struct Pair {
  const Run* then;
  const Run* now;
  bool has_reference;  ///< other runs have errors

  double allowance() const { return ricochet::allowance(*then, !now->sensitivities.empty()); }
  bool have_errors() const { return then->has_error() && now->has_error() && now->error >= 0; }
};

void hold_error(const Pair& pair, double then_at_coarser_tolerance, GateLine& line) {
  const double then = pair.then->error, now = pair.now->error, a = pair.allowance();
  const bool is_loose = is_error_controlled(*pair.then) || then >= kAsymptoticError * pair.then->solution_size;
  const double factor = is_loose ? GateRules::kCoarseErrorFactor : GateRules::kErrorFactor;  // (2), (1)
  const double limit = std::max(factor * then, then_at_coarser_tolerance) + a;
  const std::string finding = fmt::format("error {:.3e} in the baseline, now {:.3e}", then, now);
  if (!(now <= limit))
    line.add(GateVerdict::worse, fmt::format("{}, at most {:.3e} holds", finding, limit));
  else if (now < 0.5 / factor * then - a)
    line.add(GateVerdict::better, finding);
}

void hold_counters(const Pair& pair, GateLine& line) {
  const auto hold = [&](const char* name, std::int64_t c_then, std::int64_t c_now, bool is_of_matrices) {
    const auto then = static_cast<double>(c_then), now = static_cast<double>(c_now);
    const double share = is_of_matrices ? GateRules::kMatrixCounterShare : GateRules::kCounterShare;  // (4), (3)
    const double least = is_of_matrices ? GateRules::kMatrixCounterLeast : GateRules::kCounterLeast;
    const std::string finding = fmt::format("{} {} in the baseline, now {}", name, c_then, c_now);
    if (is_more_work(then, now, share, least)) line.add(GateVerdict::worse, finding);
  };
  for (const auto& [name, member, is_of_matrices] : kCounters)
    hold(name, pair.then->counters.*member, pair.now->counters.*member, is_of_matrices);
  hold("detected events", pair.then->detected_events, pair.now->detected_events, false);
}

/// Reason why the results have no error to compare; empty if they have one, or need none.
std::string why_no_error(const Pair& pair) {
  const Run& now = *pair.now;
  if (now.error < 0 || std::isinf(now.error)) return fmt::format("error {}: a number >= 0 is required", now.error);
  if (pair.has_reference && !now.has_error()) return "success without an error";
  if (pair.then->succeeded() && !pair.then->has_error() && now.has_error()) return "the baseline has no error";
  return {};
}

/// Reason why a run is incomplete, and has no work, residual or error to compare; empty for a complete run. A step that
/// ends where a formula changes its branch is one more.
std::string reason_incomplete(const Run& now) {
  const auto counted = now.counters.steps;
  const bool is_whole = is_error_controlled(now) ? counted > 0 : counted >= now.setting.steps;
  if (is_whole) return {};
  return is_error_controlled(now) ? "success without a step"
                                  : fmt::format("success with {} of {} steps", counted, now.setting.steps);
}

/// Reason why two errors belong to different references; empty if the reference is the same.
std::string why_other_reference(const Pair& pair) {
  const double size = pair.now->solution_size, size_then = pair.then->solution_size;
  if (!(std::abs(size - size_then) <= GateRules::kSizeTolerance * size_then))
    return fmt::format("size of the solution {:g} in the baseline, now {:g}: another reference", size_then, size);
  const double u = pair.now->reference_error, u_then = pair.then->reference_error;
  if (!(u >= 0 && u <= GateRules::kReferenceErrorFactor * u_then + GateRules::kRounding * size_then))
    return fmt::format("uncertainty of the reference {:.1e} in the baseline, now {:.1e}", u_then, u);
  return {};
}

void hold_run(const Pair& pair, double then_at_coarser_tolerance, GateLine& line) {
  const Run &then = *pair.then, &now = *pair.now;
  if (!is_known_status(now.status))
    return line.add(GateVerdict::not_compared, fmt::format("status '{}' is unknown", now.status));
  if (now.status == "not_built") return line.add(GateVerdict::not_compared, "not built: " + now.message);
  if (!now.succeeded()) {
    if (then.succeeded())
      line.add(GateVerdict::worse, fmt::format("succeeded in the baseline, now {}: {}", now.status, now.message));
    return;
  }
  if (const auto reason = reason_incomplete(now); !reason.empty()) return line.add(GateVerdict::not_compared, reason);
  if (const auto reason = why_no_error(pair); !reason.empty()) return line.add(GateVerdict::not_compared, reason);
  if (!then.succeeded()) return line.add(GateVerdict::better, "failed in the baseline, now succeeds");
  if (pair.have_errors()) {
    if (const auto reason = why_other_reference(pair); !reason.empty())
      return line.add(GateVerdict::not_compared, reason);
    hold_error(pair, then_at_coarser_tolerance, line);
  }
  if (then.max_residual >= 0 && !(now.max_residual >= 0))
    line.add(GateVerdict::not_compared,
             fmt::format("residual {:.1e} in the baseline, now not audited ({})", then.max_residual, now.max_residual));
  hold_counters(pair, line);
}

/// "fesd:gauss:3", "fesd:gauss:3 in place of moreau_jean".
std::string method_of(const Run& run) {
  return run.instead_of.empty() ? run.method : fmt::format("{} in place of {}", run.method, run.instead_of);
}

/// Comparison of all runs of a method that succeed in baseline and results.
class MethodGate {
 public:
  explicit MethodGate(std::string method) : method_(std::move(method)) {}
  const std::string& method() const { return method_; }
  void add(const Pair& pair) {
    if (pair.then->succeeded() && pair.now->succeeded()) pairs_.push_back(pair);
  }

  GateLine residual() const;
  GateLine work() const;
  /// @param then  the order in the baseline  @param now  in the results, by their own window
  GateLine order(const ObservedOrder& then, const ObservedOrder& now) const;

 private:
  std::string method_;
  std::vector<Pair> pairs_;
};

GateLine MethodGate::residual() const {  // (5)
  GateLine line{method_, "residual"};
  double then = -1, now = -1, a = 0;
  const Run* where = nullptr;
  for (const Pair& pair : pairs_) {
    if (pair.then->max_residual < 0) continue;
    then = std::max(then, pair.then->max_residual);
    a = std::max(a, pair.allowance());
    if (pair.now->max_residual > now) {
      now = pair.now->max_residual;
      where = pair.now;
    }
  }
  const double limit = GateRules::kResidualFactor * then + a;
  if (where && now > limit)
    line.add(GateVerdict::worse, fmt::format("{:.1e} in the baseline, now {:.1e} at {}, at most {:.1e} holds", then,
                                             now, where->setting.value(), limit));
  return line;
}

GateLine MethodGate::work() const {  // (6)
  GateLine line{method_, "work"};
  for (const Counter& counter : kCounters) {
    double then = 0, now = 0;
    for (const Pair& pair : pairs_) {
      then += static_cast<double>(pair.then->counters.*counter.member);
      now += static_cast<double>(pair.now->counters.*counter.member);
    }
    const std::string finding =
        fmt::format("{} {:.0f} in the baseline, now {:.0f}, in {} runs", counter.name, then, now, pairs_.size());
    if (is_more_work(then, now, GateRules::kCounterShare, GateRules::kCounterLeast))
      line.add(GateVerdict::worse, finding);
    else if (is_more_work(now, then, GateRules::kCounterShare, GateRules::kCounterLeast))
      line.add(GateVerdict::better, finding);
  }
  return line;
}

GateLine MethodGate::order(const ObservedOrder& then, const ObservedOrder& now) const {  // (7)
  GateLine line{method_, "order"};
  if (!then.fit) {
    line.add(GateVerdict::better, fmt::format("none in the baseline, {}; now {:.2f}", then.no_fit, now.fit->slope));
    return line;
  }
  std::vector<double> step_lengths, errors_then, errors_held;
  for (const Pair& pair : pairs_) {
    const int steps = pair.then->setting.steps;
    if (steps < then.fit->first_steps || steps > then.fit->last_steps || !pair.have_errors()) continue;
    step_lengths.push_back(pair.then->h_bar);
    errors_then.push_back(pair.then->error);
    errors_held.push_back(std::max(pair.then->error, pair.now->error - pair.allowance()));
  }
  if (static_cast<int>(step_lengths.size()) < then.fit->used) {
    line.add(GateVerdict::not_compared,
             fmt::format("{} of {} runs of its window, N_sim = {} .. {}, have an error", step_lengths.size(),
                         then.fit->used, then.fit->first_steps, then.fit->last_steps));
    return line;
  }
  const double p_then = fit_line(step_lengths, errors_then).slope, p = fit_line(step_lengths, errors_held).slope;
  if (p < p_then - GateRules::kOrderSlack) {
    line.add(GateVerdict::worse, fmt::format("{:.2f} in the baseline, now {:.2f}, over N_sim = {} .. {}", p_then, p,
                                             then.fit->first_steps, then.fit->last_steps));
  }
  return line;
}

/// The error of the next coarser tolerance of the same method, by run; 0 where there is none.
std::map<const Run*, double> errors_at_coarser_tolerances(const GridResults& baseline) {
  std::map<const Run*, double> errors;
  for (const auto& method : baseline.methods()) {
    double coarser = 0;
    for (const Run* run : baseline.of(method)) {  // descending tolerances
      if (!is_error_controlled(*run)) continue;
      errors[run] = coarser;
      if (run->has_error()) coarser = run->error;
    }
  }
  return errors;
}

std::string setting_of(const Run& run) {
  return run.instead_of.empty() ? run.setting.value()
                                : fmt::format("{} in place of {}", run.setting.value(), run.instead_of);
}

std::set<std::string> methods_of(const std::vector<Run>& records) {
  std::set<std::string> names;
  for (const Run& record : records) names.insert(record.method);
  return names;
}

int runs_of_method(const std::vector<Run>& records, const std::string& method) {
  return static_cast<int>(std::ranges::count(records, method, &Run::method));
}

class Gate {
 public:
  Gate(const GridResults& baseline, const GridResults& results) : baseline_(baseline), results_(results) {
    for (const Run& run : results.records) {
      const bool is_new = now_.emplace(key_of(run), &run).second;
      if (!is_new) add_run(run, 0, "the results have this run twice");
    }
  }

  std::vector<GateLine> lines() {
    if (baseline_.records.empty()) add_all(results_.id, "the baseline holds no run");
    hold_runs();
    name_missing_methods();
    name_new_runs();
    hold_methods();
    return std::move(lines_);
  }

 private:
  void add_run(const Run& run, int line, const std::string& reason) {
    lines_.push_back({run.method, "run", setting_of(run), line, GateVerdict::not_compared, {reason}});
  }
  void add_all(const std::string& method, const std::string& reason) {
    lines_.push_back({method, "all runs", "", 0, GateVerdict::not_compared, {reason}});
  }
  void hold_runs();
  void hold_methods();
  void name_missing_methods();
  void name_new_runs();

  const GridResults &baseline_, &results_;
  std::map<GateKey, const Run*> now_;
  std::vector<MethodGate> methods_;
  std::vector<GateLine> lines_;
};

void Gate::hold_runs() {
  const auto coarser = errors_at_coarser_tolerances(baseline_);
  const auto known = methods_of(results_.records);
  const bool has_reference = baseline_.has_errors() || results_.has_errors();
  for (const Run& then : baseline_.records) {
    if (!known.contains(then.method)) continue;  // one line for all of them
    const auto found = now_.find(key_of(then));
    if (found == now_.end()) {
      add_run(then, baseline_.line_of(then), "this run of the baseline is not in the results");
      continue;
    }
    const Pair pair{&then, found->second, has_reference};
    const auto at_coarser = coarser.find(&then);
    GateLine line{then.method, "run", setting_of(then), baseline_.line_of(then)};
    hold_run(pair, at_coarser == coarser.end() ? 0 : at_coarser->second, line);
    lines_.push_back(std::move(line));
    const std::string method = method_of(then);
    auto gate = std::ranges::find(methods_, method, &MethodGate::method);
    if (gate == methods_.end()) gate = methods_.insert(gate, MethodGate(method));
    gate->add(pair);
  }
}

void Gate::name_missing_methods() {
  const auto known = methods_of(results_.records);
  for (const auto& method : methods_of(baseline_.records)) {
    if (!known.contains(method))
      add_all(method, fmt::format("the results do not have this method; its runs in the baseline: {}",
                                  runs_of_method(baseline_.records, method)));
  }
}

void Gate::name_new_runs() {
  const auto known = methods_of(baseline_.records);
  for (const auto& method : methods_of(results_.records)) {
    if (!known.contains(method))
      add_all(method, fmt::format("the baseline does not have this method; its runs in the results: {}",
                                  runs_of_method(results_.records, method)));
  }
  std::set<GateKey> held;
  for (const Run& then : baseline_.records) held.insert(key_of(then));
  for (const auto& [key, run] : now_) {
    if (known.contains(run->method) && !held.contains(key)) add_run(*run, 0, "this run is not in the baseline");
  }
}

void Gate::hold_methods() {
  for (const MethodGate& gate : methods_) {
    lines_.push_back(gate.residual());
    lines_.push_back(gate.work());
    const auto runs = baseline_.of(gate.method());
    if (runs.empty() || is_error_controlled(*runs.front())) continue;  // runs in place of others have no order
    const ObservedOrder then = observe_order(runs), now = observe_order(results_.of(gate.method()));
    if (then.fit || now.fit) lines_.push_back(gate.order(then, now));
  }
}

}  // namespace

bool is_more_work(double then, double now, double share, double least) {
  return now - then > std::max(least, share * then);
}

const char* to_string(GateVerdict verdict) {
  switch (verdict) {
    case GateVerdict::same:
      return "same";
    case GateVerdict::better:
      return "better";
    case GateVerdict::worse:
      return "worse";
    case GateVerdict::not_compared:
      return "not compared";
  }
  return "";
}

void GateLine::add(GateVerdict kind, std::string finding) {
  verdict = std::max(verdict, kind);  // in the order of the enumerators
  findings.push_back(std::move(finding));
}

int GateReport::count(GateVerdict verdict) const {
  return static_cast<int>(std::ranges::count(lines, verdict, &GateLine::verdict));
}

bool GateReport::holds() const {
  return compared() > 0 && count(GateVerdict::worse) == 0 && count(GateVerdict::not_compared) == 0;
}

GateReport hold_against(const GridResults& baseline, const GridResults& results) {
  if (baseline.id != results.id)
    throw InputError(fmt::format("baseline: {}:1: experiment", baseline.path), baseline.id,
                     fmt::format("the results belong to {}", results.id));
  if (baseline.is_quick != results.is_quick)
    throw InputError("baseline", baseline.path,
                     baseline.is_quick ? "the baseline is of a --quick run, the results are not"
                                       : "the results are of a --quick run, the baseline is not");
  return {results.id, results.path, baseline.path, Gate(baseline, results).lines()};
}

GateKey key_of(const Run& record) {
  return {record.method, record.setting.steps, record.setting.tolerance, record.instead_of};
}

bool is_known_status(const std::string& status) {
  static constexpr Status kAll[] = {Status::success,    Status::infeasible, Status::inner_solver_failed,
                                    Status::step_limit, Status::time_limit, Status::non_finite};
  return status == "not_built" || status == "declined" ||
         std::ranges::any_of(kAll, [&](Status known) { return status == to_string(known); });
}

}  // namespace ricochet
