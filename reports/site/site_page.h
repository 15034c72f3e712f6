#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <utility>
#include <vector>

#include "reports/section.h"
#include "reports/table.h"

namespace ricochet {

/// A page of the site: where it is, and what is on it.
struct SitePage {
  std::string folder;          ///< "methods"; empty for those at the top
  std::string id;              ///< of the file, without .html
  std::string title;           ///< of the heading
  std::string label;           ///< in the contents; the title where it is empty
  std::string html;            ///< below the heading
  bool has_equations = false;  ///< elements of class "tex", which KaTeX typesets

  std::string path() const { return (folder.empty() ? "" : folder + "/") + id + ".html"; }
  /// Path from this page to the top folder: "../" or empty.
  std::string root() const { return folder.empty() ? "" : "../"; }
};

/// Pages that stand together in the contents.
struct SiteGroup {
  std::string title;
  std::vector<SitePage> pages;
};

/// The whole text of a page: head, contents with this page marked, body.
std::string site_html(const SitePage& page, const std::vector<SiteGroup>& groups);

/// "<h2 id=...>" with a link to itself.
std::string site_heading(const std::string& text, const std::string& id, int level = 2);

/// A table with links below. @param links  (text, address from the page): its files
using SiteLinks = std::vector<std::pair<std::string, std::string>>;
std::string site_table(const Table& table, const std::string& id, const SiteLinks& links, bool is_long);
/// A chart, which the site's scripts draw from its data if they can (src/site.js).
/// @param stills  HTML of the pictures that stand there without a script  @param links  HTML below its caption
std::string site_chart(const Section::ShownChart& shown, const std::string& stills, const std::string& links);
/// JSON inside of a script element, which the first "</" would end.
std::string script_json(const nlohmann::json& data);
/// "<p class=links>..." @return empty for none
std::string site_links(const SiteLinks& links);

/// For an anchor or a file: letters, digits, '-' and '_'.
std::string site_id(const std::string& text);

}  // namespace ricochet
