// The gate: results held against a baseline. Nothing passes that was not compared, rounding passes, improvements pass.
#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <functional>
#include <random>
#include <sstream>

#include "bench/experiment/experiment_file.h"
#include "bench/gate/baseline.h"
#include "bench/gate/gate_output.h"
#include "bench/measure/data_folder.h"
#include "bench/studies/grid/grid_experiment.h"
#include "problems/input_error.h"
#include "reports/text_file.h"

namespace ricochet {
namespace {

namespace fs = std::filesystem;

/// A method of order 3 with runs down to 1e-11, one of which failed and was answered, and an error-controlled one.
GridResults gated_results() {
  GridResults results;
  results.path = "results.jsonl";
  results.id = "e";
  results.title = "t";
  results.is_complete = true;
  const auto add = [&](ricochet::Run r) {
    r.experiment = "e";
    r.problem = "p";
    r.solution_size = 1;
    r.reference_error = 1e-16;
    r.status = "success";
    r.max_residual = 2e-16;
    r.detected_events = 2;
    results.records.push_back(r);
  };
  for (const int steps : {5, 50, 60, 70, 85, 100, 120, 150, 180, 220, 270, 330, 400, 500, 600, 750, 900}) {
    ricochet::Run r;
    r.method = "m";
    r.setting.steps = steps;
    r.h_bar = 1.0 / steps;
    r.error = 0.5 * std::pow(r.h_bar, 3);
    r.counters.steps = steps;
    r.counters.force_evaluations = 3 * steps;
    r.counters.matrix_factorizations = 13;
    r.counters.events = 2;
    add(r);
    if (steps != 60) continue;
    results.records.back().status = "infeasible";
    results.records.back().error = std::nan("");
    r.method = "answer";
    r.instead_of = "m";
    add(r);
  }
  for (const double tolerance : {1e-4, 1e-6, 1e-8}) {
    ricochet::Run r;
    r.method = "adaptive";
    r.setting.tolerance = tolerance;
    r.h_bar = 0.1;
    r.error = tolerance;
    r.counters.steps = 20;
    add(r);
  }
  return results;
}

ricochet::Run& run_of(GridResults& results, const std::string& method, double setting) {
  return *std::ranges::find_if(results.records, [&](const ricochet::Run& r) {
    return r.method == method && (r.setting.steps == setting || r.setting.tolerance == setting);
  });
}

class Gate : public testing::Test {
 protected:
  GridResults baseline = gated_results(), results = gated_results();

