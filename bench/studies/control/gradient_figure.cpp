#include <fmt/format.h>

#include <algorithm>

#include "bench/studies/control/gradient_rows.h"

namespace ricochet {

Chart gradient_chart(const std::vector<ControlGradient>& gradients, const std::string& name) {
  Chart chart{.name = "derivatives_over_intervals",
              .file = name,
              .title = "Derivatives of the terminal state",
              .caption =
                  "Derivative of each component of the terminal state with respect to the control of each interval. "
                  "FESD-J lies on the reference, time stepping does not, with any step length."};
  for (const auto& component : gradients.front().components)
    chart.panels.push_back({.title = component,
                            .x = {.label = "control interval"},
                            .y = {.label = fmt::format("d {}(T) / du", component)}});
  std::size_t shown = 0;  // the coarsest and the finest of each method
  for (std::size_t k = 0; k < gradients.size(); ++k) {
    const ControlGradient& g = gradients[k];
    const bool is_first = k == 0 || gradients[k - 1].method != g.method;
    const bool is_last = k + 1 == gradients.size() || gradients[k + 1].method != g.method;
    if (!is_first && !is_last) continue;
    const CurveLook look = g.is_reference() ? CurveLook{.colour = 7, .is_open = true} : CurveLook::of(shown++);
    for (std::size_t c = 0; c < g.components.size(); ++c) {
      Chart::Points points;
      for (const double derivative : g.derivatives[c])
        points.emplace_back(static_cast<double>(points.size() + 1), derivative);
      chart.panels[c].add(g.is_reference() ? g.method : fmt::format("{}, {} steps", g.method, g.steps), look,
                          g.is_reference() ? Chart::Drawn::marks : Chart::Drawn::both, points);
    }
  }
  if (gradients.front().is_reference()) {  // above the others
    for (auto& panel : chart.panels) std::ranges::rotate(panel.series, panel.series.begin() + 1);
  }
  return chart;
}

}  // namespace ricochet
