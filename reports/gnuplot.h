#pragma once

#include <string>
#include <utility>
#include <vector>

namespace ricochet {

// What all figures have in common: page, lines of data, colours.

/// The first lines of a script: an SVG of this size in pixels.
std::string gnuplot_head(int width, int height);

/// Points as a named data block, "$name" in a plot. A NaN ends a line.
std::string data_block(const std::string& name, const std::vector<std::pair<double, double>>& points);

/// Of the k-th curve, or body, from 0.
const std::string& curve_color(std::size_t k);

/// Decades that contain all values, as gnuplot range.
std::pair<double, double> decades(const std::vector<double>& values);

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
