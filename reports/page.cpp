#include "reports/page.h"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <sstream>

#include "problems/input_error.h"
#include "reports/animation.h"
#include "reports/figures.h"
#include "reports/tables.h"
#include "reports/verdict_matrix.h"

namespace ricochet {
namespace {

namespace fs = std::filesystem;

const char* const kStyle = R"(
:root { color-scheme: light; }
body { font: 16px/1.5 "Helvetica Neue", Helvetica, Arial, sans-serif; color: #222; margin: 2.5rem auto; max-width: 76rem; padding: 0 1.25rem; }
h1 { font-size: 1.7rem; margin-bottom: .2rem; }
h2 { font-size: 1.25rem; margin-top: 2.6rem; border-bottom: 1px solid #ddd; padding-bottom: .25rem; }
h3 { font-size: 1.05rem; margin-top: 2.2rem; }
p.lead { color: #555; max-width: 46rem; }
p.warning { background: #fff4e0; border-left: 4px solid #d94801; padding: .5rem .8rem; }
figure { margin: 1.4rem 0; }
figure svg { width: 100%; height: auto; }
figcaption { color: #555; font-size: .9rem; }
figure.table figcaption { color: #222; font-weight: 600; font-size: 1rem; margin-bottom: .4rem; }
.figures { display: grid; grid-template-columns: repeat(auto-fit, minmax(28rem, 1fr)); gap: 1rem 1.5rem; }
.scroll { overflow-x: auto; }
details .scroll { max-height: 36rem; overflow-y: auto; }
table { border-collapse: collapse; font-size: .85rem; font-variant-numeric: tabular-nums; }
th, td { padding: .2rem .7rem; text-align: right; white-space: nowrap; }
th { border-bottom: 1px solid #888; background: #fff; position: sticky; top: 0; }
td { border-bottom: 1px solid #eee; }
th.text, td.text { text-align: left; }
td.long { min-width: 22rem; white-space: normal; }
p.note { color: #666; font-size: .85rem; }
code, pre { font: .85rem/1.45 "DejaVu Sans Mono", Menlo, Consolas, monospace; }
pre { background: #f6f6f6; padding: .8rem 1rem; overflow-x: auto; }
summary { cursor: pointer; color: #2171b5; }
)";

void write_file(const fs::path& path, const std::string& text) {
  std::ofstream file(path);
  file << text;
  if (!file.flush()) throw InputError("report file", path.string(), "cannot be written");
}

std::string read_file(const fs::path& path) {
  std::ifstream file(path);
  std::ostringstream text;
  text << file.rdbuf();
  return text.str();
}

/// HTML and Markdown, written side by side.
class Document {
 public:
  explicit Document(fs::path folder) : folder_(std::move(folder)) {}

  void heading(const std::string& text) {
    html_ += fmt::format("<h2>{}</h2>\n", escape_html(text));
    markdown_ += fmt::format("\n## {}\n\n", text);
  }
  void subheading(const std::string& text) {
    html_ += fmt::format("<h3>{}</h3>\n", escape_html(text));
    markdown_ += fmt::format("\n### {}\n\n", text);
  }
  void paragraph(const std::string& text, const char* css_class = "lead") {
    html_ += fmt::format("<p class=\"{}\">{}</p>\n", css_class, escape_html(text));
    markdown_ += text + "\n\n";
  }
  void code(const std::string& text) {
    html_ += fmt::format("<pre>{}</pre>\n", escape_html(text));
    markdown_ += "```\n" + text + "\n```\n\n";
  }
  void figures(const std::vector<Figure>& list) {
    html_ += list.size() > 1 ? "<div class=\"figures\">\n" : "<div>\n";
    for (std::size_t k = 0; k < list.size(); ++k) {
      const Figure& figure = list[k];
      const bool is_last_of_its_caption = k + 1 == list.size() || list[k + 1].caption != figure.caption;
      const std::string caption = is_last_of_its_caption ? figure.caption : "";
      std::string svg = read_file(folder_ / figure.file);
      svg = svg.substr(svg.find("<svg"));  // inside a page the XML prologue is not allowed
      html_ += fmt::format("<figure>{}<figcaption>{}</figcaption></figure>\n", svg, escape_html(caption));
      markdown_ += fmt::format("![{}]({})\n\n{}\n\n", figure.title, figure.file, caption);
    }
    html_ += "</div>\n";
  }
  void animation(const ControlRun& run) {
    html_ += animation_html(run);
    has_animation_ = true;
  }
  void table(const Table& table, const std::string& name, bool is_long = false) {
    write_file(folder_ / (name + ".csv"), table.csv());
    if (is_long) {
      html_ += fmt::format("<details><summary>{} ({} rows, also in {}.csv)</summary>{}</details>\n",
                           escape_html(table.title), table.rows.size(), name, table.html());
    } else {
      html_ += table.html();
    }
    markdown_ += table.markdown() + "\n";
  }

  std::string html() const { return html_ + (has_animation_ ? animation_script() : ""); }
  const std::string& markdown() const { return markdown_; }

 private:
  fs::path folder_;
  std::string html_, markdown_;
  bool has_animation_ = false;
};

std::string html_page(const std::string& title, const std::string& body) {
  return fmt::format(
      "<!doctype html>\n<html lang=\"en\"><head><meta charset=\"utf-8\"><meta name=\"viewport\" "
      "content=\"width=device-width, initial-scale=1\"><title>{}</title><style>{}{}</style></head>\n"
      "<body>{}</body></html>\n",
      escape_html(title), kStyle, animation_style(), body);
}

std::string environment_text(const nlohmann::json& header) {
  std::string text;
  const nlohmann::json environment = header.value("environment", nlohmann::json::object());
  for (const auto& [key, value] : environment.items()) {
    text += fmt::format("{:<18} {}\n", key, value.is_string() ? value.get<std::string>() : value.dump());
  }
  return text;
}

void add_control_runs(const Results& results, Document& document, FigureFolder& figures, bool draw) {
  const std::string id = results.experiment();
  std::vector<std::pair<std::string, std::vector<const ControlRun*>>> problems;
  for (const auto& run : results.control_runs) {
    if (problems.empty() || problems.back().first != run.problem)
      problems.emplace_back(run.problem, std::vector<const ControlRun*>());
    problems.back().second.push_back(&run);
  }
  document.table(control_table(results.control_runs), id + "_runs");
  const Table failed = control_failures(results.control_runs);
  if (!failed.rows.empty()) document.table(failed, id + "_failures");
  for (const auto& [problem, runs] : problems) {
    document.subheading(fmt::format("{}: {}", problem, runs.front()->title));
    const auto pictured = std::ranges::find_if(runs, [](const ControlRun* run) { return !run->picture.empty(); });
    if (pictured != runs.end()) {
      document.figures({figures.frames(**pictured, fmt::format("{}_{}_frames", id, problem))});
      document.animation(**pictured);
    }
    if (draw) document.figures({figures.control(runs, id + "_" + problem)});
  }
}

void add_hard_cases(const Results& results, Document& document, const std::string& folder) {
  const std::string id = results.experiment();
  const auto& cells = results.hard_cells;
  document.figures({draw_verdict_matrix(cells, folder, id + "_matrix")});
  document.table(verdict_legend(cells), id + "_verdicts");
  document.table(case_table(cells), id + "_cases");
  if (const Table drift = energy_table(cells); !drift.rows.empty()) document.table(drift, id + "_energy");
  document.table(hard_failures(cells), id + "_failures", true);
  document.table(hard_details(cells), id + "_cells", true);
}

void add_experiment(const Results& results, Document& document, FigureFolder& figures, const std::string& folder,
                    bool draw) {
  const std::string id = results.experiment();
  document.heading(results.header.value("title", id));
  document.paragraph(results.header.value("description", ""));
  if (!results.is_complete) document.paragraph("These results are not complete: the run was interrupted.", "warning");
  if (results.header.value("quick", false)) {
    document.paragraph("Quick run: long runs are left out and times are measured three times only.", "warning");
  }
  if (draw) {
    for (const auto& trajectory : results.trajectories)
      document.figures({figures.trajectory(trajectory, id + "_trajectory")});
  }
  if (results.has_errors()) {
    if (draw) document.figures(figures.order(results));
    document.table(order_summary(results), id + "_orders");
  }
  const Table failed = failures(results);
  if (!failed.rows.empty()) document.table(failed, id + "_failures");
  if (results.has_errors() && results.has_timings()) {
    if (draw) document.figures({figures.work_precision(results)});
    document.table(time_to_reach(results), id + "_time_to_reach");
  }
  if (results.header.contains("overhead_of")) document.table(overhead(results), id + "_overhead");
  if (!results.control_runs.empty()) add_control_runs(results, document, figures, draw);
  if (!results.seed_runs.empty()) {
    document.table(seed_table(results.seed_runs), id + "_success");
    if (draw) document.figures({figures.seeds(results.seed_runs, id)});
    const Table unsolved = seed_failures(results.seed_runs);
    if (!unsolved.rows.empty()) document.table(unsolved, id + "_failures");
    document.table(seed_details(results.seed_runs), id + "_runs", true);
  }
  if (!results.gradients.empty()) {
    document.table(gradient_table(results.gradients), id + "_errors");
    if (draw) document.figures({figures.control_gradient(results.gradients, id)});
    document.table(gradient_details(results.gradients), id + "_derivatives", true);
  }
  if (!results.zeno_runs.empty()) {
    if (draw) document.figures(figures.zeno(results.zeno_captures, results.zeno_runs, id));
    document.table(zeno_capture_table(results.zeno_captures), id + "_captures");
    document.table(zeno_table(results.zeno_runs), id + "_methods");
    document.table(zeno_details(results.zeno_runs), id + "_runs", true);
  }
  if (!results.ramps.empty()) {
    if (draw) document.figures({figures.ramps(results.ramps, id)});
    document.table(ramp_table(results.ramps), id + "_methods");
  }
  if (!results.ramp_facets.empty()) {
    if (draw) document.figures({figures.ramp_facets(results.ramp_facets, id + "_facets")});
    document.table(ramp_facets_table(results.ramp_facets), id + "_polygons");
  }
  if (!results.growth.empty()) {
    document.table(growth_table(results.growth), id + "_work");
    if (draw) document.figures({figures.growth(growth_curves(results.growth), id, "Time", "intervals N", "seconds")});
    document.table(homotopy_steps(results.growth), id + "_steps", true);
  }
  if (!results.hard_cells.empty()) add_hard_cases(results, document, folder);
  if (!results.scale_runs.empty()) {
    if (draw)
      document.figures({figures.growth(scale_curves(results.scale_runs), id, "Time of a step", "active contacts",
                                       "microseconds per step")});
    document.table(scale_table(results.scale_runs), id + "_steps");
    const Table without = scale_failures(results.scale_runs);
    if (!without.rows.empty()) document.table(without, id + "_failures");
  }
  if (!results.records.empty()) document.table(order_details(results), id + "_runs", true);
  if (results.has_timings()) document.table(precision_details(results), id + "_times", true);
  document.paragraph("Where it was measured, and how to repeat it:", "note");
  document.code(fmt::format("{}\n{}", results.header.value("command", ""), environment_text(results.header)));
}

}  // namespace

std::string write_report(const std::vector<std::string>& paths, const std::string& folder) {
  FigureFolder figures(folder);
  Document document(folder);
  const bool draw = can_draw();
  if (!draw) document.paragraph("The figures are missing: gnuplot was not found.", "warning");
  std::string title;
  for (const auto& path : paths) {
    const Results results = read_results(path);
    title += (title.empty() ? "" : ", ") + results.experiment();
    add_experiment(results, document, figures, folder, draw);
    fs::copy_file(path, fs::path(folder) / fs::path(path).filename(), fs::copy_options::overwrite_existing);
  }
  const fs::path index = fs::path(folder) / "index.html";
  write_file(fs::path(folder) / "report.md", "# Ricochet: " + title + "\n" + document.markdown());
  write_file(index, html_page("Ricochet: " + title,
                              "<h1>Ricochet</h1>\n<p class=\"lead\">Accuracy and speed of methods for rigid-body "
                              "motion with impacts.</p>\n" +
                                  document.html()));
  return index.string();
}

std::string write_animation(const ControlRun& run, const std::string& folder) {
  const fs::path path = fs::path(folder) / (run.problem + ".html");
  write_file(path, html_page(run.title, animation_html(run) + animation_script()));
  return path.string();
}

}  // namespace ricochet
