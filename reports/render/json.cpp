#include "reports/render/json.h"

#include <algorithm>

namespace ricochet {
namespace {

using nlohmann::json;
using Drawn = Chart::Drawn;

constexpr int kGrey = 7, kCross = 4;

const char* drawn_word(Drawn drawn) {
  switch (drawn) {
    case Drawn::both:
      return "both";
    case Drawn::marks:
    case Drawn::failed:
    case Drawn::cells:
      return "marks";
    case Drawn::steps:
      return "steps";
    case Drawn::line:
    case Drawn::stems:
    case Drawn::reference:
      return "lines";
  }
  return "";
}

json range_json(const Chart::Axis& axis, const std::pair<double, double>& range) {
  return axis.is_reversed ? json{range.second, range.first} : json{range.first, range.second};
}

json curve_json(const Chart::Panel& panel, const Chart::Series& series) {
  CurveLook look = series.look;
  if (series.drawn == Drawn::reference) look = {.colour = kGrey, .dash = 2};
  if (series.drawn == Drawn::failed) look.symbol = kCross;
  json points = json::array();
  for (auto [x, y] : series.points) {
    if (series.drawn == Drawn::failed) y = panel.y_range().second;
    if (panel.has_place({x, y})) points.push_back({x, y});
  }
  return {
      {"label", series.label}, {"drawn", drawn_word(series.drawn)}, {"colour", look.colour}, {"symbol", look.symbol},
      {"dash", look.dash},     {"is_open", look.is_open},           {"points", points}};
}

}  // namespace

json chart_json(const Chart& chart) {
  json panels = json::array();
  for (const auto& panel : chart.panels) {
    json curves = json::array();
    for (const auto& series : panel.series) {
      json curve = curve_json(panel, series);
      if (!curve["points"].empty()) curves.push_back(std::move(curve));
    }
    json entry = {{"title", panel.heading()},
                  {"x_label", panel.x.label},
                  {"y_label", panel.y.label},
                  {"x_range", range_json(panel.x, panel.x_range())},
                  {"y_range", range_json(panel.y, panel.y_range())},
                  {"is_log_x", panel.x.is_log},
                  {"is_log_y", panel.y.is_log},
                  {"curves", std::move(curves)}};
    if (!panel.x.names.empty()) entry["x_names"] = panel.x.names;
    if (!panel.x.links.empty()) entry["x_links"] = panel.x.links;
    if (!panel.y.names.empty()) entry["y_names"] = panel.y.names;
    panels.push_back(std::move(entry));
  }
  return {{"panels", std::move(panels)}};
}

bool is_interactive(const Chart& chart) {
  return !chart.has_key_each && std::ranges::none_of(chart.panels, &Chart::Panel::has_cells);
}

}  // namespace ricochet
