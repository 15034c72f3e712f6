#include "bench/site/citation.h"

#include <fmt/format.h>

#include <filesystem>
#include <regex>
#include <sstream>

#include "bench/data_folder.h"
#include "bench/environment.h"
#include "methods/registry.h"
#include "reports/markup.h"
#include "reports/text_file.h"

namespace ricochet {
namespace {

/// Whether a line of an entry, "ricochet = {fesd, fesd_adaptive}", names the method.
bool is_named_in(const std::string& line, const std::string& method) {
  static const std::regex word("[a-z0-9_]+");
  for (std::sregex_iterator found(line.begin(), line.end(), word), end; found != end; ++found) {
    if (found->str() == method) return true;
  }
  return false;
}

}  // namespace

std::string sources_of(const std::string& method) {
  std::istringstream file(read_text(std::filesystem::path(data_folder()) / "methods/sources.bib"));
  std::string sources, entry;
  bool is_wanted = false;
  for (std::string line; std::getline(file, line);) {
    if (line.starts_with("@")) {
      entry.clear();
      is_wanted = false;
    }
    if (line.starts_with("  ricochet = "))
      is_wanted = is_named_in(line.substr(line.find('{')), method);  // the last field, which BibTeX does not know
    else
      entry += line + "\n";
    if (line == "}" && is_wanted) sources += (sources.empty() ? "" : "\n") + entry;
  }
  return sources;
}

SitePage citation_page() {
  const std::string program = fmt::format(
      "@software{{ricochet,\n  author = {{{{The Ricochet authors}}}},\n  title = {{Ricochet: a benchmark suite for "
      "rigid-body motion with impacts and friction}},\n  note = {{{}}}\n}}\n",
      version_text());
  SitePage page{.folder = "", .id = "cite", .title = "To cite", .label = "To cite", .html = ""};
  page.html = fmt::format(
      "<p class=\"lead\">Please cite the program, and the sources of the methods that you used. Below every table is the "
      "same table as LaTeX (booktabs), below a chart the same chart as PGFPlots.</p>\n<pre tabindex=\"0\">{}</pre>\n",
      escape_html(program));
  for (const auto& entry : methods()) {
    const std::string sources = sources_of(entry.name);
    if (sources.empty()) continue;
    page.html +=
        site_heading(entry.name, entry.name) + fmt::format("<pre tabindex=\"0\">{}</pre>\n", escape_html(sources));
  }
  return page;
}

}  // namespace ricochet
