// Part of an experiment: by method and by problem, exactly or by a pattern.
#include "bench/experiment/selection.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "bench/experiment/experiment_file.h"
#include "bench/experiment/experiment_schema.h"
#include "bench/experiment/study.h"
#include "problems/input_error.h"
#include "reports/run.h"
#include "tests/small_experiment.h"

namespace ricochet {
namespace {

using nlohmann::json;

TEST(Selection, PatternsAreExactButForStars) {
  EXPECT_TRUE(matches("fesd:gauss:4", "fesd:gauss:4"));
  EXPECT_FALSE(matches("fesd:gauss:4", "fesd:gauss"));
  EXPECT_FALSE(matches("fesd:gauss:4", "gauss:4"));
  EXPECT_TRUE(matches("fesd:gauss:4", "fesd:*"));
  EXPECT_TRUE(matches("fesd:gauss:4", "*"));
  EXPECT_TRUE(matches("fesd:gauss:4", "*gauss*4*"));
  EXPECT_FALSE(matches("fesd:gauss:4", "*gauss*5"));
  EXPECT_TRUE(matches("cvode:adams", "cvode:adams*"));
  EXPECT_FALSE(matches("", "fesd"));
}

/// The document of a shipped experiment with all methods by name.
json named(const std::string& name) {
  ExperimentFile file = read_experiment_file(name);
  file.take_quick_part(false);
  const Study& study = find_study(file.kind());
  if (study.name_methods) study.name_methods(file.document);
  return file.document;
}

/// Whatever the kind of study, no shipped experiment has a method or a problem that cannot be selected.
TEST(Selection, EveryShippedExperimentCanBeCutDownToEachOfItsNames) {
  int n_methods = 0, n_problems = 0;
  for (const auto& name : experiment_names()) {
    if (read_experiment_file(name).document.contains("parts")) continue;
    const json whole = named(name);
    const JsonSchema& schema = experiment_schema(find_study(whole.value("kind", kDefaultStudy)));
    const ListedNames names = names_in(whole);
    json all = whole;
    EXPECT_EQ(select(all, {{"*"}, {}}), !names.methods.empty()) << name;
    EXPECT_EQ(select(all, {{}, {"*"}}), !names.problems.empty()) << name;
    EXPECT_EQ(all, whole) << name;
    for (const auto& method : names.methods) {
      json one = whole;
      ASSERT_TRUE(select(one, {{method}, {}})) << name << " " << method;
      EXPECT_EQ(names_in(one).methods, std::set<std::string>{method}) << name;
      EXPECT_NO_THROW(schema.check(one, name + ": ")) << method;
      ++n_methods;
    }
    for (const auto& problem : names.problems) {
      json one = whole;
      ASSERT_TRUE(select(one, {{}, {problem}})) << name << " " << problem;
      EXPECT_EQ(names_in(one).problems, std::set<std::string>{problem}) << name;
      EXPECT_NO_THROW(schema.check(one, name + ": ")) << problem;
      ++n_problems;
    }
  }
  EXPECT_GT(n_methods, 100);
  EXPECT_GT(n_problems, 50);
}

TEST(Selection, WhatFitsNothingIsSaidWithWhatThereIs) {
  const json document = json::parse(R"({"problem": "bouncing_ball", "methods": [{"method": "moreau_jean"}]})");
  const auto error_of = [&](const Selection& selection) -> std::string {
    try {
      require_matches(selection, names_in(document));
    } catch (const InputError& error) {
      return error.what();
    }
    return "no error";
  };
  EXPECT_EQ(error_of({{"moreau_jean", "fesd*"}, {}}),
            "--method = fesd*: the experiment has no such name; it has moreau_jean");
  EXPECT_EQ(error_of({{}, {"ball"}}), "--problem = ball: the experiment has no such name; it has bouncing_ball");
  EXPECT_EQ(error_of({{"moreau*"}, {"*ball"}}), "no error");
  json both = json::parse(R"({"runs": [{"problem": "a", "methods": ["x"]}, {"problem": "b", "methods": ["y"]}]})");
  EXPECT_FALSE(select(both, {{"x"}, {"b"}})) << "neither run fits both";
}

TEST(Selection, MeasuresAreNoMatterOfChoice) {
  json document =
      json::parse(R"({"reference": {"method": "event_driven"}, "methods": [{"method": "a"}, {"method": "b"}],
    "trajectory": {"method": "b"}, "overhead_of": {"a": "b", "b": "b"}})");
  ASSERT_TRUE(select(document, {{"a"}, {}}));
  EXPECT_EQ(document, json::parse(R"({"reference": {"method": "event_driven"}, "methods": [{"method": "a"}],
    "overhead_of": {}})"));
}

constexpr const char* kGrid =
    R"({"id": "grid", "problem": "bouncing_ball", "reference": null, "times": false, "methods": [
  {"method": "fesd:gauss:1", "steps": [3, 40], "on_failure": "fesd:gauss:1,elements=as_needed"},
  {"method": "moreau_jean", "steps": [10, 20]}, {"method": "cvode:adams", "tolerances": [1e-6]}]})";

