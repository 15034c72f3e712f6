#include "bench/site/report_site.h"

#include "bench/site/method_pages.h"
#include "bench/site/problem_pages.h"
#include "reports/site/site.h"

namespace ricochet {

std::string write_report_site(const std::vector<ShownResults>& list, const std::string& folder) {
  return write_site(list, {method_pages(list), problem_pages(list)}, folder + "/site");
}

}  // namespace ricochet
