#include "reports/export.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <map>

#include "problems/input_error.h"

namespace ricochet {
namespace {

using nlohmann::json;

std::string escape_latex(const std::string& text) {
  static const std::map<char, std::string> escapes = {{'\\', "\\textbackslash{}"},
                                                      {'^', "\\textasciicircum{}"},
                                                      {'~', "\\textasciitilde{}"},
                                                      {'<', "\\textless{}"},
                                                      {'>', "\\textgreater{}"},
                                                      {'|', "\\textbar{}"},
                                                      {'&', "\\&"},
                                                      {'%', "\\%"},
                                                      {'$', "\\$"},
                                                      {'#', "\\#"},
                                                      {'_', "\\_"},
                                                      {'{', "\\{"},
                                                      {'}', "\\}"}};
  std::string escaped;
  for (const char c : text) {
    const auto escape = escapes.find(c);
    escaped += escape == escapes.end() ? std::string(1, c) : escape->second;
  }
  return escaped;
}

std::string snake_case(const std::string& name) {
  std::string snake;
  for (const char c : name) {
    const auto byte = static_cast<unsigned char>(c);
    if (std::isupper(byte) && !snake.empty() && snake.back() != '_') snake += '_';
    snake += std::isalnum(byte) ? static_cast<char>(std::tolower(byte)) : '_';
  }
  return snake;
}

using Fields = std::vector<std::pair<std::string, std::string>>;  // name, cell

void flatten(const std::string& name, const json& value, Fields& fields) {
  if (value.is_object()) {
    for (const auto& [key, part] : value.items())
      flatten((name.empty() ? "" : name + "_") + snake_case(key), part, fields);
  } else if (value.is_array()) {
    std::string joined;
    for (const auto& part : value) {
      if (!part.is_string()) return;
      joined += (joined.empty() ? "" : ";") + part.get<std::string>();
    }
    fields.emplace_back(name, csv_cell(joined));
  } else if (value.is_number_float()) {
    const double number = value;
    fields.emplace_back(name, std::isnan(number) ? "NaN" : fmt::format("{}", number));
  } else {
    fields.emplace_back(
        name, value.is_null() ? "NaN" : csv_cell(value.is_string() ? value.get<std::string>() : value.dump()));
  }
}

Fields fields_of(json row, const char* left_out) {
  row.erase("kind");
  row.erase(left_out);
  Fields fields;
  flatten("", row, fields);
  return fields;
}

/// The palette of the site on white (reports/site/src/site.css).
constexpr std::array<const char*, 8> kColors = {"0072B2", "C25000", "007A5A", "A8437F",
                                                "6B6F00", "3A86C4", "8A5A00", "5C5F62"};
constexpr std::array<const char*, 8> kMarks = {"*", "square*", "triangle*", "diamond*",
                                               "o", "square",  "triangle",  "diamond"};

std::string colors_text() {
  std::string text;
  for (std::size_t k = 0; k < kColors.size(); ++k)
    text += fmt::format("\\definecolor{{ricochet{}}}{{HTML}}{{{}}}\n", k, kColors[k]);
  return text;
}

/// Of the k-th curve, from 0.
std::string look(std::size_t k) {
  const std::size_t round = k / kColors.size();
  return fmt::format("color=ricochet{}, mark={}, mark size=1.2pt{}", k % kColors.size(), kMarks[k % kMarks.size()],
                     round == 0   ? ""
                     : round == 1 ? ", dashed"
                                  : ", dotted");
}

std::string axis_text(const std::string& kind, const std::string& options, const std::string& body) {
  return colors_text() +
         fmt::format(
             "\\begin{{tikzpicture}}\n\\begin{{{0}}}[width=13cm, height=9cm, {1}, grid=major, legend columns=3, "
             "legend cell align=left,\n  legend style={{at={{(0.5,-0.16)}}, anchor=north, "
             "font=\\scriptsize}}]\n{2}\\end{{{0}}}\n\\end{{tikzpicture}}\n",
             kind, options, body);
}

/// Powers of ten between two numbers, ten at most: more of them run into each other.
std::string ticks_text(double least, double most) {
  const int first = static_cast<int>(std::floor(std::log10(least))),
            last = static_cast<int>(std::ceil(std::log10(most)));
  const int by = std::max(1, (last - first + 9) / 10);
  std::string text;
  for (int k = last; k >= first; k -= by) text = fmt::format("1e{}{}{}", k, text.empty() ? "" : ", ", text);
  return text;
}

std::string work_precision(const json& data) {
  constexpr double kLargestError = 10;  // beyond it a run says nothing: it is drawn on the edge
  double least = kLargestError, most = 0;
  for (const auto& run : data.at("runs")) {
    const double error = std::clamp(run.at("error").get<double>(), 1e-300, kLargestError);
    least = std::min(least, error);
    most = std::max(most, error);
  }
  std::string body;
  std::size_t curve = 0;
  for (std::size_t m = 0; m < data.at("methods").size(); ++m) {
    std::string points;
    for (const auto& run : data.at("runs")) {
      if (run.at("method") == m)
        points += fmt::format("{} {}\n", std::min(kLargestError, run.at("error").get<double>()),
                              run.at("time").get<double>());
    }
    if (!points.empty())
      body += fmt::format("\\addplot[{}] table {{\n{}}};\n\\addlegendentry{{{}}}\n", look(curve++), points,
                          escape_latex(data["methods"][m].at("label")));
  }
  const std::string label = data.at("errors").front().at("label");
  return axis_text("loglogaxis",
                   fmt::format("xlabel={{{}}}, ylabel={{CPU time [ms]}}, xtick={{{}}}", escape_latex(label),
                               ticks_text(least, most)),
                   body);
}

std::string profile(const json& data) {
  const double problems = data.at("problems");
  double last = 10;
  for (const auto& solver : data.at("solvers")) {
    for (const double ratio : solver.at("ratios")) last = std::max(last, ratio);
  }
  std::string body;
  std::size_t curve = 0;
  for (const auto& solver : data.at("solvers")) {
    std::string points = "1 0\n";
    double solved = 0;
    for (const double ratio : solver.at("ratios")) points += fmt::format("{} {}\n", ratio, ++solved / problems);
    points += fmt::format("{} {}\n", last, solved / problems);
    body += fmt::format("\\addplot[const plot, {}, mark=none] table {{\n{}}};\n\\addlegendentry{{{}}}\n", look(curve++),
                        points, escape_latex(solver.at("name")));
  }
  return axis_text("semilogxaxis",
                   fmt::format("xlabel={{$\\tau$}}, ylabel={{share of {} problems}}, ymin=0, ymax=1.02", problems),
                   body);
}

/// A row that adds to the run of this number.
bool is_part_of_a_run(const nlohmann::json& row) {
  const auto number = row.find("row");
  return number != row.end() && number->is_number_unsigned();
}

/// The kind that most rows have, of those that stand for themselves.
std::string kind_of_runs(const Results& results) {
  std::map<std::string, int> counts;
  for (const auto& row : results.rows) {
    if (!is_part_of_a_run(row)) ++counts[row.at("kind")];
  }
  if (counts.empty()) throw InputError("results", results.path, "at least one run is required");
  return std::ranges::max_element(counts, {}, [](const auto& count) { return count.second; })->first;
}

}  // namespace

std::string latex(const Table& table, const std::string& label) {
  std::string text = "% needs \\usepackage{booktabs}\n\\begin{table}\n  \\centering\n  \\caption{" +
                     escape_latex(table.title) + "}\n  \\label{" + label + "}\n  \\begin{tabular}{";
  for (const auto& column : table.columns) text += column.is_text ? 'l' : 'r';
  text += "}\n    \\toprule\n";
  const auto line = [&](const auto& cell) {
    text += "    ";
    for (std::size_t c = 0; c < table.columns.size(); ++c) text += (c ? " & " : "") + escape_latex(cell(c));
    text += " \\\\\n";
  };
  line([&](std::size_t c) { return table.columns[c].header; });
  text += "    \\midrule\n";
  for (const auto& row : table.rows) line([&](std::size_t c) { return row[c]; });
  text += "    \\bottomrule\n  \\end{tabular}\n";
  if (!table.note.empty()) text += "  \\par\\footnotesize " + escape_latex(table.note) + "\n";
  return text + "\\end{table}\n";
}

std::string tidy_csv(const Results& results) {
  const std::string kind = kind_of_runs(results);
  std::vector<Fields> runs;
  for (const auto& row : results.rows) {
    if (row.at("kind") == kind) runs.push_back(fields_of(row, ""));
  }
  for (const auto& row : results.rows) {
    if (row.at("kind") == kind || !is_part_of_a_run(row) || row["row"] >= runs.size()) continue;
    for (auto& field : fields_of(row, "row")) runs[row["row"].get<std::size_t>()].push_back(std::move(field));
  }
  std::vector<std::string> names;
  for (const auto& run : runs) {
    for (const auto& [name, cell] : run) {
      if (std::ranges::find(names, name) == names.end()) names.push_back(name);
    }
  }
  std::string text;
  for (std::size_t c = 0; c < names.size(); ++c) text += (c ? "," : "") + names[c];
  text += "\n";
  for (const auto& run : runs) {
    const std::map<std::string, std::string> cells(run.begin(), run.end());
    for (std::size_t c = 0; c < names.size(); ++c) {
      const auto cell = cells.find(names[c]);
      text += (c ? "," : "") + (cell == cells.end() ? "NaN" : cell->second);
    }
    text += "\n";
  }
  return text;
}

bool has_pgfplots(const Section::Chart& chart) {
  return chart.kind == "work_precision" || chart.kind == "profile";
}

std::string pgfplots(const Section::Chart& chart) {
  const std::string head = fmt::format("% {}\n", chart.title);
  if (chart.kind == "work_precision") return head + work_precision(chart.data);
  if (chart.kind == "profile") return head + profile(chart.data);
  throw InputError("chart", chart.kind, "work_precision or profile is required");
}

std::string pgfplots_document(const std::string& charts) {
  return "\\documentclass[multi=tikzpicture, border=2mm]{standalone}  % \\usepackage{standalone} takes it into a paper by \\input\n"
         "\\usepackage[utf8]{inputenc}\n\\usepackage[T1]{fontenc}\n\\usepackage{lmodern, pgfplots}\n\\pgfplotsset{compat=1.17}\n"
         "\\begin{document}\n" +
         charts + "\\end{document}\n";
}

}  // namespace ricochet
