#include "reports/curve_look.h"

#include <fmt/format.h>

#include <array>
#include <cmath>

namespace ricochet {
namespace {

template <std::size_t n>
const std::string& entry(const std::array<std::string, n>& list, int k) {
  return list[static_cast<std::size_t>(k) % n];
}

// The second blue comes last.
constexpr std::array<int, CurveLook::kColours> kOrder = {0, 1, 2, 3, 4, 6, 7, 5};

}  // namespace

CurveLook CurveLook::of(std::size_t k) {
  const auto curve = static_cast<int>(k);
  const int round = curve / kColours;
  return {kOrder[k % kOrder.size()], (curve % kColours + round) % kSymbols, (curve + round) % kDashes};
}

CurveLook CurveLook::of(const nlohmann::json& curve, const CurveLook& otherwise) {
  return {curve.value("colour", otherwise.colour), curve.value("symbol", otherwise.symbol),
          curve.value("dash", otherwise.dash)};
}

void CurveLook::put_into(nlohmann::json& curve) const {
  curve["colour"] = colour;
  curve["symbol"] = symbol;
  curve["dash"] = dash;
}

std::string CurveLook::gnuplot() const {
  static constexpr std::array<int, kSymbols> kPoints = {7, 5, 9, 13, 1, 3};
  return fmt::format("lc rgb '#{}' dt {} pt {}", palette_colour(colour), 1 + dash % kDashes,
                     kPoints[static_cast<std::size_t>(symbol) % kSymbols]);
}

std::string CurveLook::pgfplots() const {
  static const std::array<std::string, kSymbols> marks = {"*", "square*", "triangle*", "diamond*", "+", "star"};
  static const std::array<std::string, kDashes> dashes = {"solid", "dashed", "densely dotted", "dashdotted"};
  return fmt::format("color=ricochet{}, mark={}, mark options={{solid}}, {}", colour % kColours, entry(marks, symbol),
                     entry(dashes, dash));
}

const std::string& palette_colour(int colour) {
  static const std::array<std::string, CurveLook::kColours> colours = {"0072b2", "c25000", "007a5a", "a8437f",
                                                                       "6b6f00", "3a86c4", "8a5a00", "5c5f62"};
  return entry(colours, colour);
}

std::string latex_palette() {
  std::string text;
  for (int k = 0; k < CurveLook::kColours; ++k) {
    std::string hex = palette_colour(k);
    for (char& c : hex) c = static_cast<char>(std::toupper(static_cast<unsigned char>(c)));
    text += fmt::format("\\definecolor{{ricochet{}}}{{HTML}}{{{}}}\n", k, hex);
  }
  return text;
}

nlohmann::json curves_data(const std::vector<CurvePanel>& panels) {
  nlohmann::json data = {{"panels", nlohmann::json::array()}};
  for (const auto& panel : panels) {
    nlohmann::json curves = nlohmann::json::array();
    for (const auto& curve : panel.curves) {
      nlohmann::json points = nlohmann::json::array();
      for (const auto& [x, y] : curve.points) {
        if ((x > 0 || !panel.x_names.empty()) && (y > 0 || !panel.is_log_y)) points.push_back({x, y});
      }
      if (points.empty()) continue;
      nlohmann::json entry = {{"label", curve.label}, {"drawn", curve.drawn}, {"points", points}};
      curve.look.put_into(entry);
      curves.push_back(entry);
    }
    nlohmann::json entry = {
        {"title", panel.title}, {"x_label", panel.x_label}, {"y_label", panel.y_label}, {"curves", curves}};
    if (!panel.x_names.empty()) entry["x_names"] = panel.x_names;
    if (!panel.x_links.empty()) entry["x_links"] = panel.x_links;
    if (!panel.is_log_y) entry["is_log_y"] = false;
    data["panels"].push_back(entry);
  }
  return data;
}

}  // namespace ricochet
