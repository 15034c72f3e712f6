#include "reports/render/pgfplots.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "reports/latex.h"

namespace ricochet {
namespace {

using Drawn = Chart::Drawn;

/// Powers of ten within a range, ten at most: more of them run into each other.
std::string decades_text(const std::pair<double, double>& range) {
  const int first = static_cast<int>(std::ceil(std::log10(range.first))),
            last = static_cast<int>(std::floor(std::log10(range.second)));
  const int by = std::max(1, (last - first + 10) / 10);
  std::string text;
  for (int k = last; k >= first; k -= by) text = fmt::format("1e{}{}{}", k, text.empty() ? "" : ", ", text);
  return text;
}

/// Options of one axis. @param name  "x"
std::string axis_options(const std::string& name, const Chart::Axis& axis, const std::pair<double, double>& range) {
  std::string text = fmt::format("{0}label={{{1}}}, {0}min={2:.6g}, {0}max={3:.6g}", name, escape_latex(axis.label),
                                 range.first, range.second);
  if (axis.is_log) text += fmt::format(", {}mode=log", name);
  if (axis.is_log && range.second > 10 * range.first) text += fmt::format(", {}tick={{{}}}", name, decades_text(range));
  if (axis.is_reversed) text += fmt::format(", {} dir=reverse", name);
  std::string places, labels;
  for (std::size_t k = 0; k < axis.names.size(); ++k) {
    places += fmt::format("{}{}", k ? "," : "", k);
    labels += fmt::format("{}{{{}}}", k ? "," : "", escape_latex(axis.names[k]));
  }
  return places.empty() ? text : text + fmt::format(", {0}tick={{{1}}}, {0}ticklabels={{{2}}}", name, places, labels);
}

std::string look_options(const CurveLook& look) {
  static constexpr std::array kMarks = {"*", "square*", "triangle*", "diamond*", "x", "star"},
                              kOpen = {"o", "square", "triangle", "diamond", "x", "star"};
  static constexpr std::array kDashes = {"solid", "dashed", "densely dotted", "dashdotted"};
  const auto symbol = static_cast<std::size_t>(look.symbol % CurveLook::kSymbols);
  return fmt::format("color=ricochet{}, mark={}, mark options={{solid}}, {}", look.colour % CurveLook::kColours,
                     look.is_open ? kOpen[symbol] : kMarks[symbol],
                     kDashes[static_cast<std::size_t>(look.dash % CurveLook::kDashes)]);
}

std::string pgfplots_style(const Chart::Series& series) {
  switch (series.drawn) {
    case Drawn::both:
      return look_options(series.look);
    case Drawn::line:
      return look_options(series.look) + ", mark=none";
    case Drawn::marks:
      return look_options(series.look) + ", only marks";
    case Drawn::steps:  // a mark on some of them tells curves of similar colours apart
      return fmt::format("const plot, {}, mark repeat={}", look_options(series.look),
                         std::max<std::size_t>(1, series.points.size() / 5));
    case Drawn::stems:
      return "ycomb, " + look_options(series.look);
    case Drawn::failed:
      return look_options({.colour = series.look.colour, .symbol = 4}) + ", only marks";
    case Drawn::reference:
      return "color=gray!60, thick, mark=none";
    case Drawn::cells:
      return "";
  }
  return "";
}

/// Coordinates of a drawn point as text; a value without a place on its axis is nan, which PGFPlots leaves out.
std::string numbers_of(const Chart::Panel& panel, const Chart::Series& series, std::size_t k) {
  if (k >= series.points.size()) return "nan nan";
  auto [x, y] = series.points[k];
  if (series.drawn == Drawn::failed) y = panel.y_range().second;
  return panel.has_place({x, y}) ? fmt::format("{} {}", x, y) : "nan nan";
}

/// Two columns for each curve; shorter ones end with nan.
std::string columns_text(const Chart::Panel& panel) {
  std::string text;
  std::size_t rows = 0;
  for (std::size_t k = 0; k < panel.series.size(); ++k) {
    text += fmt::format("# columns {} and {}: {}\n", 2 * k, 2 * k + 1, panel.series[k].label);
    rows = std::max(rows, panel.series[k].points.size());
  }
  for (std::size_t r = 0; r < rows; ++r) {
    for (std::size_t k = 0; k < panel.series.size(); ++k)
      text += (k > 0 ? " " : "") + numbers_of(panel, panel.series[k], r);
    text += "\n";
  }
  return text;
}

/// @param file  of the numbers; empty: they stand here
std::string picture_text(const Chart::Panel& panel, const std::string& file) {
  std::string body;
  std::size_t longest = 0;
  for (std::size_t k = 0; k < panel.series.size(); ++k) {
    const Chart::Series& series = panel.series[k];
    std::string table = fmt::format(" table[header=false, x index={}, y index={}] {{{}}}", 2 * k, 2 * k + 1, file);
    if (file.empty()) {
      table = " table {\n";
      for (std::size_t r = 0; r < series.points.size(); ++r) table += numbers_of(panel, series, r) + "\n";
      table += "}";
    }
    const std::string quiet = series.label.empty() ? ", forget plot" : "";
    body += fmt::format("\\addplot[{}, mark size=1.2pt, unbounded coords=jump{}]{};\n", pgfplots_style(series), quiet,
                        table);
    if (quiet.empty()) body += fmt::format("\\addlegendentry{{{}}}\n", escape_latex(series.label));
    longest = std::max(longest, series.label.size());
  }
  constexpr std::size_t kMany = 24, kLetters = 130;  // in a line of the key
  const std::size_t columns = panel.series.size() > kMany ? 3 : std::clamp<std::size_t>(kLetters / (longest + 8), 1, 3);
  return latex_palette() +
         fmt::format(
             "\\begin{{tikzpicture}}\n\\begin{{axis}}[width=13cm, height=9cm, title={{{}}},\n  {},\n  {},\n  grid=major, "
             "legend columns={}, legend cell align=left, legend style={{at={{(0.5,-0.16)}}, anchor=north, "
             "font=\\scriptsize}}]\n{}\\end{{axis}}\n\\end{{tikzpicture}}\n",
             escape_latex(panel.heading()), axis_options("x", panel.x, panel.x_range()),
             axis_options("y", panel.y, panel.y_range()), columns, body);
}

}  // namespace

bool has_pgfplots(const Chart& chart) {
  return !chart.panels.empty() && std::ranges::none_of(chart.panels, &Chart::Panel::has_cells);
}

std::string pgfplots(const Chart& chart, std::vector<PgfplotsData>* data, const std::string& stem) {
  std::string text;
  std::size_t count = 0;
  for (const auto& panel : chart.panels) {
    if (panel.series.empty()) continue;
    ++count;
    std::string file;
    if (data) {
      file = stem + (count > 1 ? fmt::format("_{}", count) : "") + ".dat";
      data->push_back({file, columns_text(panel)});
    }
    text += fmt::format("% {}{}\n", chart.title, panel.title.empty() ? "" : ": " + panel.heading()) +
            picture_text(panel, file);
  }
  return text;
}

std::string pgfplots_document(const std::string& charts) {
  return "\\documentclass[multi=tikzpicture, border=2mm]{standalone}  % \\usepackage{standalone} takes it into a paper by \\input\n"
         "\\usepackage[utf8]{inputenc}\n\\usepackage[T1]{fontenc}\n\\usepackage{lmodern, pgfplots}\n\\pgfplotsset{compat=1.17}\n"
         "\\begin{document}\n" +
         charts + "\\end{document}\n";
}

}  // namespace ricochet
