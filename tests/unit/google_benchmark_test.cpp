// JSON of Google Benchmark as results, and the gate of its counters.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>

#include "bench/experiment/study.h"
#include "bench/gate/counter_gate.h"
#include "bench/gate/gate_output.h"
#include "bench/studies/google_benchmark/benchmark_file.h"
#include "problems/input_error.h"

namespace ricochet {
namespace {

/// What Google Benchmark 1.7 writes: a benchmark of three repetitions with what it makes of them, one that fails, one
/// without items in other units, and the fit of a family.
const std::string kBenchmarkFile = R"({
  "context": {
    "date": "2026-11-23T08:22:05+00:00", "host_name": "vm", "executable": "out/bin/bench_some", "num_cpus": 2,
    "mhz_per_cpu": 2300, "cpu_scaling_enabled": false, "caches": [{"type": "Data", "level": 1, "size": 49152}],
    "load_avg": [6.4,4.1], "library_build_type": "debug"
  },
  "benchmarks": [
    {"name": "m/s/8", "family_index": 0, "per_family_instance_index": 0, "run_name": "m/s/8", "run_type": "iteration",
     "repetitions": 3, "repetition_index": 0, "threads": 1, "iterations": 10, "real_time": 9.0, "cpu_time": 8.0,
     "time_unit": "us", "items_per_second": 1.25e+05, "allocations": 4.0e+00, "steps": 100, "bytes": 64},
    {"name": "m/s/8", "family_index": 0, "per_family_instance_index": 0, "run_name": "m/s/8", "run_type": "iteration",
     "repetitions": 3, "repetition_index": 1, "threads": 1, "iterations": 10, "real_time": 5.0, "cpu_time": 4.0,
     "time_unit": "us", "items_per_second": 2.5e+05, "allocations": 4.0e+00, "steps": 100, "bytes": 64},
    {"name": "m/s/8_mean", "family_index": 0, "per_family_instance_index": 0, "run_name": "m/s/8",
     "run_type": "aggregate", "repetitions": 3, "threads": 1, "aggregate_name": "mean", "aggregate_unit": "time",
     "iterations": 3, "real_time": 7.0, "cpu_time": 5.0, "time_unit": "us", "items_per_second": 2e+05,
     "allocations": 4.0, "steps": 100, "bytes": 64},
    {"name": "m/s/8_median", "family_index": 0, "per_family_instance_index": 0, "run_name": "m/s/8",
     "run_type": "aggregate", "repetitions": 3, "threads": 1, "aggregate_name": "median", "aggregate_unit": "time",
     "iterations": 3, "real_time": 5.0, "cpu_time": 4.0, "time_unit": "us", "items_per_second": 2.5e+05,
     "allocations": 4.0, "steps": 100, "bytes": 64},
    {"name": "m/s/8_stddev", "family_index": 0, "per_family_instance_index": 0, "run_name": "m/s/8",
     "run_type": "aggregate", "repetitions": 3, "threads": 1, "aggregate_name": "stddev", "aggregate_unit": "time",
     "iterations": 3, "real_time": 2.0, "cpu_time": 0.5, "time_unit": "us", "items_per_second": 3e+04,
     "allocations": 0.0, "steps": 0, "bytes": 0},
    {"name": "m/s/8_cv", "family_index": 0, "per_family_instance_index": 0, "run_name": "m/s/8",
     "run_type": "aggregate", "repetitions": 3, "threads": 1, "aggregate_name": "cv",
     "aggregate_unit": "percentage", "iterations": 3, "real_time": 0.4, "cpu_time": 0.1, "time_unit": "us",
     "items_per_second": 0.1, "allocations": 0.0, "steps": -NaN, "bytes": NaN},
    {"name": "m/s/16", "family_index": 1, "per_family_instance_index": 0, "run_name": "m/s/16",
     "run_type": "iteration", "repetitions": 1, "repetition_index": 0, "threads": 1, "error_occurred": true,
     "error_message": "no NaN, \"no\" Infinity", "iterations": 0, "real_time": 0, "cpu_time": 0, "time_unit": "us"},
    {"name": "m/s/32", "family_index": 2, "per_family_instance_index": 0, "run_name": "m/s/32",
     "run_type": "iteration", "repetitions": 1, "repetition_index": 0, "threads": 1, "iterations": 3,
     "real_time": 3.0, "cpu_time": 2.0, "time_unit": "ms", "label": "a text", "allocations": 7, "residual": Infinity},
    {"name": "m/s_BigO", "family_index": 3, "per_family_instance_index": 0, "run_name": "m/s",
     "run_type": "aggregate", "repetitions": 1, "threads": 1, "aggregate_name": "BigO", "aggregate_unit": "time",
     "cpu_coefficient": 2.0, "real_coefficient": 3.0, "big_o": "N^2", "time_unit": "ns"},
    {"name": "m/s_RMS", "family_index": 3, "per_family_instance_index": 0, "run_name": "m/s",
     "run_type": "aggregate", "repetitions": 1, "threads": 1, "aggregate_name": "RMS",
     "aggregate_unit": "percentage", "rms": 0.25}
  ]
})";

