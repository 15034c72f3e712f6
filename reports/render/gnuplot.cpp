#include "reports/render/gnuplot.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <filesystem>

#include "problems/input_error.h"
#include "problems/split.h"

namespace ricochet {
namespace {

using Drawn = Chart::Drawn;

constexpr int kTitleLine = 21, kKeyLine = 21;  // [px]

/// Any text as a string expression: between quotes, with those in it doubled, lines joined.
std::string quoted(const std::string& text) {
  std::string expression = "'";
  for (const char c : text) expression += c == '\'' ? "''" : c == '\n' ? "'.\"\\n\".'" : std::string(1, c);
  return expression + "'";
}

int title_lines(const std::string& text) {
  return text.empty() ? 0 : 1 + static_cast<int>(std::ranges::count(text, '\n'));
}

std::size_t longest_line(const std::string& text) {
  std::size_t longest = 0;
  for (const auto& line : split(text, '\n')) longest = std::max(longest, line.size());
  return longest;
}

std::string line_color(const CurveLook& look) {
  return fmt::format("lc rgb '#{}'", palette_colour(look.colour));
}

std::string point_type(const CurveLook& look, double size) {
  static constexpr std::array<int, CurveLook::kSymbols> kFilled = {7, 5, 9, 13, 2, 3}, kOpen = {6, 4, 8, 12, 2, 3};
  const auto k = static_cast<std::size_t>(look.symbol % CurveLook::kSymbols);
  return fmt::format("pt {} ps {}", look.is_open ? kOpen[k] : kFilled[k], size);
}

/// Style of a series; the marks of stems are a second plot item.
std::string gnuplot_style(const Chart::Series& series) {
  const CurveLook& look = series.look;
  const int dash = 1 + look.dash % CurveLook::kDashes;
  constexpr std::size_t kMany = 60;
  const double size = series.points.size() > kMany ? 0.4 : 0.6;
  switch (series.drawn) {
    case Drawn::both:
      return fmt::format("with linespoints {} dt {} {} lw 1.6", line_color(look), dash, point_type(look, size));
    case Drawn::line:
      return fmt::format("with lines {} dt {} lw 1.6", line_color(look), dash);
    case Drawn::marks:
      return fmt::format("with points {} {}", line_color(look), point_type(look, size));
    case Drawn::steps:
      return fmt::format("with steps {} dt {} lw 1.8", line_color(look), dash);
    case Drawn::stems:
      return fmt::format("with impulses {} lw 2", line_color(look));
    case Drawn::failed:
      return fmt::format("axes x1y2 with points {} pt 2 ps 0.9 lw 1.6", line_color(look));
    case Drawn::reference:
      return "with lines lc rgb '#bdbdbd' lw 2.5";
    case Drawn::cells:
      return "with image pixels";
  }
  return "";
}

/// A data block. A point without a place ends a line.
std::string block_text(const std::string& name, const Chart::Panel& panel, const Chart::Series& series) {
  std::string text = fmt::format("${} << EOD\n", name);
  for (std::size_t k = 0; k < series.points.size(); ++k) {
    const auto& [x, y] = series.points[k];
    if (series.drawn == Drawn::failed)
      text += fmt::format("{:.10g} 1\n", x);
    else if (series.drawn == Drawn::cells)
      text += fmt::format("{:.6g} {:.6g} {:.4g}\n", x, y, series.values[k]);
    else
      text += panel.has_place({x, y}) ? fmt::format("{:.10g} {:.10g}\n", x, y) : "\n";
  }
  return text + "EOD\n";
}

/// Settings of one axis. @param name  "x"
std::string axis_text(const std::string& name, const Chart::Axis& axis, const std::pair<double, double>& range) {
  const auto [low, high] = range;
  std::string text = axis.is_log ? fmt::format("set logscale {}\n", name) : fmt::format("unset logscale {}\n", name);
  text += fmt::format("set {}range [{:.8g}:{:.8g}]\nset {}label {}\n", name, axis.is_reversed ? high : low,
                      axis.is_reversed ? low : high, name, quoted(axis.label));
  const bool has_short_numbers = !axis.is_log || (low > 5e-3 && high < 2e5);
  const bool has_few_decades = axis.is_log && std::log10(high / low) < (has_short_numbers ? 2.2 : 1.3);
  std::string tics, format = has_short_numbers || has_few_decades ? "%g" : "10^{%L}";
  if (axis.label.empty()) format.clear();
  for (std::size_t k = 0; k < axis.names.size(); ++k)
    tics += fmt::format("{}{} {}", k ? ", " : "", quoted(axis.names[k]), k);
  if (has_few_decades) {
    std::vector<double> digits = {1, 2, 5};
    if (high < 10 * low) digits = {1, 1.5, 2, 3, 4, 5, 7};
    for (double decade = std::pow(10, std::floor(std::log10(low))); decade <= high; decade *= 10) {
      for (const double digit : digits) tics += fmt::format("{}{:g}", tics.empty() ? "" : ", ", digit * decade);
    }
  }
  return text + fmt::format("set {0}tics {1} {2}\nset format {0} '{3}'\n", name,
                            axis.names.empty() ? "enhanced" : "noenhanced",
                            tics.empty() ? "autofreq" : "(" + tics + ")", format);
}

/// One entry of the key for each label: with the first of its series.
std::vector<const Chart::Series*> key_of(const std::vector<Chart::Panel>& panels) {
  std::vector<const Chart::Series*> key;
  for (const auto& panel : panels) {
    for (const auto& series : panel.series) {
      if (!series.label.empty() && std::ranges::none_of(key, [&](auto* s) { return s->label == series.label; }))
        key.push_back(&series);
    }
  }
  std::ranges::stable_partition(key, [](auto* s) { return s->drawn != Drawn::reference; });
  return key;
}

/// Positions of all parts [px], from the left and from above.
struct Layout {
  std::vector<int> left, right, top, bottom;  ///< of the columns' and the rows' areas
  int width = 0, height = 0, key_columns = 1, key_height = 0;

