#pragma once

#include <string>
#include <vector>

#include "reports/section.h"
#include "reports/site/site_page.h"

namespace ricochet {

/// The site of results (reports/site/site.h), with a page for each method and each problem of this program.
/// @param more  pages beside that of citations: history_pages()
/// @return the path of its index.html  @throws InputError when it cannot be written
std::string write_report_site(const std::vector<ShownResults>& list, const std::string& folder,
                              const std::vector<SitePage>& more = {}, bool with_pdf = false);

}  // namespace ricochet
