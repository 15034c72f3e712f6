// A chart and what is rendered from it: gnuplot, PGFPlots, CSV, data of the site.
#include "reports/chart.h"

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <cmath>
#include <filesystem>
#include <set>

#include "bench/experiment/experiment_file.h"
#include "bench/measure/data_folder.h"
#include "problems/input_text.h"
#include "reports/render/csv.h"
#include "reports/render/gnuplot.h"
#include "reports/render/json.h"
#include "reports/render/pgfplots.h"
#include "reports/text_file.h"

namespace ricochet {
namespace {

using Drawn = Chart::Drawn;

/// Two panels with a point that has no logarithm, a failed run, a gap, and texts that formats must escape.
Chart small_chart() {
  Chart chart{.name = "small", .file = "results_small", .title = "T", .caption = "c"};
  Chart::Panel& left = chart.panel("A, left", {.label = "h̄ [s]", .is_log = true}, {.label = "it's", .is_log = true});
  left.add("a_b", {.colour = 3, .symbol = 2, .dash = 1}, Drawn::both, {{0.1, 2}, {0.2, 4}, {0.3, 0}});
  left.add("", {.colour = 3}, Drawn::failed, {{0.4, Chart::kAuto}});
  left.add_power("order 1", 10, 1);
  Chart::Panel& right = chart.panel("right", {.label = "t", .from = 0, .to = 4}, {.label = "v"});
  right.add("a_b", {.colour = 3, .symbol = 2, .dash = 1}, Drawn::line, {{1, 1}, {2, 3}, {2, Chart::kAuto}, {2, 5}});
  right.add("stem", {.is_open = true}, Drawn::stems, {{3, 4}});
  return chart;
}

bool contains(const std::string& text, const std::string& part) {
  return text.find(part) != std::string::npos;
}

TEST(Chart, HasRangesOfItsPoints) {
  const Chart chart = small_chart();
  const auto [x_least, x_most] = chart.panels[0].x_range();
  EXPECT_TRUE(x_least < 0.1 && x_least > 0.05) << "the reference line and what has no logarithm count for nothing";
  EXPECT_TRUE(x_most > 0.4 && x_most < 0.6) << "a failed run has an abscissa";
  const auto [y_least, y_most] = chart.panels[0].y_range();
  EXPECT_TRUE(y_least > 1 && y_least < 2 && y_most > 4 && y_most < 6);
  EXPECT_EQ(chart.panels[1].x_range(), std::pair(0., 4.)) << "as stated";
  EXPECT_LT(chart.panels[1].y_range().first, 0) << "a stem begins at zero";
  const Chart::Panel empty{};
  EXPECT_LT(empty.x_range().first, empty.x_range().second);
  const Chart::Panel named{.x = {.label = "commit", .names = {"a", "b", "c"}}};
  EXPECT_LT(named.x_range().first, 0);
  EXPECT_GT(named.x_range().second, 2);
}

TEST(Chart, FindsThePanelOfATitle) {
  Chart chart = small_chart();
  EXPECT_EQ(&chart.panel("right", {}, {}), &chart.panels[1]);
  const Chart::Panel* const added = &chart.panel("new", {.label = "x"}, {});
  EXPECT_EQ(added, &chart.panels[2]);
  EXPECT_EQ(chart.panels[2].x.label, "x");
}

TEST(Chart, ReferenceIsAPower) {
  const Chart chart = small_chart();
  const Chart::Series& line = chart.panels[0].series.back();
  ASSERT_EQ(line.points.size(), 2u);
  for (const auto& [x, y] : line.points) EXPECT_DOUBLE_EQ(y, 10 * x);
  EXPECT_DOUBLE_EQ(line.points[0].second, chart.panels[0].y_range().first) << "it begins where it is inside";
}

TEST(Csv, HasEveryPointWithItsCurve) {
  EXPECT_EQ(chart_csv(small_chart()).substr(0, chart_csv(small_chart()).find("reference")),
            "panel,x axis,y axis,curve,drawn as,piece,x,y,value\n"
            "\"A, left\",h̄ [s],it's,a_b,line and marks,1,0.1,2,\n"
            "\"A, left\",h̄ [s],it's,a_b,line and marks,1,0.2,4,\n"
            "\"A, left\",h̄ [s],it's,a_b,line and marks,1,0.3,0,\n"
            "\"A, left\",h̄ [s],it's,a_b,failed,1,0.4,NaN,\n"
            "\"A, left\",h̄ [s],it's,order 1,");
  EXPECT_TRUE(contains(chart_csv(small_chart()), "right,t,v,a_b,line,1,2,3,\nright,t,v,a_b,line,2,2,5,\n"));
}

TEST(Csv, HasValuesOfCells) {
  Chart chart;
  chart.panel("p", {.label = "x"}, {.label = "y", .names = {"zero", "one"}})
      .series.push_back({.drawn = Drawn::cells, .points = {{0, 0}, {0.5, 1}}, .values = {-3, Chart::kAuto}});
  EXPECT_TRUE(contains(chart_csv(chart), "p,x,y,,cells,1,0,zero,-3\np,x,y,,cells,1,0.5,one,NaN\n")) << chart_csv(chart);
}

TEST(Gnuplot, ScriptHasOneKeyAndEscapesTexts) {
  const std::string script = gnuplot_script(small_chart());
  EXPECT_TRUE(contains(script, "set output 'results_small.svg'\n"));
  EXPECT_TRUE(contains(script, "set ylabel 'it''s'\n"));
  EXPECT_TRUE(contains(script, "$p0_0 << EOD\n0.1 2\n0.2 4\n\nEOD\n")) << "zero has no logarithm\n" << script;
  const auto keys = [&](const std::string& title) {
    std::size_t n = 0;
    for (auto at = script.find(title); at != std::string::npos; at = script.find(title, at + 1)) ++n;
    return n;
  };
  EXPECT_EQ(keys("title 'a_b'"), 1u) << "one entry for both panels";
  EXPECT_TRUE(contains(gnuplot_script(small_chart(), true), "set output 'results_small.pdf'\n"));
  Chart of_each = small_chart();
  of_each.has_key_each = true;
  EXPECT_FALSE(contains(gnuplot_script(of_each), "maxcols"));
}

TEST(Gnuplot, DrawsEveryFormOfASeries) {
  if (!can_draw()) GTEST_SKIP() << "gnuplot";
  Chart chart = small_chart();
  chart.scale = {.label = "colour", .from = -4, .to = 0};
  Chart::Panel& all = chart.panel("all\nforms", {.label = "x"}, {.label = "y", .names = {"zero", "one's", "two"}});
  all.series.push_back(
      {.drawn = Drawn::cells, .points = {{0, 0}, {1, 0}, {0, 1}, {1, 1}}, .values = {-1, -2, -3, Chart::kAuto}});
  all.add("steps", {.colour = 1}, Drawn::steps, {{0, 0}, {1, 1}, {2, 2}});
  all.add("marks", {.colour = 2, .symbol = 5}, Drawn::marks, {{0.5, 1.5}});
  chart.panel("nothing", {.label = "x"}, {.label = "y"});
  chart.panel("of its own", {.label = "x", .is_log = true, .is_reversed = true}, {.label = "y"}).file = "own";
  const std::string folder =
      (std::filesystem::temp_directory_path() / ("ricochet_chart_" + std::to_string(::getpid()))).string();
  const auto figures = draw_chart(FigureFolder(folder, true), chart);
  ASSERT_EQ(figures.size(), 2u);
  EXPECT_EQ(figures[1].file, "own.svg");
  const std::string svg = read_text(std::filesystem::path(folder) / figures[0].file);
  for (const char* text : {"A, left", "it's", "a_b", "order 1", "forms", "one's", "steps", "colour"})
    EXPECT_TRUE(contains(svg, text)) << text;
  EXPECT_TRUE(read_text(std::filesystem::path(folder) / "results_small.pdf").starts_with("%PDF"));
  EXPECT_TRUE(contains(read_text(std::filesystem::path(folder) / "results_small.gp"), "set terminal svg"));
  std::filesystem::remove_all(folder);
}

TEST(Json, HasThePointsThatAreDrawn) {
  Chart chart = small_chart();
  const auto panel = chart_json(chart).at("panels").at(0);
  EXPECT_EQ(panel.at("is_log_y"), true);
  const auto& curve = panel.at("curves").at(0);
  EXPECT_EQ(curve.at("points"), nlohmann::json::parse("[[0.1, 2.0], [0.2, 4.0]]")) << "zero has no logarithm";
  EXPECT_EQ(curve.at("colour"), 3);
  EXPECT_EQ(curve.at("symbol"), 2);
  EXPECT_EQ(curve.at("dash"), 1);
  const auto& failed = panel.at("curves").at(1);
  EXPECT_EQ(failed.at("drawn"), "marks");
  EXPECT_EQ(failed.at("points").at(0).at(1), chart.panels[0].y_range().second) << "on the upper frame";
  EXPECT_EQ(panel.at("x_range").at(0), chart.panels[0].x_range().first);
  chart.panels[0].x.is_reversed = true;
  EXPECT_EQ(chart_json(chart).at("panels").at(0).at("x_range").at(1), chart.panels[0].x_range().first);
  EXPECT_TRUE(is_interactive(chart));
  chart.has_key_each = true;
  EXPECT_FALSE(is_interactive(chart));
}

TEST(Pgfplots, HasAPicturePerPanel) {
  Chart chart = small_chart();
  chart.panel("none", {}, {});
  std::vector<PgfplotsData> data;
  const std::string text = pgfplots(chart, &data, "fig");
  EXPECT_TRUE(contains(text, "title={A, left},\n  xlabel={$\\bar h$ [s]}")) << text;
  EXPECT_TRUE(contains(text, "xmode=log"));
  EXPECT_TRUE(contains(text, "color=ricochet3, mark=triangle*, mark options={solid}, dashed")) << text;
  EXPECT_TRUE(contains(text, "\\addlegendentry{a\\_b}"));
  EXPECT_TRUE(contains(text, "only marks, mark size=1.2pt, unbounded coords=jump, forget plot]")) << "the failed run";
  EXPECT_TRUE(contains(text, "ycomb, color=ricochet0, mark=o"));
  EXPECT_TRUE(contains(text, "table[header=false, x index=0, y index=1] {fig.dat}"));
  ASSERT_EQ(data.size(), 2u) << "an empty panel has no picture";
  EXPECT_EQ(data[1].file, "fig_2.dat");
  EXPECT_EQ(data[1].text,
            "# columns 0 and 1: a_b\n# columns 2 and 3: stem\n1 1 3 4\n2 3 nan nan\nnan nan nan nan\n2 5 nan nan\n");
  EXPECT_TRUE(contains(pgfplots(chart), " table {\n0.1 2\n0.2 4\nnan nan\n};")) << "numbers in the picture";
  EXPECT_TRUE(has_pgfplots(chart));
  chart.panels[0].series.push_back({.drawn = Drawn::cells});
  EXPECT_FALSE(has_pgfplots(chart));
  EXPECT_FALSE(has_pgfplots({}));
}

TEST(CurveLook, DiffersInMoreThanItsColour) {
  std::set<std::pair<int, int>> colour_and_symbol, colour_and_dash;
  for (std::size_t k = 0; k < 24; ++k) {
    const CurveLook look = CurveLook::of(k);
    colour_and_symbol.emplace(look.colour, look.symbol);
    colour_and_dash.emplace(look.colour, look.dash);
  }
  EXPECT_EQ(colour_and_symbol.size(), 24u);
  EXPECT_EQ(colour_and_dash.size(), 24u);
}

TEST(CurveLook, HasThePaletteOfTheSite) {
  const std::string css = read_input_text(find_project_file("reports/site/src/site.css"), "style sheet");
  for (int k = 0; k < CurveLook::kColours; ++k)
    EXPECT_TRUE(contains(css, fmt::format("--c{}: #{};", k, palette_colour(k)))) << k;
}

}  // namespace
}  // namespace ricochet