  GateReport held() const { return hold_against(baseline, results); }
  /// The only line that does not hold, as text.
  std::string finding() const {
    const GateReport report = held();
    std::string text;
    for (const GateLine& line : report.lines) {
      if (line.verdict != GateVerdict::worse && line.verdict != GateVerdict::not_compared) continue;
      text += (text.empty() ? "" : " | ") + std::string(to_string(line.verdict)) + ": " + line.name() + ": " +
              line.findings.front();
    }
    EXPECT_EQ(report.holds(), text.empty());
    return text;
  }
};

TEST_F(Gate, HoldsForEqualResults) {
  const GateReport report = held();
  EXPECT_TRUE(report.holds()) << gate_text(report);
  EXPECT_EQ(report.count(GateVerdict::better), 0);
  EXPECT_EQ(report.compared(), 21 + 3 + 3 + 1) << "runs; residual and work of three methods; the order of one";
}

TEST_F(Gate, NoticesALargerError) {
  run_of(results, "m", 100).error *= 1.2;
  EXPECT_EQ(finding(), "worse: m at 100: error 5.000e-07 in the baseline, now 6.000e-07, at most 5.500e-07 holds");
}

TEST_F(Gate, RoundingPasses) {
  for (ricochet::Run& r : results.records) r.error += 0.9e-11;
  EXPECT_EQ(finding(), "") << "the order, too: the errors of the window reach down to 7e-10";
  for (ricochet::Run& r : results.records) r.max_residual *= 1000;
  EXPECT_EQ(finding(), "");
  run_of(results, "m", 100).counters.matrix_factorizations = 18;
  run_of(results, "m", 120).counters.force_evaluations += 3;
  EXPECT_EQ(finding(), "");
  for (ricochet::Run& r : results.records) r.sensitivities = {"param:e"};
  for (ricochet::Run& r : results.records) r.error += 8e-11;
  EXPECT_EQ(finding(), "") << "derivatives";
}

/// An error-controlled run turns with a last bit: ten times its error, or the error of the next coarser tolerance.
TEST_F(Gate, ErrorControlledRunsMayScatter) {
  run_of(results, "adaptive", 1e-4).error = 9e-4;
  EXPECT_EQ(finding(), "");
  run_of(results, "adaptive", 1e-8).error = 9e-7;
  EXPECT_EQ(finding(), "") << "the run at 1e-6 has an error of 1e-6";
  run_of(results, "adaptive", 1e-8).error = 1.2e-6;
  EXPECT_EQ(finding(),
            "worse: adaptive at 1e-08: error 1.000e-08 in the baseline, now 1.200e-06, at most 1.000e-06 holds");
}

TEST_F(Gate, CoarseRunsAreHeldToAnOrderOfMagnitude) {
  ricochet::Run& coarse = run_of(results, "m", 5);
  ASSERT_GT(coarse.error, 3e-3);
  coarse.error *= 9;
  EXPECT_EQ(finding(), "");
  coarse.error *= 2;
  EXPECT_EQ(finding(), "worse: m at 5: error 4.000e-03 in the baseline, now 7.200e-02, at most 4.000e-02 holds");
}

/// 9 % at each run is allowed, but not 9 % more at each finer one.
TEST_F(Gate, NoticesALowerOrder) {
  const auto worse_by = [&](double steps) { return 1.099 * std::pow(steps / 900, 0.033); };
  for (ricochet::Run& r : results.records) {
    if (r.method == "m") r.error *= std::max(1.0, worse_by(r.setting.steps));
  }
  EXPECT_EQ(finding(), "");
  results = baseline;
  for (ricochet::Run& r : results.records) {
    if (r.method == "m" && r.has_error())
      r.error = std::max(r.error, 0.5 * std::pow(100, -3) * std::pow(r.setting.steps / 100., -2.8));
  }
  const GateReport report = held();
  const auto order = std::ranges::find(report.lines, "order", &GateLine::what);
  EXPECT_EQ(order->verdict, GateVerdict::worse);
  EXPECT_EQ(order->findings.front().substr(0, 30), "3.00 in the baseline, now 2.83");
}

/// The window of the fit moves with the errors: with the finest runs below the floor, and coarse ones that become
/// asymptotic. What became better was worse before.
TEST_F(Gate, AnImprovementNeverBlocks) {
  for (const double factor : {0.5, 0.1, 1e-3, 1e-9, 0.0}) {
    results = baseline;
    for (ricochet::Run& r : results.records) r.error *= factor;
    EXPECT_EQ(finding(), "") << factor;
    if (factor < 0.4) EXPECT_GT(held().count(GateVerdict::better), 3) << factor;
  }
  results = baseline;
  for (ricochet::Run& r : results.records) r.error *= r.setting.steps < 200 ? 0.01 : 1;
  EXPECT_EQ(finding(), "") << "coarse runs alone: their line has another slope";
  results = baseline;
  ricochet::Run& failed = run_of(results, "m", 60);
  failed.status = "success";
  failed.error = 1;
  EXPECT_EQ(finding(), "") << "an error where there was none";
  results = baseline;
  for (ricochet::Run& r : results.records) r.counters = {.steps = r.counters.steps};
  EXPECT_EQ(finding(), "") << "less work";
  EXPECT_GT(held().count(GateVerdict::better), 0);
}

TEST_F(Gate, NoticesAFailure) {
  ricochet::Run& run = run_of(results, "m", 180);
  run.status = "infeasible";
  run.message = "no solution";
  run.error = std::nan("");
  EXPECT_EQ(finding(),
            "worse: m at 180: succeeded in the baseline, now infeasible: no solution | "
            "not compared: m, order: 14 of 15 runs of its window, N_sim = 50 .. 900, have an error");
}

/// What a method declines in both is held; what it declines now it solved before.
TEST_F(Gate, NoticesWhatIsDeclined) {
  ricochet::Run& run = run_of(results, "m", 60);
  run_of(baseline, "m", 60).status = run.status = "declined";
  EXPECT_EQ(finding(), "");
  run_of(results, "adaptive", 1e-6).status = "declined";
  EXPECT_TRUE(finding().starts_with("worse: adaptive at 1e-06: succeeded in the baseline, now declined")) << finding();
}

TEST_F(Gate, HoldsTheLargestResidual) {
  run_of(results, "m", 180).max_residual = 1e-10;
  EXPECT_EQ(finding(), "worse: m, residual: 2.0e-16 in the baseline, now 1.0e-10 at 180, at most 1.0e-11 holds");
  for (const double not_audited : {-1.0, std::nan("")}) {
    results = baseline;
    run_of(results, "m", 180).max_residual = not_audited;
    EXPECT_TRUE(finding().starts_with("not compared: m at 180: residual 2.0e-16 in the baseline, now not audited"))
        << finding();
  }
}

TEST_F(Gate, HoldsTheWork) {
  run_of(results, "m", 180).counters.force_evaluations = 600;
  EXPECT_EQ(finding(), "worse: m at 180: force evaluations 540 in the baseline, now 600");
  results = baseline;
  run_of(results, "m", 180).detected_events = 5;
  EXPECT_EQ(finding(), "worse: m at 180: detected events 2 in the baseline, now 5");
  results = baseline;
  for (ricochet::Run& r : results.records) {
    if (r.method == "m") r.counters.matrix_factorizations = 16;
  }
  EXPECT_EQ(finding(), "worse: m, work: matrix factorizations 208 in the baseline, now 256, in 16 runs")
      << "a decision of Newton's method in one run; in all of them it is the method";
}

/// A run in place of one that failed is one as well.
TEST_F(Gate, HoldsRunsInPlaceOfOthers) {
  ricochet::Run& answer = run_of(results, "answer", 60);
  answer.max_residual = 1e-6;
  EXPECT_EQ(finding(),
            "worse: answer in place of m, residual: 2.0e-16 in the baseline, now 1.0e-06 at 60, at most 1.0e-11 holds");
  answer.max_residual = 0;
  answer.error *= 2;
  EXPECT_TRUE(finding().starts_with("worse: answer at 60 in place of m: error 2.315e-06")) << finding();
}

/// The error of a run that nobody measured, or that nobody had measured.
TEST_F(Gate, NothingPassesThatWasNotCompared) {
  const auto change = [&](const std::function<void(ricochet::Run&)>& how) {
    results = baseline;
    how(run_of(results, "adaptive", 1e-6));
    return finding();
  };
  const std::string run = "not compared: adaptive at 1e-06: ";
  EXPECT_EQ(change([](ricochet::Run& r) { r.error = std::nan(""); }), run + "success without an error");
  EXPECT_EQ(change([](ricochet::Run& r) { r.error = -1; }), run + "error -1: a number >= 0 is required");
  EXPECT_EQ(change([](ricochet::Run& r) { r.error = HUGE_VAL; }), run + "error inf: a number >= 0 is required");
  EXPECT_EQ(change([](ricochet::Run& r) { r.counters.steps = 0; }), run + "success without a step");
  EXPECT_EQ(change([](ricochet::Run& r) { r.status = "sucess"; }), run + "status 'sucess' is unknown");
  EXPECT_EQ(change([](ricochet::Run& r) {
              r.status = "not_built";
              r.message = "no SUNDIALS";
            }),
            run + "not built: no SUNDIALS");
  EXPECT_EQ(change([](ricochet::Run& r) { r.solution_size = 1e6; }),
            run + "size of the solution 1 in the baseline, now 1e+06: another reference");
  EXPECT_EQ(change([](ricochet::Run& r) { r.reference_error = 1e-3; }),
            run + "uncertainty of the reference 1.0e-16 in the baseline, now 1.0e-03");
  EXPECT_EQ(change([](ricochet::Run& r) { r.setting.tolerance = 3e-6; }),
            run +
                "this run of the baseline is not in the results | "
                "not compared: adaptive at 3e-06: this run is not in the baseline");
  EXPECT_TRUE(
      change([](ricochet::Run& r) {
        r.method = "new";
      }).ends_with("not compared: new, all runs: the baseline does not have this method; its runs in the results: 1"));

  results = baseline;
  run_of(results, "m", 100).counters.steps = 50;
  EXPECT_EQ(finding().substr(0, 58), "not compared: m at 100: success with 50 of 100 steps");

  results = baseline;
  results.records.push_back(results.records.back());
  EXPECT_EQ(finding(), "not compared: adaptive at 1e-08: the results have this run twice");

  results = baseline;
  std::erase_if(results.records, [](const ricochet::Run& r) { return r.method == "adaptive" || r.method == "answer"; });
  EXPECT_EQ(finding(),
            "not compared: adaptive, all runs: the results do not have this method; its runs in the baseline: 3 | "
            "not compared: answer, all runs: the results do not have this method; its runs in the baseline: 1");

  results = baseline;
  run_of(results, "m", 60).status = "success";
  EXPECT_EQ(finding(), "not compared: m at 60: success without an error") << "it failed in the baseline";

  results = baseline;
  baseline.records.clear();
  EXPECT_FALSE(held().holds());
  EXPECT_EQ(held().compared(), 0);
  results.records.clear();
  EXPECT_EQ(finding(), "not compared: e, all runs: the baseline holds no run") << "neither holds one";
  EXPECT_EQ(held().count(GateVerdict::not_compared), 1);
}

/// An experiment without reference has residuals and counters to hold.
TEST_F(Gate, HoldsRunsWithoutAReference) {
  for (GridResults* both : {&baseline, &results}) {
    for (ricochet::Run& r : both->records) r.error = std::nan("");
  }
  EXPECT_EQ(finding(), "");
  run_of(results, "m", 180).counters.force_evaluations = 600;
  EXPECT_EQ(finding(), "worse: m at 180: force evaluations 540 in the baseline, now 600");
}

TEST_F(Gate, OfAnotherExperimentIsNone) {
  results.id = "another";
  EXPECT_THROW(held(), InputError);
  results.id = "e";
  results.is_quick = true;
  EXPECT_THROW(held(), InputError) << "the short part has another window";
}

class BaselineFile : public Gate {
 protected:
  fs::path folder = fs::temp_directory_path() / ("ricochet_gate_" + std::to_string(::getpid()));
  std::string path = (folder / "e.jsonl").string();

