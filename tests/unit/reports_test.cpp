#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <limits>
#include <optional>
#include <random>

#include "bench/rows/results_file.h"
#include "bench/studies/control/growth_rows.h"
#include "bench/studies/grid/grid_tables.h"
#include "bench/studies/grid/scale_rows.h"
#include "bench/studies/grid/work_precision.h"
#include "problems/input_error.h"
#include "reports/order_fit.h"
#include "reports/performance_profile.h"
#include "reports/quantile.h"
#include "reports/table.h"
#include "reports/text_file.h"
#include "tests/round_trip.h"

namespace ricochet {
namespace {

namespace fs = std::filesystem;

/// Runs of a method of order p: error = c h^p, on a grid that is not made of powers of two.
std::vector<ricochet::Run> runs_of_order(double p, double c = 1, const std::string& method = "m") {
  std::vector<ricochet::Run> records;
  for (const int steps :
       {50, 60, 70, 85, 100, 120, 150, 180, 220, 270, 330, 400, 500, 600, 750, 900, 1100, 1300, 1600, 2000}) {
    ricochet::Run r;
    r.experiment = "e";
    r.problem = "p";
    r.method = method;
    r.title = method;
    r.setting.steps = steps;
    r.h_bar = 1.0 / steps;
    r.nominal_order = p;
    r.status = "success";
    r.error = c * std::pow(r.h_bar, p);
    r.solution_size = 1;
    r.counters.steps = steps;
    records.push_back(r);
  }
  return records;
}

std::vector<const ricochet::Run*> pointers(const std::vector<ricochet::Run>& records) {
  std::vector<const ricochet::Run*> list;
  for (const auto& r : records) list.push_back(&r);
  return list;
}

TEST(OrderFit, FindsTheOrderOfExactData) {
  for (const double p : {1.0, 2.0, 3.5, 7.0}) {
    const auto records = runs_of_order(p, 2e-3 * std::pow(50, p));
    const auto fit = fit_order(pointers(records));
    ASSERT_TRUE(fit) << p;
    EXPECT_NEAR(fit->slope, p, 1e-10);
    EXPECT_NEAR(fit->half_width, 0, 1e-6);
    EXPECT_EQ(fit->attempted, 20);
  }
}

TEST(OrderFit, IntervalCoversTheSlopeOfNoisyData) {
  std::mt19937 random(5);
  std::normal_distribution<double> noise(0, 0.3);
  int covered = 0;
  for (int trial = 0; trial < 400; ++trial) {
    auto records = runs_of_order(3, 0.1);
    for (auto& r : records) r.error *= std::pow(10, 0.1 * noise(random));
    const auto fit = fit_order(pointers(records));
    ASSERT_TRUE(fit);
    covered += fit->lower() <= 3 && 3 <= fit->upper();
  }
  EXPECT_GE(covered, 365) << "95 % of 400 is 380, standard deviation 4.4";
}

TEST(OrderFit, WindowLeavesOutWhatIsNotAsymptoticAndWhatIsRounding) {
  auto records = runs_of_order(4, 1);
  for (auto& r : records)
    r.error = std::max(r.error, 3e-13);                // floor: above 10 x 1e-13 of the solution from N = 700 on
  for (int k = 0; k < 5; ++k) records[k].error = 0.5;  // coarse: no order yet
  const auto fit = fit_order(pointers(records));
  ASSERT_TRUE(fit);
  EXPECT_NEAR(fit->slope, 4, 1e-10);
  EXPECT_EQ(fit->first_steps, 120);
  EXPECT_EQ(fit->last_steps, 900);
}

TEST(OrderFit, WindowIsRelativeToTheSolution) {
  auto records = runs_of_order(4, 1);
  for (auto& r : records) r.error = std::max(r.error, 3e-13);
  const auto fit = fit_order(pointers(records));
  for (auto& r : records) {
    r.error *= 1e6;
    r.solution_size = 1e6;
  }
  const auto same = fit_order(pointers(records));
  ASSERT_TRUE(fit && same);
  EXPECT_EQ(same->first_steps, fit->first_steps);
  EXPECT_EQ(same->last_steps, fit->last_steps);
}

/// Six points that lie 0.1 and 0.2 decades off a line, against the formulas of linear regression.
TEST(OrderFit, IntervalAndScatterAreThoseOfARegression) {
  const double off[] = {0.1, -0.2, 0.1, 0.1, -0.2, 0.1};
  std::vector<ricochet::Run> records = runs_of_order(2, 1e-3);
  records.resize(6);
  for (std::size_t k = 0; k < 6; ++k) records[k].error *= std::pow(10, off[k]);
  double mean_x = 0, mean_y = 0, S_xx = 0, S_xy = 0, squares = 0;
  std::vector<double> x, y, step_lengths, errors;
  for (const ricochet::Run& r : records) {
    step_lengths.push_back(r.h_bar);
    errors.push_back(r.error);
    x.push_back(std::log10(r.h_bar));
    y.push_back(std::log10(r.error));
    mean_x += x.back() / 6;
    mean_y += y.back() / 6;
  }
  for (std::size_t k = 0; k < 6; ++k) {
    S_xx += std::pow(x[k] - mean_x, 2);
    S_xy += (x[k] - mean_x) * (y[k] - mean_y);
  }
  for (std::size_t k = 0; k < 6; ++k) squares += std::pow(y[k] - mean_y - S_xy / S_xx * (x[k] - mean_x), 2);
  const OrderFit fit = fit_line(step_lengths, errors);
  EXPECT_EQ(fit.used, 6);
  EXPECT_NEAR(fit.slope, S_xy / S_xx, 1e-12);
  EXPECT_NEAR(fit.scatter, std::sqrt(squares / 4), 1e-12) << "6 points and 2 unknowns";
  EXPECT_NEAR(fit.half_width, 2.7764451052 * std::sqrt(squares / 4 / S_xx), 1e-9) << "Student's t, 0.975, 4";
}

TEST(OrderFit, FewPointsAreNoFit) {
  auto records = runs_of_order(1, 3);
  const ObservedOrder order = observe_order(pointers(records));
  EXPECT_FALSE(order.fit) << "errors of 0.3 % of the solution are reached at N = 1000 only";
  EXPECT_EQ(order.no_fit, "too few points");
  EXPECT_EQ(order.reason,
            "4 of the 6 points that are required; up to N_sim = 900 errors are above 3.0e-03, 0.3 % of the solution");
}

/// Whoever reads that there is no order reads why, with the floor below which nothing is fitted.
TEST(OrderFit, SaysWhyThereIsNone) {
  const auto order_of = [](std::vector<ricochet::Run> records) { return observe_order(pointers(records)); };
  const ObservedOrder fitted = order_of(runs_of_order(2, 1e-3));
  EXPECT_TRUE(fitted.fit);
  EXPECT_EQ(fitted.no_fit + fitted.reason, "");
  EXPECT_EQ(fitted.floor, 10 * 1e-13) << "rounding: the reference is exact";

  EXPECT_EQ(order_of(runs_of_order(0, 0.1)).no_fit, "too coarse");

  const ObservedOrder exact = order_of(runs_of_order(0, 2e-16));
  EXPECT_EQ(exact.no_fit, "exact to rounding");
  EXPECT_EQ(exact.reason, "from N_sim = 50 on errors are below 1.0e-12, 10 times rounding");
  EXPECT_EQ(order_of(runs_of_order(0, 0)).no_fit, "exact to rounding") << "an error of zero is one";

  auto records = runs_of_order(4, 1);
  for (auto& r : records) r.reference_error = 1.01e-9;  // errors are above 1.01e-8 up to N = 85
  const ObservedOrder floor = order_of(records);
  EXPECT_EQ(floor.no_fit, "too few points");
  EXPECT_DOUBLE_EQ(floor.floor, 1.01e-8);
  EXPECT_EQ(
      floor.reason,
      "4 of the 6 points that are required; from N_sim = 100 on not all are above 1.0e-08, 10 times the uncertainty of the "
      "reference");
  for (auto& r : records) r.reference_error = 1;
  EXPECT_EQ(order_of(records).no_fit, "as exact as the reference");

  for (auto& r : records) r.error = std::nan("");
  EXPECT_EQ(order_of(records).no_fit, "no reference");
  for (auto& r : records) r.status = "infeasible";
  EXPECT_EQ(order_of(records).reason, "none of 20 runs has a solution");
}

/// Six points between 4.8e-7 and 9e-7 with a slope of 4.84 +- 4.83 say nothing of an order.
TEST(OrderFit, AWideIntervalIsNoFit) {
  std::vector<ricochet::Run> records = runs_of_order(4, 1e-3);
  records.resize(6);
  for (std::size_t k = 0; k < 6; ++k) records[k].error *= k % 2 == 0 ? 1.2 : 0.8;
  ASSERT_TRUE(fit_order(pointers(records)));
  EXPECT_LT(fit_order(pointers(records))->half_width, kWidestInterval);
  for (std::size_t k = 0; k < 6; ++k) records[k].error *= k % 2 == 0 ? 3 : 1 / 3.;
  const ObservedOrder order = observe_order(pointers(records));
  EXPECT_FALSE(order.fit);
  EXPECT_EQ(order.no_fit, "no line");
  EXPECT_TRUE(order.reason.ends_with(" through 6 points, N_sim = 50 .. 120; at most ± 1 is a fit")) << order.reason;
}

/// A run that is exact by chance lies below the floor and ends the window: it is not dropped from the middle of it.
TEST(OrderFit, AnErrorOfZeroEndsTheWindow) {
  auto records = runs_of_order(4, 1);
  records[12].error = 0;
  const auto fit = fit_order(pointers(records));
  ASSERT_TRUE(fit);
  EXPECT_EQ(fit->last_steps, records[11].setting.steps);
}

TEST(OrderFit, DivergenceIsANegativeSlope) {
  const auto records = runs_of_order(-1, 1e-6);
  const auto fit = fit_order(pointers(records));
  ASSERT_TRUE(fit);
  EXPECT_NEAR(fit->slope, -1, 1e-10);
}

TEST(LocalSlopes, AreBetweenNeighbours) {
  auto records = runs_of_order(2);
  records[3].status = "infeasible";
  const auto slopes = local_slopes(pointers(records));
  EXPECT_FALSE(slopes[0]);
  EXPECT_NEAR(*slopes[1], 2, 1e-10);
  EXPECT_FALSE(slopes[3]);
  EXPECT_FALSE(slopes[4]) << "its left neighbour failed";
  records[9].error = 0;
  EXPECT_FALSE(local_slopes(pointers(records))[10]) << "there is no logarithm of zero";
}

class ResultsOnDisk : public testing::Test {
 protected:
  std::string folder = (fs::temp_directory_path() / ("ricochet_results_" + std::to_string(::getpid()))).string();
  ~ResultsOnDisk() override { fs::remove_all(folder); }
  static nlohmann::json header(const std::string& key) {
    return {{"kind", "header"}, {"schema", 1}, {"experiment", "e"}, {"key", key}};
  }
  void write_rows(ResultsFile& file, const std::vector<ricochet::Run>& records) {
    for (const auto& record : records) file.row<ricochet::Run>([&] { return record; });
  }
};

TEST_F(ResultsOnDisk, RowsSurviveTheRoundTrip) {
  auto records = runs_of_order(2);
  records[1].status = "infeasible";
  records[1].message = "a \"reason\", with commas";
  records[1].error = std::nan("");
  {
    ResultsFile file(folder, "e", header("k"));
    write_rows(file, records);
    file.rows<TimingRow>(1, [] { return std::vector{TimingRow{2, {1, 0.5, 0.7, 1.2, 9}}}; });
    file.finish();
  }
  const GridResults results(read_results(folder + "/e.jsonl"));
  EXPECT_TRUE(results.is_complete);
  ASSERT_EQ(results.records.size(), records.size());
  EXPECT_EQ(results.records[0].error, records[0].error) << "to the last bit";
  EXPECT_TRUE(std::isnan(results.records[1].error));
  EXPECT_EQ(results.records[1].message, records[1].message);
  ASSERT_NE(results.timing_of(results.records[2]), nullptr);
  EXPECT_EQ(results.timing_of(results.records[2])->repetitions, 9);
  EXPECT_EQ(results.timing_of(results.records[1]), nullptr);
}

TEST_F(ResultsOnDisk, NoNumberIsNullInTheFile) {
  ricochet::Run record;
  record.error = std::nan("");
  record.h_bar = std::numeric_limits<double>::infinity();
  EXPECT_NE(line_of(record).dump().find("\"error\":null"), std::string::npos);
  EXPECT_TRUE(std::isnan(round_trip(record).error));
  EXPECT_TRUE(std::isnan(round_trip(record).h_bar)) << "JSON cannot tell it from NaN";
  EXPECT_EQ(round_trip(record).setting.tolerance, 0);
}

/// Different numbers in all fields: what is read in place of another one shows.
TEST_F(ResultsOnDisk, EveryFieldKeepsItsPlace) {
  ricochet::Run r;
  r.experiment = "e";
  r.problem = "p";
  r.method = "m";
  r.title = "t";
  r.setting.steps = 1;
  r.setting.tolerance = 2e-3;
  r.h_bar = 3e-3;
  r.nominal_order = 4;
  r.status = "success";
  r.message = "why";
  r.error = 5e-3;
  r.reference_error = 6e-3;
  r.solution_size = 7;
  r.sensitivities = {"param:e"};
  r.max_residual = 8e-3;
  r.detected_events = 9;
  r.counters = {10, 11, 12, 13, 14, 15, 16, 17, 18, 19, 20};
  r.metrics = {true, "why", 21, 22, 23, 24, 25, 26, 27, 28, 29, 30, 31, 32, 33, 34, 35, 36, 37, 38, 39, 40};
  r.instead_of = "o";
  r.parameters = {{"a", 41}};
  r.values = {{"b", 42}};
  r.conditions = {{"c", 43}};
  r.timing = {44, 45, 46, 47, 48};
  r.peak_bytes = 49;
  {
    ResultsFile file(folder, "e", header("k"));
    write_rows(file, {r});
    file.rows<TimingRow>(1, [] { return std::vector{TimingRow{0, {1, 2, 3, 4, 5}, 6}}; });
    file.finish();
  }
  const auto line = line_of(r);
  EXPECT_EQ(line.at("error"), 5e-3);
  EXPECT_EQ(line.at("reference_error"), 6e-3);
  EXPECT_EQ(line.at("counters").at("inner_iterations"), 18);
  EXPECT_EQ(line.at("metrics").at("missed_events"), 26);
  EXPECT_EQ(line.at("metrics").at("signorini"), 33);
  const GridResults results(read_results(folder + "/e.jsonl"));
  ASSERT_EQ(results.records.size(), 1u);
  EXPECT_EQ(line_of(results.records[0]), line);
  ASSERT_NE(results.timing_of(results.records[0]), nullptr);
  EXPECT_EQ(nlohmann::json(*results.timing_of(results.records[0])), nlohmann::json(Timing{1, 2, 3, 4, 5}));
  EXPECT_EQ(results.peak_bytes_of(results.records[0]), 6);
}

TEST_F(ResultsOnDisk, WorkThatIsNotCountedHasNoNumberInTheChart) {
  auto records = runs_of_order(2);
  records.resize(3);
  records[0].counters = {.steps = 5, .force_evaluations = 7, .linear_solves = 9};
  records[1].counters = {.steps = 5};  // as an engine
  records[1].metrics.energy_error = -0.5;
  records[2].status = "infeasible";
  ricochet::Run answer = records[0];
  answer.method = "other";
  answer.instead_of = records[2].method;
  answer.setting = records[2].setting;
  records.push_back(answer);
  {
    ResultsFile file(folder, "e", header("k"));
    write_rows(file, records);
    file.rows<TimingRow>(2, [] {
      return std::vector{TimingRow{0, {1, 2, 3, 4, 5}, 6000}, TimingRow{1, {1, 2, 3, 4, 5}}};
    });
    file.finish();
  }
  const GridResults results(read_results(folder + "/e.jsonl"));
  const nlohmann::json data = work_precision_data(results);
  ASSERT_EQ(data.at("runs").size(), 2u);
  const nlohmann::json &counts = data["runs"][0], &engine = data["runs"][1];
  EXPECT_EQ(counts.at("force_evaluations"), 7);
  EXPECT_EQ(counts.at("matrix_factorizations"), 0) << "it needs none";
  EXPECT_EQ(counts.at("peak"), 6);
  EXPECT_EQ(engine.at("steps"), 5);
  for (const char* field : {"force_evaluations", "linear_solves", "matrix_factorizations"})
    EXPECT_TRUE(engine.at(field).is_null()) << field;
  EXPECT_EQ(engine.at("energy"), 0.5) << "an axis has no sign";
  ASSERT_EQ(data.at("failures").size(), 1u);
  EXPECT_NE(data["failures"][0].value("answer", "").find("instead other: error"), std::string::npos);
  const Chart chart = work_precision_chart(results);
  ASSERT_EQ(chart.panels.at(0).series.size(), 1u);
  const Chart::Points points = {{records[0].error, 1e3}, {records[1].error, 1e3}};
  EXPECT_EQ(chart.panels[0].series[0].points, points) << "error, and milliseconds";
}

TEST_F(ResultsOnDisk, AnInterruptedRunLooksIncompleteAndIsContinued) {
  const auto records = runs_of_order(2);
  {
    ResultsFile file(folder, "e", header("k"));
    write_rows(file, {records[0], records[1]});
  }  // interrupted here
  EXPECT_FALSE(fs::exists(folder + "/e.jsonl"));
  {
    std::ofstream file(folder + "/e.jsonl.partial", std::ios::app);
    file << "{\"kind\": \"row\", \"exper";  // a line cut by the interruption
  }
  ResultsFile file(folder, "e", header("k"));
  int made = 0;
  for (int k = 0; k < 3; ++k) {
    const ricochet::Run row = file.row<ricochet::Run>([&] {
      ++made;
      return records[k];
    });
    EXPECT_EQ(row.error, records[k].error);
  }
  EXPECT_EQ(made, 1) << "the others were there";
  file.finish();
  EXPECT_EQ(read_results(folder + "/e.jsonl").all<ricochet::Run>().size(), 3u);
}

TEST_F(ResultsOnDisk, OneProcessWritesThem) {
  const auto records = runs_of_order(2);
  {
    ResultsFile first(folder, "e", header("k"));
    ResultsFile second(folder, "e", header("k"));
    write_rows(first, {records[0]});
    EXPECT_THROW(write_rows(second, {records[0]}), InputError) << "at its first row";
    EXPECT_THROW(ResultsFile(folder, "e", header("k")), InputError) << "before its work";
    write_rows(first, {records[1]});
    first.finish();
  }
  EXPECT_EQ(read_results(folder + "/e.jsonl").all<ricochet::Run>().size(), 2u);
  ResultsFile again(folder, "e", header("k"));
  EXPECT_TRUE(again.is_complete());
  EXPECT_NE(again.message().find("--force"), std::string::npos);
}

TEST_F(ResultsOnDisk, ForceComputesThemAgainAndKeepsTheFormer) {
  const auto records = runs_of_order(2);
  {
    ResultsFile file(folder, "e", header("k"));
    write_rows(file, {records[0]});
    file.finish();
  }
  ResultsFile file(folder, "e", header("k"), true);
  EXPECT_FALSE(file.is_complete());
  write_rows(file, {records[1]});
  file.finish();
  EXPECT_EQ(read_results(folder + "/e.jsonl").all<ricochet::Run>().at(0).error, records[1].error);
  EXPECT_EQ(std::distance(fs::directory_iterator(folder), fs::directory_iterator()), 2) << "the former, dated";
}

TEST_F(ResultsOnDisk, OfTwoRunsInOneFileAreRefused) {
  const auto records = runs_of_order(2);
  {
    ResultsFile file(folder, "e", header("k"));
    write_rows(file, {records[0], records[0]});
    file.finish();
  }
  EXPECT_THROW(GridResults(read_results(folder + "/e.jsonl")), InputError) << "a run that is there twice";
  std::string text = read_text(folder + "/e.jsonl");
  write_text("test", folder + "/behind.jsonl", text + line_of(records[1]).dump() + "\n");
  EXPECT_THROW(read_results(folder + "/behind.jsonl"), InputError) << "behind the end";
  const std::string head = text.substr(0, text.find('\n') + 1);
  write_text("test", folder + "/heads.jsonl", head + text);
  EXPECT_THROW(read_results(folder + "/heads.jsonl"), InputError) << "a second header";
}

TEST_F(ResultsOnDisk, RowsOfOneSessionAreMadeAgainTogether) {
  const std::vector<TimingRow> first = {{0, {1, 1, 1, 1, 9}}, {1, {1, 1, 1, 1, 9}}, {2, {1, 1, 1, 1, 9}}};
  const std::vector<TimingRow> second = {{0, {2, 2, 2, 2, 9}}, {1, {2, 2, 2, 2, 9}}, {2, {2, 2, 2, 2, 9}}};
  {
    ResultsFile file(folder, "e", header("k"));
    file.rows<TimingRow>(2, [&] { return std::vector{first[0], first[1]}; });  // as if a third was still missing
  }
  ResultsFile file(folder, "e", header("k"));
  file.rows<TimingRow>(3, [&] { return second; });
  file.finish();
  const auto rows = read_results(folder + "/e.jsonl").all<TimingRow>();
  ASSERT_EQ(rows.size(), 3u);
  for (const auto& row : rows) EXPECT_EQ(row.timing.median, 2);
}

TEST_F(ResultsOnDisk, NothingIsWrittenBeforeTheFirstRow) {
  { const ResultsFile file(folder, "e", header("k")); }
  EXPECT_FALSE(fs::exists(folder));
}

TEST_F(ResultsOnDisk, FinishedResultsAreReusedOrKeptAside) {
  {
    ResultsFile file(folder, "e", header("k"));
    file.finish();
  }
  EXPECT_TRUE(ResultsFile(folder, "e", header("k")).is_complete());
  {
    ResultsFile file(folder, "e", header("another program"));
    EXPECT_FALSE(file.is_complete());
    file.finish();
  }
  int files = 0;
  for ([[maybe_unused]] const auto& entry : fs::directory_iterator(folder)) ++files;
  EXPECT_EQ(files, 2) << "the older results are still there";
}

TEST_F(ResultsOnDisk, DamagedFilesAreErrors) {
  fs::create_directories(folder);
  std::ofstream(folder + "/bad.jsonl") << "{\"kind\": \"header\", \"schema\": 99}\n";
  EXPECT_THROW(read_results(folder + "/bad.jsonl"), InputError);
  std::ofstream(folder + "/bad2.jsonl") << "no json\n";
  EXPECT_THROW(read_results(folder + "/bad2.jsonl"), InputError);
  EXPECT_THROW(read_results(folder + "/missing.jsonl"), InputError);
}

TEST(Quantile, IsLinearBetweenNeighbours) {
  EXPECT_EQ(quantile({4, 1, 3, 2}, 0), 1);
  EXPECT_EQ(quantile({4, 1, 3, 2}, 0.25), 1.75);
  EXPECT_EQ(median({4, 1, 3, 2}), 2.5);
  EXPECT_EQ(quantile({4, 1, 3, 2}, 1), 4);
  EXPECT_TRUE(std::isnan(median({})));
}

TEST(ControlGrowth, ExponentIsThatOfAPower) {
  EXPECT_NEAR(growth_exponent({10, 20, 40}, {3 * 100., 3 * 400., 3 * 1600.}), 2, 1e-12) << "rounding";
  EXPECT_TRUE(std::isnan(growth_exponent({10, 20}, {1, 2})));
}

TEST(ControlGrowth, IsReadAsItWasWritten) {
  ControlGrowth run;
  run.problem = "two_carts";
  run.command = "x";
  run.intervals = 4;
  run.variables = 5;
  run.pairs = 6;
  run.status = run.again_status = "success";
  run.iterations = 7;
  run.seconds = 8;
  run.derivative_seconds = 0.5;
  run.steps.push_back({0.01, 3, 0.25, 1e-3, true});
  run.again_kept_branch = true;
  EXPECT_SURVIVES(run);
}

TEST(Table, AColumnSaysWhatItShows) {
  struct Ball {
    std::string name;
    double mass;
    std::optional<int> bounces;
  };
  const std::vector<Column<Ball>> columns = {
      {"ball", &Ball::name},
      {"mass", "kg", "{:.1f}", &Ball::mass},
      {"bounces", "", "{}", &Ball::bounces},
  };
  const Table table = table_of("Balls", columns, {Ball{"a", 0.5, 3}, Ball{"b", std::nan(""), std::nullopt}}, "note");
  EXPECT_EQ(table.columns[1].header, "mass [kg]");
  EXPECT_TRUE(table.columns[0].is_text);
  EXPECT_FALSE(table.columns[1].is_text);
  EXPECT_EQ(table.rows[0], (std::vector<std::string>{"a", "0.5", "3"}));
  EXPECT_EQ(table.rows[1], (std::vector<std::string>{"b", "-", "-"})) << "no number";
  EXPECT_NE(table.markdown(1).find("1 of 2 rows."), std::string::npos) << "a table that is cut says so";
  EXPECT_EQ(table.markdown(2).find("rows."), std::string::npos);
}

/// Two methods with known times, one with a run that failed and was answered by another one.
class ResultTables : public testing::Test {
 protected:
  GridResults results;

