#include "reports/latex.h"

#include <fmt/format.h>

#include <algorithm>

#include "problems/names.h"
#include "reports/latex_layout.h"

namespace ricochet {
namespace {

class Printer {
 public:
  Printer(const LatexContent& content, const LatexLayout& layout, std::string caption, std::string label,
          const LatexPage& page)
      : content_(content), layout_(layout), caption_(std::move(caption)), label_(std::move(label)) {
    const double width = turned() ? page.height : page.width, height = turned() ? page.width : page.height;
    constexpr double kNoteLeading = 9.5, kAround = 70;  // [pt] caption, header and rules
    const double body = layout.lines * (layout.attempt.type.leading + (is_spaced() ? 2 : 0));
    const double below =
        kNoteLeading * (static_cast<double>(content.notes.size()) + kEightPoints.factor * content.notes_width / width);
    constexpr double kOfAPage = 0.92;
    constexpr std::size_t kMostRows = 40;
    is_long_ = content.rows > kMostRows || body + below + kAround > kOfAPage * height;
  }

  std::string text() const {
    const std::string head = fmt::format("% needs \\usepackage{{booktabs{}{}{}}}\n", has_widths() ? ",array" : "",
                                         is_long_ ? ",longtable" : "",
                                         !turned()  ? ""
                                         : is_long_ ? ",pdflscape"
                                                    : ",rotating");
    return head + (is_long_ ? long_table() : floating());
  }

 private:
  bool turned() const { return layout_.attempt.is_turned; }
  bool has_widths() const { return !layout_.widths.empty(); }
  bool is_spaced() const { return layout_.lines > 1.25 * static_cast<double>(content_.rows); }

  std::string type() const {
    const LatexAttempt& attempt = layout_.attempt;
    std::string text;
    if (attempt.type.points < kTenPoints.points)
      text += fmt::format("\\fontsize{{{}}}{{{}}}\\selectfont", attempt.type.points, attempt.type.leading);
    if (attempt.gap < kLatexGap) text += fmt::format("\\setlength{{\\tabcolsep}}{{{}pt}}", attempt.gap);
    return text;
  }
  std::string columns() const {
    if (!has_widths()) {
      std::string letters;
      for (const auto& column : content_.columns) letters += column.is_text ? 'l' : 'r';
      return letters;
    }
    std::string text = "@{}";
    for (std::size_t c = 0; c < content_.columns.size(); ++c)
      text += fmt::format(">{{\\{}\\arraybackslash}}p{{{:.1f}pt}}",
                          content_.columns[c].is_text ? "raggedright" : "raggedleft", layout_.widths[c]);
    return text + "@{}";
  }
  template <class Get>
  std::string line(const Get& cell) const {
    std::string text = "    ";
    for (std::size_t c = 0; c < content_.columns.size(); ++c)
      text += (c ? " & " : "") + with_breaks(cell(content_.columns[c]).tex, layout_.attempt.wraps == LatexWraps::text);
    return text + " \\\\\n";
  }
  std::string header() const {
    return "    \\toprule\n" + line([](const auto& column) -> const LatexCell& { return column.header; }) +
           "    \\midrule\n";
  }
  std::string rows() const {
    std::string text;
    for (std::size_t r = 0; r < content_.rows; ++r) {
      if (r > 0 && is_spaced()) text += "    \\addlinespace[2pt]\n";
      text += line([&](const auto& column) -> const LatexCell& { return column.cells[r]; });
    }
    return text;
  }
  std::string notes() const {
    std::string text = content_.notes.empty() ? "" : "  \\par\\smallskip\n";
    for (const auto& note : content_.notes)
      text += fmt::format("  \\par{{\\fontsize{{8}}{{9.5}}\\selectfont\\raggedright {}\\par}}\n", note);
    return text;
  }

