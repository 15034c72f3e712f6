#include <fmt/format.h>

#include <algorithm>

#include "bench/studies/control/gradient_rows.h"

namespace ricochet {

Table gradient_table(const std::vector<ControlGradient>& gradients) {
  using G = ControlGradient;
  static const std::vector<Column<G>> columns = {
      {"method", &G::method},
      {"steps per interval", "", "{}", &G::steps},
      {"relative error", "", "{:.1e}", &G::error},
      {"after the last impact", "", "{:.1e}", &G::error_after_impact},
  };
  const auto compared = rows_where(gradients, [](const G& g) { return !g.is_reference(); });
  return table_of(
      "Derivatives of the terminal state with respect to the controls", columns, compared,
      "The largest error over the components of (q, v) at T and the intervals, relative to the largest derivative of "
      "that component; then the same for the intervals after the last impact only. Reference: "
      "central differences of CVODE with located events. The derivatives of time "
      "stepping are central differences of the discrete scheme.");
}

Table gradient_details(const std::vector<ControlGradient>& gradients) {
  struct Line {
    const ControlGradient* gradient;
    std::string component;
    std::size_t control;
    double derivative;
  };
  static const std::vector<Column<Line>> columns = {
      {"method", [](const Line& l) { return l.gradient->method; }},
      {"steps per interval", "", "{}",
       [](const Line& l) { return when(!l.gradient->is_reference(), l.gradient->steps); }},
      {"component", &Line::component},
      {"control", "", "{}", &Line::control},
      {"derivative", "", "{:.10g}", &Line::derivative},
  };
  std::vector<Line> lines;
  for (const auto& g : gradients) {
    for (std::size_t c = 0; c < g.components.size(); ++c) {
      for (std::size_t k = 0; k < g.derivatives[c].size(); ++k)
        lines.push_back({&g, g.components[c], k + 1, g.derivatives[c][k]});
    }
  }
  return table_of("All derivatives", columns, lines);
}

}  // namespace ricochet
