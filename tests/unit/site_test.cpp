// The site: what it says of methods and problems, and that every link of it leads somewhere.
#include <fmt/format.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <filesystem>
#include <iterator>
#include <regex>
#include <set>

#include "bench/site/drawn_scene.h"
#include "bench/site/expression_tex.h"
#include "bench/site/history_page.h"
#include "bench/site/problem_pages.h"
#include "bench/site/report_site.h"
#include "bench/site/site_texts.h"
#include "bench/studies/grid/fastest_rows.h"
#include "problems/input_error.h"
#include "problems/registry.h"
#include "reference/certified/certified_motion.h"
#include "reports/drawing/scene_drawing.h"
#include "reports/render/gnuplot.h"
#include "reports/text_file.h"
#include "tests/test_data.h"

namespace ricochet {
namespace {

namespace fs = std::filesystem;

TEST(ExpressionTex, IsTheFormula) {
  const GiNaC::symbol q("q[0]"), k("k"), m("m1"), theta("theta0"), height("height");
  EXPECT_EQ(expression_tex(q), "q_{0}");
  EXPECT_EQ(expression_tex(-k * q), "-k \\, q_{0}");
  EXPECT_EQ(expression_tex(k / (2 * m)), "\\frac{k}{2 \\, m_{1}}");
  EXPECT_EQ(expression_tex(height - q), "\\mathrm{height}-q_{0}") << "a sum leads with a plus";
  EXPECT_EQ(expression_tex(k * (height - q)), "\\left(\\mathrm{height}-q_{0}\\right) \\, k");
  EXPECT_EQ(expression_tex(-q - k), "-k-q_{0}");
  EXPECT_EQ(expression_tex(pow(q - height, 3) / (q - k)),
            "\\frac{\\left(\\mathrm{height}-q_{0}\\right)^{3}}{\\left(k-q_{0}\\right)}")
      << "both signs are gone";
  EXPECT_EQ(expression_tex(sin(theta)), "\\operatorname{sin}\\left(\\theta_{0}\\right)");
  EXPECT_EQ(expression_tex(sqrt(k) / pow(q + m, 2)), "\\frac{\\sqrt{k}}{\\left(m_{1}+q_{0}\\right)^{2}}");
  EXPECT_EQ(expression_tex(pow(k, -1)), "\\frac{1}{k}");
  EXPECT_EQ(expression_tex(GiNaC::ex(GiNaC::numeric(-3, 4)) * k), "-\\frac{3 \\, k}{4}");
}

const MethodEntry& method_named(const std::string& name) {
  static const std::vector<MethodEntry> list = methods();
  return *std::ranges::find(list, name, &MethodEntry::name);
}

const SceneEntry& scene_named(const std::string& id) {
  static const std::vector<SceneEntry> list = scenes();
  return *std::ranges::find(list, id, &SceneEntry::id);
}

TEST(Scheme, IsTheCommentOfTheMethod) {
  const auto stepping = scheme_of(method_named("moreau_jean"));
  ASSERT_TRUE(stepping);
  EXPECT_EQ(stepping->file, "methods/time_stepping/moreau_jean.cpp");
  EXPECT_TRUE(stepping->text.starts_with("Moreau-Jean time stepping"));
  EXPECT_NE(stepping->text.find("q_{k+1} = q_k + h (theta v_{k+1} + (1 - theta) v_k)"), std::string::npos);
  EXPECT_EQ(stepping->text.find("#include"), std::string::npos);
  const auto fesd = scheme_of(method_named("fesd"));
  ASSERT_TRUE(fesd);
  EXPECT_NE(fesd->text.find("v_j = v_0 + h sum_k a_jk w_k"), std::string::npos) << "of a header that its comment names";
  const auto siconos = scheme_of(method_named("siconos_projection"));
  ASSERT_TRUE(siconos) << "whether or not it is built";
  EXPECT_EQ(siconos->file, "methods/peers/siconos/moreau_jean.cpp");
  MethodEntry elsewhere = method_named("fesd");
  elsewhere.file = "no/such/file.cpp";
  EXPECT_FALSE(scheme_of(elsewhere));
  elsewhere.file.clear();
  EXPECT_FALSE(scheme_of(elsewhere)) << "a plugin that could not be loaded";
}

// As src/scheme.js finds them: lines that end in a number in brackets, after space.
std::ptrdiff_t count_equations(const std::string& text) {
  static const std::regex equation("(^|\\n) {2,}[^ \\n][^\\n]* \\([0-9]+[a-z']?\\)(?=\\n)");
  return std::distance(std::sregex_iterator(text.begin(), text.end(), equation), std::sregex_iterator());
}

TEST(Scheme, HasEquationsOrSaysWhyNot) {
  for (const auto& method : methods()) {
    if (method.file.empty()) continue;                               // a plugin that could not be loaded
    if (method.file.find("/tests/") != std::string::npos) continue;  // methods of other tests in this program
    const auto scheme = scheme_of(method);
    ASSERT_TRUE(scheme) << method.file
                        << ": the comment at its top states the scheme; equations are indented lines that "
                           "end in ' (1)'";
    if (scheme->text.find("No equations: ") != std::string::npos) continue;
    EXPECT_GE(count_equations(scheme->text), 2) << method.name << ", " << scheme->file;
  }
}

TEST(Statement, IsTheCommentAboveAScene) {
  for (const auto& scene : scenes()) {
    if (!scene.solution.empty()) continue;  // has no file
    const auto statement = statement_of(scene);
    ASSERT_TRUE(statement) << scene.file << ": a comment of three lines // or more stands above the class";
    EXPECT_NE(statement->text.find('\n'), std::string::npos) << scene.id;
    EXPECT_EQ(statement->text.find("//"), std::string::npos) << scene.id;
  }
  EXPECT_NE(statement_of(scene_named("bead_row"))->text.find("f_c^1 = x_1 - R"), std::string::npos);
  EXPECT_EQ(statement_of(scene_named("ball_row"))->text, statement_of(scene_named("ball_row_touching"))->text)
      << "one file";
  EXPECT_FALSE(statement_of(scene_named("P3_sliding_block")));
}

TEST(Statement, HasWordsBesideSketchAndEquations) {
  const auto words = paragraphs_of({"", "A ball.\n\n   o   m z'' = -m g\n\nIt falls,\nand lands.\n"});
  EXPECT_EQ(words, (std::vector<std::string>{"A ball.", "It falls, and lands."}));
}

TEST(CaseOfTheGroundTruth, SaysWhatIsHardAndWhereItIsFrom) {
  std::set<std::string> hard;
  for (const auto& truth : ground_truth()) {
    const SceneEntry& scene = scene_named(truth.id);
    EXPECT_TRUE(hard.insert(scene.hard_feature).second) << "another case is hard for the same reason: " << truth.id;
    EXPECT_EQ(scene.hard_feature.find("decimals"), std::string::npos) << truth.id;
    EXPECT_NE(scene.solution.find("decimals"), std::string::npos) << truth.id;
    EXPECT_FALSE(scene.source.empty()) << truth.id;
  }
}

TEST(DrawnScene, IsEachCaseOfTheGroundTruth) {
  for (const auto& truth : ground_truth()) {
    const auto problem = make_problem(truth.id);
    const auto drawn = with_picture(*problem);
    ASSERT_TRUE(drawn) << truth.id;
    EXPECT_EQ(drawn->info().q0, problem->info().q0) << truth.id;
    EXPECT_NE(scene_svg(*drawn).find("<svg"), std::string::npos) << truth.id;
    EXPECT_FALSE(problem->info().geometry) << "for drawings alone";
  }
  EXPECT_FALSE(with_picture(*make_problem("bouncing_ball")));
}

class Site : public testing::Test {
 protected:
  const fs::path folder = fs::temp_directory_path() / ("ricochet_site_" + std::to_string(getpid()));
  fs::path root;
  std::map<std::string, std::string> pages;  // by path from the root