Results read_text_of_benchmarks(const std::string& text) {
  auto results = read_benchmarks("some.json", text);
  if (!results) throw std::runtime_error("it is not taken for JSON of Google Benchmark");
  return *results;
}

std::string with_replaced(std::string text, const std::string& before, const std::string& after) {
  const auto at = text.find(before);
  EXPECT_NE(at, std::string::npos) << before;
  return text.replace(at, before.size(), after);
}

TEST(GoogleBenchmark, TakesTheMedianOfRepetitions) {
  const auto rows = read_text_of_benchmarks(kBenchmarkFile).all<BenchmarkRow>();
  ASSERT_EQ(rows.size(), 3u);
  EXPECT_EQ(rows[0].name, "m/s/8");
  EXPECT_EQ(rows[0].aggregate, "median");
  EXPECT_EQ(rows[0].repetitions, 3);
  EXPECT_DOUBLE_EQ(rows[0].real_seconds, 5e-6);
  EXPECT_DOUBLE_EQ(rows[0].cpu_seconds, 4e-6);
  EXPECT_DOUBLE_EQ(rows[0].spread, 0.1);
  EXPECT_DOUBLE_EQ(rows[0].items_per_second, 2.5e5);
  EXPECT_EQ(rows[0].counters, (std::map<std::string, double>{{"allocations", 4}, {"bytes", 64}, {"steps", 100}}));
}

TEST(GoogleBenchmark, TakesTheMeanOrTheFirstWhereThereIsNoMedian) {
  const std::string no_median =
      with_replaced(kBenchmarkFile, R"("aggregate_name": "median")", R"("aggregate_name": "p90")");
  const auto mean = read_text_of_benchmarks(no_median).all<BenchmarkRow>().front();
  EXPECT_EQ(mean.aggregate, "mean");
  EXPECT_DOUBLE_EQ(mean.cpu_seconds, 5e-6);
  const std::string no_mean = with_replaced(no_median, R"("aggregate_name": "mean")", R"("aggregate_name": "max")");
  const auto first = read_text_of_benchmarks(no_mean).all<BenchmarkRow>().front();
  EXPECT_EQ(first.aggregate, "");
  EXPECT_DOUBLE_EQ(first.cpu_seconds, 8e-6);
  EXPECT_TRUE(std::isnan(first.spread));
}

TEST(GoogleBenchmark, ReadsErrorsUnitsAndFits) {
  const Results results = read_text_of_benchmarks(kBenchmarkFile);
  const auto rows = results.all<BenchmarkRow>();
  EXPECT_EQ(rows[1].error, "no NaN, \"no\" Infinity") << "inside of a text these are words";
  EXPECT_TRUE(std::isnan(rows[1].cpu_seconds));
  EXPECT_DOUBLE_EQ(rows[2].cpu_seconds, 2e-3);
  EXPECT_TRUE(std::isnan(rows[2].items_per_second));
  EXPECT_TRUE(std::isnan(rows[2].counters.at("residual")));
  const auto fits = results.all<ComplexityRow>();
  ASSERT_EQ(fits.size(), 1u);
  EXPECT_EQ(fits[0].name, "m/s");
  EXPECT_EQ(fits[0].big_o, "N^2");
  EXPECT_DOUBLE_EQ(fits[0].cpu_seconds, 2e-9);
  EXPECT_DOUBLE_EQ(fits[0].rms, 0.25);
}

TEST(GoogleBenchmark, TheContextIsTheEnvironment) {
  const Results results = read_text_of_benchmarks(kBenchmarkFile);
  EXPECT_EQ(results.experiment(), "bench_some");
  const auto& environment = results.header.at("environment");
  for (const auto& [name, value] : environment.items()) EXPECT_TRUE(value.is_string()) << name;
  EXPECT_EQ(environment.at("host_name"), "vm");
  EXPECT_EQ(environment.at("processor"), "2 processors of 2300 MHz");
  EXPECT_EQ(environment.at("load_avg"), "[6.4,4.1]");
}

