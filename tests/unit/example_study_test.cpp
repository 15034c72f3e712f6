// A kind of study of the reader's own: this file is all there is of it.
#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <sstream>

#include "bench/experiment/run_experiment.h"
#include "bench/experiment/study.h"
#include "problems/input_error.h"
#include "reports/results_page.h"
#include "reports/site/site.h"

namespace ricochet {
namespace {

namespace fs = std::filesystem;

int rolls = 0;  // how many rows were made, not taken over
int interrupted_at = -1;

/// A throw of a die, which has a result when it does not fall off the table.
struct Throw {
  static constexpr const char* kKind = "throw";

  int number = 0;
  bool is_on_table = true;
  double eyes = 0;
};
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE_WITH_DEFAULT(Throw, number, is_on_table, eyes)

void run_dice(const nlohmann::json& experiment, ResultsFile& file) {
  const int n = experiment.at("throws");
  for (int k = 0; k < n; ++k) {
    if (k == interrupted_at) throw std::runtime_error("interrupted");
    file.row<Throw>([&] {
      ++rolls;
      return Throw{k, k != experiment.value("falls", -1), 1 + k % 6 + 0.5};
    });
  }
}

void show_dice(const Results& results, Section& section) {
  static const std::vector<Column<Throw>> columns = {
      {"throw", "", "{}", &Throw::number},
      {"eyes", "", "{:.2f}", [](const Throw& t) { return when(t.is_on_table, t.eyes); }},
  };
  section.result("throws", table_of("Throws of a die", columns, results.all<Throw>()));
}

const bool dice_are_registered = register_study({
    .kind = "dice",
    .summary = "throws of a die",
    .fields = R"({"required": ["throws"], "properties": {
      "throws": {"type": "integer", "minimum": 1, "description": "How many.", "examples": [6]},
      "falls": {"type": "integer", "description": "The throw that falls off the table.", "examples": [1]}}})",
    .rows = {Throw::kKind},
    .run = run_dice,
    .show = show_dice,
    .unexpected_failures =
        [](const Results& results) {
          const auto throws = results.all<Throw>();
          return static_cast<int>(std::ranges::count(throws, false, &Throw::is_on_table));
        },
});

class ExampleStudy : public testing::Test {
 protected:
  fs::path folder = fs::temp_directory_path() / ("ricochet_dice_" + std::to_string(getpid()));
  RunOptions options;

  void SetUp() override {
    ASSERT_TRUE(dice_are_registered);
    fs::create_directories(folder);
    options.folder = (folder / "results").string();
    rolls = 0;
    interrupted_at = -1;
  }
  ~ExampleStudy() override { fs::remove_all(folder); }

  std::string experiment(const std::string& fields) {
    const fs::path path = folder / "dice.json";
    std::ofstream(path) << R"({"id": "dice", "kind": "dice", "title": "Dice", "description": "First. Second.", )"
                        << fields << "}";
    return path;
  }
  static std::string read(const fs::path& path) {
    std::ifstream file(path);
    std::ostringstream text;
    text << file.rdbuf();
    return text.str();
  }
};

TEST_F(ExampleStudy, IsRunOnceAndContinued) {
  const std::string name = experiment(R"("throws": 4)");
  interrupted_at = 2;
  EXPECT_THROW(run_experiment(name, options), std::runtime_error);
  EXPECT_EQ(rolls, 2);
  EXPECT_FALSE(fs::exists(options.folder + "/dice.jsonl")) << "a file that looks complete is complete";
  interrupted_at = -1;
  const std::string path = run_experiment(name, options);
  EXPECT_EQ(rolls, 4) << "the first two were taken over";
  EXPECT_EQ(read_results(path).all<Throw>().size(), 4u);
  EXPECT_EQ(run_experiment(name, options), path);
  EXPECT_EQ(rolls, 4) << "nothing is missing";
}

