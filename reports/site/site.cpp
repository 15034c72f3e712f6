#include "reports/site/site.h"

#include <fmt/format.h>

#include <filesystem>
#include <type_traits>

#include "problems/input_error.h"
#include "reports/assets.h"
#include "reports/export.h"
#include "reports/markup.h"
#include "reports/render/csv.h"
#include "reports/render/gnuplot.h"
#include "reports/results_list.h"
#include "reports/site/motion_csv.h"
#include "reports/text_file.h"

namespace ricochet {
namespace {

namespace fs = std::filesystem;

const char* const kResultsFolder = "experiments";

std::string warning(const std::string& text) {
  return fmt::format("<p class=\"warning\">{}</p>\n", escape_html(text));
}

/// Command that repeats the results above it.
std::string command_html(const Results& results) {
  const std::string command = results.header.value("command", "");
  return command.empty() ? "" : fmt::format("<code class=\"command\">{}</code>", escape_html(command));
}

/// A drawn figure, as an image of its own file.
std::string still_html(const Figure& figure) {
  return fmt::format("<img class=\"still\" src=\"{}\" alt=\"{}\" loading=\"lazy\">", escape_html(figure.file),
                     escape_html(figure.title + ". " + figure.caption));
}

/// Links to what a figure is drawn by: the picture, and the script of gnuplot with its numbers where there is one.
std::string figure_links(const Figure& figure, const fs::path& folder) {
  std::string links = fmt::format("<a href=\"{}\">SVG</a> ", escape_html(figure.file));
  const std::string script = fs::path(figure.file).replace_extension(".gp");
  if (fs::exists(folder / script))
    links += fmt::format("<a href=\"{}\">gnuplot, with its data</a> ", escape_html(script));
  return links;
}

/// In the folder of results: "two_balls_order_orders.tex".
std::string file_of(const Results& results, const std::string& table, const char* extension) {
  return fmt::format("{}_{}.{}", results.experiment(), table, extension);
}

/// The page of one results file.
class ResultsPage {
 public:
  ResultsPage(const ShownResults& shown, const FigureFolder& figures, fs::path folder, bool draw)
      : results_(shown.results), figures_(figures), folder_(std::move(folder)), draw_(draw) {
    page_.folder = kResultsFolder;
    page_.id = site_id(results_.experiment());
    page_.title = results_.title();
    page_.label = results_.experiment();
    page_.html = fmt::format("<p class=\"lead\">{}</p>\n", escape_html(results_.header.value("description", "")));
    for (const auto& sentence : warnings(results_)) page_.html += warning(sentence);
    if (results_.header.value("quick", false))
      page_.html += warning("Quick run: long runs are left out and times are measured three times only.");
    for (const auto& part : shown.section.parts()) std::visit([&](const auto& p) { add(p); }, part);
    add_provenance();
  }

  const SitePage& page() const { return page_; }

 private:
  std::string csv_of(const std::string& table) const { return file_of(results_, table, "csv"); }

  /// A link to the numbers of a figure; without any, to those of all runs.
  std::string csv_link(std::string file, const std::string& csv) const {
    if (csv.empty() && results_.rows.empty()) return "";
    if (csv.empty())
      file = csv_of("all_digits");
    else
      write_text("report file", folder_ / file, csv);
    return fmt::format("<a href=\"{}\">CSV</a> ", escape_html(file));
  }

