#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>

#include "bench/studies/zeno/zeno_rows.h"
#include "methods/method_spec.h"
#include "reports/growth.h"

namespace ricochet {
namespace {

/// Below this part of t_Z an error of the rest time is rounding of the impact times.
constexpr double kRounding = 1e-13;

/// The runs of one method together.
struct ZenoSummary {
  std::string method;
  int runs = 0, infeasible = 0, failed = 0, above = 0;
  double order = 0;
  bool has_bound = false;
  double ratio = 0, position_ratio = 0;  ///< largest error over its bound
  double v_plus = 0, v_end = 0;          ///< the largest
  std::vector<double> settings, errors;  ///< of all e on one line: their bound says how they depend on e

  void add(const ZenoRun& run) {
    ++runs;
    infeasible += run.status == "infeasible";
    failed += !run.succeeded() && run.status != "infeasible";
    if (!run.succeeded()) return;
    v_plus = std::max(v_plus, run.v_plus);
    v_end = std::max(v_end, run.v_end);
    const double rest_error = std::abs(run.rest_error());
    if (run.rests && rest_error > kRounding * run.t_Z) {
      settings.push_back(run.H > 0 ? run.H : run.tolerance);
      errors.push_back(rest_error * (1 - run.e));
    }
    if (!run.has_bound()) return;
    has_bound = true;
    const double allowed = run.rest_bound + kRounding * run.t_Z;
    above += !(rest_error <= allowed);
    ratio = std::max(ratio, rest_error / allowed);
    position_ratio = std::max(position_ratio, run.position_error / (run.position_bound + kRounding));
  }
};

std::vector<ZenoSummary> summaries(const std::vector<ZenoRun>& runs) {
  std::vector<ZenoSummary> list;
  for (const auto& run : runs) {
    if (list.empty() || list.back().method != run.method) list.emplace_back().method = run.method;
    list.back().add(run);
  }
  for (auto& summary : list) summary.order = growth_exponent(summary.settings, summary.errors);
  return list;
}

std::string outcome_of(const ZenoRun& run) {
  return !run.succeeded() ? run.status : run.rests ? "rests" : "bounces";
}

bool comes_to_rest(const ZenoRun& run) {
  return run.succeeded() && run.rests;
}

}  // namespace

std::string tableau_of(const std::string& method) {
  return fmt::format("{}", fmt::join(MethodSpec(method).arguments(), ":"));
}

bool ZenoRun::has_bound() const {
  return succeeded() && rests && std::isfinite(rest_bound);
}

Table zeno_capture_table(const std::vector<ZenoCapture>& captures) {
  using C = ZenoCapture;
  static const std::vector<Column<C>> columns = {
      {"tableau", &C::tableau},
      {"kappa", "", "{:.6f}", &C::kappa},
      {"measured - kappa", "", "{:.1e}", [](const C& c) { return c.measured_kappa - c.kappa; }},
      {"kappa / n_s^2", "", "{:.4f}", [](const C& c) { return c.kappa / (c.n_s * c.n_s); }},
      {"v_1 / v+", "", "{:.0f}", &C::kept},
      {"measured", "", "{:.13f}", &C::measured_kept},
  };
  return table_of(
      "Closed elements that start with v+ > 0", columns, captures,
      "An element of length h has stage forces >= 0 if and only if h >= kappa v+/g. Measured: the shortest such "
      "element, by bisection, and the velocity at its right end.");
}

Table zeno_table(const std::vector<ZenoRun>& runs) {
  using S = ZenoSummary;
  static const std::vector<Column<S>> columns = {
      {"method", &S::method},
      {"runs", "", "{}", &S::runs},
      {"infeasible", "", "{}", &S::infeasible},
      {"other failures", "", "{}", &S::failed},
      {"order of t_rest", "", "{:.2f}", &S::order},
      {"largest error / bound", "", "{:.3f}", [](const S& s) { return when(s.has_bound, s.ratio); }},
      {"above bound", "", "{}", [](const S& s) { return when(s.has_bound, s.above); }},
      {"v+ at rest", "", "{:.1e}", &S::v_plus},
      {"|v(T)|", "", "{:.1e}", &S::v_end},
      {"position error / bound", "", "{:.3f}", [](const S& s) { return when(s.has_bound, s.position_ratio); }},
  };
  return table_of("A ball comes to rest", columns, summaries(runs),
                  "t_rest: the last impact, after which the contact stays closed. Order: exponent of |t_Z - t_rest| "
                  "(1 - e) over the step H, or the tolerance, all e together. Bounds: methods/fesd/capture.h, plus "
                  "rounding of 1e-13 t_Z and 1e-13 m; none for one stage, whose flights are not exact, and for Gauss, "
                  "where a projection absorbs v+. v+, |v(T)|: the largest of all runs.");
}

Table zeno_details(const std::vector<ZenoRun>& runs) {
  using R = ZenoRun;
  static const std::vector<Column<R>> columns = {
      {"method", &R::method},
      {"e", "", "{}", &R::e},
      {"H or tolerance", "", "{:.3g}", [](const R& r) { return r.H > 0 ? r.H : r.tolerance; }},
      {"status", outcome_of},
      {"impacts", "", "{}", &R::impacts},
      {"t_Z - t_rest", "s", "{:.1e}", [](const R& r) { return when(comes_to_rest(r), r.rest_error()); }},
      {"bound", "", "{:.1e}", &R::rest_bound},
      {"v+", "m/s", "{:.1e}", [](const R& r) { return when(comes_to_rest(r), r.v_plus); }},
      {"|v(T)|", "m/s", "{:.1e}", [](const R& r) { return when(r.succeeded(), r.v_end); }},
      {"position error", "m", "{:.1e}", [](const R& r) { return when(comes_to_rest(r), r.position_error); }},
      {"energy", "m^2/s^2", "{:.1e}", [](const R& r) { return when(comes_to_rest(r), r.energy); }},
      {"why", &R::message},
  };
  return table_of("Every run", columns, runs);
}

}  // namespace ricochet
