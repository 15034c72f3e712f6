#include "reports/site/site_page.h"

#include <fmt/format.h>

#include <cctype>

#include "reports/markup.h"
#include "reports/render/json.h"

namespace ricochet {
namespace {

std::string contents_html(const SitePage& page, const std::vector<SiteGroup>& groups) {
  std::string html = "<nav aria-label=\"Contents\"><details class=\"contents\"><summary>Contents</summary>\n";
  for (const auto& group : groups) {
    bool is_here = group.pages.size() <= 3;
    for (const auto& other : group.pages) is_here |= other.path() == page.path();
    if (!group.title.empty())
      html += fmt::format("<details class=\"group\"{}><summary>{}</summary>", is_here ? " open" : "",
                          escape_html(group.title));
    html += "<ul>\n";
    for (const auto& other : group.pages) {
      html += fmt::format("<li><a href=\"{}{}\"{}>{}</a></li>\n", page.root(), other.path(),
                          other.path() == page.path() ? " aria-current=\"page\"" : "",
                          escape_html(other.label.empty() ? other.title : other.label));
    }
    html += group.title.empty() ? "</ul>\n" : "</ul></details>\n";
  }
  return html + "</details></nav>\n";
}

}  // namespace

std::string site_html(const SitePage& page, const std::vector<SiteGroup>& groups) {
  const std::string root = page.root();
  std::string head = fmt::format(
      "<!doctype html>\n<html lang=\"en\"><head><meta charset=\"utf-8\"><meta name=\"viewport\" "
      "content=\"width=device-width, initial-scale=1\"><meta name=\"color-scheme\" content=\"light dark\">"
      "<title>{} - Ricochet</title><link rel=\"stylesheet\" href=\"{}assets/site.css\">",
      escape_html(page.title), root);
  if (page.has_equations)
    head += fmt::format(
        "<link rel=\"stylesheet\" href=\"{0}assets/equations.css\">"
        "<script defer src=\"{0}assets/equations.js\"></script>",
        root);
  return head + fmt::format(
                    "<script defer src=\"{0}assets/site.js\"></script></head>\n<body>"
                    "<a class=\"skip\" href=\"#content\">To the content</a>\n"
                    "<header><a class=\"name\" href=\"{0}index.html\">Ricochet</a>"
                    "<span>methods for rigid-body motion with impacts and friction</span></header>\n"
                    "<div class=\"columns\">{1}<main id=\"content\"><h1>{2}</h1>\n{3}</main></div></body></html>\n",
                    root, contents_html(page, groups), escape_html(page.title), page.html);
}

std::string site_heading(const std::string& text, const std::string& id, int level) {
  return fmt::format(
      "<h{0} id=\"{1}\">{2} <a class=\"anchor\" href=\"#{1}\" aria-label=\"Link to: {2}\">#</a></h{0}>\n", level, id,
      escape_html(text));
}

std::string script_json(const nlohmann::json& data) {
  std::string text = data.dump();
  for (std::size_t at = 0; (at = text.find("</", at)) != std::string::npos; at += 3) text.insert(at + 1, "\\");
  return text;
}

std::string site_chart(const Section::ShownChart& shown, const std::string& stills, const std::string& links) {
  const Chart& chart = shown.chart;
  std::string kind = shown.kind, script;
  if (kind.empty() && is_interactive(chart)) kind = "curves";
  if (!kind.empty()) {
    nlohmann::json data = shown.data;
    data.update(chart_json(chart));
    script =
        fmt::format("<div class=\"drawing\"></div><script type=\"application/json\">{}</script>", script_json(data));
  }
  const std::string drawn = kind.empty() ? "" : fmt::format(" class=\"chart\" data-chart=\"{}\"", kind);
  return fmt::format("<figure{} aria-label=\"{}\">{}{}<figcaption>{}</figcaption><p class=\"links\">{}</p></figure>\n",
                     drawn, escape_html(chart.title), stills, script, escape_html(chart.caption), links);
}

std::string site_links(const SiteLinks& links) {
  std::string html;
  for (const auto& [text, address] : links)
    html += fmt::format("<a href=\"{}\">{}</a> ", escape_html(address), escape_html(text));
  return html.empty() ? "" : "<p class=\"links\">" + html + "</p>\n";
}

std::string site_table(const Table& table, const std::string& id, const SiteLinks& links, bool is_long) {
  const std::string html =
      fmt::format("<div id=\"{}\" class=\"block\">{}{}</div>\n", id, table.html(), site_links(links));
  if (!is_long) return html;
  return fmt::format("<details class=\"long\"><summary>{} ({} rows)</summary>{}</details>\n", escape_html(table.title),
                     table.rows.size(), html);
}

std::string site_id(const std::string& text) {
  std::string id;
  for (const char c : text) {
    const bool is_kept = std::isalnum(static_cast<unsigned char>(c)) || c == '_' || c == '-';
    if (is_kept)
      id += c;
    else if (!id.empty() && id.back() != '-')
      id += '-';
  }
  return id;
}

}  // namespace ricochet