  void SetUp() override {
    results.id = "e";
    results.overhead_of = {{"slow", "fast"}};
    for (const char* method : {"slow", "fast"}) {
      for (ricochet::Run& r : runs_of_order(2, 0.1, method)) {
        r.counters.elements = r.setting.steps;
        // 2 us or 1 us a step
        results.timings[results.records.size()] = {(r.method == "slow" ? 2e-6 : 1e-6) * r.setting.steps, 0, 0, 0, 3};
        results.records.push_back(r);
      }
    }
    ricochet::Run& failed = results.records[0];
    failed.status = "infeasible";
    failed.message = "why";
    ricochet::Run answer = failed;
    answer.method = "other";
    answer.status = "success";
    answer.error = 0.25;
    answer.instead_of = "slow";
    results.records.push_back(answer);
  }

  static std::string cell(const Table& table, std::size_t row, const std::string& header) {
    const auto column = std::ranges::find(table.columns, header, &Table::Column::header);
    return table.rows.at(row).at(static_cast<std::size_t>(column - table.columns.begin()));
  }
};

TEST_F(ResultTables, TimesAreMicrosecondsAndRatios) {
  EXPECT_EQ(cell(order_summary(results), 0, "us/step"), "2.000");
  EXPECT_EQ(cell(order_summary(results), 1, "us/step"), "1.000");
  // An error of 0.1 / N^2 is below 1e-6 from N = 330 on.
  const Table reached = time_to_reach(results, {1e-6});
  EXPECT_EQ(reached.rows[0][1], "0.660") << "330 steps of 2 us, in ms";
  EXPECT_EQ(reached.rows[0][2], "2.0");
  EXPECT_EQ(reached.rows[1][1], "0.330");
  EXPECT_EQ(reached.rows[1][2], "1.0");
  EXPECT_EQ(time_to_reach(results, {1e-12}).rows[0][1], "not reached");
  const Table ratios = overhead(results);
  ASSERT_EQ(ratios.rows.size(), 20u);
  for (std::size_t k = 0; k < ratios.rows.size(); ++k) EXPECT_EQ(cell(ratios, k, "ratio"), "2.00");
}

TEST_F(ResultTables, AFailureIsShownWithItsAnswer) {
  const Table failed = failures(results);
  ASSERT_EQ(failed.rows.size(), 1u) << "the answer is no failure";
  EXPECT_EQ(cell(failed, 0, "method"), "slow");
  EXPECT_EQ(cell(failed, 0, "reason"), "why");
  EXPECT_EQ(cell(failed, 0, "answered by"), "other: error 2.50e-01");
  results.records.back().status = "step_limit";
  ASSERT_EQ(failures(results).rows.size(), 1u);
  EXPECT_EQ(cell(failures(results), 0, "answered by"), "other: step_limit");
  EXPECT_EQ(order_details(results).rows.size(), 41u) << "no run is dropped";
}

TEST_F(ResultTables, RunsAreInTheOrderOfWhatTheyCost) {
  results.records.clear();
  for (const double tolerance : {1e-8, 1e-4, 1e-6}) {
    ricochet::Run r;
    r.method = "m";
    r.setting.tolerance = tolerance;
    results.records.push_back(r);
  }
  const auto runs = results.of("m");
  EXPECT_EQ(runs[0]->setting.tolerance, 1e-4);
  EXPECT_EQ(runs[1]->setting.tolerance, 1e-6);
  EXPECT_EQ(runs[2]->setting.tolerance, 1e-8);
}

TEST(ScaleCurves, AreOverTheContactsThatTouch) {
  ricochet::Run run;
  run.scene = "pile";
  run.method = "m";
  run.setting.steps = 100;
  run.status = "success";
  std::vector<ricochet::Run> runs;
  for (const int active : {0, 40, 80}) {
    run.values["active"] = active;
    run.timing = {.median = 1e-4 * active, .repetitions = 1};
    runs.push_back(run);
  }
  runs.push_back(run);
  runs.back().status = "step_limit";
  runs.push_back(run);
  runs.back().method = "other";
  const auto curves = scale_curves(runs);
  ASSERT_EQ(curves.size(), 2u);
  using Points = std::vector<std::pair<double, double>>;
  EXPECT_EQ(curves[0].points, (Points{{40, 40}, {80, 80}})) << "microseconds; nothing touches in the first run";
  EXPECT_EQ(curves[1].points, (Points{{80, 80}}));
}

TEST(GrowthChart, HasAPanelPerSceneAndASlope) {
  const Chart chart =
      growth_chart({{"a", "m", {{1, 4}, {2, 6}}}, {"b", "m", {{1, 1}}}, {"a", "n", {{2, 8}}}, {"c", "m", {}}}, "f",
                   "Time", "n", "seconds");
  ASSERT_EQ(chart.panels.size(), 2u) << "nothing is known of c";
  const auto& series = chart.panels[0].series;
  ASSERT_EQ(series.size(), 3u);
  EXPECT_EQ(series[0].look, chart.panels[1].series[0].look) << "of one method";
  EXPECT_NE(series[0].look, series[1].look);
  EXPECT_EQ(series[2].label, "slope 1");
  for (const auto& [x, y] : series[2].points) EXPECT_DOUBLE_EQ(y, 2 * x) << "half of the least time at the least n";
}

TEST(PerformanceProfile, IsAStepPerProblem) {
  const PerformanceProfile profile({"a", "b"}, {{1, 2, 4, HUGE_VAL}, {3, HUGE_VAL, 2, HUGE_VAL}});
  const Chart chart = profile.chart("n", "f", "T", "c");
  const auto& series = chart.panels.at(0).series;
  ASSERT_EQ(series.size(), 2u);
  EXPECT_EQ(series[0].points, (Chart::Points{{1, 0}, {1, 0.25}, {1, 0.5}, {2, 0.75}, {10, 0.75}}));
  EXPECT_EQ(series[1].points, (Chart::Points{{1, 0}, {1, 0.25}, {3, 0.5}, {10, 0.5}}))
      << "what it does not solve is infinite";
}

TEST(Table, PrintsInFourWays) {
  Table table{"title", "note", {{"name", true}, {"value"}}, {{"a|b", "1.5"}, {"<x>, \"y\"", "10"}}};
  EXPECT_EQ(table.csv(), "name,value\na|b,1.5\n\"<x>, \"\"y\"\"\",10\n");
  EXPECT_NE(table.markdown().find("| a\\|b | 1.5 |"), std::string::npos) << table.markdown();
  EXPECT_NE(table.html().find("<td class=\"text\">&lt;x&gt;, &quot;y&quot;</td><td>10</td>"), std::string::npos);
  EXPECT_NE(table.text().find("  a|b         1.5\n"), std::string::npos) << table.text();
}

}  // namespace
}  // namespace ricochet
