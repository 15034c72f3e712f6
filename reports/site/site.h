#pragma once

#include <string>
#include <vector>

#include "reports/section.h"
#include "reports/site/site_page.h"

namespace ricochet {

/// Writes the site of results into `folder`: index.html, whose first screen says what to choose, a page per experiment
/// with the CSV of each table and each figure as SVG, the pages of `more`, and what they share (assets/). Pages of a group
/// without a title stand beside the first. It works from a disk, without a server and without a network; every page is
/// loaded when it is asked for, and has a style for paper.
/// @param with_pdf  what gnuplot draws is there as PDF, too
/// @return the path of index.html
/// @throws InputError when the folder cannot be written, or two results are of one experiment (results_list.h)
std::string write_site(const std::vector<ShownResults>& list, const std::vector<SiteGroup>& more,
                       const std::string& folder, bool with_pdf = false);

}  // namespace ricochet
