#pragma once

#include <string>

namespace ricochet {

/// Look of a curve in all formats. Curves differ in more than their colour, for readers who cannot distinguish all
/// colours, and for print in grey.
struct CurveLook {
  static constexpr int kColours = 8, kSymbols = 6, kDashes = 4;

  int colour = 0;        ///< of the palette, from 0: "c0" of the site, which has another one for the dark theme
  int symbol = 0;        ///< circle, square, triangle, diamond, cross, star
  int dash = 0;          ///< solid, dashed, dotted, dashes and dots
  bool is_open = false;  ///< the symbol is an outline

  /// Look of the k-th of some unrelated curves; 24 looks differ.
  static CurveLook of(std::size_t k);
  /// The k-th colour with a solid line and circles.
  static CurveLook plain(std::size_t k) { return {.colour = of(k).colour}; }

  bool operator==(const CurveLook&) const = default;
};

/// The palette on white, "0072b2": that of the site's style sheet (reports/site/src/site.css).
const std::string& palette_colour(int colour);
/// The colour of the k-th curve, or body, "#0072b2".
std::string curve_color(std::size_t k);
/// \definecolor of ricochet0 and so on.
std::string latex_palette();

}  // namespace ricochet
