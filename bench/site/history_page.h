#pragma once

#include <string>
#include <vector>

#include "reports/site/site_page.h"

namespace ricochet {

/// Changes of the program commit by commit, from the folder that ./run history writes (bench/tools/history/make_history).
/// @throws InputError if the folder contains no history, or a damaged one
SitePage history_page(const std::string& folder);

/// The same as a list: none for an empty name of a folder.
std::vector<SitePage> history_pages(const std::string& folder);

}  // namespace ricochet
