#pragma once

#include <string>
#include <vector>

#include "reports/section.h"

namespace ricochet {

/// Results that stand on one page: what is written of each is named after its experiment, and its file keeps its name.
/// @throws InputError where two are of one experiment, or two files have one name
void require_different(const std::vector<ShownResults>& list);

/// Puts a results file into a folder; one that is there already stays. @throws InputError when it cannot be written
void copy_results(const Results& results, const std::string& folder);

}  // namespace ricochet
