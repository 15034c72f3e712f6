#include "reports/zeno_results.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "reports/growth.h"
#include "reports/json_number.h"

namespace ricochet {
namespace {

using nlohmann::json;

std::string fixed(double x, int digits) {
  return std::isfinite(x) ? fmt::format("{:.{}f}", x, digits) : "-";
}

/// Below this part of t_Z an error of the rest time is rounding of the impact times.
constexpr double kRounding = 1e-13;

}  // namespace

bool ZenoRun::has_bound() const {
  return succeeded() && rests && std::isfinite(rest_bound);
}

json to_json(const ZenoCapture& c) {
  return {{"kind", "zeno_capture"},
          {"tableau", c.tableau},
          {"n_s", c.n_s},
          {"kappa", c.kappa},
          {"kept", c.kept},
          {"measured_kappa", c.measured_kappa},
          {"measured_kept", c.measured_kept}};
}

ZenoCapture zeno_capture_from_json(const json& j) {
  ZenoCapture c;
  j.at("tableau").get_to(c.tableau);
  j.at("n_s").get_to(c.n_s);
  c.kappa = number_or_nan(j.at("kappa"));
  c.kept = number_or_nan(j.at("kept"));
  c.measured_kappa = number_or_nan(j.at("measured_kappa"));
  c.measured_kept = number_or_nan(j.at("measured_kept"));
  return c;
}

json to_json(const ZenoRun& r) {
  return {{"kind", "zeno_run"},
          {"method", r.method},
          {"command", r.command},
          {"e", r.e},
          {"H", r.H},
          {"tolerance", r.tolerance},
          {"status", r.status},
          {"message", r.message},
          {"t_Z", r.t_Z},
          {"impacts", r.impacts},
          {"rests", r.rests},
          {"t_rest", r.t_rest},
          {"v_plus", r.v_plus},
          {"v_end", r.v_end},
          {"position_error", r.position_error},
          {"rest_bound", r.rest_bound},
          {"position_bound", r.position_bound},
          {"energy", r.energy}};
}

ZenoRun zeno_run_from_json(const json& j) {
  ZenoRun r;
  j.at("method").get_to(r.method);
  j.at("command").get_to(r.command);
  j.at("e").get_to(r.e);
  j.at("H").get_to(r.H);
  j.at("tolerance").get_to(r.tolerance);
  j.at("status").get_to(r.status);
  j.at("message").get_to(r.message);
  j.at("t_Z").get_to(r.t_Z);
  j.at("impacts").get_to(r.impacts);
  j.at("rests").get_to(r.rests);
  j.at("t_rest").get_to(r.t_rest);
  j.at("v_plus").get_to(r.v_plus);
  j.at("v_end").get_to(r.v_end);
  j.at("position_error").get_to(r.position_error);
  r.rest_bound = number_or_nan(j.at("rest_bound"));
  r.position_bound = number_or_nan(j.at("position_bound"));
  j.at("energy").get_to(r.energy);
  return r;
}

Table zeno_capture_table(const std::vector<ZenoCapture>& captures) {
  Table table;
  table.title = "Closed elements that start with v+ > 0";
  table.columns = {{"tableau", true}, {"kappa"}, {"measured - kappa"}, {"kappa / n_s^2"}, {"v_1 / v+"}, {"measured"}};
  for (const auto& c : captures) {
    table.rows.push_back({c.tableau, fixed(c.kappa, 6), scientific(c.measured_kappa - c.kappa),
                          fixed(c.kappa / (c.n_s * c.n_s), 4), fixed(c.kept, 0), fixed(c.measured_kept, 13)});
  }
  table.note =
      "An element of length h has stage forces >= 0 exactly when h >= kappa v+/g. Measured: bisection for the shortest "
      "one, and the velocity at its right end.";
  return table;
}

Table zeno_table(const std::vector<ZenoRun>& runs) {
  Table table;
  table.title = "A ball comes to rest";
  table.columns = {
      {"method", true},          {"runs"},        {"infeasible"}, {"other failures"}, {"order of t_rest"},
      {"largest error / bound"}, {"above bound"}, {"v+ at rest"}, {"|v(T)|"},         {"position error / bound"}};
  for (std::size_t first = 0; first < runs.size();) {
    std::size_t last = first;
    int infeasible = 0, failed = 0, above = 0;
    double ratio = 0, position_ratio = 0, v_plus = 0, v_end = 0;
    bool has_bound = false;
    std::vector<double> steps, errors;
    for (; last < runs.size() && runs[last].method == runs[first].method; ++last) {
      const ZenoRun& run = runs[last];
      infeasible += run.status == "infeasible";
      failed += !run.succeeded() && run.status != "infeasible";
      if (!run.succeeded()) continue;
      v_plus = std::max(v_plus, run.v_plus);
      v_end = std::max(v_end, run.v_end);
      const double setting = run.H > 0 ? run.H : run.tolerance;
      // The errors of all e on one line: their bound says how they depend on e.
      if (run.rests && std::abs(run.rest_error()) > kRounding * run.t_Z) {
        steps.push_back(setting);
        errors.push_back(std::abs(run.rest_error()) * (1 - run.e));
      }
      if (!run.has_bound()) continue;
      has_bound = true;
      const double allowed = run.rest_bound + kRounding * run.t_Z;
      above += !(std::abs(run.rest_error()) <= allowed);
      ratio = std::max(ratio, std::abs(run.rest_error()) / allowed);
      position_ratio = std::max(position_ratio, run.position_error / (run.position_bound + kRounding));
    }
    const double order = growth_exponent(steps, errors);
    table.rows.push_back({runs[first].method, fmt::format("{}", last - first), fmt::format("{}", infeasible),
                          fmt::format("{}", failed), fixed(order, 2), has_bound ? fixed(ratio, 3) : "-",
                          has_bound ? fmt::format("{}", above) : "-", scientific(v_plus), scientific(v_end),
                          has_bound ? fixed(position_ratio, 3) : "-"});
    first = last;
  }
  table.note =
      "t_rest: the last impact, behind which the contact stays closed. Order: exponent of |t_Z - t_rest| (1 - e) over "
      "the step H, or the tolerance, all e together. Bounds: methods/fesd/capture.h, plus rounding of 1e-13 t_Z and "
      "1e-13 m; none for one stage, whose flights are not exact, and for Gauss, which gives v+ back. v+, |v(T)|: the "
      "largest of all runs.";
  return table;
}

Table zeno_details(const std::vector<ZenoRun>& runs) {
  Table table;
  table.title = "Every run";
  table.columns = {{"method", true},     {"e"},        {"H or tolerance"}, {"status", true}, {"impacts"},
                   {"t_Z - t_rest [s]"}, {"bound"},    {"v+ [m/s]"},       {"|v(T)| [m/s]"}, {"position error [m]"},
                   {"energy [m^2/s^2]"}, {"why", true}};
  for (const auto& r : runs) {
    const bool rests = r.succeeded() && r.rests;
    table.rows.push_back({r.method, fmt::format("{}", r.e), fmt::format("{:.3g}", r.H > 0 ? r.H : r.tolerance),
                          !r.succeeded() ? r.status
                          : r.rests      ? "rests"
                                         : "bounces",
                          fmt::format("{}", r.impacts), rests ? scientific(r.rest_error()) : "-",
                          scientific(r.rest_bound), rests ? scientific(r.v_plus) : "-",
                          r.succeeded() ? scientific(r.v_end) : "-", rests ? scientific(r.position_error) : "-",
                          rests ? scientific(r.energy) : "-", r.message});
  }
  return table;
}

}  // namespace ricochet
