#pragma once

#include <string>
#include <vector>

#include "reports/section.h"

namespace ricochet {

/// Writes a Markdown page of the tables of results, from the results files only, so that no number in it is older than
/// the data: per study a heading, a sentence, its tables, how many runs failed, and the command, program and machine
/// that the numbers come from. Long tables are cut; every table is a CSV in `tables`.
/// @param path    of the page  @param tables  folder of the CSV files
/// @throws InputError when a file cannot be written
void write_results_page(const std::vector<ShownResults>& list, const std::string& path, const std::string& tables);

}  // namespace ricochet
