#pragma once

#include <limits>
#include <string>
#include <utility>
#include <vector>

#include "reports/curve_look.h"

namespace ricochet {

/// The only description of a figure: panels with axes and series of numbers. Every format is rendered from it by a file in
/// reports/render/: SVG and PDF by gnuplot, PGFPlots, CSV, and the data of the site's charts.
struct Chart {
  using Points = std::vector<std::pair<double, double>>;
  static constexpr double kAuto = std::numeric_limits<double>::quiet_NaN();

  struct Axis {
    std::string label = {};  ///< an axis without a label has no numbers: the panel below or on the left shows them
    bool is_log = false;
    double from = kAuto, to = kAuto;  ///< its ends; kAuto: as the points need
    bool is_reversed = false;
    std::vector<std::string> names = {};  ///< of the places 0, 1, ..., instead of numbers
    std::vector<std::string> links = {};  ///< addresses of the named places
  };

  enum class Drawn {
    both,       ///< a line with marks
    line,       ///< a point whose ordinate is NaN ends a piece of it
    marks,      ///< marks alone
    steps,      ///< a value holds until the next point
    stems,      ///< from zero to a mark
    failed,     ///< runs without a result: crosses at the upper end of the y axis; their own ordinates are ignored
    reference,  ///< a grey line for comparison; axes are not extended for it
    cells       ///< a rectangular grid of colours, from `values` and the scale of the chart
  };

  struct Series {
    std::string label = {};  ///< in the key, once for all panels; a series without one belongs to the one before it
    CurveLook look = {};
    Drawn drawn = Drawn::both;
    Points points = {};
    std::vector<double> values = {};  ///< of cells, one for each point
    bool is_minor = false;            ///< left out of pictures, in which nobody can switch curves off
  };

  struct Panel {
    std::string title = {};  ///< of one or more lines
    Axis x = {}, y = {};
    std::vector<Series> series = {};
    std::string file = {};  ///< of a picture of its own; empty: the picture of the chart contains it

    /// Adds a series if it has points.
    void add(const std::string& label, const CurveLook& look, Drawn drawn, const Points& points);
    /// Adds the part of the reference line y = c x^p that lies inside of the axes, after all other series. It is drawn
    /// straight: p is 0 or 1, or both axes are logarithmic.
    void add_power(const std::string& label, double c, double p);

    /// The title on one line.
    std::string heading() const;
    bool has_cells() const;
    /// Whether a point has a place on both axes: zero has none on a logarithmic one.
    bool has_place(const std::pair<double, double>& point) const;
    /// Lower and upper end of an axis: as it states them, or else as its points need.
    std::pair<double, double> x_range() const { return range(x, true); }
    std::pair<double, double> y_range() const { return range(y, false); }

   private:
    std::pair<double, double> range(const Axis& axis, bool is_x) const;
  };

  /// Colour scale of cells.
  struct Scale {
    std::string label = {};
    double from = 0, to = 1;
  };

  std::string name = {};  ///< of the view, and of its anchor: "work_precision"
  std::string file = {};  ///< of its files: "two_balls_order_work_precision"
  std::string title = {}, caption = {};
  std::vector<Panel> panels = {};
  int columns = 2, width = 390, height = 280;  ///< number of columns; area inside of the axes of a panel [px]
  bool has_key_each = false;                   ///< a key above each panel; else one key for all of them
  Scale scale = {};

  /// The panel of this title; it is added with these axes if there is none.
  Panel& panel(const std::string& title, const Axis& x, const Axis& y);
};

}  // namespace ricochet
