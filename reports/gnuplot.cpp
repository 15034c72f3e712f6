#include "reports/gnuplot.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <regex>

#include "reports/curve_look.h"

namespace ricochet {

std::string gnuplot_head(int width, int height) {
  return fmt::format(R"(set encoding utf8
set terminal svg size {},{} dynamic font "Helvetica,14" background "#ffffff"
set border 3 lc rgb "#404040"
set tics nomirror textcolor rgb "#404040"
set grid lc rgb "#e4e4e4" lt 1 lw 0.7
set key noenhanced
set title noenhanced
set xlabel noenhanced
set ylabel noenhanced
)",
                     width, height);
}

std::string pdf_script(const std::string& script) {
  static const std::regex terminal(R"re(set terminal svg size (\d+),(\d+) dynamic font "Helvetica,(\d+)"[^\n]*)re"),
      output(R"re((set output '[^'\n]*)\.svg')re");
  std::smatch size;
  if (!std::regex_search(script, size, terminal)) return script;
  constexpr double kPixels = 72;  // to the inch, for which the size of letters is meant
  const std::string pdf = fmt::format("set terminal pdfcairo size {:.4f}in,{:.4f}in font \"Helvetica,{}\"",
                                      std::stod(size[1]) / kPixels, std::stod(size[2]) / kPixels, size[3].str());
  return std::regex_replace(std::regex_replace(script, terminal, pdf), output, "$1.pdf'");
}

std::string KeyedPanels::script(const std::string& name) const {
  constexpr int kKeyLine = 21, kAroundKey = 36, kSample = 90;     // [px]
  constexpr double kLetter = 9.5;                                 // [px], of the key's font
  constexpr int kLeft = 80, kRight = 25, kTop = 48, kBelow = 62;  // of a panel: tics and labels
  const int used = std::min(columns, static_cast<int>(panels.size()));
  const int rows = (static_cast<int>(panels.size()) + columns - 1) / columns;
  const int width = panel_width * used;
  std::size_t longest = 1;
  for (const Entry& entry : key) longest = std::max(longest, entry.title.size());
  const int key_columns = std::max(1, static_cast<int>(width / (kSample + kLetter * static_cast<double>(longest))));
  const int key_lines = (static_cast<int>(key.size()) + key_columns - 1) / key_columns;
  const int key_height = kAroundKey + kKeyLine * key_lines;
  const int height = panel_height * rows + key_height;
  const auto margins = [&](int left, int right, int top, int bottom) {  // [px], from the left and from above
    return fmt::format(
        "set lmargin at screen {:.5f}\nset rmargin at screen {:.5f}\nset tmargin at screen {:.5f}\n"
        "set bmargin at screen {:.5f}\n",
        static_cast<double>(left) / width, static_cast<double>(right) / width, 1 - static_cast<double>(top) / height,
        1 - static_cast<double>(bottom) / height);
  };
  const std::string head = gnuplot_head(width, height);
  std::string text = head + fmt::format("set output '{}.svg'\nset multiplot\n", name);
  for (std::size_t k = 0; k < panels.size(); ++k) {
    const int column = static_cast<int>(k) % columns, row = static_cast<int>(k) / columns;
    text += "unset key\n" +
            margins(column * panel_width + kLeft, (column + 1) * panel_width - kRight, row * panel_height + kTop,
                    (row + 1) * panel_height - kBelow) +
            panels[k] +
            "unset arrow\nunset logscale\nunset title\nset format '%g'\nset xrange [*:*] "
            "noreverse\nset yrange [*:*] noreverse\nset xtics autofreq\nset ytics autofreq\n";
  }
  PlotCommand entries;
  entries.add("[0:1][0:1] NaN notitle");
  for (const Entry& entry : key) entries.add(fmt::format("NaN {} title {}", entry.style, gnuplot_text(entry.title)));
  return text + "unset border\nunset tics\nunset grid\nunset xlabel\nunset ylabel\n" +
         margins(20, width - 10, height - key_height, height) +
         fmt::format("set key center center horizontal maxcols {} reverse Left samplen 3 font ',13' noenhanced\n",
                     key_columns) +
         entries.text() + "unset multiplot\n";
}

std::string data_block(const std::string& name, const Points& points) {
  std::string text = fmt::format("${} << EOD\n", name);
  for (const auto& [x, y] : points) text += std::isnan(y) ? "\n" : fmt::format("{:.10g} {:.10g}\n", x, y);
  return text + "EOD\n";
}

std::string gnuplot_text(const std::string& text) {
  std::string quoted = "'";
  for (const char c : text) quoted += c == '\'' ? std::string("''") : std::string(1, c);
  return quoted + "'";
}

std::pair<double, double> decades(const std::vector<double>& values) {
  const auto [low, high] = std::ranges::minmax_element(values);
  return {std::pow(10, std::floor(std::log10(*low))), std::pow(10, std::ceil(std::log10(*high)))};
}

const std::string& curve_color(std::size_t k) {
  static const auto colors = [] {
    std::vector<std::string> list;
    for (std::size_t c = 0; c < CurveLook::kColours; ++c) list.push_back("#" + palette_colour(CurveLook::of(c).colour));
    return list;
  }();
  return colors[k % colors.size()];
}

void Panel::add(const Points& points, std::size_t color, const std::string& style, const std::string& title) {
  if (points.empty()) return;
  const std::string name = fmt::format("{}_{}", id_, count_++);
  data_ += data_block(name, points);
  plot_.add(fmt::format("${} {} lc rgb '{}' {}", name, style, curve_color(color),
                        title.empty() ? "notitle" : "title " + gnuplot_text(title)));
}

}  // namespace ricochet
