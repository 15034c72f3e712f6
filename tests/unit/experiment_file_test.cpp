// Experiment files against their schema: every shipped one fits, what does not fit is refused with its place, and the
// files and pages in the repository are those that the schemas give.
#include "bench/experiment/experiment_file.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>

#include "bench/commands/schema_page.h"
#include "bench/experiment/experiment_schema.h"
#include "bench/experiment/run_experiment.h"
#include "bench/experiment/study.h"
#include "problems/input_error.h"
#include "problems/input_text.h"
#include "problems/scene_file/scene_file.h"
#include "problems/scene_file/scene_schema.h"
#include "reports/run.h"
#include "tests/cli/program.h"
#include "tests/small_experiment.h"

namespace ricochet {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

const fs::path kSource = fs::path(RICOCHET_TEST_DATA) / "../..";

std::string text_of(const fs::path& path) {
  return read_input_text((kSource / path).string(), "file of the repository");
}

/// What is wrong with an experiment; it is not run where something is.
std::string error_of(const std::string& text, const RunOptions& options = {}) {
  try {
    run_small_experiment(text, options);
  } catch (const InputError& error) {
    std::string message = error.what();
    const auto file = message.find("small.json");
    if (file != std::string::npos) message = message.substr(file);
    return message.substr(0, message.find('\n'));
  }
  return "no error";
}

TEST(ExperimentSchema, EveryShippedExperimentFits) {
  int n = 0;
  for (const auto& name : experiment_names()) {
    ++n;
    ExperimentFile file = read_experiment_file(name);
    if (file.document.contains("parts")) continue;
    for (const bool quick : {false, true}) {
      ExperimentFile chosen = file;
      chosen.take_quick_part(quick);
      EXPECT_NO_THROW(experiment_schema(find_study(file.kind())).check(chosen.document, name + ": ")) << name;
    }
  }
  EXPECT_GT(n, 25);
}

/// Examples fit their own field, so that they are true; and every field is described.
void check_fields(const JsonSchema& schema, const json& object, const std::string& place) {
  const json properties = object.value("properties", json::object());
  for (const auto& [name, field] : properties.items()) {
    const json& meant = schema.resolved(field);
    const bool is_described = field.contains("description") || meant.contains("description");
    const json examples = field.value("examples", json::array());
    if (is_described)
      EXPECT_FALSE(examples.empty() && !field.contains("items") && !field.contains("properties"))
          << place << name << " has no example";
    for (const json& example : examples) EXPECT_NO_THROW(schema.check(example, place + name, field)) << place << name;
    if (field.contains("items")) check_fields(schema, field["items"], place + name + "[].");
    check_fields(schema, field, place + name + ".");
  }
}

TEST(ExperimentSchema, EveryFieldHasAnExampleThatFits) {
  for (const auto& study : studies())
    check_fields(experiment_schema(study), experiment_schema(study).document(), study.kind + ": ");
  for (const char* part : {"scene", "contact", "control", "constraint", "geometry", "body", "shape", "link", "set"})
    check_fields(scene_schema(), scene_schema().definition(part), std::string(part) + ": ");
}

/// The program prints them: other tests of this one register studies of their own.
TEST(ExperimentSchema, FilesOfTheRepositoryAreThoseOfTheProgram) {
  for (const auto& [what, file] : {std::pair("experiment", "bench/experiments/schema/experiment.schema.json"),
                                   std::pair("experiment --page", "bench/experiments/FIELDS.md"),
                                   std::pair("scene --page", "problems/scene_file/README.md")}) {
    const std::string arguments = std::string("schema ") + what;
    EXPECT_EQ(text_of(file), cli::run(arguments).text) << "ricochet " << arguments << " > " << file;
  }
}

TEST(SceneFilePage, ItsExampleIsAScene) {
  const std::string page = scene_file_page(), mark = "```json\n";
  const auto begin = page.find(mark) + mark.size();
  const auto problem = read_scene_text(page.substr(begin, page.find("```", begin) - begin), "example");
  EXPECT_EQ(problem->n_q(), 3);
  EXPECT_EQ(problem->info().contacts[0].mu, 0.3);
}

TEST(ExperimentFile, MistakesNameTheirPlace) {
  const auto grid = [](const std::string& more) {
    return R"({"id": "small", "problem": "bouncing_ball", "times": false, )" + more + "}";
  };
  const std::string methods = R"("methods": [{"method": "moreau_jean", "steps": [10]}])";
  EXPECT_EQ(error_of(grid(methods)), "no error");
  EXPECT_EQ(error_of(grid("\"methods\": 7")), "small.json: methods = 7: a list is required");
  EXPECT_EQ(error_of(grid(R"("methods": [{"method": "moreau_jean", "step": [10]}])")).substr(0, 43),
            "small.json: methods[0] = 'step': unknown; d");
  EXPECT_EQ(error_of(grid(R"("methods": [{"method": "moreau_jean", "steps": [10, "a", 0.5]}])")),
            "small.json: methods[0].steps[2] = 0.5: a whole number or a text in quotes or an object is required");
  EXPECT_EQ(error_of(grid(R"("problme": "x", )" + methods)).substr(0, 30), "small.json = 'problme': unknow");
  EXPECT_EQ(error_of(grid(R"("times": true, )" + methods)), "small.json: times: this field is given twice");
  EXPECT_EQ(error_of(grid(R"("quick_part": {"metods": []}, )" + methods)).substr(0, 29),
            "small.json = 'metods': unknow");
  EXPECT_EQ(error_of(grid(R"("quick_part": 5, )" + methods)), "small.json: quick_part = number: an object is required");
  EXPECT_EQ(error_of(R"({"id": "small", "kind": 7})"), "small.json: kind = 7: a text in quotes is required");
  EXPECT_EQ(error_of(R"({"parts": [7]})"), "small.json: parts[0] = 7: a text in quotes is required");
  EXPECT_EQ(error_of(R"({"id": "small", "kind": "zeno"})"), "small.json: tableaus: this field is missing");
  EXPECT_EQ(error_of(R"({"id": "small", "kind": "control_gradient", "problem": "two_carts", "control": [[4]],
                         "methods": [{"method": "fesd:gauss:2", "steps": 5}]})"),
            "small.json: methods[0].steps = 5: a list is required");
  RunOptions twice;
  twice.changes = {"times=false", "times=true"};
  EXPECT_EQ(error_of(grid(methods), twice), "--set = times=true: this field is given twice");
}

