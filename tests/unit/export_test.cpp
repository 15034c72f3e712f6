// Results for papers and other programs.
#include "reports/export.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <set>

#include "bench/experiment/experiment_file.h"
#include "problems/input_error.h"
#include "problems/input_text.h"
#include "reports/curve_look.h"

namespace ricochet {
namespace {

TEST(Export, LatexHasRulesOfBooktabsAndEscapesText) {
  const Table table{.title = "Cost & error_x",
                    .note = "50 % of all",
                    .columns = {{"method", true}, {"empty"}, {"error"}, {"why", true}},
                    .rows = {{"a_b", "-", "1e-3", std::string(40, 'c')}, {"--c, h̄ <= 1", "", "2", ""}}};
  const std::string text = latex(table, "tab:x");
  EXPECT_NE(text.find("\\begin{tabular}{lr>{\\raggedright\\arraybackslash}p{14em}}\n    \\toprule\n"
                      "    method & error & why \\\\\n    \\midrule\n    a\\_b & 1e-3 & ccc"),
            std::string::npos)
      << text;
  EXPECT_NE(text.find("    -{}-c, $\\bar h$ $\\leq$ 1 & 2 &  \\\\\n    \\bottomrule"), std::string::npos) << text;
  EXPECT_NE(text.find("\\caption{Cost \\& error\\_x}\n  \\label{tab:x}"), std::string::npos);
  EXPECT_NE(text.find("50 \\% of all"), std::string::npos);
}

TEST(Export, LatexBreaksLongTables) {
  Table table{.title = "T", .note = "", .columns = {{"method", true}, {"x"}}, .rows = {}};
  table.rows.assign(40, {"m", "1"});
  EXPECT_EQ(latex(table, "t").find("longtable"), std::string::npos);
  table.rows.push_back({"m", "1"});
  EXPECT_NE(latex(table, "t").find("\\begin{longtable}{lr}"), std::string::npos);
}

TEST(Export, TakesChosenColumns) {
  const std::vector<std::string> known = {"method", "drift, worst [deg]", "time [us]"};
  EXPECT_EQ(headers_in("time,drift, worst [deg],method", known),
            (std::vector<std::string>{"time", "drift, worst [deg]", "method"}));
  EXPECT_THROW(headers_in("method,speed", known), InputError);
  EXPECT_THROW(headers_in("method,", known), InputError);
  const Table table{
      .title = "T", .note = "", .columns = {{"method", true}, {"time [us]"}}, .rows = {{"a", "1"}, {"b", "2"}}};
  const Table chosen = with_columns(table, {"time", "method", "order"});
  EXPECT_EQ(chosen.columns.size(), 2u);
  EXPECT_EQ(chosen.rows[1], (std::vector<std::string>{"2", "b"}));
}

TEST(Export, TidyHasALinePerRunWithAllDigits) {
  const Results results = parse_results("f", R"~({"kind": "header", "schema": 1}
{"kind": "run", "method": "a,b", "error": 0.1234567890123456, "work": {"linearSolves": 3}, "names": ["x", "y"], "q": [1, 2]}
{"kind": "run", "method": "c", "error": null, "work": {"linearSolves": 4}, "names": []}
{"kind": "time", "row": 1, "timing": {"median": 1e-7}}
{"kind": "end"}
)~");
  EXPECT_EQ(tidy_csv(results),
            "error,method,names,work_linear_solves,timing_median\n"
            "0.1234567890123456,\"a,b\",x;y,3,NaN\n"
            "NaN,c,,4,1e-07\n");
  EXPECT_THROW(tidy_csv(parse_results("f", "{\"kind\": \"header\", \"schema\": 1}\n{\"kind\": \"end\"}\n")),
               InputError);
}

TEST(Export, PgfplotsHasTheDataOfTheChart) {
  Section::Chart chart{
      .kind = "profile", .name = "n", .table = "t", .title = "T", .caption = "c", .data = {}, .still = {}};
  chart.data = {{"problems", 4}, {"solvers", {{{"name", "a_b"}, {"ratios", {1.0, 3.0}}}}}};
  const std::string text = pgfplots(chart);
  EXPECT_NE(text.find("1 0\n1 0.25\n3 0.5\n10 0.5\n"), std::string::npos) << "what it does not solve is infinite\n"
                                                                          << text;
  EXPECT_NE(text.find("\\addlegendentry{a\\_b}"), std::string::npos);
  chart.kind = "work_precision";
  chart.data = {{"errors", {{{"label", "E"}}}},
                {"methods", {{{"label", "first"}}, {{"label", "second"}}}},
                {"runs", {{{"method", 1}, {"error", 1e-3}, {"time", 2.5}}}}};
  EXPECT_NE(pgfplots(chart).find("0.001 2.5\n};\n\\addlegendentry{second}"), std::string::npos) << pgfplots(chart);
  EXPECT_EQ(pgfplots(chart).find("first"), std::string::npos) << "it has no run";
  chart.data["largest_error"] = 1e-4;
  chart.data["methods"][1].update({{"colour", 3}, {"symbol", 2}, {"dash", 1}});
  EXPECT_NE(pgfplots(chart).find("0.0001 2.5\n"), std::string::npos) << "on the edge that the chart states";
  EXPECT_NE(pgfplots(chart).find("color=ricochet3, mark=triangle*, mark options={solid}, dashed"), std::string::npos);
  std::vector<PgfplotsData> data;
  EXPECT_NE(pgfplots(chart, &data, "fig").find("table[header=false, x index=0, y index=1] {fig.dat}"),
            std::string::npos);
  ASSERT_EQ(data.size(), 1u);
  EXPECT_EQ(data[0].text, "# columns 0 and 1: second\n0.0001 2.5\n");
  chart.kind = "verdicts";
  EXPECT_THROW(pgfplots(chart), InputError);
}

TEST(Export, PgfplotsHasAPicturePerPanel) {
  const Section::Chart chart{
      .kind = "curves",
      .name = "n",
      .table = "t",
      .title = "T",
      .caption = "c",
      .data = curves_data({{.title = "left",
                            .x_label = "h̄",
                            .y_label = "E",
                            .curves = {{.label = "a", .look = {}, .points = {{1, 2}, {2, 4}, {3, 0}}},
                                       {.label = "", .look = {}, .drawn = "lines", .points = {{1, 1}}}}},
                           {.title = "none", .x_label = "", .y_label = "", .curves = {}}}),
      .still = {}};
  std::vector<PgfplotsData> data;
  const std::string text = pgfplots(chart, &data, "fig");
  EXPECT_NE(text.find("title={left}, xlabel={$\\bar h$}"), std::string::npos) << text;
  EXPECT_NE(text.find("mark=none, mark size=1.2pt, forget plot]"), std::string::npos) << text;
  ASSERT_EQ(data.size(), 1u) << "an empty panel has no picture";
  EXPECT_EQ(data[0].text, "# columns 0 and 1: a\n# columns 2 and 3: \n1 2 1 1\n2 4 nan nan\n")
      << "what has no logarithm is left out";
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
  nlohmann::json curve;
  CurveLook::of(9).put_into(curve);
  EXPECT_EQ(CurveLook::of(curve, {}), CurveLook::of(9));
}

TEST(CurveLook, HasThePaletteOfTheSite) {
  const std::string css = read_input_text(find_project_file("reports/site/src/site.css"), "style sheet");
  for (int k = 0; k < CurveLook::kColours; ++k)
    EXPECT_NE(css.find(fmt::format("--c{}: #{};", k, palette_colour(k))), std::string::npos) << k;
}

}  // namespace
}  // namespace ricochet