  Site() {
    fs::create_directories(folder);
    const std::string path = folder / "small.jsonl";
    write_text(
        "results", path,
        R"~({"kind": "header", "schema": 1, "experiment": "small", "title": "A <small> one", "command": "ricochet x"}
{"kind": "run", "problem": "cart", "title": "A & B", "discretisation": "FESD", "t": [0.5, 1], "q": [[1], [2]], "v": [[3], [-9.5]]}
{"kind": "proof", "scene": "bead_row", "grade": "assumed", "decimals": 31}
{"kind": "end"}
)~");
    ShownResults shown{read_results(path), {}};
    Table choice{.title = "Which",
                 .note = "",
                 .columns = {{"class of scene", true}, {"wanted error", true}},
                 .rows = {{"a", "1"}}};
    choice.filters = {0, 1};
    choice.row_ids = {"the-row"};
    shown.section.choice("choice", choice, {});
    shown.section.details("runs", choice);
    const nlohmann::json row = shown.results.rows.front();
    shown.section.drawings([row](const FigureFolder& figures) {
      figures.write("frames.svg", "<svg xmlns=\"x\"></svg>");
      return std::vector<Figure>{{"frames.svg", "cart: frames", "c", row}};
    });
    Chart work{.name = "chart", .file = "small_chart", .title = "Work", .caption = "c"};
    work.panel("", {.label = "E", .is_log = true}, {.label = "t", .is_log = true})
        .add("m", {}, Chart::Drawn::both, {{0.1, 1}});
    shown.section.chart(work, "work_precision",
                        nlohmann::json::parse(R"({"errors": [{"field": "error", "label": "</script><b>"}],
                           "works": [{"field": "time", "label": "t"}], "methods": [{"id": "m", "label": "m"}],
                           "runs": [{"method": 0, "error": 0.1, "time": 1}], "failures": []})"));
    Chart times{.name = "times", .file = "small_times", .title = "Over time", .caption = "c"};
    times.has_key_each = true;
    times.panel("", {.label = "t"}, {.label = "v"}).add("v", {}, Chart::Drawn::line, {{0, 1}, {2, 3}});
    shown.section.chart(times);
    fs::create_directories(folder / "history");
    write_text(
        "history", folder / "history" / "history.json",
        R"([{"commit": "abc1234", "date": "2026-01-02", "subject": "Faster <b>", "rows": 3, "verdicts": {"ok": 2},
                    "changes": [{"text": "grid: moreau_jean: steps 5 to 4"}]}])");
    write_text("history", folder / "history" / "curves.json",
               R"([{"title": "Orders", "label": "order", "is_log": false,
                    "curves": [{"label": "grid: moreau_jean, order", "points": [[0, -0.5]]}]}])");
    root = fs::path(write_report_site({shown}, folder.string(), history_pages((folder / "history").string())))
               .parent_path();
    for (const auto& entry : fs::recursive_directory_iterator(root)) {
      if (entry.path().extension() == ".html") pages[fs::relative(entry.path(), root)] = read_text(entry.path());
    }
  }
  ~Site() override { fs::remove_all(folder); }

  /// What stands between `before` and the next quote; std::regex would recurse through pictures of megabytes.
  static std::set<std::string> all_between_quotes(const std::string& text, const std::string& before) {
    std::set<std::string> found;
    for (auto at = text.find(before); at != std::string::npos; at = text.find(before, at)) {
      at += before.size();
      found.insert(text.substr(at, text.find('"', at) - at));
    }
    return found;
  }
};