TEST(ExperimentFile, SettingsAreOfTheKindThatTheMethodTakes) {
  const auto error = [](const std::string& entry) {
    return error_of(R"({"id": "small", "problem": "bouncing_ball", "times": false, "methods": [)" + entry + "]}");
  };
  EXPECT_EQ(error(R"({"method": "moreau_jean", "steps": [10], "tolerances": [1e-6]})"),
            "methods: tolerances: moreau_jean takes fixed steps and no tolerance");
  EXPECT_EQ(error(R"({"method": "cvode:adams", "steps": [10], "tolerances": [1e-6]})"),
            "methods: steps: cvode:adams controls its error, it takes a tolerance and no steps");
  EXPECT_EQ(error(R"({"method": "moreau_jean", "steps": [10], "on_failure": "cvode:adams"})"),
            "methods: on_failure with steps: cvode:adams controls its error, it takes a tolerance and no steps");
  EXPECT_EQ(error_of(R"({"id": "small", "kind": "friction_ramp", "grid": 3, "duration": 0.1, "v_0": [0],
                         "methods": [{"method": "moreau_jean", "steps": 5, "tolerance": 1e-6}]})"),
            "methods: tolerance: moreau_jean takes fixed steps and no tolerance");
  EXPECT_EQ(error_of(R"({"id": "small", "kind": "scale", "steps": 5, "runs": [{"problem": "bead_row", "sizes": [2],
                         "methods": ["cvode:adams"]}]})"),
            "steps: cvode:adams controls its error, it takes a tolerance and no steps");
  EXPECT_EQ(error_of(R"({"id": "small", "kind": "fastest", "levels": [1e-3], "time_limit": 1, "scenes": [],
                         "families": [{"name": "a", "methods": ["moreau_jean"], "steps": {"from": 5, "to": 50, "per_decade": 1},
                                       "tolerances": {"from": 1e-3, "to": 1e-5, "per_decade": 1}}]})"),
            "families.a: tolerances: none of its methods takes them");
}

TEST(ExperimentFile, AMethodThatDeclinesIsARow) {
  const Results results = run_small_experiment(R"({"id": "small", "problem": "sliding_block", "times": false,
    "methods": [{"method": "irk:gauss:2", "steps": [10, 20]}, {"method": "moreau_jean", "steps": [10]}]})");
  const auto rows = results.all<ricochet::Run>();
  ASSERT_EQ(rows.size(), 3u);
  for (const std::size_t k : {0, 1}) {
    EXPECT_EQ(rows[k].status, "declined");
    EXPECT_NE(rows[k].message.find("contact"), std::string::npos) << rows[k].message;
  }
  EXPECT_EQ(rows[2].status, "success");
}

TEST(ExperimentFile, PathsAreRelativeToTheFile) {
  const fs::path folder = fs::temp_directory_path() / ("ricochet_beside_" + std::to_string(getpid()));
  fs::create_directories(folder / "scenes");
  fs::copy_file(kSource / "tests/data/press.json", folder / "scenes/my_press.json",
                fs::copy_options::overwrite_existing);
  fs::copy_file(kSource / "tests/data/classical_rk4.json", folder / "my_rk4.json",
                fs::copy_options::overwrite_existing);
  std::ofstream(folder / "mine.json") << R"({"id": "mine", "problem": "scenes/my_press.json", "times": false,
    "methods": [{"method": "moreau_jean", "steps": [10]}, {"method": "fesd:@my_rk4.json,n_fe=2", "steps": [10]}]})";
  RunOptions options;
  options.folder = (folder / "results").string();
  const Results results = read_results(run_experiment((folder / "mine.json").string(), options));
  const auto rows = results.all<ricochet::Run>();
  ASSERT_EQ(rows.size(), 2u);
  EXPECT_EQ(rows[0].status, "success") << rows[0].message;
  EXPECT_EQ(rows[1].method, "fesd:@" + (folder / "my_rk4.json").string() + ",n_fe=2");
  fs::remove_all(folder);
}

}  // namespace
}  // namespace ricochet
