#pragma once

#include <string>

namespace ricochet {

// A cell of a table as LaTeX, and how wide it is.

/// Any text, in what LaTeX reads.
std::string escape_latex(const std::string& text);

struct LatexCell {
  std::string tex;   ///< with marks where its column may break it; with_breaks() makes LaTeX of them
  double width = 0;  ///< on one line, in Computer Modern with 10 points [pt]
  double word = 0;   ///< the longest part that cannot be broken [pt]
};

/// Ranges and intervals, minus signs, "us" and "<=" are typeset as what they mean.
/// @param is_interval  "1.0 .. 1.2" is one, not a range
LatexCell latex_cell(const std::string& text, bool is_interval = false);

/// Names of methods may break behind colons and commas, where cells wrap.
std::string with_breaks(const std::string& tex, bool may_wrap);

}  // namespace ricochet