TEST_F(Site, HasPagesWhoseLinksLeadSomewhere) {
  for (const char* page : {"index.html", "environment.html", "cite.html", "history.html", "experiments/small.html",
                           "methods/fesd.html", "problems/bouncing_ball.html"})
    EXPECT_TRUE(pages.contains(page)) << page;
  std::size_t checked = 0;
  for (const auto& [path, text] : pages) {
    const auto ids = all_between_quotes(text, " id=\"");
    auto links = all_between_quotes(text, " href=\"");
    links.merge(all_between_quotes(text, " src=\""));
    for (const auto& target : links) {
      ++checked;
      if (target.starts_with("data:")) continue;  // a picture that the page carries itself
      EXPECT_EQ(target.find("://"), std::string::npos) << path << " needs a network: " << target;
      if (target.starts_with("#"))
        EXPECT_TRUE(ids.contains(target.substr(1))) << path << " " << target;
      else
        EXPECT_TRUE(fs::exists(root / fs::path(path).parent_path() / target)) << path << " " << target;
    }
  }
  EXPECT_GT(checked, 200u);
}

TEST_F(Site, SaysOnItsFirstScreenWhatToChoose) {
  const std::string& first = pages["index.html"];
  EXPECT_NE(first.find("<div class=\"choice\">"), std::string::npos);
  EXPECT_NE(first.find("data-filters=\"0 1\""), std::string::npos);
  EXPECT_NE(first.find("<tr id=\"the-row\">"), std::string::npos);
  EXPECT_NE(first.find("A &lt;small&gt; one"), std::string::npos);
  const auto size = [&](const char* file) { return fs::file_size(root / file); };
  EXPECT_LT(size("index.html") + size("assets/site.css") + size("assets/site.js"), 2000000u) << "of the first view";
}

