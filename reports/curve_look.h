#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <utility>
#include <vector>

namespace ricochet {

/// How a curve looks wherever it is drawn: gnuplot, PGFPlots and the site read it. Curves differ in more than their
/// colour, for readers who cannot tell all colours apart, and for print in grey.
struct CurveLook {
  static constexpr int kColours = 8, kSymbols = 6, kDashes = 4;

  int colour = 0;  ///< of the palette, from 0: "c0" of the site, which has another one for the dark theme
  int symbol = 0;  ///< circle, square, triangle, diamond, cross, star
  int dash = 0;    ///< solid, dashed, dotted, dashes and dots

  /// Of the k-th of some curves that have nothing in common; 24 of them differ.
  static CurveLook of(std::size_t k);
  /// Of a chart's data: {"colour", "symbol", "dash"}, `otherwise` where it has none.
  static CurveLook of(const nlohmann::json& curve, const CurveLook& otherwise);

  /// Adds its fields to those of a curve.
  void put_into(nlohmann::json& curve) const;
  std::string gnuplot() const;   ///< "lc rgb '#0072b2' dt 1 pt 7"
  std::string pgfplots() const;  ///< "color=ricochet0, mark=*"

  bool operator==(const CurveLook&) const = default;
};

/// The palette on white, "0072b2": that of the site's style sheet (reports/site/src/site.css).
const std::string& palette_colour(int colour);
/// \definecolor of ricochet0 and so on.
std::string latex_palette();

/// Data of a chart of kind "curves", as what has no chart of its own on the site has: panels, whose axes are logarithmic where
/// they are not said to be others.
struct CurvePanel {
  struct Curve {
    std::string label;
    CurveLook look;
    std::string drawn = "both";  ///< "lines", "marks" or both
    std::vector<std::pair<double, double>> points;
  };
  std::string title, x_label, y_label;
  std::vector<Curve> curves = {};
  std::vector<std::string> x_names =
      {};  ///< of the places 0, 1, ... of a linear axis; a curve ends where it has no point
  std::vector<std::string> x_links = {};  ///< addresses of the same
  bool is_log_y = true;
};
nlohmann::json curves_data(const std::vector<CurvePanel>& panels);

}  // namespace ricochet
