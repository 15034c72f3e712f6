#include "reports/gnuplot.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace ricochet {

std::string gnuplot_head(int width, int height) {
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

std::string data_block(const std::string& name, const Points& points) {
  std::string text = fmt::format("${} << EOD\n", name);
  for (const auto& [x, y] : points) text += std::isnan(y) ? "\n" : fmt::format("{:.10g} {:.10g}\n", x, y);
  return text + "EOD\n";
}

std::string gnuplot_text(const std::string& text) {
  std::string quoted = "'";
  for (const char c : text) quoted += c == '\'' ? std::string("''") : std::string(1, c);
  return quoted + "'";
}

std::pair<double, double> decades(const std::vector<double>& values) {
  const auto [low, high] = std::ranges::minmax_element(values);
  return {std::pow(10, std::floor(std::log10(*low))), std::pow(10, std::ceil(std::log10(*high)))};
}

const std::string& curve_color(std::size_t k) {
  static const std::vector<std::string> colors = {"#2171b5", "#d94801", "#238b45", "#6a51a3",
                                                  "#525252", "#ae017e", "#8c510a", "#01939a"};
  return colors[k % colors.size()];
}

void Panel::add(const Points& points, std::size_t color, const std::string& style, const std::string& title) {
  if (points.empty()) return;
  const std::string name = fmt::format("{}_{}", id_, count_++);
  data_ += data_block(name, points);
  plot_.add(fmt::format("${} {} lc rgb '{}' {}", name, style, curve_color(color),
                        title.empty() ? "notitle" : "title " + gnuplot_text(title)));
}

}  // namespace ricochet
