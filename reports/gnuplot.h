#pragma once

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>
#include <vector>

namespace ricochet {

// Pieces of gnuplot scripts that all figures share.

inline const std::vector<std::string>& curve_colors() {
  static const std::vector<std::string> colors = {"#2171b5", "#d94801", "#238b45", "#6a51a3", "#525252", "#ae017e"};
  return colors;
}

/// Terminal and style. @param width, height  [px]
inline std::string figure_head(int width, int height) {
  return fmt::format(R"(set encoding utf8
set terminal svg size {},{} dynamic font "Helvetica,14" background "#ffffff"
set border 3 lc rgb "#404040"
set tics nomirror textcolor rgb "#404040"
set grid lc rgb "#e4e4e4" lt 1 lw 0.7
set key noenhanced
set title noenhanced
set xlabel noenhanced
set ylabel noenhanced
)",
                     width, height);
}

/// A named block of data.
inline std::string block(const std::string& name, const std::vector<std::pair<double, double>>& points) {
  std::string text = fmt::format("${} << EOD\n", name);
  for (const auto& [x, y] : points) text += fmt::format("{:.10g} {:.10g}\n", x, y);
  return text + "EOD\n";
}

/// Decades that contain all values, as gnuplot range.
inline std::pair<double, double> decades(const std::vector<double>& values) {
  const auto [low, high] = std::minmax_element(values.begin(), values.end());
  return {std::pow(10, std::floor(std::log10(*low))), std::pow(10, std::ceil(std::log10(*high)))};
}

/// A list of curves becomes one plot command.
class PlotCommand {
 public:
  void add(const std::string& item) { text_ += (text_.empty() ? "plot " : ", \\\n     ") + item; }
  /// A panel without curves stays empty.
  std::string text() const { return (text_.empty() ? "set multiplot next" : text_) + "\n"; }

 private:
  std::string text_;
};

}  // namespace ricochet
