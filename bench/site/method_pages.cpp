#include "bench/site/method_pages.h"

#include <fmt/format.h>

#include <algorithm>
#include <map>

#include "bench/site/site_texts.h"
#include "bench/studies/hard_cases/hard_cell.h"
#include "bench/studies/verify/scorecard.h"
#include "methods/registry.h"
#include "problems/registry.h"
#include "reports/markup.h"

namespace ricochet {
namespace {

const char* const kMethodFolder = "methods";

/// Rows of one kind in all results, by the name of their method.
template <class Row>
class RowsByMethod {
 public:
  explicit RowsByMethod(const std::vector<ShownResults>& list) {
    for (const auto& shown : list) {
      for (auto& row : shown.results.all<Row>()) {
        const std::string method = MethodSpec(row.method).name();
        rows_[method].push_back(std::move(row));
      }
    }
  }
  const std::vector<Row>& of(const std::string& method) const {
    static const std::vector<Row> none;
    const auto found = rows_.find(method);
    return found == rows_.end() ? none : found->second;
  }

 private:
  std::map<std::string, std::vector<Row>> rows_;
};

/// Results that pages of methods show.
struct MethodResults {
  RowsByMethod<CheckRow> checks;
  RowsByMethod<HardCell> hard_cases;
};

std::string yes(bool is_so) {
  return is_so ? "yes" : "no";
}

std::string examples_html(const MethodEntry& entry) {
  using I = MethodInfo;
  static const std::vector<Column<I>> columns = {
      {"method", &I::id},
      {"title", &I::title},
      {"order, smooth", "", "{:g}", &I::order_smooth},
      {"order, impacts", "", "{:g}", &I::order_impacts},
      {"error-controlled", [](const I& i) { return yes(i.is_adaptive); }},
      {"derivatives", [](const I& i) { return yes(i.has_sensitivities); }},
      {"steps allocate", [](const I& i) { return yes(!i.is_allocation_free); }},
      {"source", &I::source},
  };
  std::vector<I> infos;
  for (const auto& example : entry.examples) infos.push_back(make_method(example)->info());
  return table_of("Examples", columns, infos, "Orders are claims; the scorecard holds them against measured ones.")
      .html();
}

std::string options_html(const MethodEntry& entry) {
  using O = MethodOption;
  static const std::vector<Column<O>> columns = {
      {"option", &O::name}, {"default", &O::fallback}, {"allowed", &O::allowed}};
  const auto options = options_of(entry);
  return options.empty() ? "" : table_of("Options", columns, options).html();
}

/// Scenes that it declines, with the reason: its limits, as it states them itself.
std::string limits_html(const MethodEntry& entry, const std::vector<ProblemInfo>& problems) {
  struct Limit {
    std::string method, problem, reason;
  };
  static const std::vector<Column<Limit>> columns = {
      {"method", &Limit::method}, {"problem", &Limit::problem}, {"why not", &Limit::reason}};
  std::vector<Limit> limits;
  for (const auto& example : entry.examples) {
    const auto method = make_method(example);
    for (const auto& problem : problems) {
      const Support support = method->supports(problem);
      if (!support.ok) limits.push_back({example, problem.id, support.reason});
    }
  }
  if (limits.empty()) return "<p>It declines none of the scenes.</p>\n";
  return site_table(table_of("Scenes that it declines", columns, limits), "declined", {}, limits.size() > 20);
}

std::string scorecard_html(const std::vector<CheckRow>& rows) {
  if (rows.empty()) return "<p>No results of <code>ricochet run-experiment verify</code> are on this site.</p>\n";
  const Table failures = check_table(rows, true);
  return scorecard_table(rows).html() +
         (failures.rows.empty() ? "" : site_table(failures, "failures", {}, failures.rows.size() > 12));
}

std::string hard_cases_html(const std::vector<HardCell>& cells) {
  if (cells.empty()) return "<p>No results of <code>ricochet run-experiment hard_cases</code> are on this site.</p>\n";
  using C = HardCell;
  static const std::vector<Column<C>> columns = {
      {"method", &C::method},       {"verdict", [](const C& c) { return text_of(c.verdict()).word; }},
      {"case", &C::scene},          {"because", [](const C& c) { return decisive_number(c.verdict(), c); }},
      {"repeat with", &C::command},
  };
  Table table = table_of("Verdicts", columns, cells);
  table.filters = {0, 1};
  return site_table(table, "verdicts", {}, cells.size() > 30);
}

std::string scheme_html(const MethodEntry& method) {
  const auto scheme = scheme_of(method);
  if (!scheme || scheme->text.empty()) return "";
  return site_heading("The scheme", "scheme") +
         fmt::format("<pre class=\"scheme\" tabindex=\"0\">{}</pre>\n<p class=\"links\">From {}</p>\n",
                     escape_html(scheme->text), escape_html(scheme->file));
}

std::string sources_html(const std::string& method) {
  const std::string sources = sources_of(method);
  if (sources.empty()) return "";
  return site_heading("To cite", "cite") + fmt::format("<pre tabindex=\"0\">{}</pre>\n", escape_html(sources));
}

SitePage page_of(const MethodEntry& entry, const MethodResults& results, const std::vector<ProblemInfo>& problems) {
  SitePage page{.folder = kMethodFolder,
                .id = entry.name,
                .title = entry.summary,
                .label = entry.name,
                .html = "",
                .has_equations = true};
  page.html = fmt::format("<p class=\"links\"><code>{}</code></p>\n", escape_html(entry.usage));
  if (!entry.make) {
    page.html += fmt::format("<p class=\"warning\">Not built: {}</p>\n", escape_html(entry.not_built)) +
                 scheme_html(entry) + sources_html(entry.name);
    return page;
  }
  page.html += examples_html(entry) + options_html(entry) + scheme_html(entry) + sources_html(entry.name);
  page.html += site_heading("Limits", "limits") + limits_html(entry, problems);
  page.html += site_heading("Scorecard", "scorecard") + scorecard_html(results.checks.of(entry.name));
  page.html += site_heading("Hard cases", "hard-cases") + hard_cases_html(results.hard_cases.of(entry.name));
  return page;
}

}  // namespace

SiteGroup method_pages(const std::vector<ShownResults>& list) {
  std::vector<ProblemInfo> problems;
  for (const auto& scene : scenes()) problems.push_back(make_problem(scene.id)->info());
  const MethodResults results{RowsByMethod<CheckRow>(list), RowsByMethod<HardCell>(list)};
  SiteGroup group{"Methods", {}};
  for (const auto& entry : methods()) group.pages.push_back(page_of(entry, results, problems));
  return group;
}

}  // namespace ricochet