TEST(Selection, RowsAreThoseOfTheWholeExperiment) {
  const auto whole = run_small_experiment(kGrid);
  RunOptions options;
  options.selection.methods = {"moreau*", "fesd:gauss:1"};
  const Results part = run_small_experiment(kGrid, options);
  EXPECT_EQ(part.experiment(), "grid_part");
  EXPECT_NE(part.header.at("command").get<std::string>().find("--method 'moreau*' --method fesd:gauss:1"),
            std::string::npos);
  std::vector<json> expected;
  for (json row : whole.rows) {
    if (row.at("method") == "cvode:adams") continue;
    row["experiment"] = "grid_part";
    expected.push_back(row);
  }
  EXPECT_EQ(json(part.rows).dump(), json(expected).dump());
}

/// The rows of a run by several processes are those of one, to the last digit, and so is the whole file.
TEST(Processes, TheFileIsTheSame) {
  const auto lines = [](int jobs) {
    RunOptions options;
    options.jobs = jobs;
    const Results results = run_small_experiment(kGrid, options);
    json header = results.header;
    header["environment"].erase("date");
    header.erase("command");  // names the file of the test
    return header.dump() + json(results.rows).dump();
  };
  const std::string one = lines(1);
  EXPECT_EQ(lines(2), one);
  EXPECT_EQ(lines(7), one);
}

TEST(Processes, AnInterruptedRunGoesOn) {
  namespace fs = std::filesystem;
  const fs::path folder = fs::temp_directory_path() / ("ricochet_jobs_" + std::to_string(getpid()));
  fs::create_directories(folder);
  std::ofstream(folder / "grid.json") << kGrid;
  RunOptions options;
  options.folder = (folder / "results").string();
  options.jobs = 3;
  const std::string path = run_experiment((folder / "grid.json").string(), options);
  const auto text_of = [&](const std::string& file) {
    std::ifstream stream(file);
    return std::string(std::istreambuf_iterator<char>(stream), {});
  };
  // The header tells the second in which the run was taken up; all else is the same.
  const auto undated = [](const std::string& text) {
    const std::size_t end = text.find('\n');
    json header = json::parse(text.substr(0, end));
    header.at("environment").erase("date");
    return header.dump() + text.substr(end);
  };
  const std::string complete = text_of(path);
  // Cut off after the first row of a piece of two, and inside a line.
  for (const std::size_t n_lines : {2, 3, 5}) {
    std::size_t end = 0;
    for (std::size_t k = 0; k < n_lines; ++k) end = complete.find('\n', end) + 1;
    fs::remove(path);
    std::ofstream(path + ".partial") << complete.substr(0, end) << R"({"kind": "row", "me)";
    run_experiment((folder / "grid.json").string(), options);
    EXPECT_EQ(undated(text_of(path)), undated(complete)) << n_lines;
  }
  fs::remove_all(folder);
}

TEST(Processes, AreRefusedWhereTimesAreMeasured) {
  RunOptions options;
  options.jobs = 2;
  const auto error_of = [&](const std::string& text) -> std::string {
    try {
      run_small_experiment(text, options);
    } catch (const InputError& error) {
      return error.what();
    }
    return "no error";
  };
  EXPECT_EQ(
      error_of(R"({"id": "grid", "problem": "bouncing_ball", "methods": [{"method": "moreau_jean", "steps": [5]}]})"),
      "--jobs = 2: --no-times is required, or --times exclusive or --times shared, since runs beside each other would "
      "spoil the times");
  EXPECT_EQ(error_of(R"({"id": "cost", "kind": "contact_cost", "methods": ["moreau_jean"]})"),
            "--jobs = 2: 1 is required: experiments of kind contact_cost measure all times in one session, which alone "
            "can compare them");
}

}  // namespace
}  // namespace ricochet
