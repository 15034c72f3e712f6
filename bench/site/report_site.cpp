#include "bench/site/report_site.h"

#include "bench/site/citation.h"
#include "bench/site/history_page.h"
#include "bench/site/method_pages.h"
#include "bench/site/problem_pages.h"
#include "reports/site/site.h"

namespace ricochet {

std::string write_report_site(const std::vector<ShownResults>& list, const std::string& folder,
                              const std::string& history) {
  SiteGroup top{"", {citation_page()}};
  if (!history.empty()) top.pages.push_back(history_page(history));
  return write_site(list, {top, method_pages(list), problem_pages(list)}, folder + "/site");
}

}  // namespace ricochet