/// The section of a results file that is on disk, as the commands read it.
class BenchmarkSection : public testing::Test {
 protected:
  void SetUp() override { std::filesystem::create_directories(folder_); }
  void TearDown() override { std::filesystem::remove_all(folder_); }
  std::string write(const std::string& name, const std::string& text) const {
    std::ofstream(folder_ / name) << text;
    return folder_ / name;
  }
  const std::filesystem::path folder_ =
      std::filesystem::temp_directory_path() / ("ricochet_benchmarks_" + std::to_string(::getpid()));
};

TEST_F(BenchmarkSection, HasATableOfTimesOneOfFitsAndOneOfFailures) {
  const ShownResults shown = shown_results(write("some.json", kBenchmarkFile));
  const auto tables = shown.section.tables();
  ASSERT_EQ(tables.size(), 3u);
  const Table& times = tables[0]->table;
  std::vector<std::string> headers;
  for (const auto& column : times.columns) headers.push_back(column.header);
  EXPECT_EQ(headers, (std::vector<std::string>{"method", "scene", "N", "real time [us]", "CPU time [us]", "spread [%]",
                                               "items [1/s]", "allocations", "bytes", "residual", "steps"}));
  ASSERT_EQ(times.rows.size(), 2u);
  EXPECT_EQ(times.rows[0], (std::vector<std::string>{"m", "s", "8", "5", "4", "10", "2.5e+05", "4", "64", "-", "100"}));
  EXPECT_EQ(times.rows[1], (std::vector<std::string>{"m", "s", "32", "3000", "2000", "-", "-", "7", "-", "-", "-"}));
  EXPECT_NE(times.note.find("a debug build of Google Benchmark"), std::string::npos);
  EXPECT_EQ(tables[1]->table.rows[0], (std::vector<std::string>{"m/s", "N^2", "0.002", "0.003", "25"}));
  EXPECT_EQ(tables[2]->table.rows[0][0], "m/s/16");
}

TEST_F(BenchmarkSection, OfAReleaseBuildWarnsOfNothing) {
  const ShownResults shown = shown_results(write("some.json", with_replaced(kBenchmarkFile, "debug", "release")));
  EXPECT_EQ(shown.section.tables()[0]->table.note.find("Warning"), std::string::npos);
}

TEST_F(BenchmarkSection, NamesOfAnotherFormStayWhole) {
  const ShownResults shown = shown_results(
      write("some.json", with_replaced(kBenchmarkFile, R"("run_name": "m/s/32")", R"("run_name": "BM_sort")")));
  const Table& times = shown.section.tables()[0]->table;
  EXPECT_EQ(times.columns[0].header, "benchmark");
  EXPECT_EQ(times.rows[1][0], "BM_sort");
}

TEST(BenchmarkName, HasACurveASceneAndN) {
  const auto expect = [](const std::string& text, const std::string& curve, const std::string& scene, double n) {
    const auto name = BenchmarkName::parse(text);
    EXPECT_EQ(name.curve, curve) << text;
    EXPECT_EQ(name.scene, scene) << text;
    EXPECT_EQ(name.n, n) << text;
  };
  expect("newton/box_3d/4", "newton", "box_3d", 4);
  expect("fesd/two_carts/20/hessian", "fesd/hessian", "two_carts", 20);
  expect("cvode:bdf/ball_3d/1e-06", "cvode:bdf/1e-06", "ball_3d", 0);
  expect("BM_sort/1024", "BM_sort", "", 1024);
  expect("BM_sort/1024/threads:2", "BM_sort/threads:2", "", 1024);
  expect("BM_sort", "BM_sort", "", 0);
}

TEST(GoogleBenchmark, IsToldFromResultsByItsBeginning) {
  EXPECT_FALSE(read_benchmarks("r", R"({"kind": "header", "schema": 1, "title": "\"context\""})"
                                    "\n"));
  EXPECT_FALSE(read_benchmarks("r", R"({"problem": "bouncing_ball"})"));
  EXPECT_FALSE(read_benchmarks("r", ""));
  EXPECT_FALSE(read_benchmarks("r", "no \"context\""));
  std::string one_line = kBenchmarkFile;
  std::ranges::replace(one_line, '\n', ' ');
  EXPECT_TRUE(read_benchmarks("r", one_line));
}

