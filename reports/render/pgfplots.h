#pragma once

#include <string>
#include <vector>

#include "reports/chart.h"

namespace ricochet {

/// Whether PGFPlots can draw it: everything but cells.
bool has_pgfplots(const Chart& chart);

/// A file of numbers that a picture reads.
struct PgfplotsData {
  std::string file, text;
};

/// A chart for PGFPlots, a tikzpicture per panel.
/// @param data  null: the numbers stand in the pictures; else there is a file for each of them here, STEM.dat, or
///              STEM_2.dat and so on for those after the first
std::string pgfplots(const Chart& chart, std::vector<PgfplotsData>* data = nullptr, const std::string& stem = "");
/// A document of its own with such charts, one on each page.
std::string pgfplots_document(const std::string& charts);

}  // namespace ricochet
