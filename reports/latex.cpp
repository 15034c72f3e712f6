#include "reports/latex.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "problems/names.h"

namespace ricochet {
namespace {

constexpr std::size_t kFloatRows = 40;  // of a float
constexpr std::size_t kSentence = 32;  // letters, from which on a column wraps

bool is_empty(const std::string& cell) {
  return cell.empty() || cell == "-";
}

/// The letters that a column needs on one line.
std::size_t length_of(const Table& table, std::size_t column) {
  std::size_t longest = table.columns[column].header.size();
  for (const auto& row : table.rows) longest = std::max(longest, row[column].size());
  return longest;
}

/// @param columns  numbers of columns of the table
std::string specification(const Table& table, const std::vector<std::size_t>& columns) {
  std::string text;
  for (const std::size_t c : columns) {
    if (!table.columns[c].is_text)
      text += 'r';
    else if (length_of(table, c) <= kSentence)
      text += 'l';
    else
      text +=
          fmt::format(">{{\\raggedright\\arraybackslash}}p{{{}em}}", length_of(table, c) <= 2 * kSentence ? 14 : 24);
  }
  return text;
}

template <class Cell>
std::string line_of(const std::vector<std::size_t>& columns, const Cell& cell) {
  std::string text;
  for (const std::size_t c : columns) text += (text.empty() ? "    " : " & ") + escape_latex(cell(c));
  return text + " \\\\\n";
}

}  // namespace

std::string escape_latex(const std::string& text) {
  // A combination comes before the letter that it begins with.
  // clang-format off
  static const std::vector<std::pair<std::string, std::string>> escapes = {
      {"\\", "\\textbackslash{}"}, {"^", "\\textasciicircum{}"}, {"~", "\\textasciitilde{}"}, {"<=", "$\\leq$"},
      {">=", "$\\geq$"}, {"<", "\\textless{}"}, {">", "\\textgreater{}"}, {"|", "\\textbar{}"}, {"--", "-{}-"},
      {"&", "\\&"}, {"%", "\\%"}, {"$", "\\$"}, {"#", "\\#"}, {"_", "\\_"}, {"{", "\\{"}, {"}", "\\}"},
      {"θ", "$\\theta$"}, {"κ", "$\\kappa$"}, {"μ", "$\\mu$"}, {"⁺", "$^+$"}, {"σ", "$\\sigma$"}, {"τ", "$\\tau$"}, {"ω", "$\\omega$"}, {"α", "$\\alpha$"},
      {"ε", "$\\varepsilon$"}, {"±", "$\\pm$"}, {"×", "$\\times$"}, {"·", "$\\cdot$"}, {"≤", "$\\leq$"},
      {"≥", "$\\geq$"}, {"∞", "$\\infty$"}, {"²", "$^2$"}, {"³", "$^3$"}, {"→", "$\\to$"}, {"√", "$\\surd$"},
      {"−", "$-$"}, {"°", "$^\\circ$"}, {"h̄", "$\\bar h$"}};
  // clang-format on
  std::string escaped;
  for (std::size_t at = 0; at < text.size();) {
    const auto found = std::ranges::find_if(
        escapes, [&](const auto& escape) { return text.compare(at, escape.first.size(), escape.first) == 0; });
    escaped += found == escapes.end() ? text.substr(at, 1) : found->second;
    at += found == escapes.end() ? 1 : found->first.size();
  }
  return escaped;
}

std::string latex(const Table& table, const std::string& label) {
  std::vector<std::size_t> columns;
  for (std::size_t c = 0; c < table.columns.size(); ++c) {
    const bool has_content = std::ranges::any_of(table.rows, [c](const auto& row) { return !is_empty(row[c]); });
    if (c == 0 || has_content || table.rows.empty()) columns.push_back(c);
  }
  const std::string caption = escape_latex(table.title), note = escape_latex(table.note),
                    head = "    \\toprule\n" +
                           line_of(columns, [&](std::size_t c) { return table.columns[c].header; }) + "    \\midrule\n";
  std::string rows;
  for (const auto& row : table.rows) rows += line_of(columns, [&row](std::size_t c) { return row[c]; });
  const std::string below = note.empty() ? "" : fmt::format("  \\par\\smallskip{{\\footnotesize {}\\par}}\n", note);
  if (table.rows.size() <= kFloatRows)
    return fmt::format(
        "% needs \\usepackage{{booktabs,array,adjustbox}}\n\\begin{{table}}\n  \\centering\n  \\caption{{{}}}\n"
        "  \\label{{{}}}\n  \\begin{{adjustbox}}{{max width=\\linewidth,max totalheight=0.8\\textheight}}\n"
        "  \\begin{{tabular}}{{{}}}\n{}{}    \\bottomrule\n  \\end{{tabular}}\n  \\end{{adjustbox}}\n{}\\end{{table}}\n",
        caption, label, specification(table, columns), head, rows, below);
  return fmt::format(
      "% needs \\usepackage{{booktabs,array,longtable}}\n{{\\scriptsize\\setlength{{\\tabcolsep}}{{2pt}}\n"
      "  \\begin{{longtable}}{{{0}}}\n    \\caption{{{1}}}\\label{{{2}}}\\\\\n{3}    \\endfirsthead\n{3}    \\endhead\n"
      "    \\bottomrule\n    \\endfoot\n{4}  \\end{{longtable}}\n{5}}}\n",
      specification(table, columns), caption, label, head, rows, below);
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
