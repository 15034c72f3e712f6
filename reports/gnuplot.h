#pragma once

#include <string>
#include <utility>
#include <vector>

namespace ricochet {

// What all figures have in common: page, lines of data, colours.

/// The first lines of a script: an SVG of this size in pixels.
std::string gnuplot_head(int width, int height);

/// The script of an SVG, by gnuplot_head(), as one that writes a PDF of the same proportions, 72 pixels to the inch.
std::string pdf_script(const std::string& script);

using Points = std::vector<std::pair<double, double>>;

/// Points as a named data block, "$name" in a plot. A NaN ends a line.
std::string data_block(const std::string& name, const Points& points);

/// A figure of several panels with one key below all of them.
struct KeyedPanels {
  /// What a curve of a style, "with lines lc rgb '#000000'", is called.
  struct Entry {
    std::string style, title;
  };

  int columns = 2, panel_width = 490, panel_height = 390;  ///< [px]
  std::vector<std::string> panels;  ///< each: settings, data blocks and its plot command, whose curves have no title
  std::vector<Entry> key;

  /// A whole script that writes NAME.svg.
  std::string script(const std::string& name) const;
};

/// Any text as a string of a script: between quotes, with those in it doubled.
std::string gnuplot_text(const std::string& text);

/// Of the k-th curve, or body, from 0.
const std::string& curve_color(std::size_t k);

/// Decades that contain all values, as gnuplot range.
std::pair<double, double> decades(const std::vector<double>& values);

/// A list of curves becomes one plot command.
class PlotCommand {
 public:
  void add(const std::string& item) { text_ += (text_.empty() ? "plot " : ", \\\n     ") + item; }
  bool is_empty() const { return text_.empty(); }
  /// A panel without curves stays empty.
  std::string text() const { return (text_.empty() ? "set multiplot next" : text_) + "\n"; }

 private:
  std::string text_;
};

/// The plot command of one panel, and the data blocks of its curves.
class Panel {
 public:
  /// @param id  of the data blocks, unique in a script
  explicit Panel(std::string id) : id_(std::move(id)) {}

  /// Nothing without points. @param style  of the data; empty title: not in the key
  void add(const Points& points, std::size_t color, const std::string& style, const std::string& title = "");

  const std::string& data() const { return data_; }
  std::string plot() const { return plot_.text(); }

 private:
  std::string id_, data_;
  PlotCommand plot_;
  int count_ = 0;
};

}  // namespace ricochet
