#include "bench/site/history_page.h"

#include <fmt/format.h>

#include <filesystem>
#include <nlohmann/json.hpp>

#include "problems/input_error.h"
#include "reports/chart.h"
#include "reports/markup.h"
#include "reports/section.h"
#include "reports/text_file.h"

namespace ricochet {
namespace {

using nlohmann::json;

constexpr std::size_t kShown = 8;  // changes of a commit that are read at once

std::string list_of(const json& changes, std::size_t from, std::size_t to) {
  std::string html = "<ul>\n";
  for (std::size_t k = from; k < std::min(to, changes.size()); ++k)
    html += fmt::format("<li>{}</li>\n", escape_html(changes[k].at("text")));
  return html + "</ul>\n";
}

std::string commit_html(const json& entry) {
  const std::string commit = entry.at("commit");
  const json& changes = entry.at("changes");
  std::string html =
      site_heading(fmt::format("{} {}", entry.at("date").get<std::string>(), commit), "commit-" + site_id(commit));
  html += fmt::format("<p>{}</p>\n", escape_html(entry.at("subject")));
  html += fmt::format("<p>{} rows, {} quantities changed.</p>\n", entry.at("rows").get<int>(), changes.size());
  html += list_of(changes, 0, kShown);
  if (changes.size() > kShown)
    html += fmt::format("<details><summary>{} more</summary>{}</details>\n", changes.size() - kShown,
                        list_of(changes, kShown, changes.size()));
  std::string verdicts;
  for (const auto& [word, n] : entry.at("verdicts").items())
    verdicts += fmt::format("{}{} {}", verdicts.empty() ? "" : ", ", n.get<int>(), escape_html(word));
  return verdicts.empty() ? html : html + fmt::format("<p>Hard cases: {}.</p>\n", verdicts);
}

/// @param panels  of the file curves.json
std::string chart_html(const json& history, const json& panels) {
  Chart chart{.name = "curves",
              .file = "history",
              .title = "What changed most, over the commits",
              .caption =
                  "Of each method the quantity that moved most, of the methods those that moved most. Rows that a "
                  "commit added are no change."};
  Chart::Axis commits{.label = "commit"};
  for (const auto& entry : history) {
    commits.names.push_back(entry.at("commit"));
    commits.links.push_back("#commit-" + site_id(commits.names.back()));
  }
  for (const auto& drawn : panels) {
    Chart::Panel& panel = chart.panels.emplace_back(Chart::Panel{
        .title = drawn.at("title"), .x = commits, .y = {.label = drawn.at("label"), .is_log = drawn.at("is_log")}});
    for (const auto& curve : drawn.at("curves"))
      panel.add(curve.at("label"), CurveLook::of(panel.series.size()), Chart::Drawn::both, curve.at("points"));
  }
  if (chart.panels.empty()) return "";
  return site_heading(chart.title, chart.name) +
         site_chart({chart, "", json::object()}, "", "<code class=\"command\">./run history</code>");
}

}  // namespace

SitePage history_page(const std::string& folder) try {
  const std::filesystem::path root = folder;
  const json history = json::parse(read_text(root / "history.json"));
  SitePage page{
      .folder = "", .id = "history", .title = "What changed, commit by commit", .label = "History", .html = ""};
  page.html =
      "<p class=\"lead\">Deterministic counters, errors and orders that the gate holds every commit to, and verdicts of "
      "the published hard cases. A commit that is not here changed none of them. No times: they are those of a machine, "
      "and lie, marked so, in the files of <code>./run history</code>.</p>\n";
  page.html += chart_html(history, json::parse(read_text(root / "curves.json")));
  for (auto entry = history.rbegin(); entry != history.rend(); ++entry) page.html += commit_html(*entry);
  return page;
} catch (const json::exception& error) {
  throw InputError("history", folder, fmt::format("a folder of ./run history is required: {}", error.what()));
}

std::vector<SitePage> history_pages(const std::string& folder) {
  return folder.empty() ? std::vector<SitePage>() : std::vector{history_page(folder)};
}

}  // namespace ricochet
