// The question pages: what they measure of methods whose answers are known, and the derivatives of their cases.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>

#include "bench/experiment/experiment_file.h"
#include "bench/experiment/run_experiment.h"
#include "bench/experiment/study.h"
#include "bench/measure/sensitivities.h"
#include "bench/studies/questions/gradient_cases.h"
#include "bench/studies/questions/question.h"
#include "bench/studies/questions/toss_data.h"
#include "methods/method_spec.h"
#include "methods/registry.h"
#include "problems/input_error.h"
#include "reference/certified/certified_motion.h"

namespace ricochet {
namespace {

namespace fs = std::filesystem;

/// Answers of an experiment with a few methods.
class Questions : public testing::Test {
 protected:
  fs::path folder = fs::temp_directory_path() / ("ricochet_questions_" + std::to_string(getpid()));
  ~Questions() override { fs::remove_all(folder); }

  Results ask(const std::string& name, const std::vector<std::string>& methods, const nlohmann::json& changes) const {
    ExperimentFile file = read_experiment_file(name);
    file.take_quick_part(true);
    file.document["methods"] = methods;
    file.document.merge_patch(changes);
    RunOptions options;
    options.folder = folder;
    return read_results(run_experiment(file, options));
  }
};

/// Time stepping that tells the ends of its steps alone, as engines do.
class SteppingWithoutMotion : public Method {
 public:
  explicit SteppingWithoutMotion(const MethodSpec&) {}
  MethodInfo info() const override { return inner_->info(); }
  Support supports(const ProblemInfo& problem) const override { return inner_->supports(problem); }

 protected:
  Solution do_solve(const Problem& problem, const Settings& settings) const override {
    Solution solution = inner_->solve(problem, settings);
    solution.motion = {};
    return solution;
  }

