#include <fmt/format.h>

#include <algorithm>

#include "bench/studies/control/seed_rows.h"

namespace ricochet {

Chart seed_chart(const std::vector<SeedRun>& runs, const std::string& name) {
  const auto groups = seed_groups(runs);
  const bool is_timed = std::ranges::any_of(runs, &SeedRun::is_timed);
  Chart chart{
      .name = "costs",
      .file = name,
      .title = "Random initial guesses",
      .caption = fmt::format("Cost over {}, one point per guess: the lower and the further left the better. Crosses "
                             "on the upper frame: guesses without a solution.",
                             is_timed ? "CPU time" : "iterations"),
      .columns = 3,
      .width = 360};
  for (const auto& group : groups) {
    Chart::Panel& panel =
        chart.panels.emplace_back(Chart::Panel{.title = group.front()->problem + "\n" + solver_name(group, groups),
                                               .x = {.label = is_timed ? "CPU time [s]" : "iterations", .from = 0},
                                               .y = {.label = "cost"}});
    Chart::Points stationary, others, failed;
    for (const SeedRun* run : group) {
      Chart::Points& points = !run->succeeded() ? failed : run->is_b_stationary ? stationary : others;
      points.emplace_back(is_timed ? run->cpu_seconds : run->iterations, run->cost);
    }
    panel.add("B-stationary", CurveLook::plain(0), Chart::Drawn::marks, stationary);
    panel.add("others", {.colour = 1, .is_open = true}, Chart::Drawn::marks, others);
    panel.add("no solution", {.colour = 7}, Chart::Drawn::failed, failed);
  }
  return chart;
}

}  // namespace ricochet
