#include "bench/site/citation.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <filesystem>
#include <regex>
#include <sstream>

#include "bench/experiment/data_folder.h"
#include "bench/measure/environment.h"
#include "reports/markup.h"
#include "reports/text_file.h"

namespace ricochet {
namespace {

/// The names in a line of an entry, "ricochet = {fesd, fesd_adaptive}".
std::vector<std::string> names_in(const std::string& line) {
  static const std::regex word("[a-z0-9_]+");
  std::vector<std::string> names;
  for (std::sregex_iterator found(line.begin(), line.end(), word), end; found != end; ++found)
    names.push_back(found->str());
  return names;
}

/// The value of a line "name: value" of CITATION.cff, the first one.
std::string field_of(const std::string& file, const std::string& name) {
  std::istringstream lines(file);
  for (std::string line; std::getline(lines, line);) {
    if (!line.starts_with(name + ": ")) continue;
    const std::string value = line.substr(name.size() + 2);
    return value.starts_with('"') ? value.substr(1, value.size() - 2) : value;
  }
  return "";
}

std::vector<Source> read_sources() {
  std::istringstream file(read_text(std::filesystem::path(data_folder()) / "methods/sources.bib"));
  std::vector<Source> list;
  Source source;
  for (std::string line; std::getline(file, line);) {
    if (line.starts_with("@")) source = {};
    if (line.starts_with("  ricochet = "))
      source.methods = names_in(line.substr(line.find('{')));  // the last field, which BibTeX does not know
    else
      source.entry += line + "\n";
    if (line == "}") list.push_back(source);
  }
  return list;
}

}  // namespace

const std::vector<Source>& sources() {
  static const std::vector<Source> list = read_sources();
  return list;
}

std::string sources_of(const std::string& method) {
  std::string text;
  for (const Source& source : sources()) {
    if (std::ranges::find(source.methods, method) != source.methods.end())
      text += (text.empty() ? "" : "\n") + source.entry;
  }
  return text;
}

std::string program_entry() {
  const std::string file = read_text(std::filesystem::path(data_folder()) / "CITATION.cff");
  const std::string title = field_of(file, "title"), author = field_of(file, "  - name"),
                    released = field_of(file, "date-released");
  std::string entry = "@software{ricochet,\n";
  const auto add = [&](const std::string& name, const std::string& value) {
    if (!value.empty()) entry += fmt::format("  {} = {{{}}},\n", name, value);
  };
  add("author", author.empty() ? "" : "{" + author + "}");
  add("title", title.empty() ? "Ricochet" : title);
  add("version", field_of(file, "version"));
  add("year", released.substr(0, released.find('-')));
  return entry + fmt::format("  note = {{{}}}\n}}\n", version_text());
}

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

}  // namespace ricochet
