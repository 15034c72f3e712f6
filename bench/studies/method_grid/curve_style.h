#pragma once

#include <string>

#include "bench/studies/method_grid/grid_results.h"

namespace ricochet {

// How the methods of some results are called and drawn: a family of methods reads as one.

/// Of a curve drawn by gnuplot.
struct CurveStyle {
  std::string color;
  int point;  ///< gnuplot's point type
  int dash;   ///< gnuplot's dash type
};

/// A method keeps its colour in all figures of its results. Variants of a method are dashed.
CurveStyle curve_style(const GridResults& results, const std::string& method);

/// "FESD-J Gauss 4", or the title that the method gives itself.
std::string curve_label(const GridResults& results, const Record& record);

/// "fesd:gauss" of "fesd:gauss:4"; "event-driven"; the others without a tableau are one family, "time stepping".
std::string curve_family(const std::string& method);
/// "FESD-J Gauss"
std::string family_title(const std::string& family);

}  // namespace ricochet
