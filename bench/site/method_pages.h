#pragma once

#include <vector>

#include "reports/section.h"
#include "reports/site/site_page.h"

namespace ricochet {

/// A page for each method that is registered: what it is, its source and orders, its options, the scheme as its file
/// states it, what it declines and why, and what the results of `list` say of it: its scorecard and its hard cases.
SiteGroup method_pages(const std::vector<ShownResults>& list);

}  // namespace ricochet