TEST_F(ExampleStudy, IsInTheTerminalTheSiteAndTheResults) {
  const std::string path = run_experiment(experiment(R"("throws": 30)"), options);
  const ShownResults shown = shown_results(path);
  ASSERT_EQ(shown.section.tables().size(), 1u);
  EXPECT_EQ(shown.section.tables().front()->name, "throws");
  write_site({shown}, {}, (folder / "site").string());
  EXPECT_NE(read(folder / "site/experiments/dice.html").find("Throws of a die"), std::string::npos);
  EXPECT_TRUE(fs::exists(folder / "site/experiments/dice_throws.csv"));

  write_results_page({shown}, (folder / "RESULTS.md").string(), (folder / "tables").string());
  const std::string results = read(folder / "RESULTS.md");
  EXPECT_NE(results.find("## Dice\n\nFirst.\n"), std::string::npos) << results;
  EXPECT_EQ(results.find("Second."), std::string::npos) << "one sentence";
  EXPECT_NE(results.find("24 of 30 rows."), std::string::npos) << results;
  EXPECT_NE(results.find("[Throws of a die](tables/dice_throws.csv) (30 rows)"), std::string::npos) << results;
  EXPECT_NE(results.find("Made by `ricochet run-experiment "), std::string::npos) << results;
  EXPECT_NE(read(folder / "tables" / "dice_throws.csv").find("29,6.50"), std::string::npos);
}

TEST_F(ExampleStudy, CountsItsSurprises) {
  EXPECT_EQ(unexpected_failures(read_results(run_experiment(experiment(R"("throws": 3)"), options))), 0);
  EXPECT_EQ(unexpected_failures(read_results(run_experiment(experiment(R"("throws": 3, "falls": 1)"), options))), 1);
}

TEST_F(ExampleStudy, AChangedExperimentHasResultsOfItsOwn) {
  const std::string name = experiment(R"("throws": 3)");
  const std::string whole = run_experiment(name, options);
  options.changes = {"throws=2"};
  const std::string part = run_experiment(name, options);
  EXPECT_TRUE(part.ends_with("dice_part.jsonl")) << part;
  EXPECT_EQ(read_results(part).all<Throw>().size(), 2u);
  EXPECT_EQ(read_results(whole).all<Throw>().size(), 3u);
  options.changes = {"throws"};
  EXPECT_THROW(run_experiment(name, options), InputError);
}

TEST_F(ExampleStudy, ResultsOfAnEarlierFormatAreRead) {
  const fs::path path = folder / "old.jsonl";
  std::ofstream(path) << R"({"kind": "header", "schema": 1, "experiment": "old", "key": "k"})"
                      << "\n"
                      << R"({"kind": "throw", "eyes": null, "former_field": 1})"
                      << "\n"
                      << R"({"kind": "end"})"
                      << "\n";
  const Results results = read_results(path);
  EXPECT_EQ(study_of(results).kind, "dice") << "known by its rows: there was no \"study\"";
  const auto throws = results.all<Throw>();
  ASSERT_EQ(throws.size(), 1u);
  EXPECT_TRUE(throws[0].is_on_table) << "the default of a field that is missing";
  EXPECT_TRUE(std::isnan(throws[0].eyes));
  EXPECT_EQ(shown_results(path).section.tables().front()->table.rows[0][1], "-");

  std::ofstream(path, std::ios::app) << R"({"kind": "throw", "number": "three"})"
                                     << "\n";
  EXPECT_THROW(read_results(path).all<Throw>(), InputError) << "a damaged row";
}

TEST_F(ExampleStudy, BadInputLeavesNoResults) {
  EXPECT_THROW(run_experiment(experiment(R"("throws": 0)"), options), InputError);
  EXPECT_THROW(run_experiment(experiment(R"("throw": 1)"), options), InputError);
  EXPECT_FALSE(fs::exists(options.folder));
}

}  // namespace
}  // namespace ricochet
