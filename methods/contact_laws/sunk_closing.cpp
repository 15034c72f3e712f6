#include "methods/contact_laws/sunk_closing.h"

#include <algorithm>

#include "methods/contact_laws/falling_zero.h"

namespace ricochet {

SunkClosing find_sunk_closing(GapSearch& gaps, int contact, double height, double left_gap, double rounding,
                              double slack) {
  constexpr double kHop = 0.01;  // heights
  const double sunk = -std::min(left_gap, 0.0);
  const auto gap = [&](double s) { return gaps.gap(contact, s); };
  const auto closing_at = [&](double level) {
    SunkClosing closing{.piece = gaps.first_closing(contact, {.gap = level + slack, .rounding = rounding}),
                        .level = level};
    if (closing)
      closing.theta = falling_zero(closing.piece.from, closing.piece.to, [&](double s) { return gap(s) + level; });
    return closing;
  };
  const SunkClosing closing = closing_at(std::max(height, sunk));  // (1)
  const bool falls = closing && sunk >= height - slack && gap(0.5 * closing.theta) < kHop * height - sunk;
  return falls ? closing_at(height + sunk) : closing;  // (2)
}

}  // namespace ricochet
