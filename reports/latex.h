#pragma once

#include <string>
#include <vector>

#include "reports/table.h"

namespace ricochet {

// Tables for papers.

/// Any text, as LaTeX.
std::string escape_latex(const std::string& text);

/// A table for LaTeX with booktabs, caption and label. Up to 40 rows are a `table` that adjustbox shrinks to the page if
/// it is too large; more rows are a `longtable` in small type. Columns without content are left out, and columns of
/// sentences wrap. The first line names the packages.
/// @param label  "tab:two_balls_order"
std::string latex(const Table& table, const std::string& label);

/// The table with these columns only, in this order.
/// @param names  headers, with or without their units; those that the table lacks are skipped
Table with_columns(const Table& table, const std::vector<std::string>& names);

/// The headers in a list "method,drift, worst [deg]": a header may contain a comma.
/// @throws InputError for a header that is none of `known`
std::vector<std::string> headers_in(const std::string& list, const std::vector<std::string>& known);

}  // namespace ricochet