  void SetUp() override { fs::create_directories(folder); }
  ~BaselineFile() override { fs::remove_all(folder); }

  std::string error_of(const std::function<void()>& call) {
    try {
      call();
    } catch (const InputError& error) {
      return error.what();
    }
    return "no error";
  }
  /// The message for a file in which a text is replaced.
  std::string damaged(const std::string& from, const std::string& to) {
    fs::remove(path);
    write_baseline(baseline, path);
    std::string text = read_text(path);
    const auto at = text.find(from);
    EXPECT_NE(at, std::string::npos) << from;
    fs::remove(path);
    write_text("baseline file", path, text.replace(at, from.size(), to));
    return error_of([&] { read_baseline(path); });
  }
};

TEST_F(BaselineFile, HoldsWhatItWasMadeOf) {
  write_baseline(baseline, path);
  const GridResults read = read_baseline(path);
  EXPECT_TRUE(hold_against(read, results).holds()) << gate_text(hold_against(read, results));
  EXPECT_EQ(hold_against(read, results).lines.size(), held().lines.size());
  EXPECT_EQ(read.line_of(read.records[3]), 5) << "after the header, counted from 1";
  const std::string text = read_text(path), fourth = "\"method\":\"answer\"";
  EXPECT_EQ(std::ranges::count(text.substr(0, text.find(fourth)), '\n'), 4);
  EXPECT_NE(error_of([&] { write_baseline(baseline, path); }), "no error") << "an existing file is not replaced";
}

TEST_F(BaselineFile, NamesFileLineAndFieldOfWhatIsDamaged) {
  const std::string where = "baseline: " + path;
  EXPECT_EQ(damaged("\"error\":0.004,", ""), where + ":2: error = (missing): a number or null is required");
  EXPECT_EQ(damaged("\"error\":0.004,", "\"error\":\"0.004\","),
            where + ":2: error = \"0.004\": a number or null is required");
  EXPECT_EQ(damaged("\"error\":0.004,", "\"error\":-0.004,"),
            where + ":2: m at 5: error = -0.004: a finite number >= 0 is required");
  EXPECT_EQ(damaged("\"error\":0.004,", "\"error\":null,"),
            where + ":2: m at 5: error: a success has none, although other runs have one");
  EXPECT_EQ(damaged("\"matrix_factorizations\":13", "\"matrix_factorizations\":1.5"),
            where + ":2: counters.matrix_factorizations = 1.5: a whole number >= 0 is required");
  EXPECT_EQ(damaged("\"matrix_factorizations\":13", "\"factorizations\":13"),
            where + ":2: counters.factorizations = 13: unknown");
  EXPECT_EQ(damaged("\"detected_events\":2", "\"detected_events\":-2"),
            where + ":2: detected_events = -2: a whole number >= 0 is required");
  EXPECT_EQ(damaged("\"success\",\"steps\":5}", "\"success\",\"steps\":50}"),
            where + ":3: m at 50: this run is there twice");
  EXPECT_EQ(damaged("\"success\",\"steps\":5}", "\"success\"}"),
            where + ":2: steps = 0: either steps or a tolerance > 0 is required");
  EXPECT_EQ(damaged("\"status\":\"success\"", "\"status\":\"sucess\""),
            where + ":2: m at 5: status 'sucess' is unknown");
  EXPECT_EQ(damaged("\"solution_size\":1.0", "\"solution_size\":0"),
            where + ":2: m at 5: a finite solution_size > 0 and a reference_error from 0 to 0.3 % of it are required");
  EXPECT_TRUE(damaged("\"reference_error\":1e-16", "\"reference_error\":1.0").ends_with("0.3 % of it are required"))
      << "nothing could be held against it";
  EXPECT_EQ(damaged("\"matrix_factorizations\":13", "\"matrix_factorizations\":10000000000000000000"),
            where + ":2: counters.matrix_factorizations = 10000000000000000000: a whole number >= 0 is required")
      << "as a number of 64 bits it would be negative";
  EXPECT_EQ(damaged("{\"kind\":\"end\"}\n", ""), "baseline: results file = " + path + ": it is not complete");
  EXPECT_TRUE(damaged("\"quick\":false", "\"quick\":\"no\"").starts_with(where + ":1: quick"));
  EXPECT_TRUE(damaged("\"experiment\":\"e\"", "\"experiment\":7").starts_with(where + ":1: experiment"));
  EXPECT_EQ(damaged("method_grid", "zeno"), where + ":1: study = zeno: results of a method_grid are required");
  EXPECT_TRUE(damaged("{\"experiment\"", "[").starts_with(where + ":1: not a line of a results file"));
  EXPECT_EQ(error_of([&] { read_baseline(folder.string()); }),
            "baseline: results file = " + folder.string() + ": it is a directory, a file is required");
}

/// Any value in place of any other, in a baseline or in results: a message, or a report that names the change or could
/// not see it since it is none for the worse.
TEST_F(BaselineFile, NoDamageGetsThrough) {
  std::mt19937 random(7);
  const std::vector<nlohmann::json> values = {nullptr,
                                              -1,
                                              -0.0,
                                              0,
                                              7,
                                              1e300,
                                              -1e300,
                                              1e-300,
                                              "",
                                              "1e3",
                                              "x",
                                              "\u0000",
                                              true,
                                              nlohmann::json::array(),
                                              nlohmann::json::object()};
  write_baseline(baseline, path);
  std::vector<nlohmann::json> lines;
  std::istringstream text(read_text(path));
  for (std::string line; std::getline(text, line);) lines.push_back(nlohmann::json::parse(line));
  const std::string changed = (folder / "changed.jsonl").string();
  int messages = 0, blocked = 0;
  for (int trial = 0; trial < 800; ++trial) {
    auto damaged = lines;
    auto& line = damaged[random() % damaged.size()];
    auto& object = line.contains("counters") && random() % 3 == 0 ? line["counters"] : line;
    auto field = object.begin();
    std::advance(field, random() % object.size());
    const std::string name = field.key();
    const nlohmann::json former = field.value(), value = values[random() % values.size()];
    if (random() % 8 == 0)
      object.erase(field);
    else
      field.value() = value;
    fs::remove(changed);
    std::string whole;
    for (const auto& l : damaged) whole += l.dump() + "\n";
    write_text("results file", changed, whole);
    const std::string what = name + ": " + former.dump() + " -> " + (object.contains(name) ? object[name].dump() : "");
    try {
      const GridResults read = read_gated_results(changed);
      const GateReport report = hold_against(read_baseline(path), read);
      blocked += !report.holds();
      if (!report.holds()) continue;
      // What may change without harm: what is not compared, less work, a smaller error.
      const bool is_smaller = !object.contains(name) || object[name] == former || name == "events" ||
                              (object[name].is_number() && former.is_number() && object[name] <= former);
      const bool is_held = name != "title" && name != "h_bar" && name != "command" && name != "schema";
      EXPECT_TRUE(is_smaller || !is_held || value == 7 || value == 1e-300 || name == "reference_error" ||
                  former == "infeasible" || former.is_null())
          << what << "\n"
          << gate_text(report);
    } catch (const InputError& error) {
      ++messages;
    }
    try {
      hold_against(read_baseline(changed), results);
    } catch (const InputError& error) {
      EXPECT_NE(std::string(error.what()).find(changed.substr(0, 5)), std::string::npos) << what << error.what();
    }
  }
  EXPECT_GT(messages, 100);
  EXPECT_GT(blocked, 20);
}

TEST_F(BaselineFile, OfNothingIsNotWritten) {
  const auto refused = [&](const std::function<void()>& change) {
    baseline = gated_results();
    change();
    const std::string error = error_of([&] { write_baseline(baseline, path); });
    EXPECT_FALSE(fs::exists(path)) << error;
    return error;
  };
  EXPECT_EQ(refused([&] { baseline.records.clear(); }),
            "baseline file = " + path + ": the results contain no run to compare");
  EXPECT_EQ(refused([&] { run_of(baseline, "m", 50).error = std::nan(""); }),
            "results.jsonl:3: m at 50: error: a success has none, although other runs have one");
  path = (folder / "missing" / "e.jsonl").string();
  EXPECT_EQ(refused([] {}), "baseline file = " + path + ": cannot be written: the folder does not exist or is closed");
}

/// Every method of every order experiment is held: one that is new has no baseline until somebody makes it.
TEST(ShippedBaselines, HoldEveryMethodOfTheOrderExperiments) {
  const auto held = read_experiment_file("orders").parts();
  int experiments = 0;
  for (const auto& name : experiment_names()) {
    if (!name.ends_with("_order")) continue;
    for (const auto& part : read_experiment_file(name).parts()) {
      ++experiments;
      EXPECT_NE(std::ranges::find(held, part), held.end()) << part << " is not in bench/experiments/orders.json";
    }
  }
  EXPECT_GE(experiments, 8);
  for (const auto& part : held) {
    const GridResults baseline = read_baseline(find_project_file("reports/baselines/" + part + ".jsonl"));
    EXPECT_TRUE(baseline.is_quick) << "the tests run the short part";
    const GridExperiment experiment = read_grid_experiment(read_experiment_file(part).document);
    for (const auto& grid : experiment.methods) {
      const auto runs = baseline.of(grid.method);
      EXPECT_FALSE(runs.empty()) << part << " has no baseline for " << grid.method << ": ./run baselines";
      const auto solved = std::ranges::count_if(runs, [](const ricochet::Run* run) { return run->succeeded(); });
      EXPECT_TRUE(solved > 0 || !grid.may_fail.empty()) << part << ": " << grid.method;
    }
  }
}

// What machines read.

class GateOutput : public Gate {
 protected:
  GridResults odd = gated_results();

