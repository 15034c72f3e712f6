#include "reports/render/csv.h"

#include <fmt/format.h>

#include <cmath>

#include "reports/table.h"

namespace ricochet {
namespace {

const char* word_of(Chart::Drawn drawn) {
  using Drawn = Chart::Drawn;
  switch (drawn) {
    case Drawn::both:
      return "line and marks";
    case Drawn::line:
      return "line";
    case Drawn::marks:
      return "marks";
    case Drawn::steps:
      return "steps";
    case Drawn::stems:
      return "stems";
    case Drawn::failed:
      return "failed";
    case Drawn::reference:
      return "reference";
    case Drawn::cells:
      return "cells";
  }
  return "";
}

std::string number_cell(double x) {
  return std::isfinite(x) ? fmt::format("{:.10g}", x) : "NaN";
}

/// A place with a name, or a number.
std::string place_cell(const Chart::Axis& axis, double x) {
  const auto k = static_cast<std::size_t>(x);
  return k < axis.names.size() ? csv_cell(axis.names[k]) : number_cell(x);
}

}  // namespace

std::string chart_csv(const Chart& chart) {
  std::string csv = "panel,x axis,y axis,curve,drawn as,piece,x,y,value\n";
  for (const auto& panel : chart.panels) {
    std::string curve;
    for (const auto& series : panel.series) {
      if (!series.label.empty()) curve = series.label;
      int piece = 1;
      for (std::size_t k = 0; k < series.points.size(); ++k) {
        const auto& [x, y] = series.points[k];
        if (std::isnan(y) && series.drawn == Chart::Drawn::line) {
          ++piece;
          continue;
        }
        csv +=
            fmt::format("{},{},{},{},{},{},{},{},{}\n", csv_cell(panel.heading()), csv_cell(panel.x.label),
                        csv_cell(panel.y.label), csv_cell(curve), word_of(series.drawn), piece, place_cell(panel.x, x),
                        series.drawn == Chart::Drawn::failed ? "NaN" : place_cell(panel.y, y),
                        series.drawn == Chart::Drawn::cells ? number_cell(series.values[k]) : "");
      }
    }
  }
  return csv;
}

}  // namespace ricochet