  void add(const Section::NamedTable& named) {
    if (named.role == Section::Role::summary) return;
    write_text("report file", folder_ / csv_of(named.name), named.table.csv());
    const bool is_long = named.role == Section::Role::details || named.table.rows.size() > kLong;
    SiteLinks links = {{"CSV", csv_of(named.name)}};
    if (!is_long || named.role == Section::Role::choice) {
      const std::string tex = file_of(results_, named.name, "tex");
      write_text("report file", folder_ / tex,
                 latex(named.table, fmt::format("tab:{}_{}", results_.experiment(), named.name)));
      links.emplace_back("LaTeX", tex);
    }
    page_.html += site_table(named.table, site_id(named.name), links, is_long);
  }
  void add(const Section::Drawings& drawings) {
    const auto list = drawings.draw(figures_);
    page_.html += list.size() > 1 ? "<div class=\"figures\">\n" : "<div>\n";
    for (const auto& figure : list) {
      const std::string file = fs::path(figure.file).stem().string() + "_drawn.csv";
      page_.html +=
          fmt::format("<figure>{}<figcaption>{}</figcaption><p class=\"links\">{}{}{}</p></figure>\n",
                      still_html(figure), escape_html(figure.caption), csv_link(file, motion_csv(figure.motion)),
                      figure_links(figure, folder_), command_html(results_));
    }
    page_.html += "</div>\n";
  }
  void add(const Section::Heading& heading) { page_.html += site_heading(heading.text, site_id(heading.text)); }
  /// The pictures of a chart, which stay where the site's scripts do not draw it.
  void add(const Section::ShownChart& shown) {
    const Chart& chart = shown.chart;
    const bool has_numbers = !chart.panels.empty();
    std::string stills, links = csv_link(chart.file + "_drawn.csv", has_numbers ? chart_csv(chart) : "");
    if (draw_ && has_numbers) {
      for (const auto& figure : draw_chart(figures_, chart)) {
        stills += still_html(figure);
        links += figure_links(figure, folder_);
      }
    }
    if (has_pgfplots(chart)) {
      const std::string tex = file_of(results_, chart.name + "_pgfplots", "tex");
      write_text("report file", folder_ / tex, pgfplots_document(pgfplots(chart)));
      links += fmt::format("<a href=\"{}\">PGFPlots</a> ", escape_html(tex));
    }
    page_.html += site_heading(chart.title, chart.name);
    page_.html += site_chart(shown, stills, links + command_html(results_));
  }

  void add_provenance() {
    page_.html += site_heading("Where it was measured, and how to repeat it", "environment");
    copy_results(results_, folder_);
    SiteLinks links = {{"every run, as JSON lines", fs::path(results_.path).filename().string()}};
    if (!results_.rows.empty()) {
      const std::string runs = file_of(results_, "all_digits", "csv");
      write_text("report file", folder_ / runs, tidy_csv(results_));
      links.emplace_back("every run, as CSV with all digits", runs);
    }
    page_.html += site_links(links);
    page_.html += "<pre tabindex=\"0\">" + escape_html(results_.header.value("command", "")) + "\n";
    const nlohmann::json environment = results_.header.value("environment", nlohmann::json::object());
    for (const auto& [key, value] : environment.items()) {
      const std::string text = value.is_string() ? value.get<std::string>() : value.dump();
      page_.html += escape_html(fmt::format("{:<18} {}\n", key, text));
    }
    page_.html += "</pre>\n";
  }

  static constexpr std::size_t kLong = 60;  // rows of a table that is opened when it is asked for

