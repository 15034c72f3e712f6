#include "reports/curve_look.h"

#include <fmt/format.h>

#include <array>
#include <cctype>

namespace ricochet {
namespace {

// The second blue comes last.
constexpr std::array<int, CurveLook::kColours> kOrder = {0, 1, 2, 3, 4, 6, 7, 5};

}  // namespace

CurveLook CurveLook::of(std::size_t k) {
  const auto curve = static_cast<int>(k);
  const int round = curve / kColours;
  return {kOrder[k % kOrder.size()], (curve % kColours + round) % kSymbols, (curve + round) % kDashes};
}

const std::string& palette_colour(int colour) {
  static const std::array<std::string, CurveLook::kColours> colours = {"0072b2", "c25000", "007a5a", "a8437f",
                                                                       "6b6f00", "3a86c4", "8a5a00", "5c5f62"};
  return colours[static_cast<std::size_t>(colour) % colours.size()];
}

std::string curve_color(std::size_t k) {
  return "#" + palette_colour(CurveLook::of(k).colour);
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

}  // namespace ricochet
