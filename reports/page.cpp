#include "reports/page.h"

#include <fmt/format.h>

#include <filesystem>
#include <type_traits>

#include "problems/input_error.h"
#include "reports/assets.h"
#include "reports/markup.h"
#include "reports/results_list.h"
#include "reports/text_file.h"

namespace ricochet {
namespace {

namespace fs = std::filesystem;

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
      std::string svg = read_text(folder_ / figure.file);
      svg = svg.substr(svg.find("<svg"));  // inside a page the XML prologue is not allowed
      html_ += fmt::format("<figure>{}<figcaption>{}</figcaption></figure>\n", svg, escape_html(caption));
      markdown_ += fmt::format("![{}]({})\n\n{}\n\n", figure.title, figure.file, caption);
    }
    html_ += "</div>\n";
  }
  void table(const Table& table, const std::string& name, bool is_long = false) {
    write_text("report file", folder_ / (name + ".csv"), table.csv());
    if (is_long) {
      html_ += fmt::format("<details><summary>{} ({} rows, also in {}.csv)</summary>{}</details>\n",
                           escape_html(table.title), table.rows.size(), name, table.html());
    } else {
      html_ += table.html();
    }
    markdown_ += table.markdown() + "\n";
  }

  std::string html() const { return html_; }
  const std::string& markdown() const { return markdown_; }

 private:
  fs::path folder_;
  std::string html_, markdown_;
};

std::string html_page(const std::string& title, const std::string& body) {
  return fmt::format(
      "<!doctype html>\n<html lang=\"en\"><head><meta charset=\"utf-8\"><meta name=\"viewport\" "
      "content=\"width=device-width, initial-scale=1\"><title>{}</title><style>{}</style></head>\n"
      "<body>{}</body></html>\n",
      escape_html(title), assets::kPageStyle, body);
}

std::string environment_text(const nlohmann::json& header) {
  std::string text;
  const nlohmann::json environment = header.value("environment", nlohmann::json::object());
  for (const auto& [key, value] : environment.items()) {
    text += fmt::format("{:<18} {}\n", key, value.is_string() ? value.get<std::string>() : value.dump());
  }
  return text;
}

void add_section(const Results& results, const Section& section, const FigureFolder& figures, bool draw,
                 Document& document) {
  const auto add = [&](const auto& part) {
    using Part = std::decay_t<decltype(part)>;
    if constexpr (std::is_same_v<Part, Section::NamedTable>) {
      if (part.role != Section::Role::summary)
        document.table(part.table, results.experiment() + "_" + part.name, part.role == Section::Role::details);
    } else if constexpr (std::is_same_v<Part, Section::Figures>) {
      if (draw || !part.needs_gnuplot) document.figures(part.draw(figures));
    } else if constexpr (std::is_same_v<Part, Section::Heading>) {
      document.subheading(part.text);
    } else {
      if (draw || !part.still.needs_gnuplot) document.figures(part.still.draw(figures));
    }
  };
  for (const auto& part : section.parts()) std::visit(add, part);
}

void add_results(const ShownResults& shown, const FigureFolder& figures, bool draw, Document& document) {
  const Results& results = shown.results;
  document.heading(results.title());
  document.paragraph(results.header.value("description", ""));
  for (const auto& sentence : warnings(results)) document.paragraph(sentence, "warning");
  if (results.header.value("quick", false)) {
    document.paragraph("Quick run: long runs are left out and times are measured three times only.", "warning");
  }
  add_section(results, shown.section, figures, draw, document);
  document.paragraph("Where it was measured, and how to repeat it:", "note");
  document.code(fmt::format("{}\n{}", results.header.value("command", ""), environment_text(results.header)));
}

}  // namespace

std::string write_page(const std::vector<ShownResults>& list, const std::string& folder, bool with_pdf) {
  require_different(list);
  const FigureFolder figures(folder, with_pdf);
  Document document(folder);
  const bool draw = can_draw();
  if (!draw) document.paragraph("The figures are missing: gnuplot was not found.", "warning");
  std::string title;
  for (const auto& shown : list) {
    title += (title.empty() ? "" : ", ") + shown.results.experiment();
    add_results(shown, figures, draw, document);
    copy_results(shown.results, folder);
  }
  const fs::path index = fs::path(folder) / "index.html";
  write_text("report file", fs::path(folder) / "report.md", "# Ricochet: " + title + "\n" + document.markdown());
  write_text("report file", index,
             html_page("Ricochet: " + title,
                       "<h1>Ricochet</h1>\n<p class=\"lead\">Accuracy and speed of methods for rigid-body "
                       "motion with impacts.</p>\n" +
                           document.html()));
  return index.string();
}

}  // namespace ricochet