TEST_F(Site, GivesWhatAPaperNeeds) {
  EXPECT_NE(read_text(root / "experiments/small_choice.tex").find("\\toprule"), std::string::npos);
  EXPECT_NE(read_text(root / "experiments/small_chart_pgfplots.tex").find("0.1 1\n"), std::string::npos);
  const std::string &sources = pages["methods/fesd.html"], &cite = pages["cite.html"];
  EXPECT_NE(sources.find("@article{fesd_j,"), std::string::npos);
  EXPECT_EQ(sources.find("@book{"), std::string::npos) << "sources of other methods";
  EXPECT_NE(cite.find("@software{ricochet,"), std::string::npos);
  EXPECT_TRUE(
      std::regex_search(cite, std::regex("@software[^@]*\n  version = [{][0-9.]+[}],\n  year = [{]\\d{4}[}],\n")))
      << "by CITATION.cff";
  EXPECT_NE(cite.find("id=\"fesd_j\""), std::string::npos);
  EXPECT_EQ(cite.find("@article{fesd_j,"), cite.rfind("@article{fesd_j,"))
      << "once, whatever methods it is a source of";
}

TEST_F(Site, TellsOfItsHistory) {
  const std::string& history = pages["history.html"];
  EXPECT_NE(history.find("2026-01-02 abc1234"), std::string::npos);
  EXPECT_NE(history.find("<p>Faster &lt;b&gt;</p>"), std::string::npos);
  EXPECT_NE(history.find("moreau_jean: steps 5 to 4"), std::string::npos);
  EXPECT_NE(history.find("Hard cases: 2 ok."), std::string::npos);
  EXPECT_NE(history.find("[[0.0,-0.5]]"), std::string::npos)
      << "an order may be negative, and commits are named, not positive";
  EXPECT_NE(history.find("\"x_links\":[\"#commit-abc1234\"]"), std::string::npos);
  EXPECT_THROW(write_report_site({}, folder.string(), history_pages(folder.string())), InputError)
      << "no history is there";
  write_text("history", folder / "history" / "curves.json", "[]");  // nothing has changed
  EXPECT_EQ(history_page((folder / "history").string()).html.find("<figure"), std::string::npos);
}

TEST_F(Site, KeepsTheDataOfAChartInsideOfItsElement) {
  const std::string& page = pages["experiments/small.html"];
  EXPECT_NE(page.find(R"~(<\/script><b>)~"), std::string::npos);
  EXPECT_NE(page.find("data-chart=\"work_precision\""), std::string::npos);
  EXPECT_NE(page.find("\"points\":[[0.1,1.0]]"), std::string::npos) << "of the chart itself";
  EXPECT_NE(page.find("<figure aria-label=\"Over time\">"), std::string::npos) << "no script draws it";
  if (can_draw()) {
    EXPECT_NE(page.find("src=\"small_chart.svg\""), std::string::npos) << "for those without scripts";
  }
}

TEST_F(Site, LinksEveryFigureToItsNumbers) {
  const std::string& page = pages["experiments/small.html"];
  std::size_t n = 0;
  for (auto at = page.find("<figure"); at != std::string::npos; at = page.find("<figure", at + 1)) {
    const std::string figure = page.substr(at, page.find("</figure>", at) - at);
    if (figure.starts_with("<figure class=\"table\"")) continue;  // its links stand below
    ++n;
    EXPECT_NE(figure.find(".csv\">CSV</a>"), std::string::npos) << figure;
  }
  EXPECT_EQ(n, 3u) << "a drawing and two charts";
  EXPECT_NE(read_text(root / "experiments/small_times_drawn.csv").find("\n,t,v,v,line,1,2,3,\n"), std::string::npos);
  EXPECT_EQ(read_text(root / "experiments/frames_drawn.csv"), "t,q[0],v[0]\n0.5,1,3\n1,2,-9.5\n");
}

TEST_F(Site, TakesEachExperimentAndEachNameOnce) {
  const auto shown_as = [&](const char* file, const char* experiment) {
    const std::string path = folder / file;
    fs::create_directories(fs::path(path).parent_path());
    write_text("results", path,
               fmt::format("{{\"kind\": \"header\", \"schema\": 1, \"experiment\": \"{}\"}}\n{{\"kind\": \"end\"}}\n",
                           experiment));
    return ShownResults{read_results(path), {}};
  };
  const std::string site = folder / "other";
  const ShownResults first = shown_as("a/experiments/one.jsonl", "one"), same = shown_as("a/again.jsonl", "one"),
                     named_alike = shown_as("b/one.jsonl", "two");
  EXPECT_THROW(write_report_site({first, same}, site), InputError);
  EXPECT_THROW(write_report_site({first, named_alike}, site), InputError);
  EXPECT_FALSE(fs::exists(site)) << "nothing is written";
  EXPECT_NO_THROW(write_report_site({first}, folder / "a")) << "the folder that the results are in";
  EXPECT_EQ(read_results(folder / "a/experiments/one.jsonl").experiment(), "one");
}

