#include "bench/site/report_site.h"

#include "bench/site/citation.h"
#include "bench/site/method_pages.h"
#include "bench/site/problem_pages.h"
#include "reports/site/site.h"

namespace ricochet {

std::string write_report_site(const std::vector<ShownResults>& list, const std::string& folder,
                              const std::vector<SitePage>& more, bool with_pdf) {
  SiteGroup top{"", {citation_page()}};
  top.pages.insert(top.pages.end(), more.begin(), more.end());
  return write_site(list, {top, method_pages(list), problem_pages(list)}, folder, with_pdf);
}

}  // namespace ricochet
