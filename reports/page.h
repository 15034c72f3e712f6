#pragma once

#include <string>
#include <vector>

#include "reports/section.h"

namespace ricochet {

/// Writes the report of results into `folder`: index.html (figures inside, opens without a server), report.md, one CSV
/// per table, the figures as SVG, and a copy of the results files. @return the path of index.html
/// @param with_pdf  the figures as PDF, too
/// @throws InputError when the folder cannot be written, or two results are of one experiment (results_list.h)
std::string write_page(const std::vector<ShownResults>& list, const std::string& folder, bool with_pdf = false);

}  // namespace ricochet