  void SetUp() override {
    ricochet::Run& worse = run_of(results, "m", 100);
    worse.status = "infeasible";
    worse.message = "50 % of <a> & \"b\",\nthen a bell \x07 and half a letter \xC3 | `x`";
    run_of(results, "adaptive", 1e-6).error = -1;
    run_of(results, "adaptive", 1e-4).error = 1e-9;
  }
};

/// The elements of a well-formed XML document without namespaces, as "depth name attribute=value ..."; a message where
/// it is not well-formed: a start tag without its end tag, an attribute without quotes, a bare "<" or "&" in a text.
std::vector<std::string> elements_of(const std::string& xml) {
  std::vector<std::string> elements, open;
  const auto fault = [&](std::size_t at) { return std::vector{"not well-formed at: " + xml.substr(at, 60)}; };
  const auto is_text = [](const std::string& text) {
    for (std::size_t k = 0; k < text.size(); ++k) {
      if (text[k] == '<' || (static_cast<unsigned char>(text[k]) < 0x20 && text[k] != '\n')) return false;
      if (text[k] != '&') continue;
      const auto end = text.find(';', k);
      if (end == std::string::npos) return false;
      const std::string entity = text.substr(k + 1, end - k - 1);
      if (!entity.starts_with('#') && entity != "amp" && entity != "lt" && entity != "gt" && entity != "quot")
        return false;
    }
    return true;
  };
  std::size_t at = xml.find("?>") + 2;
  if (!xml.starts_with("<?xml version=\"1.0\"")) return fault(0);
  while (at < xml.size()) {
    const auto begin = xml.find('<', at);
    if (!is_text(xml.substr(at, begin - at))) return fault(at);
    if (begin == std::string::npos) break;
    const auto end = xml.find('>', begin);
    if (end == std::string::npos) return fault(begin);
    std::string tag = xml.substr(begin + 1, end - begin - 1);
    at = end + 1;
    if (tag.starts_with('/')) {
      if (open.empty() || open.back() != tag.substr(1)) return fault(begin);
      open.pop_back();
      continue;
    }
    const bool is_closed = tag.ends_with('/');
    if (is_closed) tag.pop_back();
    const std::string name = tag.substr(0, tag.find(' '));
    std::string element = std::to_string(open.size()) + " " + name;
    for (std::size_t k = name.size(); k < tag.size();) {
      const auto quote = tag.find("=\"", k), last = tag.find('"', quote + 2);
      if (tag[k] != ' ' || quote == std::string::npos || last == std::string::npos) return fault(begin);
      if (!is_text(tag.substr(quote + 2, last - quote - 2))) return fault(begin);
      element += tag.substr(k, last + 1 - k);
      k = last + 1;
    }
    elements.push_back(element);
    if (!is_closed) open.push_back(name);
  }
  if (!open.empty()) return fault(xml.size());
  return elements;
}

TEST_F(GateOutput, JunitIsXmlWithATestCasePerLine) {
  const GateReport report = held();
  const std::string xml = gate_junit({report});
  const auto elements = elements_of(xml);
  ASSERT_GT(elements.size(), report.lines.size()) << elements.front();
  EXPECT_EQ(elements[0], "0 testsuites name=\"ricochet check\"");
  EXPECT_EQ(elements[1], "1 testsuite name=\"e\" tests=\"28\" failures=\"1\" errors=\"2\" skipped=\"0\"");
  EXPECT_EQ(std::ranges::count_if(elements, [](const auto& e) { return e.starts_with("2 testcase"); }), 28);
  EXPECT_EQ(std::ranges::count_if(elements, [](const auto& e) { return e.starts_with("3 failure"); }), 1);
  EXPECT_EQ(std::ranges::count_if(elements, [](const auto& e) { return e.starts_with("3 error"); }), 2);
  EXPECT_EQ(std::ranges::count_if(elements, [](const auto& e) { return e.starts_with("3 system-out"); }), 1);
  EXPECT_NE(
      xml.find(
          "50 % of &lt;a&gt; &amp; &quot;b&quot;,&#10;then a bell \xEF\xBF\xBD and half a letter \xEF\xBF\xBD | `x`"),
      std::string::npos)
      << xml;
}

TEST_F(GateOutput, AnnotationsStandAtTheLineOfTheBaseline) {
  baseline.path = "baselines/a,b.jsonl";
  const std::string text = gate_annotations({held()});
  EXPECT_NE(
      text.find("::error file=baselines/a%2Cb.jsonl,line=8,title=e%3A worse::m at 100: succeeded in the baseline, now "
                "infeasible: 50 %25 of <a> & \"b\",%0Athen a bell"),
      std::string::npos)
      << text;
  EXPECT_NE(text.find("title=e%3A not compared::adaptive at 1e-06: error -1"), std::string::npos) << text;
  EXPECT_NE(text.find("::notice file="), std::string::npos) << text;
  EXPECT_EQ(std::ranges::count(text, '\n'), 4) << "a line each, whatever the message has\n" << text;
  for (ricochet::Run& r : results.records) r.error = -1;
  const std::string many = gate_annotations({held()});
  EXPECT_EQ(std::ranges::count(many, '\n'), 10) << "GitHub shows ten of a step";
  EXPECT_NE(many.find("\n::error title=ricochet check::and 12 more, see the summary\n"), std::string::npos) << many;
}

TEST_F(GateOutput, MarkdownIsATable) {
  const std::string text = gate_markdown({held()});
  EXPECT_TRUE(text.starts_with("### e: does not hold\n\n26 lines compared with ")) << text;
  EXPECT_NE(text.find("\n| m at 100 | worse | succeeded in the baseline, now infeasible: 50 % of &lt;a&gt; &amp; "
                      "&quot;b&quot;, then a bell \x07 and half a letter \xC3 \\| \\`x\\` |\n"),
            std::string::npos)
      << text;
  EXPECT_NE(text.find("<details><summary>1 better</summary>"), std::string::npos) << text;
}

TEST_F(GateOutput, JsonHasEveryLine) {
  const nlohmann::json written = gate_json({held()});
  EXPECT_EQ(written["holds"], false);
  const auto& experiment = written["experiments"][0];
  EXPECT_EQ(experiment["experiment"], "e");
  EXPECT_EQ(experiment["worse"], 1);
  EXPECT_EQ(experiment["not_compared"], 2);
  EXPECT_EQ(experiment["better"], 1);
  EXPECT_EQ(experiment["lines"].size(), 28u);
  results = baseline;
  EXPECT_EQ(gate_json({held()})["holds"], true);
}

}  // namespace
}  // namespace ricochet