TEST(Competitions, AreThoseOfTheProblemOfTheirRuns) {
  const fs::path folder = fs::temp_directory_path() / ("ricochet_competition_" + std::to_string(getpid()));
  fs::create_directories(folder);
  const std::string path = folder / "fast.jsonl";
  const auto row = [](const char* scene, const char* family, const char* problem, double microseconds) {
    FastestRun run;
    run.scene = scene;
    run.problem = problem;
    run.labels = {{"family", family}, {"solver", "new"}};
    run.conditions = {{"level", 0.1}};
    if (microseconds > 0) run.timing = {.median = 1e-6 * microseconds, .repetitions = 9};
    nlohmann::json line = run;
    line["kind"] = ricochet::Run::kKind;
    return line.dump() + "\n";
  };
  write_text("results", path,
             "{\"kind\": \"header\", \"schema\": 1, \"experiment\": \"fast\", \"title\": \"Fast\"}\n" +
                 row("stiff", "a", "bouncing_ball", 2) + row("stiff", "slow family", "bouncing_ball", -1) +
                 row("case", "a", "reference/data/ground_truth.json#P3_sliding_block", 2) + "{\"kind\": \"end\"}\n");
  const SiteGroup group = problem_pages({ShownResults{read_results(path), {}}});
  const auto page = [&](const char* id) {
    return std::ranges::find(group.pages, std::string(id), &SitePage::id)->html;
  };
  for (const char* id : {"bouncing_ball", "P3_sliding_block"})
    EXPECT_NE(page(id).find("../experiments/fast.html"), std::string::npos) << id;
  EXPECT_NE(page("bouncing_ball").find("stiff"), std::string::npos);
  EXPECT_EQ(page("block_on_ramp").find("../experiments/fast.html"), std::string::npos);
  fs::remove_all(folder);
}

TEST_F(Site, TellsOfMethodsAndProblems) {
  EXPECT_NE(pages["methods/moreau_jean.html"].find("<pre class=\"scheme\""), std::string::npos);
  const std::string& symplectic = pages["methods/symplectic.html"];
  EXPECT_NE(symplectic.find("Scenes that it declines"), std::string::npos) << "it has neither friction nor e < 1";
  const std::string& ball = pages["problems/bouncing_ball.html"];
  EXPECT_NE(ball.find("The scene as it starts"), std::string::npos);
  EXPECT_NE(ball.find("f_c^"), std::string::npos);
  EXPECT_NE(ball.find("title>impact of "), std::string::npos) << "on the line of time";
  EXPECT_NE(ball.find("Which methods can run it"), std::string::npos);
  EXPECT_EQ(ball.find("<pre class=\"statement\""), std::string::npos) << "its equations stand once, typeset";
  EXPECT_NE(ball.find("the simplest Zeno point"), std::string::npos);
  const std::string& case_page = pages["problems/P2_two_balls_spring.html"];
  EXPECT_NE(case_page.find("FESD-J, section 5.1"), std::string::npos);
  EXPECT_NE(case_page.find("known to 42 decimals"), std::string::npos);
  const std::string& row = pages["problems/bead_row.html"];
  EXPECT_NE(row.find("<pre class=\"statement\""), std::string::npos);
  EXPECT_NE(row.find("operatorname{diag}(m)"), std::string::npos) << "it has no formulas of all coordinates";
}

TEST_F(Site, ShowsProvenDigits) {
  const std::string &ball = pages["problems/bouncing_ball.html"], &column = pages["problems/block_column.html"],
                    &beads = pages["problems/bead_row.html"];
  const bool is_proven = beads.find("id=\"truth\"") != std::string::npos;  // on the page itself, or else published
  EXPECT_NE(beads.find("<a href=\"../experiments/small.html\">assumed to 31 decimals</a>") != std::string::npos,
            is_proven);
  if (!reference::certified::can_certify()) {
    EXPECT_EQ(ball.find("proven"), std::string::npos);
    return;
  }
  EXPECT_NE(ball.find(">proven to 30 decimals</a>"), std::string::npos);
  // sqrt(1.8 / 9.81) = 0.42835293687811934009018405632532...
  EXPECT_NE(ball.find("0.428352936878119340090184056325…"), std::string::npos) << "time of the first impact";
  EXPECT_EQ(ball.find("id=\"event-list\""), std::string::npos) << "events are listed once";
  const bool is_open = column.find("<dt>motion</dt><dd>not proven: ") != std::string::npos;
  EXPECT_EQ(column.find("id=\"event-list\"") != std::string::npos, is_open);
}

}  // namespace
}  // namespace ricochet
