// Results for papers and other programs.
#include "reports/export.h"

#include <gtest/gtest.h>

#include "problems/input_error.h"

namespace ricochet {
namespace {

TEST(Export, LatexHasRulesOfBooktabsAndNoCharacterOfItsOwn) {
  const Table table{.title = "Cost & error_x",
                    .note = "50 % of all",
                    .columns = {{"method", true}, {"error"}},
                    .rows = {{"a_b", "1e-3"}}};
  const std::string text = latex(table, "tab:x");
  EXPECT_NE(text.find("\\begin{tabular}{lr}\n    \\toprule\n    method & error \\\\\n    \\midrule\n    a\\_b & 1e-3 "
                      "\\\\\n    \\bottomrule"),
            std::string::npos)
      << text;
  EXPECT_NE(text.find("\\caption{Cost \\& error\\_x}"), std::string::npos);
  EXPECT_NE(text.find("50 \\% of all"), std::string::npos);
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
  chart.kind = "verdicts";
  EXPECT_THROW(pgfplots(chart), InputError);
}

}  // namespace
}  // namespace ricochet
