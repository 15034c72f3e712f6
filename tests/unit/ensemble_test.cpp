#include "bench/ensemble/ensemble.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <atomic>
#include <filesystem>
#include <fstream>
#include <sstream>

#include "bench/ensemble/counter_random.h"
#include "bench/ensemble/ensemble_file.h"
#include "bench/rows/in_order.h"
#include "methods/registry.h"
#include "problems/input_error.h"
#include "tests/test_data.h"

namespace ricochet {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

/// The known answers of the generator's authors (Random123, kat_vectors).
TEST(Philox, GivesTheKnownAnswers) {
  using Counter = std::array<std::uint32_t, 4>;
  EXPECT_EQ(philox({0, 0, 0, 0}, {0, 0}), (Counter{0x6627e8d5, 0xe169c58d, 0xbc57ac4c, 0x9b00dbd8}));
  EXPECT_EQ(philox({~0u, ~0u, ~0u, ~0u}, {~0u, ~0u}), (Counter{0x408f276d, 0x41c83b0e, 0xa20bc7c6, 0x6d5451fd}));
  EXPECT_EQ(philox({0x243f6a88, 0x85a308d3, 0x13198a2e, 0x03707344}, {0xa4093822, 0x299f31d0}),
            (Counter{0xd16cfe09, 0x94fdcceb, 0x5001e420, 0x24126ea1}));
}

/// Means of 10000 numbers: their deviation is 0.289 / 100, and five of these are never seen.
TEST(UniformNumber, FillsTheIntervalInEveryDirection) {
  constexpr int n = 10000;
  double by_run = 0, by_number = 0, product = 0;
  for (std::uint64_t k = 0; k < n; ++k) {
    by_run += uniform_number(1, k, 0) / n;
    by_number += uniform_number(1, 0, k) / n;
    product += (uniform_number(1, k, 0) - 0.5) * (uniform_number(1, k, 1) - 0.5) / n;
    EXPECT_GT(uniform_number(2, k, 3), 0);
    EXPECT_LT(uniform_number(2, k, 3), 1);
  }
  EXPECT_NEAR(by_run, 0.5, 5 * 0.289 / 100);
  EXPECT_NEAR(by_number, 0.5, 5 * 0.289 / 100);
  EXPECT_NEAR(product, 0, 5 * 0.0834 / 100) << "deviation of a product of two: 1/12";
  EXPECT_NE(uniform_number(1, 0, 0), uniform_number(2, 0, 0));
}

TEST(VariedQuantity, TakesItsValues) {
  EXPECT_EQ(VariedQuantity("e=uniform:2:4").drawn(0.25), 2.5);
  EXPECT_DOUBLE_EQ(VariedQuantity("k=log-uniform:1e2:1e4").drawn(0.5), 1e3);
  const VariedQuantity normal("v0:1=normal:2:0.5");
  EXPECT_EQ(normal.name(), "v0:1");
  EXPECT_EQ(normal.drawn(0.5), 2);
  EXPECT_NEAR(normal.drawn(0.97724986805182079), 3, 1e-12) << "Phi(2); a rounding of it moves the value by 1e-15";
  EXPECT_TRUE(normal.is_drawn());
  EXPECT_EQ(VariedQuantity("mu=grid:0:1:5").grid(), (std::vector<double>{0, 0.25, 0.5, 0.75, 1}));
  EXPECT_EQ(VariedQuantity("k=log-grid:1:100:1").grid(), (std::vector<double>{1, 10, 100}));
  EXPECT_EQ(VariedQuantity("k=values:3:1").grid(), (std::vector<double>{3, 1}));
}

TEST(VariedQuantity, SaysWhatIsWrong) {
  for (const char* text : {"e", "=uniform:0:1", "e=uniform:1:0", "e=uniform:0", "e=uniform:0:1:2", "e=flat:0:1",
                           "e=normal:0:0", "k=log-uniform:0:1", "k=log-grid:0:1:3", "e=grid:0:1:1", "e=grid:0:1:2.5",
                           "e=values", "e=values:a", "e=values:nan", "e=uniform:0:inf"}) {
    try {
      VariedQuantity quantity(text);
      FAIL() << text;
    } catch (const InputError& error) {
      EXPECT_NE(std::string(error.what()).find("vary = " + std::string(text)), std::string::npos) << error.what();
    }
  }
}

TEST(InOrder, IsTheSameForAnyNumberOfThreads) {
  for (const int threads : {1, 2, 5}) {
    std::string all;
    std::int64_t taken = 3;
    in_order(
        threads, 3, 1000,
        [](int, std::int64_t begin, std::int64_t end) {
          std::string text;
          for (std::int64_t k = begin; k < end; ++k) text += std::to_string(k) + " ";
          return text;
        },
        [&](std::int64_t end, const std::string& text) {
          EXPECT_GT(end, taken);
          taken = end;
          all += text;
        });
    std::string expected;
    for (int k = 3; k < 1000; ++k) expected += std::to_string(k) + " ";
    EXPECT_EQ(all, expected) << threads << " threads";
    EXPECT_EQ(taken, 1000);
  }
}

TEST(InOrder, PassesExceptionsOn) {
  for (const int threads : {1, 4}) {
    const auto make = [](int, std::int64_t begin, std::int64_t end) -> std::string {
      if (begin <= 500 && 500 < end) throw std::runtime_error("500");
      return "";
    };
    std::int64_t taken = 0;
    EXPECT_THROW(in_order(threads, 0, 1000, make, [&](std::int64_t end, const std::string&) { taken = end; }),
                 std::runtime_error);
    EXPECT_LE(taken, 500);
  }
}

/// Some of its runs fail: restitution beyond 1, and initial states in the ground.
const json kBalls = {
    {"problem", "two_balls_spring"},
    {"parameters", {{"duration", 0.6}}},
    {"vary", {"k=log-uniform:1e3:1e4", "e=normal:0.8:0.2", "v0:1=values:-1:0:1", "height=uniform:0.15:1"}},
    {"runs", 40},
    {"seed", 7},
    {"method", "fesd:gauss:2,elements=as_needed"},
    {"steps", 15}};

class EnsembleOutput : public testing::Test {
 protected:
  fs::path folder = fs::temp_directory_path() / ("ricochet_ensemble_" + std::to_string(getpid()));
  void SetUp() override { fs::create_directories(folder); }
  ~EnsembleOutput() override { fs::remove_all(folder); }

