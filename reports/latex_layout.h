#pragma once

#include <algorithm>
#include <optional>
#include <string>
#include <vector>

#include "reports/latex.h"
#include "reports/latex_cell.h"

namespace ricochet {

// How a table for LaTeX is laid out: what of it is printed, and in which type, width and direction it fits.

/// What is printed of a table: columns of cells, and the paragraphs below it.
struct LatexContent {
  struct Column {
    bool is_text;
    LatexCell header;
    std::vector<LatexCell> cells;

    double widest() const { return most(&LatexCell::width); }
    double longest_word() const { return most(&LatexCell::word); }

   private:
    double most(double LatexCell::*size) const {
      double largest = 0;
      for (const LatexCell& cell : cells) largest = std::max(largest, cell.*size);
      return largest;
    }
  };
  std::vector<Column> columns;
  std::vector<std::string> notes;  ///< LaTeX
  double notes_width = 0;          ///< of all of them on one line, in 10 points
  std::size_t rows = 0;

  void note(const std::string& before, const std::string& raw) {
    const LatexCell text = latex_cell(raw);
    notes.push_back(before + with_breaks(text.tex, true));
    notes_width += text.width + 10;
  }
};

/// What a paper has to see of a table: without empty columns, with the rest of them as cells or below the table.
LatexContent latex_content(const Table& table);

struct LatexType {
  double points, leading, factor;  ///< of widths, over those of 10 points: small type is wider than in proportion
};

constexpr LatexType kTenPoints = {10, 12, 1}, kEightPoints = {8, 9.5, .86};
constexpr double kLatexGap = 6;  // on each side of a column, LaTeX' own [pt]

enum class LatexWraps { nothing, headers, text };

/// A way to print a table; the first one that holds is taken.
struct LatexAttempt {
  bool is_turned;
  LatexType type;
  double gap;  ///< on each side of a column [pt]
  LatexWraps wraps;
  double most_lines;  ///< of a row, on average, beside columns of sentences
};

struct LatexLayout {
  LatexAttempt attempt = {false, kTenPoints, kLatexGap, LatexWraps::nothing, 1};
  std::vector<double> widths;  ///< [pt]; empty: as wide as what is in them
  double lines = 0;            ///< of all rows
};

/// The first way to print it that fits; nothing where even small type on a turned page is too wide.
std::optional<LatexLayout> latex_layout(const LatexContent& content, const LatexPage& page);

}  // namespace ricochet
