#include "bench/site/report_site.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "bench/site/method_pages.h"
#include "bench/site/problem_pages.h"
#include "bench/site/site_texts.h"
#include "reports/markup.h"
#include "reports/site/site.h"

namespace ricochet {
namespace {

/// Page with the citations of this program and of the source of each method.
SitePage citation_page() {
  SitePage page{.folder = "", .id = "cite", .title = "To cite", .label = "To cite", .html = ""};
  page.html = fmt::format(
      "<p class=\"lead\">Please cite the program, and the sources of the methods that you used. Below every table is the "
      "same table as LaTeX (booktabs), below a chart the same chart as PGFPlots.</p>\n<pre tabindex=\"0\">{}</pre>\n",
      escape_html(program_entry()));
  for (const Source& source : sources()) {
    if (source.methods.empty()) continue;
    const std::string names = fmt::format("{}", fmt::join(source.methods, ", "));
    const auto key = source.entry.find('{') + 1;
    page.html += site_heading(names, source.entry.substr(key, source.entry.find(',') - key));
    page.html += fmt::format("<pre tabindex=\"0\">{}</pre>\n", escape_html(source.entry));
  }
  return page;
}

}  // namespace

std::string write_report_site(const std::vector<ShownResults>& list, const std::string& folder,
                              const std::vector<SitePage>& more, bool with_pdf) {
  SiteGroup top{"", {citation_page()}};
  top.pages.insert(top.pages.end(), more.begin(), more.end());
  return write_site(list, {top, method_pages(list), problem_pages(list)}, folder, with_pdf);
}

}  // namespace ricochet
