#include <fmt/format.h>

#include <algorithm>

#include "bench/studies/control/seed_rows.h"
#include "reports/gnuplot.h"

namespace ricochet {

Figure draw_seeds(const FigureFolder& folder, const std::vector<SeedRun>& runs, const std::string& name) {
  const auto groups = seed_groups(runs);
  const bool is_timed = std::ranges::any_of(runs, &SeedRun::is_timed);
  const auto work = [=](const SeedRun* run) { return is_timed ? run->cpu_seconds : run->iterations; };
  std::string data, panels;
  for (std::size_t g = 0; g < groups.size(); ++g) {
    Points stationary, others, failed;
    for (const SeedRun* run : groups[g]) {
      if (!run->succeeded())
        failed.emplace_back(work(run), 1);
      else
        (run->is_b_stationary ? stationary : others).emplace_back(work(run), run->cost);
    }
    Panel panel(fmt::format("g{}", g));
    panel.add(stationary, 0, "with points pt 7 ps 0.6", "B-stationary");
    panel.add(others, 1, "with points pt 6 ps 0.6", "others");
    panel.add(failed, 4, "axes x1y2 with points pt 2 ps 0.8 lw 1.6", "no solution");
    data += panel.data();
    panels +=
        fmt::format("set title \"{}\\n{}\" font ',11'\n", groups[g].front()->problem, groups[g].front()->arguments);
    panels += panel.plot();
  }
  const std::string script = gnuplot_head(460 * static_cast<int>(groups.size()), 460) + data +
                             fmt::format("set output '{}.svg'\n", name) +
                             fmt::format("set multiplot layout 1,{}\n", groups.size()) +
                             fmt::format("set xlabel '{}'\n", is_timed ? "CPU time [s]" : "iterations") +
                             "set ylabel 'cost'\nset xrange [0:*]\nset y2range [0:1]\n"
                             "set offsets graph 0.05,graph 0.05,graph 0.08,graph 0.05\nset bmargin 6\nset key at graph "
                             "0.5, -0.23 center horizontal samplen 1 font ',11'\n" +
                             panels + "unset multiplot\n";
  folder.draw(name, script);
  return {name + ".svg", "Random initial guesses",
          fmt::format("Cost over {}, one point per guess: the lower and the further left the better. Crosses on the "
                      "upper frame: guesses without a solution.",
                      is_timed ? "CPU time" : "iterations")};
}

}  // namespace ricochet
