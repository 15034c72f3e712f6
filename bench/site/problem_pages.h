#pragma once

#include <vector>

#include "reports/section.h"
#include "reports/site/site_page.h"

namespace ricochet {

/// A page for each compiled scene: its equations as the program has them, what is hard about it, its source, parameters
/// and contacts, the events of its motion, and which methods can run it.
SiteGroup problem_pages(const std::vector<ShownResults>& list);

}  // namespace ricochet