struct BadBenchmarkFile {
  const char *before, *after, *message;
};

class BadBenchmarks : public testing::TestWithParam<BadBenchmarkFile> {};

TEST_P(BadBenchmarks, NameThePlace) {
  const auto [before, after, message] = GetParam();
  try {
    read_text_of_benchmarks(with_replaced(kBenchmarkFile, before, after));
    FAIL() << message;
  } catch (const InputError& error) {
    EXPECT_NE(std::string(error.what()).find(message), std::string::npos) << error.what();
  }
}

INSTANTIATE_TEST_SUITE_P(
    Files, BadBenchmarks,
    testing::Values(
        BadBenchmarkFile{R"("rms": 0.25})", R"("rms": )", "some.json: not valid JSON"},
        BadBenchmarkFile{R"("context": {)", R"("about": {)", "some.json: context = (missing)"},
        BadBenchmarkFile{R"("benchmarks": [)", R"("benchmarks": [], "others": [)", "some.json: benchmarks = []"},
        BadBenchmarkFile{R"("benchmarks": [)", R"("benchmarks": [3, )", "benchmarks[0] = 3: an object is required"},
        BadBenchmarkFile{R"({"name": "m/s/8",)", "{", "benchmarks[0].name = (missing)"},
        BadBenchmarkFile{R"("run_name": "m/s/32")", R"("run_name": 32)", ".run_name = 32: a text is required"},
        BadBenchmarkFile{R"("time_unit": "ms")", R"("time_unit": "min")", ".time_unit = min: ns, us, ms or s"},
        BadBenchmarkFile{R"("cpu_time": 2.0)", R"("cpu_time": "2.0")", R"(.cpu_time = "2.0": a number is required)"},
        BadBenchmarkFile{R"("cpu_time": 2.0,)", "", ".cpu_time = (missing)"},
        BadBenchmarkFile{R"("big_o": "N^2",)", "", ".big_o = (missing)"},
        BadBenchmarkFile{R"("label": "a text")", R"("allocations": 1)", "this field is given twice"}));

/// A baseline of the counters above, and results that differ.
class CounterGate : public BenchmarkSection {
 protected:
  CounterResults baseline() const {
    const std::string path = folder_ / "bench_some.jsonl";
    std::filesystem::remove(path);
    write_baseline(CounterResults(read_text_of_benchmarks(kBenchmarkFile)), path);
    return read_counter_baseline(path);
  }
  GateReport held_with(const std::string& before, const std::string& after) const {
    return hold_against(baseline(), CounterResults(read_text_of_benchmarks(with_replaced(median(), before, after))));
  }
  /// The counters of the median are those that are held.
  static std::string median() {
    return with_replaced(kBenchmarkFile, R"(2.5e+05,
     "allocations": 4.0, "steps": 100,)",
                         R"(2.5e+05,
     "allocations": 4.0, "steps": 1e2,)");
  }
  static std::string last_line_but_one(const GateReport& report) {
    const std::string text = gate_text(report);
    return text.substr(0, text.find('\n'));
  }
};

TEST_F(CounterGate, HoldsForEqualCounters) {
  const GateReport report = held_with(R"("cpu_time": 4.0, "time_unit")", R"("cpu_time": 900, "time_unit")");
  EXPECT_TRUE(report.holds()) << gate_text(report);
  EXPECT_EQ(report.compared(), 3) << "the benchmark that fails in both is held, too";
  EXPECT_EQ(report.count(GateVerdict::better), 0);
}

TEST_F(CounterGate, AllocationsAreHeldExactly) {
  const GateReport worse = held_with(R"("allocations": 7)", R"("allocations": 8)");
  EXPECT_FALSE(worse.holds());
  EXPECT_EQ(last_line_but_one(worse), "regression:   m/s/32, counters: allocations 7 in the baseline, now 8");
  const GateReport better = held_with(R"("allocations": 7)", R"("allocations": 6)");
  EXPECT_TRUE(better.holds());
  EXPECT_EQ(last_line_but_one(better), "better:       m/s/32, counters: allocations 7 in the baseline, now 6");
}

