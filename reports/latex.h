#pragma once

#include <string>
#include <vector>

#include "reports/table.h"

namespace ricochet {

// Tables for papers, which fit the page.

/// What a paper leaves for a table, in points of TeX (1 cm = 28.45 pt).
struct LatexPage {
  double width = 483;   ///< of a line: A4 with margins of 2 cm
  double height = 731;  ///< of the text: a table that is turned has this width
};

/// A table for LaTeX with booktabs, caption and label, in an environment by its size:
///
///   table          what fits, in 10 to 8 points; headers and text wrap where they have to
///   sidewaystable  what does not, turned
///   longtable      what is longer than a page, or has more than 40 rows; turned in a landscape
///
/// and in several of them where even that is too narrow. Columns without content are left out. One value throughout, and
/// remarks that most rows lack, stand below the table. Widths are those of Computer Modern: other founts are narrower.
/// The first line names the packages. @param label  "tab:two_balls_order"
std::string latex(const Table& table, const std::string& label, const LatexPage& page = {});

/// The table with these columns only, in this order: headers, with or without their units.
/// @param names  of which it takes those it has
Table with_columns(const Table& table, const std::vector<std::string>& names);

/// The headers in a list "method,drift, worst [deg]": a header may have a comma itself.
/// @throws InputError for a header that is none of `known`
std::vector<std::string> headers_in(const std::string& list, const std::vector<std::string>& known);

}  // namespace ricochet