  static std::string read(const fs::path& path) {
    std::ifstream file(path, std::ios::binary);
    std::ostringstream text;
    text << file.rdbuf();
    return text.str();
  }
  /// @returns how many runs were made
  std::int64_t run(const std::string& name, const json& document, int threads) {
    const Ensemble ensemble = read_ensemble(document);
    auto workers = make_workers(ensemble, threads);
    EnsembleFile file((folder / name).string(), ensemble, workers.front()->base());
    return run_ensemble(file, workers, [](std::int64_t) {});
  }
};

TEST_F(EnsembleOutput, IsTheSameForAnyNumberOfThreads) {
  run("one.csv", kBalls, 1);
  const std::string one = read(folder / "one.csv");
  EXPECT_EQ(std::ranges::count(one, '\n'), 1 + 120);
  EXPECT_NE(one.find(",bad_input,"), std::string::npos) << "failed runs are rows";
  EXPECT_NE(one.find("eps_r in [0, 1] is required"), std::string::npos);
  for (const int threads : {2, 5}) {
    run("more.csv", kBalls, threads);
    EXPECT_EQ(read(folder / "more.csv"), one) << threads << " threads";
    fs::remove(folder / "more.csv");
  }
}

/// Where initial states vary alone every thread keeps a solver.
TEST_F(EnsembleOutput, OfInitialStatesIsTheSameForAnyNumberOfThreads) {
  json states = kBalls;
  states["vary"] = {"v0:1=uniform:-2:1", "q0:0=uniform:0.2:0.6", "q0:1=uniform:0.7:1"};
  run("one.csv", states, 1);
  const std::string one = read(folder / "one.csv");
  EXPECT_EQ(std::ranges::count(one, '\n'), 1 + 40);
  for (const int threads : {2, 5}) {
    run("more.csv", states, threads);
    EXPECT_EQ(read(folder / "more.csv"), one) << threads << " threads";
    fs::remove(folder / "more.csv");
  }
  EnsembleWorker worker(read_ensemble(states));
  const auto method = make_method(states["method"]);
  Settings settings;
  settings.steps = 15;
  int compared = 0;
  for (int k = 0; k < 40; ++k) {
    const EnsembleRun run = worker.run(k);
    if (!run.succeeded()) continue;
    const Solution alone = method->solve(worker.problem(k), settings);
    // Maps that refer to another state round otherwise: 15 steps and a few impacts of a spring with 14 rad/s.
    EXPECT_LT((alone.q - run.q).cwiseAbs().maxCoeff(), 1e-12);
    EXPECT_LT((alone.v - run.v).cwiseAbs().maxCoeff(), 1e-11);
    ++compared;
  }
  EXPECT_GT(compared, 20);
}

TEST_F(EnsembleOutput, IsTheSameAfterAnInterruption) {
  run("whole.csv", kBalls, 2);
  const std::string whole = read(folder / "whole.csv");
  run("cut.csv", kBalls, 1);
  const std::size_t header = whole.find('\n') + 1, line = whole.find('\n', header) + 1;
  for (const std::size_t bytes : {std::size_t{0}, header - 7, header, header + 1, line - 1, line, whole.size() / 2,
                                  whole.size() / 2 + 1, whole.size() / 2 + 100, whole.size() - 1, whole.size()}) {
    std::ofstream(folder / "cut.csv.partial", std::ios::binary) << whole.substr(0, bytes);
    fs::remove(folder / "cut.csv");
    const auto kept = bytes < header ? 0 : std::ranges::count(whole.substr(0, bytes), '\n') - 1;
    EXPECT_EQ(run("cut.csv", kBalls, 2), 120 - kept) << bytes << " bytes";
    EXPECT_EQ(read(folder / "cut.csv"), whole) << bytes << " bytes";
  }
  EXPECT_EQ(run("cut.csv", kBalls, 2), 0) << "nothing is missing";
}

TEST_F(EnsembleOutput, OfAnotherEnsembleIsNotTouched) {
  run("a.csv", kBalls, 1);
  const std::string before = read(folder / "a.csv");
  json other = kBalls;
  other["seed"] = 8;
  EXPECT_THROW(run("a.csv", other, 1), InputError);
  EXPECT_EQ(read(folder / "a.csv"), before);
}

/// A line gives the values back that the run had, and its state, to the last bit.
TEST_F(EnsembleOutput, IsWhatASingleRunGives) {
  const Ensemble ensemble = read_ensemble(kBalls);
  EnsembleWorker worker(ensemble);
  const EnsembleRun run = worker.run(83);
  ASSERT_TRUE(run.succeeded()) << run.message;
  EXPECT_EQ(run.values, ensemble.values(83));
  EXPECT_EQ(run.values[2], 1) << "the third point of the grid, since 80 <= 83";
  std::istringstream line(csv_line(run, worker.base()));
  std::vector<std::string> cells;
  for (std::string cell; std::getline(line, cell, ',');) cells.push_back(cell);
  ASSERT_EQ(cells.size(), 1u + 4 + 2 + 4 + 2 + 1);
  for (std::size_t k = 0; k < 4; ++k) EXPECT_EQ(std::stod(cells[1 + k]), run.values[k]);
  for (int k = 0; k < 2; ++k) EXPECT_EQ(std::stod(cells[static_cast<std::size_t>(7 + k)]), run.q[k]);
}

/// `ricochet run --set` makes the problem that an ensemble sets the values of: the same state, to the last bit.
TEST_F(EnsembleOutput, IsWhatASingleRunOfAMadeProblemGives) {
  json document = kBalls;
  document["vary"].erase(2);
  EnsembleWorker worker(read_ensemble(document));
  Settings settings;
  settings.steps = 15;
  int compared = 0;
  for (int k = 0; k < 40; ++k) {
    const EnsembleRun run = worker.run(k);
    if (!run.succeeded()) continue;
    const ParameterChanges changes{
        {"duration", 0.6}, {"k", run.values[0]}, {"e", run.values[1]}, {"height", run.values[2]}};
    const Solution alone = make_method(document["method"])->solve(*make_problem("two_balls_spring", changes), settings);
    EXPECT_EQ(alone.q, run.q);
    EXPECT_EQ(alone.v, run.v);
    ++compared;
  }
  EXPECT_GT(compared, 20);
}

TEST(Ensemble, SaysWhatIsWrong) {
  const auto refusal = [](const char* field, const json& value) -> std::string {
    json document = kBalls;
    document[field] = value;
    try {
      make_workers(read_ensemble(document), 1);
    } catch (const InputError& error) {
      return error.what();
    }
    return "none";
  };
  EXPECT_EQ(refusal("seed", 9), "none");
  EXPECT_EQ(refusal("runs", "many"), "ensemble: runs = \"many\": a whole number is required");
  EXPECT_EQ(refusal("vary", {1, 2}), "ensemble: vary[0] = 1: a text in quotes is required");
  EXPECT_EQ(refusal("parameters", {{"k", "stiff"}}), "ensemble: parameters.k = \"stiff\": a number is required");
  EXPECT_NE(refusal("runs", 0).find("runs = 0: a number from 1"), std::string::npos);
  EXPECT_NE(refusal("steps", 0).find("steps = 0: at least 1"), std::string::npos);
  EXPECT_NE(refusal("seed", -1).find("seed = -1"), std::string::npos);
  EXPECT_NE(refusal("vary", {"stiffness=uniform:0:1"}).find("stiffness"), std::string::npos);
  EXPECT_NE(refusal("vary", json::array()).find("vary = []"), std::string::npos);
  EXPECT_NE(refusal("threads", 2).find("threads"), std::string::npos) << "no field: the file does not depend on it";
  EXPECT_NE(refusal("method", "event_driven").find("steps: event_driven"), std::string::npos);
  EXPECT_NE(refusal("method", "irk:gauss:2").find("cannot run two_balls_spring"), std::string::npos);
  const Ensemble ensemble = read_ensemble(kBalls);
  EXPECT_THROW(make_workers(ensemble, 0), InputError);
  json homotopy = kBalls;
  homotopy["method"] = "fesd_homotopy:radau-iia:2";
  EXPECT_THROW(make_workers(read_ensemble(homotopy), 2), InputError);
}

}  // namespace
}  // namespace ricochet
