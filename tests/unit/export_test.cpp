// Results for papers and other programs.
#include "reports/export.h"

#include <gtest/gtest.h>

#include "problems/input_error.h"

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

}  // namespace
}  // namespace ricochet