  explicit Layout(const Chart& chart) {
    constexpr int kEdge = 26, kLabel = 40, kNumbers = 50, kAround = 14, kScale = 100;
    constexpr double kLetter = 8;
    const int n = static_cast<int>(chart.panels.size());
    const int columns = std::clamp(n, 1, chart.columns), rows = (n + columns - 1) / columns;
    left.resize(columns);
    right.resize(columns);
    top.resize(rows);
    bottom.resize(rows);
    for (int c = 0; c < columns; ++c) {
      int room = kAround;
      for (int k = c; k < n; k += columns) {
        const Chart::Axis& y = chart.panels[k].y;
        int numbers = y.label.empty() ? 0 : kNumbers + kLabel;
        for (const auto& name : y.names)
          numbers =
              std::max(numbers, static_cast<int>(kLetter * name.size()) + kAround + (y.label.empty() ? 0 : kLabel));
        room = std::max(room, numbers);
      }
      left[c] = width + room;
      right[c] = left[c] + chart.width;
      width = right[c] + kEdge;
    }
    for (int r = 0; r < rows; ++r) {
      int above = kAround, below = kAround;
      for (int k = r * columns; k < std::min(n, (r + 1) * columns); ++k) {
        const Chart::Panel& panel = chart.panels[k];
        const bool has_key = chart.has_key_each && !key_of({panel}).empty();
        above = std::max(above,
                         kAround + kTitleLine * (title_lines(panel.title) + has_key) + (panel.title.empty() ? 0 : 10));
        if (!panel.x.label.empty()) below = 2 * kAround + 2 * kTitleLine + 4;
      }
      top[r] = height + above;
      bottom[r] = top[r] + chart.height;
      height = bottom[r] + below;
    }
    if (!chart.scale.label.empty()) width += kScale;
    if (chart.has_key_each) return;
    constexpr int kSample = 90;
    constexpr double kKeyLetter = 7.5;  // of the key's font
    std::size_t longest = 1;
    const auto key = key_of(chart.panels);
    for (const auto* series : key) longest = std::max(longest, series->label.size());
    key_columns = std::max(1, static_cast<int>(width / (kSample + kKeyLetter * static_cast<double>(longest))));
    const int lines = (static_cast<int>(key.size()) + key_columns - 1) / key_columns;
    if (lines > 0) key_height = kAround + kKeyLine * lines;
    height += key_height;
  }