  const Results& results_;
  const FigureFolder& figures_;
  fs::path folder_;
  bool draw_;
  SitePage page_;
};

/// First page: recommendations of all studies that have some, then a list of all results.
SitePage first_page(const std::vector<ShownResults>& list, const std::vector<SiteGroup>& groups) {
  SitePage page{.folder = "", .id = "index", .title = "Which method to take", .label = "What to choose", .html = ""};
  std::vector<std::pair<const ShownResults*, const Section::NamedTable*>> choices;
  for (const auto& shown : list) {
    for (const auto* named : shown.section.tables()) {
      if (named->role == Section::Role::choice) choices.emplace_back(&shown, named);
    }
  }
  // Tables that distinguish more classes of scenes come first.
  std::ranges::stable_sort(choices, std::greater(), [](const auto& c) { return c.second->table.rows.size(); });
  for (const auto& [shown, named] : choices) {
    const std::string id = site_id(shown->results.experiment());
    const auto file = [&, shown = shown, named = named](const char* extension) {
      return fmt::format("{}/{}", kResultsFolder, file_of(shown->results, named->name, extension));
    };
    page.html += site_heading(shown->results.title(), id);
    Table table = named->table;  // of several experiments, whose tables have the same title
    table.title += ": " + shown->results.experiment();
    page.html += fmt::format(
        "<div class=\"choice\">{}<script type=\"application/json\">{}</script></div>\n"
        "<p class=\"links\"><a href=\"{}/{}.html\">All of this experiment</a> {}</p>\n",
        site_table(table, id + "_" + site_id(named->name), {{"CSV", file("csv")}, {"LaTeX", file("tex")}}, false),
        script_json(named->data), kResultsFolder, id, command_html(shown->results));
  }
  if (page.html.empty())
    page.html = "<p class=\"lead\">No results say which method to take: opponents and classes do.</p>\n";
  for (const auto& group : groups) {
    if (group.title.empty()) continue;
    page.html += site_heading(group.title, site_id(group.title)) + "<ul class=\"cards\">\n";
    for (const auto& other : group.pages) {
      page.html += fmt::format("<li><a href=\"{}\">{}</a> <span>{}</span></li>\n", other.path(),
                               escape_html(other.label.empty() ? other.title : other.label),
                               other.label.empty() ? "" : escape_html(other.title));
    }
    page.html += "</ul>\n";
  }
  return page;
}

/// One line per results file: when, where, with what.
SitePage environment_page(const std::vector<ShownResults>& list) {
  using S = ShownResults;
  const auto of_header = [](const char* field) {
    return [=](const S& s) {
      return s.results.header.value("environment", nlohmann::json::object()).value(field, "unknown");
    };
  };
  const std::vector<Column<S>> columns = {
      {"experiment", [](const S& s) { return s.results.experiment(); }},
      {"date", of_header("date")},
      {"revision", of_header("revision")},
      {"processor", of_header("processor")},
      {"governor", of_header("governor")},
      {"compiler", of_header("compiler")},
      {"flags", of_header("flags")},
      {"command", [](const S& s) { return s.results.header.value("command", ""); }},
  };
  return {.folder = "",
          .id = "environment",
          .title = "Where it was measured",
          .label = "Environment",
          .html = table_of("Results of this site", columns, list).html()};
}

}  // namespace

std::string write_site(const std::vector<ShownResults>& list, const std::vector<SiteGroup>& more,
                       const std::string& folder, bool with_pdf) {
  require_different(list);
  const fs::path root = folder, results = root / kResultsFolder;
  const FigureFolder figures(results.string(), with_pdf);
  const bool draw = can_draw();
  if (!draw) fmt::print(stderr, "report: gnuplot was not found: figures are missing\n");
  SiteGroup experiments{"Experiments", {}};
  for (const auto& shown : list) experiments.pages.push_back(ResultsPage(shown, figures, results, draw).page());
  std::vector<SiteGroup> groups = {experiments};
  SiteGroup top{"", {environment_page(list)}};
  for (const auto& group : more) {
    if (group.title.empty())
      top.pages.insert(top.pages.end(), group.pages.begin(), group.pages.end());
    else
      groups.push_back(group);
  }
  top.pages.insert(top.pages.begin(), first_page(list, groups));
  groups.insert(groups.begin(), top);
  for (const auto& group : groups) {
    for (const auto& page : group.pages) {
      fs::create_directories(root / page.folder);
      write_text("site", root / page.path(), site_html(page, groups));
    }
  }
  fs::create_directories(root / "assets");
  const std::pair<const char*, const char*> assets[] = {{"site.css", assets::kSiteStyle},
                                                        {"site.js", assets::kSiteScript},
                                                        {"equations.css", assets::kEquationStyle},
                                                        {"equations.js", assets::kEquationScript}};
  for (const auto& [name, text] : assets) write_text("site", root / "assets" / name, text);
  return (root / "index.html").string();
}

}  // namespace ricochet
