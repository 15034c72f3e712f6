#include "reports/pgfplots.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "problems/input_error.h"
#include "reports/curve_look.h"
#include "reports/latex.h"

namespace ricochet {
namespace {

using nlohmann::json;
using Points = std::vector<std::pair<double, double>>;

struct Curve {
  std::string label, style;
  Points points;
};

struct Picture {
  std::string title, kind, options;
  std::vector<Curve> curves;
};

/// Powers of ten between two numbers, ten at most: more of them run into each other.
std::string ticks_text(double least, double most) {
  const int first = static_cast<int>(std::floor(std::log10(least))),
            last = static_cast<int>(std::ceil(std::log10(most)));
  const int by = std::max(1, (last - first + 9) / 10);
  std::string text;
  for (int k = last; k >= first; k -= by) text = fmt::format("1e{}{}{}", k, text.empty() ? "" : ", ", text);
  return text;
}

std::string x_ticks(const std::vector<Curve>& curves) {
  double least = 1e300, most = 0;
  for (const auto& curve : curves) {
    for (const auto& [x, y] : curve.points) {
      least = std::min(least, std::max(x, 1e-300));
      most = std::max(most, x);
    }
  }
  return most > 0 ? fmt::format(", xtick={{{}}}", ticks_text(least, most)) : "";
}

Picture work_precision(const json& data) {
  const double largest = data.value("largest_error", 10.0);
  Picture picture{.title = "", .kind = "loglogaxis", .options = "", .curves = {}};
  for (std::size_t m = 0; m < data.at("methods").size(); ++m) {
    const json& method = data["methods"][m];
    Curve curve{.label = method.at("label"), .style = CurveLook::of(method, CurveLook::of(m)).pgfplots(), .points = {}};
    for (const auto& run : data.at("runs")) {
      if (run.at("method") == m)
        curve.points.emplace_back(std::min(largest, run.at("error").get<double>()), run.at("time").get<double>());
    }
    if (!curve.points.empty()) picture.curves.push_back(curve);
  }
  picture.options = fmt::format("xlabel={{{}}}, ylabel={{CPU time [ms]}}{}",
                                escape_latex(data.at("errors").front().at("label")), x_ticks(picture.curves));
  return picture;
}

Picture profile(const json& data) {
  const double problems = data.at("problems");
  Picture picture{
      .title = "",
      .kind = "semilogxaxis",
      .options = fmt::format("xlabel={{$\\tau$}}, ylabel={{share of {} problems}}, ymin=0, ymax=1.02", problems),
      .curves = {}};
  double last = 10;
  for (const auto& solver : data.at("solvers")) {
    for (const double ratio : solver.at("ratios")) last = std::max(last, ratio);
  }
  for (const auto& solver : data.at("solvers")) {
    Curve curve{.label = solver.at("name"), .style = "", .points = {{1, 0}}};
    // A mark on some of the steps tells curves of similar colours apart.
    const std::size_t every = std::max<std::size_t>(1, solver.at("ratios").size() / 5);
    curve.style = fmt::format("const plot, {}, mark repeat={}",
                              CurveLook::of(solver, CurveLook::of(picture.curves.size())).pgfplots(), every);
    double solved = 0;
    for (const double ratio : solver.at("ratios")) curve.points.emplace_back(ratio, ++solved / problems);
    curve.points.emplace_back(last, solved / problems);
    picture.curves.push_back(curve);
  }
  return picture;
}

Picture curve_panel(const json& panel) {
  Picture picture{.title = panel.at("title"), .kind = "loglogaxis", .options = "", .curves = {}};
  for (const auto& entry : panel.at("curves")) {
    const std::string drawn = entry.at("drawn");
    Curve curve{.label = entry.at("label"), .style = CurveLook::of(entry, {}).pgfplots(), .points = {}};
    if (drawn == "lines") curve.style += ", mark=none";
    if (drawn == "marks") curve.style += ", only marks";
    for (const auto& point : entry.at("points")) curve.points.emplace_back(point[0], point[1]);
    picture.curves.push_back(curve);
  }
  picture.options =
      fmt::format("title={{{}}}, xlabel={{{}}}, ylabel={{{}}}{}", escape_latex(picture.title),
                  escape_latex(panel.at("x_label")), escape_latex(panel.at("y_label")), x_ticks(picture.curves));
  return picture;
}

std::vector<Picture> pictures_of(const Section::Chart& chart) {
  if (chart.kind == "work_precision") return {work_precision(chart.data)};
  if (chart.kind == "profile") return {profile(chart.data)};
  if (chart.kind != "curves") throw InputError("chart", chart.kind, "work_precision, profile or curves is required");
  std::vector<Picture> pictures;
  for (const auto& panel : chart.data.at("panels")) {
    if (!panel.at("curves").empty()) pictures.push_back(curve_panel(panel));
  }
  return pictures;
}

/// Two columns for each curve; those of shorter ones end with nan, which PGFPlots leaves out.
std::string columns_text(const Picture& picture) {
  std::string text;
  std::size_t rows = 0;
  for (std::size_t k = 0; k < picture.curves.size(); ++k) {
    text += fmt::format("# columns {} and {}: {}\n", 2 * k, 2 * k + 1, picture.curves[k].label);
    rows = std::max(rows, picture.curves[k].points.size());
  }
  for (std::size_t r = 0; r < rows; ++r) {
    for (std::size_t k = 0; k < picture.curves.size(); ++k) {
      const Points& points = picture.curves[k].points;
      text += k > 0 ? " " : "";
      text += r < points.size() ? fmt::format("{} {}", points[r].first, points[r].second) : "nan nan";
    }
    text += "\n";
  }
  return text;
}

/// @param file  of the numbers; empty: they stand here
std::string picture_text(const Picture& picture, const std::string& file) {
  std::string body;
  for (std::size_t k = 0; k < picture.curves.size(); ++k) {
    const Curve& curve = picture.curves[k];
    std::string table;
    if (file.empty()) {
      table = " table {\n";
      for (const auto& [x, y] : curve.points) table += fmt::format("{} {}\n", x, y);
      table += "}";
    } else {
      table = fmt::format(" table[header=false, x index={}, y index={}] {{{}}}", 2 * k, 2 * k + 1, file);
    }
    const std::string quiet = curve.label.empty() ? ", forget plot" : "";
    body += fmt::format("\\addplot[{}, mark size=1.2pt{}]{};\n", curve.style, quiet, table);
    if (quiet.empty()) body += fmt::format("\\addlegendentry{{{}}}\n", escape_latex(curve.label));
  }
  std::size_t longest = 0;
  for (const auto& curve : picture.curves) longest = std::max(longest, curve.label.size());
  constexpr std::size_t kMany = 24, kLetters = 130;  // in a line of the key
  const std::size_t columns =
      picture.curves.size() > kMany ? 3 : std::clamp<std::size_t>(kLetters / (longest + 8), 1, 3);
  return latex_palette() +
         fmt::format(
             "\\begin{{tikzpicture}}\n\\begin{{{0}}}[width=13cm, height=9cm, {1}, grid=major, legend columns={2}, "
             "legend cell align=left,\n  legend style={{at={{(0.5,-0.16)}}, anchor=north, "
             "font=\\scriptsize}}]\n{3}\\end{{{0}}}\n\\end{{tikzpicture}}\n",
             picture.kind, picture.options, columns, body);
}

}  // namespace

bool has_pgfplots(const Section::Chart& chart) {
  const auto is_other = [](const auto& panel) { return panel.contains("x_names") || panel.contains("is_log_y"); };
  if (chart.kind == "curves") return std::ranges::none_of(chart.data.at("panels"), is_other);  // of logarithmic axes
  return chart.kind == "work_precision" || chart.kind == "profile";
}

std::string pgfplots(const Section::Chart& chart, std::vector<PgfplotsData>* data, const std::string& stem) {
  std::string text;
  std::size_t count = 0;
  for (const Picture& picture : pictures_of(chart)) {
    ++count;
    std::string file;
    if (data) {
      file = stem + (count > 1 ? fmt::format("_{}", count) : "") + ".dat";
      data->push_back({file, columns_text(picture)});
    }
    text += fmt::format("% {}{}\n", chart.title, picture.title.empty() ? "" : ": " + picture.title) +
            picture_text(picture, file);
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