 private:
  std::unique_ptr<Method> inner_ = make_method("moreau_jean");
};

const bool is_registered = register_method<SteppingWithoutMotion>({.name = "stepping_without_motion",
                                                                   .usage = "stepping_without_motion",
                                                                   .summary = "of a test",
                                                                   .examples = {"stepping_without_motion"}});

double found(const std::vector<Answer>& answers, const std::string& method, double h, const std::string& what,
             const std::map<std::string, double>& of = {}) {
  for (const Answer& a : answers) {
    if (a.method == method && a.h == h && (of.empty() || a.conditions == of)) {
      if (what == "error") return a.error;
      if (a.values.contains(what)) return a.values.at(what);
    }
  }
  ADD_FAILURE() << method << ", h = " << h << ": no " << what;
  return 0;
}

TEST_F(Questions, AboutBouncing) {
  const auto answers = ask("bounce", {"moreau_jean", "event_driven", "fesd:gauss:2,elements=as_needed"},
                           {{"restitution", {0.8, 1}}, {"bounces", {1, 10}}, {"step_lengths", {0.001}}})
                           .all<Answer>();
  for (const Answer& a : answers) {
    EXPECT_EQ(a.status, "success") << a.message;
    if (!a.conditions.contains("e")) continue;
    EXPECT_NEAR(a.values.at("exact"), 0.9 * std::pow(a.conditions.at("e"), 2 * a.conditions.at("bounces")), 1e-15);
    // First order: the speed of an impact is wrong by a step of gravity at most, ten times over.
    const double tolerance = a.method == "moreau_jean" ? 0.05 : a.h > 0 ? 3e-6 / a.values.at("exact") : 1e-8;
    EXPECT_NEAR(a.values.at("height") / a.values.at("exact"), 1, tolerance) << a.command();
  }
  EXPECT_EQ(found(answers, "event_driven", 0, "threshold"), 0) << "it bounces always";
  EXPECT_EQ(found(answers, "moreau_jean", 0.001, "threshold"), 0);
}

TEST_F(Questions, AboutFriction) {
  const auto answers = ask("hold", {"moreau_jean", "penalty", "event_driven", "stepping_without_motion"},
                           {{"fractions", {0.9, 1.1}}, {"step_lengths", {0.001}}})
                           .all<Answer>();
  const std::map<std::string, double> held{{"fraction", 0.9}}, slides{{"fraction", 1.1}};
  EXPECT_LT(std::abs(found(answers, "moreau_jean", 0.001, "creep", held)), 1e-12) << "rounding";
  EXPECT_GT(std::abs(found(answers, "penalty", 0.001, "creep", held)), 1e-6) << "regularised friction creeps";
  const double exact = found(answers, "event_driven", 0, "exact", slides);
  const double slope = std::atan(1.1 * 0.5);
  EXPECT_NEAR(exact, 1.5 * 9.81 * (std::sin(slope) - 0.5 * std::cos(slope)), 1e-14);
  EXPECT_NEAR(found(answers, "event_driven", 0, "creep", slides), exact, 1e-8 * exact) << "ten times its tolerance";
  // Between the ends of steps places are on straight lines: off by a(h)^2/8, and the speed by a step at most.
  EXPECT_NEAR(found(answers, "stepping_without_motion", 0.001, "creep", slides),
              found(answers, "moreau_jean", 0.001, "creep", slides), 0.01 * exact);
}

TEST_F(Questions, AboutLiftingOff) {
  const auto answers = ask("lift", {"moreau_jean", "anitescu_convex"}, {{"step_lengths", {0.001}}}).all<Answer>();
  EXPECT_LT(found(answers, "moreau_jean", 0.001, "lift"), 1e-12);
  const double thrown = found(answers, "anitescu_convex", 0.001, "throw");
  EXPECT_NEAR(thrown, std::pow(0.5 * 6 / 1.25, 2) / (2 * 9.81), 1e-12);
  EXPECT_NEAR(found(answers, "anitescu_convex", 0.001, "lift"), thrown, 0.02 * thrown) << "some steps of 1 ms";
}

TEST_F(Questions, AboutOverlapsAtTheStart) {
  const double d = 0.01, h = 0.001;
  const Results results = ask("overlap", {"moreau_jean", "schatzman_paoli", "xpbd", "event_driven"},
                              {{"depths", {d}}, {"step_lengths", {h}}});
  for (const Answer& a : results.all<Answer>()) {
    const std::string what = a.method + ", " + a.scene;
    if (a.method == "moreau_jean") {  // laws of velocities ask nothing of a depth
      EXPECT_NEAR(a.value("left"), d, 1e-12) << what;
      EXPECT_LT(a.value("speed"), 1e-12) << what;
    } else if (a.method == "schatzman_paoli") {  // out in one step, and that is a velocity
      EXPECT_NEAR(a.value("speed"), d / h, 1e-9) << what;
      const double mass = a.scene == "ball in the floor" ? 1 : a.scene == "two balls" ? 0.75 : 0.5;
      EXPECT_NEAR(a.value("gained"), mass * std::pow(d / h, 2) / 2, 1e-6) << what << ": of the reduced mass";
      if (a.scene != "ball in the floor") EXPECT_NEAR(a.value("apart"), d / h * (1 - h), 1e-9) << what;
    } else if (a.method == "xpbd") {  // out in a substep, its velocity is taken away again
      EXPECT_LT(a.value("left"), 1e-12) << what;
      EXPECT_LT(a.value("apart"), 1e-12) << what;
      EXPECT_LT(a.value("gained"), 1e-12) << what;
    }
  }
  Section section;
  study_of(results).show(results, section);
  const std::string answer = section.tables().front()->table.text();
  EXPECT_NE(answer.find("keeps the overlap"), std::string::npos) << answer;
  EXPECT_NE(answer.find("throws them apart"), std::string::npos) << answer;
}

TEST_F(Questions, AboutSteps) {
  const auto answers =
      ask("calibrate", {"moreau_jean", "fesd:gauss:2,elements=as_needed"},
          {{"scenes", nlohmann::json::array({{{"problem", "sliding_block"}}, {{"problem", "bouncing_ball"}}})},
           {"step_lengths", {0.01, 0.001}}})
          .all<Answer>();
  for (const Answer& a : answers) {
    EXPECT_EQ(a.status, "success") << a.message;
    if (a.method.starts_with("fesd")) EXPECT_LT(a.error, 1e-9) << a.command();
  }
  EXPECT_GT(found(answers, "moreau_jean", 0.01, "error"), found(answers, "moreau_jean", 0.001, "error"));
}

TEST_F(Questions, SayWhatIsMissing) {
  for (const auto& entry : methods()) {
    if (entry.make) continue;
    const auto answers = ask("hold", {entry.name}, {{"step_lengths", {0.01}}}).all<Answer>();
    EXPECT_EQ(answers.front().status, "not_built");
    EXPECT_EQ(answers.front().message, entry.not_built);
    return;
  }
}

TEST_F(Questions, HaveTheAnswerFirst) {
  const Results results = ask("hold", {"moreau_jean"}, {{"step_lengths", {0.01, 0.001}}});
  Section section;
  study_of(results).show(results, section);
  const auto tables = section.tables();
  ASSERT_FALSE(tables.empty());
  EXPECT_EQ(tables.front()->name, "answer");
  EXPECT_EQ(tables.front()->role, Section::Role::result);
  EXPECT_NE(tables.front()->table.text().find("holds"), std::string::npos);
  EXPECT_EQ(tables.back()->name, "threads");
}

/// A cube that turns about a fixed axis while it flies, in the form of the measured ones: numbers, or text in place of them.
std::string toss_file(const std::string& folder, int n, bool is_cut = false) {
  std::vector<double> numbers;
  const double dt = 1.0 / 148, a = 0.0524, rate = 4, g = 9.81;
  for (int k = 0; k < n; ++k) {
    const double t = k * dt, half = 0.5 * rate * t;
    for (const double x : {1.0 * t, -0.5 * t, 0.4 - 0.5 * g * t * t}) numbers.push_back(x / a);
    for (const double x : {std::cos(half), 0.0, std::sin(half), 0.0}) numbers.push_back(x);  // about y
    // As in the data, differences to the row before.
    for (const double x : {1.0, -0.5, -g * (t - dt / 2)}) numbers.push_back(x / a);
    for (const double x : {0.0, rate, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0}) numbers.push_back(x);
  }
  const std::string path = folder + "/0.pt";
  std::ofstream file(path, std::ios::binary);
  file << "a pickle's head";
  const std::uint64_t count = numbers.size() - (is_cut ? 1 : 0);
  file.write(reinterpret_cast<const char*>(&count), 8);
  file.write(reinterpret_cast<const char*>(numbers.data()), static_cast<std::streamsize>(8 * count));
  return path;
}

TEST_F(Questions, AboutMeasuredMotion) {
  fs::create_directories(folder / "data");
  toss_file(folder / "data", 38);
  const auto answers =
      ask("tosses", {"fesd_adaptive:radau-iia:4", "moreau_jean"}, {{"data", (folder / "data").string()}}).all<Answer>();
  ASSERT_EQ(answers.size(), 2u);
  for (const Answer& a : answers) {
    EXPECT_EQ(a.status, "success") << a.message;
    // Free flight: exact but for the straight lines between rows and steps, g dt^2 / 8 = 6e-5 m.
    EXPECT_LT(a.values.at("distance at 0.20 s"), 3e-4) << a.method;
    EXPECT_LT(a.values.at("angle at 0.20 s"), 4.0 / 148) << "the rotation of the nearer row";
  }
  fs::remove(folder / "data/0.pt");
  EXPECT_THROW(ask("tosses", {"moreau_jean"}, {{"data", (folder / "data").string()}}), InputError) << "no tosses";
  EXPECT_THROW(ask("tosses", {"moreau_jean"}, nlohmann::json::object()), InputError) << "no folder";
  EXPECT_THROW(read_toss(toss_file(folder / "data", 38, true)), InputError) << "19 numbers are a row";
}

TEST(GradientCases, AreWhatFesdAndDifferencesSay) {
  for (const GradientCase& c : gradient_cases()) {
    const auto fesd = make_method("fesd:gauss:4,elements=as_needed");
    Settings settings;
    settings.steps = 40;
    for (const GradientEntry& entry : c.entries) settings.sensitivities.push_back(entry.with_respect);
    const Solution own = fesd->solve(*c.problem, settings);
    ASSERT_TRUE(own.succeeded()) << c.name << ": " << own.message;
    const Solution beside = solve_with_differences(*fesd, *c.problem, settings, 1e-4);
    for (std::size_t k = 0; k < c.entries.size(); ++k) {
      const GradientEntry& entry = c.entries[k];
      const int n_q = c.problem->n_q();
      const auto of = [&](const Solution& s) {
        const auto column = static_cast<Eigen::Index>(k);
        return entry.output < n_q ? s.dq(entry.output, column) : s.dv(entry.output - n_q, column);
      };
      EXPECT_NEAR(of(own), entry.exact, 1e-10) << c.name << ", " << entry.name << ": rounding of forty steps";
      EXPECT_NEAR(of(beside), entry.exact, 1e-7) << c.name << ", " << entry.name << ": of differences over 1e-4";
    }
  }
}

TEST(GradientCases, AreProven) {
  if (!reference::certified::can_certify()) GTEST_SKIP() << "built without Arb";
  const auto closed_forms = gradient_cases();
  auto proven = gradient_cases();
  for (std::size_t i = 0; i < proven.size(); ++i) {
    ASSERT_TRUE(take_proven(proven[i])) << proven[i].name;
    for (std::size_t k = 0; k < proven[i].entries.size(); ++k) {
      const double exact = closed_forms[i].entries[k].exact;
      EXPECT_NEAR(proven[i].entries[k].exact, exact, 1e-14 * (1 + std::abs(exact))) << proven[i].entries[k].name;
    }
  }
}

}  // namespace
}  // namespace ricochet
