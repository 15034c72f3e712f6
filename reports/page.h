#pragma once

#include <string>
#include <vector>

#include "reports/record.h"

namespace ricochet {

/// Writes the report of results files into `folder`: index.html (figures inside, opens without a server), report.md,
/// one CSV per table, the figures as SVG, and a copy of the results. @return the path of index.html
/// @throws InputError when the folder cannot be written
std::string write_report(const std::vector<std::string>& results_paths, const std::string& folder);

/// Writes a page with nothing but the animation of a run that has a picture: PROBLEM.html. @return its path
std::string write_animation(const ControlRun& run, const std::string& folder);

}  // namespace ricochet
