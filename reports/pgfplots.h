#pragma once

#include <string>
#include <vector>

#include "reports/section.h"

namespace ricochet {

/// Whether pgfplots() knows this kind of chart: "work_precision", "profile", "curves".
bool has_pgfplots(const Section::Chart& chart);

/// A file of numbers that a picture reads.
struct PgfplotsData {
  std::string file, text;
};

/// A chart for PGFPlots, a tikzpicture per panel. @throws InputError for a kind of chart that has no such form
/// @param data  null: the numbers stand in the pictures; else there is a file for each of them here, STEM.dat, or
///              STEM_2.dat and so on for those behind the first
std::string pgfplots(const Section::Chart& chart, std::vector<PgfplotsData>* data = nullptr,
                     const std::string& stem = "");
/// A document of its own with such charts, one on each page.
std::string pgfplots_document(const std::string& charts);

}  // namespace ricochet