  std::string margins(int from_left, int to_right, int from_top, int to_bottom) const {
    return fmt::format(
        "set lmargin at screen {:.5f}\nset rmargin at screen {:.5f}\nset tmargin at screen {:.5f}\n"
        "set bmargin at screen {:.5f}\n",
        static_cast<double>(from_left) / width, static_cast<double>(to_right) / width,
        1 - static_cast<double>(from_top) / height, 1 - static_cast<double>(to_bottom) / height);
  }
};

std::string script_head(const Layout& layout, const std::string& name, bool is_pdf) {
  constexpr double kInch = 72;  // [px], for which the size of letters is meant
  const std::string terminal = is_pdf
                                   ? fmt::format("pdfcairo size {:.4f}in,{:.4f}in font \"Helvetica,14\"",
                                                 layout.width / kInch, layout.height / kInch)
                                   : fmt::format("svg size {},{} dynamic font \"Helvetica,14\" background \"#ffffff\"",
                                                 layout.width, layout.height);
  return fmt::format(R"(set encoding utf8
set terminal {}
set output '{}.{}'
set border 3 lc rgb "#404040"
set tics nomirror textcolor rgb "#404040"
set grid lc rgb "#e4e4e4" lt 1 lw 0.7
set xzeroaxis lc rgb "#b0b0b0" lt 1
set key noenhanced
set title noenhanced
set xlabel noenhanced
set ylabel noenhanced
set y2range [0:1]
set multiplot
)",
                     terminal, name, is_pdf ? "pdf" : "svg");
}

/// Blocks and the plot command of a panel. @param id  unique in the script
std::string plot_text(const Chart& chart, const Chart::Panel& panel, const std::string& id) {
  std::string blocks;
  std::vector<std::string> items;
  const auto add = [&](const Chart::Series& series, const std::string& name) {
    const std::string title =
        chart.has_key_each && !series.label.empty() ? "title " + quoted(series.label) : std::string("notitle");
    const char* columns = series.drawn == Drawn::cells ? "using 1:2:3 " : "";
    items.push_back(fmt::format("${} {}{} {}", name, columns, gnuplot_style(series), title));
    if (series.drawn == Drawn::stems)
      items.push_back(
          fmt::format("${} with points {} {} notitle", name, line_color(series.look), point_type(series.look, 0.6)));
  };
  for (const bool is_reference : {true, false}) {  // below the curves, but above cells
    for (std::size_t k = 0; k < panel.series.size(); ++k) {
      const Chart::Series& series = panel.series[k];
      if ((series.drawn == Drawn::reference) != is_reference) continue;
      const std::string name = fmt::format("{}_{}", id, k);
      blocks += block_text(name, panel, series);
      add(series, name);
    }
  }
  std::ranges::stable_partition(items, [](const std::string& item) { return item.find("image") != item.npos; });
  return blocks +
         fmt::format("plot {}\n", items.empty() ? "NaN notitle" : fmt::format("{}", fmt::join(items, ", \\\n     ")));
}

std::string panel_text(const Chart& chart, const Layout& layout, std::size_t k) {
  const Chart::Panel& panel = chart.panels[k];
  const std::size_t column = k % layout.left.size(), row = k / layout.left.size();
  constexpr std::size_t kLetter = 8;  // [px], of the larger font
  const bool has_key = chart.has_key_each && !key_of({panel}).empty();
  std::string text = layout.margins(layout.left[column], layout.right[column], layout.top[row], layout.bottom[row]);
  text += fmt::format("set title {} font ',{}' offset 0,{}\n", quoted(panel.title),
                      kLetter * longest_line(panel.title) < static_cast<std::size_t>(chart.width) ? 14 : 11,
                      has_key ? 0.8 : 0);
  text += has_key ? "set key horizontal right bottom at graph 1,1 samplen 1.6 spacing 0.9 font ',11'\n" : "unset key\n";
  return text + axis_text("x", panel.x, panel.x_range()) + axis_text("y", panel.y, panel.y_range()) +
         plot_text(chart, panel, fmt::format("p{}", k));
}

/// The colours of cells, and their scale on the right; light is little, after ColorBrewer's YlGnBu.
std::string scale_text(const Chart::Scale& scale, const Layout& layout) {
  if (scale.label.empty()) return "";
  constexpr double kFromRight = 100, kBreadth = 16;  // [px]
  return fmt::format(
      "set border 15\nunset grid\nset cbrange [{}:{}]\nset format cb '10^{{%g}}'\nset cblabel {}\n"
      "set palette defined (0 '#ffffd9', 1 '#c7e9b4', 2 '#41b6c4', 3 '#225ea8', 4 '#081d58')\n"
      "set colorbox user origin screen {:.4f},0.25 size screen {:.4f},0.5\n",
      scale.from, scale.to, quoted(scale.label), 1 - kFromRight / layout.width, kBreadth / layout.width);
}

std::string key_text(const Chart& chart, const Layout& layout) {
  if (layout.key_height == 0) return "";
  std::string text =
      "unset logscale\nunset xzeroaxis\nunset border\nunset tics\nunset grid\nunset title\nunset xlabel\nunset ylabel\n" +
      layout.margins(20, layout.width - 10, layout.height - layout.key_height, layout.height) +
      fmt::format(
          "set key center center horizontal maxcols {} reverse Left samplen 3 font ',13'\n"
          "plot [0:1][0:1] NaN notitle",
          layout.key_columns);
  for (const auto* series : key_of(chart.panels))
    text += fmt::format(", \\\n     NaN {} title {}", gnuplot_style(*series), quoted(series->label));
  return text + "\n";
}

void run_gnuplot(const FigureFolder& folder, const std::string& name, const std::string& script) {
  folder.write(name + ".gp", script);
  const std::string command = fmt::format("cd '{}' && gnuplot '{}.gp' 2>'{}.log'", folder.path(), name, name);
  if (std::system(command.c_str()) != 0)
    throw InputError("figure", name, fmt::format("gnuplot failed, see {}/{}.log", folder.path(), name));
  std::filesystem::remove(std::filesystem::path(folder.path()) / (name + ".log"));
}

/// Charts that are pictures of their own: the panels with a file, and the others together.
std::vector<Chart> pictures_of(const Chart& chart) {
  Chart rest = chart;
  rest.panels.clear();
  std::vector<Chart> pictures;
  for (Chart::Panel panel : chart.panels) {
    std::erase_if(panel.series, [](const auto& series) { return series.is_minor; });
    if (panel.file.empty()) {
      rest.panels.push_back(panel);
      continue;
    }
    Chart& picture = pictures.emplace_back(chart);
    picture.file = panel.file;
    picture.panels = {panel};
  }
  if (!rest.panels.empty()) pictures.insert(pictures.begin(), rest);
  return pictures;
}

}  // namespace

bool can_draw() {
  return std::system("gnuplot --version >/dev/null 2>&1") == 0;
}

std::string gnuplot_script(const Chart& chart, bool is_pdf) {
  const Layout layout(chart);
  std::string text = script_head(layout, chart.file, is_pdf) + scale_text(chart.scale, layout);
  for (std::size_t k = 0; k < chart.panels.size(); ++k)
    text += panel_text(chart, layout, k) + (chart.panels[k].has_cells() ? "unset colorbox\n" : "");  // one for all
  return text + key_text(chart, layout) + "unset multiplot\n";
}

std::vector<Figure> draw_chart(const FigureFolder& folder, const Chart& chart) {
  std::vector<Figure> figures;
  for (const Chart& picture : pictures_of(chart)) {
    if (folder.with_pdf()) run_gnuplot(folder, picture.file, gnuplot_script(picture, true));
    run_gnuplot(folder, picture.file, gnuplot_script(picture));  // the script that stays
    figures.push_back({picture.file + ".svg", chart.title, chart.caption});
  }
  return figures;
}

}  // namespace ricochet
