#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "bench/studies/zeno/zeno_rows.h"
#include "methods/method_spec.h"

namespace ricochet {
namespace {

/// "radau-iia" and 3 of "radau-iia:3".
std::pair<std::string, int> family_and_stages(const std::string& tableau) {
  const auto colon = tableau.find(':');
  return {tableau.substr(0, colon), std::atoi(tableau.substr(colon + 1).c_str())};
}

constexpr double kLeast = 1e-10;  // [s]; smaller errors are drawn there

std::string e_text(double e) {
  return fmt::format("e = {}", e);
}

/// The runs with fixed steps of one tableau. Elements that were added where two have no solution are open circles.
void add_runs(const std::vector<ZenoRun>& runs, const std::string& tableau, Chart::Panel& panel) {
  std::map<double, Chart::Points> fixed, added;  // by e; all panels have the same values of e
  Chart::Points bound, failed;
  for (const ZenoRun& run : runs) {
    fixed[run.e];
    if (run.H == 0 || tableau_of(run.method) != tableau) continue;
    const bool adds = MethodSpec(run.method).choice("elements", {"fixed", "as_needed"}) == "as_needed";
    if (run.has_bound()) bound.emplace_back(run.H, run.rest_bound * (1 - run.e));
    if (run.succeeded() && run.rests)
      (adds ? added : fixed)[run.e].emplace_back(run.H, std::max(std::abs(run.rest_error()) * (1 - run.e), kLeast));
    else if (!run.succeeded() && !adds)
      failed.emplace_back(run.H, Chart::kAuto);
  }
  std::size_t k = 0;
  for (const auto& [e, points] : fixed) {
    const CurveLook look = CurveLook::plain(k++);
    panel.add(e_text(e), look, Chart::Drawn::marks, points);
    panel.add(points.empty() ? e_text(e) : "", {.colour = look.colour, .is_open = true}, Chart::Drawn::marks, added[e]);
  }
  std::ranges::sort(bound);
  panel.add("bound", {.colour = 7}, Chart::Drawn::line, bound);
  panel.add("no solution with two elements", {.colour = 7}, Chart::Drawn::failed, failed);
}

/// kappa over the number of stages.
Chart::Panel kappa_panel(const std::vector<ZenoCapture>& captures) {
  Chart::Panel panel{.title = "shortest closed element, h = κ v⁺/g",
                     .x = {.label = "stages n_s", .is_log = true},
                     .y = {.label = "κ", .is_log = true}};
  std::map<std::string, Chart::Points> families;
  for (const auto& c : captures) families[family_and_stages(c.tableau).first].emplace_back(c.n_s, c.kappa);
  std::size_t k = 0;
  for (const auto& [family, points] : families) panel.add(family, CurveLook::of(k++), Chart::Drawn::both, points);
  panel.add_power("0.432 n_s²", 0.4317, 2);
  return panel;
}

}  // namespace

Chart zeno_chart(const std::vector<ZenoCapture>& captures, const std::vector<ZenoRun>& runs, const std::string& name) {
  Chart chart{.name = "rest",
              .file = name + "_rest_time",
              .title = "Rest time of a bouncing ball",
              .caption =
                  "How much too early FESD-J calls a bouncing ball at rest, times 1 - e, for all coefficients of "
                  "restitution e together. The bound is 2 H / max(2, κ): the next flight did not fit into the "
                  "element, and the closed element is long enough for its stage forces to be positive. Open "
                  "circles: elements are added where two have no solution; these lie below the others, or on them. "
                  "Crosses on the upper frame: no solution with two elements. For one stage, whose flights are not "
                  "exact, there is no bound. Errors below 1e-10 s are drawn there. Last panel: κ.",
              .columns = 3,
              .width = 290,
              .height = 270};
  for (const auto& run : runs) {
    const auto [family, stages] = family_and_stages(tableau_of(run.method));
    if (run.H == 0 || family != "radau-iia") continue;
    const std::string title = fmt::format("Radau IIA, {} stage{}", stages, stages > 1 ? "s" : "");
    Chart::Panel& panel = chart.panel(title, {.label = "step H [s]", .is_log = true},
                                      {.label = "|t_Z - t_rest| (1 - e) [s]", .is_log = true, .from = kLeast, .to = 1});
    if (panel.series.empty()) add_runs(runs, tableau_of(run.method), panel);
  }
  if (!chart.panels.empty()) chart.panels.push_back(kappa_panel(captures));
  return chart;
}

}  // namespace ricochet