  std::string floating() const {
    const std::string name = turned() ? "sidewaystable" : "table";
    const std::string small = type();
    return fmt::format(
        "\\begin{{{0}}}\n  \\centering\n  \\caption{{{1}}}\n  \\label{{{2}}}\n  \\smallskip\n{3}  \\begin{{tabular}}{{{4}}}\n{5}{6}"
        "    \\bottomrule\n  \\end{{tabular}}\n{7}\\end{{{0}}}\n",
        name, caption_, label_, small.empty() ? "" : "  " + small + "\n", columns(), header(), rows(), notes());
  }
  std::string long_table() const {
    std::string text = turned() ? "\\begin{landscape}\n" : "";
    text += fmt::format("\\begingroup\n  {}\\setlength{{\\LTcapwidth}}{{\\linewidth}}\n  \\begin{{longtable}}{{{}}}\n",
                        type(), columns());
    text += fmt::format("    \\caption{{{}}}\\label{{{}}}\\\\\n{}    \\endfirsthead\n{}    \\endhead\n", caption_,
                        label_, header(), header());
    text += fmt::format(
        "    \\midrule\n    \\multicolumn{{{}}}{{r}}{{continued}}\\\\\n    \\endfoot\n    \\bottomrule\n"
        "    \\endlastfoot\n",
        content_.columns.size());
    text += rows() + "  \\end{longtable}\n" + notes() + "\\endgroup\n";
    return text + (turned() ? "\\end{landscape}\n" : "");
  }

  const LatexContent& content_;
  const LatexLayout& layout_;
  std::string caption_, label_;
  bool is_long_ = false;
};

/// Its first column, and those from `first` to before `last`.
LatexContent part_of(const LatexContent& content, std::size_t first, std::size_t last) {
  LatexContent part = content;
  part.columns.assign(1, content.columns[0]);
  part.columns.insert(part.columns.end(), content.columns.begin() + static_cast<std::ptrdiff_t>(first),
                      content.columns.begin() + static_cast<std::ptrdiff_t>(last));
  if (last < content.columns.size()) {  // notes stand below the last one
    part.notes.clear();
    part.notes_width = 0;
  }
  return part;
}

}  // namespace

std::string latex(const Table& table, const std::string& label, const LatexPage& page) {
  const LatexContent whole = latex_content(table);
  const std::string caption = with_breaks(latex_cell(table.title).tex, false);
  std::string text;
  std::size_t parts = 0;
  for (std::size_t first = 1; parts == 0 || first < whole.columns.size(); ++parts) {
    std::size_t last = whole.columns.size();
    LatexContent part = part_of(whole, first, last);
    std::optional<LatexLayout> layout = latex_layout(part, page);
    while (!layout && last > first + 1) {
      part = part_of(whole, first, --last);
      layout = latex_layout(part, page);
    }
    if (!layout) layout = LatexLayout{.widths = {}, .lines = static_cast<double>(whole.rows)};
    text += Printer(part, *layout, caption + (parts ? ", continued" : ""),
                    parts ? fmt::format("{}_{}", label, parts + 1) : label, page)
                .text();
    first = last;
  }
  return text;
}

namespace {

/// Without its unit: "time" of "time [us]".
std::string without_unit(const std::string& header) {
  return header.substr(0, header.find(" ["));
}

bool is_called(const std::string& header, const std::string& name) {
  return header == name || without_unit(header) == name;
}

}  // namespace

Table with_columns(const Table& table, const std::vector<std::string>& names) {
  Table chosen = table;
  chosen.columns.clear();
  chosen.rows.assign(table.rows.size(), {});
  for (const auto& name : names) {
    for (std::size_t c = 0; c < table.columns.size(); ++c) {
      if (!is_called(table.columns[c].header, name)) continue;
      chosen.columns.push_back(table.columns[c]);
      for (std::size_t r = 0; r < table.rows.size(); ++r) chosen.rows[r].push_back(table.rows[r][c]);
    }
  }
  return chosen;
}

std::vector<std::string> headers_in(const std::string& list, const std::vector<std::string>& known) {
  std::vector<std::string> names;
  for (std::size_t at = 0; at <= list.size();) {
    std::string found;
    for (const auto& header : known) {
      for (const auto& name : {header, without_unit(header)}) {
        const std::size_t end = at + name.size();
        const bool is_here = list.compare(at, name.size(), name) == 0 && (end == list.size() || list[end] == ',');
        if (is_here && name.size() > found.size()) found = name;
      }
    }
    if (found.empty()) throw_unknown_name("column", list.substr(at, list.find(',', at) - at), known);
    names.push_back(found);
    at += found.size() + 1;
  }
  return names;
}

}  // namespace ricochet
