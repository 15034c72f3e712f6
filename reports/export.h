#pragma once

#include <string>

#include "reports/section.h"

namespace ricochet {

// What results are for papers and for other programs.

/// A table for LaTeX with booktabs: a table environment with caption and label. @param label  "tab:two_balls_order"
std::string latex(const Table& table, const std::string& label);

/// One line per run, as CSV: every number with all its digits and NaN where there is none, nested fields joined by '_',
/// names in snake_case. Rows of the kind that most rows have; rows that name one of them by its number ("row", as times do)
/// add their fields to it. Lists of strings are joined by ';', other lists are left out.
/// @throws InputError where the results have no row
std::string tidy_csv(const Results& results);

/// Whether pgfplots() knows this kind of chart.
bool has_pgfplots(const Section::Chart& chart);
/// A chart for PGFPlots: a tikzpicture with its data inside.
/// @throws InputError for a kind of chart that has no such form
std::string pgfplots(const Section::Chart& chart);
/// A document of its own with such charts, one on each page.
std::string pgfplots_document(const std::string& charts);

}  // namespace ricochet