TEST_F(CounterGate, WorkMayDifferByATenth) {
  EXPECT_TRUE(held_with(R"("steps": 1e2)", R"("steps": 110)").holds());
  const GateReport worse = held_with(R"("steps": 1e2)", R"("steps": 111)");
  EXPECT_FALSE(worse.holds());
  EXPECT_EQ(last_line_but_one(worse), "regression:   m/s/8, counters: steps 100 in the baseline, now 111");
  EXPECT_TRUE(held_with(R"("steps": 1e2)", R"("steps": 50)").holds());
}

TEST_F(CounterGate, BytesAndResidualsAreNotHeld) {
  EXPECT_TRUE(held_with(R"("residual": Infinity)", R"("residual": 0.5, "bytes": 1e9)").holds());
}

TEST_F(CounterGate, WhatIsMissingIsNamed) {
  const GateReport missing = held_with(R"("run_name": "m/s/32")", R"("run_name": "m/s/33")");
  EXPECT_FALSE(missing.holds());
  EXPECT_EQ(missing.count(GateVerdict::not_compared), 2);
  const std::string text = gate_text(missing);
  EXPECT_NE(text.find("m/s/32, counters: the results do not have this benchmark"), std::string::npos) << text;
  EXPECT_NE(text.find("m/s/33, counters: the baseline does not have this benchmark"), std::string::npos) << text;
  const GateReport counter = held_with(R"("label": "a text", "allocations": 7)", R"("pivots": 3)");
  EXPECT_EQ(counter.count(GateVerdict::not_compared), 1);
  EXPECT_NE(gate_text(counter).find("allocations: the results do not have this counter"), std::string::npos);
  EXPECT_NE(gate_text(counter).find("pivots: the baseline does not have this counter"), std::string::npos);
}

TEST_F(CounterGate, AFailureIsWorseAndASuccessBetter) {
  const GateReport worse =
      held_with(R"("label": "a text")", R"("error_occurred": true, "error_message": "it fell over")");
  EXPECT_FALSE(worse.holds());
  EXPECT_EQ(last_line_but_one(worse), "regression:   m/s/32, counters: measured in the baseline, now: it fell over");
  EXPECT_TRUE(held_with(R"("error_occurred": true)", R"("error_occurred": false, "allocations": 1)").holds());
}

TEST_F(CounterGate, TheSameBenchmarkTwiceIsNotCompared) {
  const GateReport report = held_with(R"("run_name": "m/s/32")", R"("run_name": "m/s/8")");
  EXPECT_FALSE(report.holds());
  EXPECT_NE(gate_text(report).find("m/s/8, counters: the results have this benchmark twice"), std::string::npos);
}

TEST_F(CounterGate, RefusesWhatItCannotHold) {
  const auto refused = [](const auto& work, const std::string& message) {
    try {
      work();
      ADD_FAILURE() << message;
    } catch (const InputError& error) {
      EXPECT_NE(std::string(error.what()).find(message), std::string::npos) << error.what();
    }
  };
  refused([&] { held_with("bench_some", "bench_other"); }, "the results belong to bench_other");
  refused([&] { held_with(R"("allocations": 7)", R"("allocations": 7.5)"); }, "m/s/32: allocations = 7.5");
  refused([&] { held_with(R"("allocations": 7)", R"("allocations": -1)"); }, "a whole number >= 0 is required");
  refused([&] { held_with(R"("allocations": 7)", R"("allocations": NaN)"); }, "m/s/32: allocations = nan");
  refused([&] { write_baseline(baseline(), folder_ / "bench_some.jsonl"); }, "the file exists; a new file is required");
  const std::string nothing =
      R"({"context": {}, "benchmarks": [{"name": "a", "real_time": 1, "cpu_time": 1, "time_unit": "ns"}]})";
  refused([&] { write_baseline(CounterResults(read_text_of_benchmarks(nothing)), folder_ / "new.jsonl"); },
          "no benchmark has a counter that the gate compares");
  const std::string cut = write("cut.jsonl", R"({"kind": "header", "schema": 1, "study": "google_benchmark"})"
                                             "\n");
  refused([&] { read_counter_baseline(cut); }, "it is not complete");
}

/// The baseline of the repository has lines, to which annotations point.
TEST_F(CounterGate, KnowsTheLineOfTheBaseline) {
  const GateReport worse = held_with(R"("allocations": 7)", R"("allocations": 8)");
  const auto line = std::ranges::find(worse.lines, GateVerdict::worse, &GateLine::verdict);
  ASSERT_NE(line, worse.lines.end());
  EXPECT_EQ(line->line, 4);
}

}  // namespace
}  // namespace ricochet
