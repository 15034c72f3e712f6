// The runs of a grid of methods and settings, as their rows say.
#include <gtest/gtest.h>

#include "bench/experiment/study.h"
#include "bench/studies/grid/curve_style.h"
#include "methods/registry.h"
#include "reports/run.h"
#include "reports/text_file.h"
#include "tests/small_experiment.h"
#include "tests/test_data.h"

namespace ricochet {
namespace {

/// Orders are drawn against T / (N_sim N_FE), however many elements an impact adds to a step.
TEST(MethodGrid, StepLengthsAreThoseOfTheElements) {
  const auto records = run_small_experiment(R"({"id": "grid", "kind": "method_grid", "title": "t", "description": "d.",
      "problem": "bouncing_ball", "parameters": {"duration": 2}, "reference": null, "times": false, "grids": {"few": [100, 250]},
      "methods": [{"method": "fesd:radau-iia:2,elements=as_needed,n_fe=1", "steps": "few"},
                  {"method": "fesd:radau-iia:2,elements=as_needed", "steps": "few"},
                  {"method": "fesd:radau-iia:2,elements=as_needed,n_fe=3", "steps": "few"},
                  {"method": "moreau_jean", "steps": "few"}]})")
                           .all<ricochet::Run>();
  ASSERT_EQ(records.size(), 8u);
  const int elements[] = {1, 2, 3, 1};
  for (std::size_t k = 0; k < records.size(); ++k) {
    ASSERT_TRUE(records[k].succeeded()) << records[k].message;
    EXPECT_NEAR(records[k].h_bar, 2.0 / (records[k].setting.steps * elements[k / 2]), 1e-16) << records[k].method;
  }
}

/// Results of a scene file that has been edited are no longer those of the experiment.
TEST(MethodGrid, AnEditedSceneFileIsAnotherExperiment) {
  namespace fs = std::filesystem;
  const fs::path folder = fs::temp_directory_path() / ("ricochet_edited_" + std::to_string(getpid()));
  fs::create_directories(folder);
  std::string scene = read_text(test_data("rising_table.json"));
  write_text("scene", folder / "scene.json", scene);
  write_text("experiment", folder / "grid.json", R"({"id": "grid", "kind": "method_grid", "title": "t",
      "description": "d.", "problem": "scene.json", "reference": null, "times": false, "grids": {"few": [50]},
      "methods": [{"method": "moreau_jean", "steps": "few"}]})");
  RunOptions options;
  options.folder = (folder / "results").string();
  const auto runs = [&] {
    run_experiment((folder / "grid.json").string(), options);
    return std::distance(fs::directory_iterator(folder / "results"), fs::directory_iterator());
  };
  EXPECT_EQ(runs(), 1);
  EXPECT_EQ(runs(), 1) << "taken over";
  write_text("scene", folder / "scene.json", scene + "\n");
  EXPECT_EQ(runs(), 2) << "computed again, the former kept under a dated name";
  fs::remove_all(folder);
}

/// A quick run leaves out the settings that take long, and nothing else.
TEST(MethodGrid, AQuickRunLeavesOutTheManySteps) {
  const std::string experiment = R"({"id": "grid", "kind": "method_grid", "title": "t", "description": "d.",
      "problem": "bouncing_ball", "parameters": {"duration": 0.1}, "reference": null, "times": false,
      "grids": {"far": [100, 20000, 20001]}, "methods": [{"method": "moreau_jean", "steps": "far"},
                                                         {"method": "anitescu_potra", "steps": [30000, 40000]}]})";
  const auto steps = [&](bool is_quick) {
    RunOptions options;
    options.quick = is_quick;
    std::vector<int> list;
    for (const ricochet::Run& record : run_small_experiment(experiment, options).all<ricochet::Run>())
      list.push_back(record.setting.steps);
    return list;
  };
  EXPECT_EQ(steps(false), (std::vector{100, 20000, 20001, 30000, 40000}));
  EXPECT_EQ(steps(true), (std::vector{100, 20000, 30000})) << "no method is left out";
}

/// A failure that another method answers is none of the experiment; an answer that failed is none.
TEST(MethodGrid, AFailureIsASurpriseUntilItIsAnswered) {
  ricochet::Run failed;
  failed.method = "first";
  failed.setting.steps = 10;
  failed.status = "infeasible";
  ricochet::Run answer = failed;
  answer.method = "second";
  answer.instead_of = "first";
  const auto unexpected_failures_of = [](const std::vector<ricochet::Run>& records) {
    Results results;
    results.header = {{"kind", "header"}, {"study", "method_grid"}};
    for (const ricochet::Run& record : records) results.rows.push_back(line_of(record));
    return unexpected_failures(results);
  };
  EXPECT_EQ(unexpected_failures_of({failed}), 1);
  EXPECT_EQ(unexpected_failures_of({failed, answer}), 1) << "an answer that failed, too";
  answer.status = "success";
  EXPECT_EQ(unexpected_failures_of({failed, answer}), 0);
  answer.setting.steps = 20;
  EXPECT_EQ(unexpected_failures_of({failed, answer}), 1) << "the answer to another setting";
}

/// Charts show what locates events as one family, whatever a method is registered as.
TEST(MethodGrid, EventDrivenMethodsAreAFamily) {
  for (const auto& entry : methods()) {
    const bool locates =
        entry.name.ends_with("event_driven") || entry.name == "cvode" || entry.name == "ida" || entry.name == "arkode";
    for (const auto& example : entry.examples) EXPECT_EQ(curve_family(example) == "event-driven", locates) << example;
  }
  EXPECT_EQ(family_title(curve_family("time_freezing:gauss:2")), "Time freezing, Gauss");
}

}  // namespace
}  // namespace ricochet
