// The hard cases: the rule of the verdicts, processes that end badly, the file, and the quick part of the matrix.
#include "bench/studies/hard_cases/hard_cases.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <csignal>
#include <cstdlib>
#include <set>
#include <stdexcept>
#include <thread>

#include "bench/experiment/experiment_file.h"
#include "bench/experiment/experiment_schema.h"
#include "bench/measure/allocations.h"
#include "bench/studies/hard_cases/run_hard_cases.h"
#include "bench/studies/hard_cases/verdict_matrix.h"
#include "methods/isolated.h"
#include "methods/registry.h"
#include "problems/input_error.h"
#include "tests/round_trip.h"

namespace ricochet {
namespace {

/// The file of the project, or its quick part, as a command line changes it.
HardCases hard_cases(const std::vector<std::string>& changes = {}, bool quick = false) {
  ExperimentFile file = read_experiment_file("hard_cases");
  file.take_quick_part(quick);
  for (const auto& change : changes) file.change(change);
  return read_hard_cases(file.document);
}

/// A run that nothing is wrong with, and limits that it keeps.
ricochet::Run good() {
  ricochet::Run r;
  r.status = "success";
  r.error = 1e-4;
  r.values = {{"energy_gain", 0}, {"penetration", 0}, {"momentum", 0}, {"cone", 0}, {"energy_change", -1}};
  return r;
}
CaseLimits limits() {
  CaseLimits l;
  l.exact = 1e-9;
  l.error = 1e-3;
  l.energy = l.penetration = l.momentum = l.cone = 0.1;
  return l;
}

/// The verdict after a change of the good run.
template <class Change>
CaseVerdict after(Change change) {
  ricochet::Run r = good();
  CaseLimits l = limits();
  change(r, l);
  return verdict(l, r);
}
#define AFTER(...) after([]([[maybe_unused]] ricochet::Run& r, [[maybe_unused]] CaseLimits& l) { __VA_ARGS__; })

TEST(Verdict, ByTheFirstRuleThatApplies) {
  EXPECT_EQ(AFTER(), CaseVerdict::accurate);
  EXPECT_EQ(AFTER(r.error = 1e-9), CaseVerdict::exact);
  EXPECT_EQ(AFTER(r.error = 1e-3), CaseVerdict::accurate) << "a limit is kept when it is met";
  EXPECT_EQ(AFTER(r.error = 1.1e-3), CaseVerdict::inaccurate);
  EXPECT_EQ(AFTER(r.error = kNoNumber), CaseVerdict::keeps);
  EXPECT_EQ(AFTER(r.values["energy_gain"] = 0.2; r.values["penetration"] = 1), CaseVerdict::violates_energy);
  EXPECT_EQ(AFTER(l.conserves_energy = true), CaseVerdict::violates_energy) << "a loss of 1 J";
  EXPECT_EQ(AFTER(r.values["penetration"] = 0.2), CaseVerdict::penetrates);
  EXPECT_EQ(AFTER(r.values["momentum"] = 0.2), CaseVerdict::changes_momentum);
  EXPECT_EQ(AFTER(r.values["cone"] = 0.2), CaseVerdict::leaves_cone);
  EXPECT_EQ(AFTER(r.values["momentum"] = 0.2; l.momentum = kNoNumber), CaseVerdict::accurate) << "not asked for";
  EXPECT_EQ(AFTER(r.values["energy_gain"] = kNoNumber), CaseVerdict::accurate) << "not measured";
  EXPECT_EQ(AFTER(r.status = "not_finite"), CaseVerdict::not_finite);
  EXPECT_EQ(AFTER(r.status = "infeasible"), CaseVerdict::fails);
  EXPECT_EQ(AFTER(r.status = "time_limit"), CaseVerdict::time_limit);
  EXPECT_EQ(AFTER(r.status = "declined"), CaseVerdict::declined);
  EXPECT_EQ(AFTER(r.status = "killed"), CaseVerdict::killed);
  EXPECT_EQ(AFTER(r.status = "crashed"), CaseVerdict::crashed);
}

TEST(Verdict, InAParadox) {
  using Code = FailureCode;
  const auto after_failure = [](Code code, const char* contact, const char* paradox = "tip") {
    return after([&](ricochet::Run& r, CaseLimits& l) {
      l.paradox = paradox;
      r.status = "infeasible";
      r.reason = {code, {contact}};
    });
  };
  for (const Code code : {Code::painleve, Code::inconsistent, Code::indeterminate})
    EXPECT_EQ(after_failure(code, "tip"), CaseVerdict::refuses);
  EXPECT_EQ(after_failure(Code::inconsistent, "heel"), CaseVerdict::fails);
  EXPECT_EQ(after_failure(Code::impacts_accumulate, "tip"), CaseVerdict::fails);
  EXPECT_EQ(after_failure(Code::not_stated, "tip"), CaseVerdict::fails);
  EXPECT_EQ(after_failure(Code::inconsistent, "tip", ""), CaseVerdict::fails) << "the case is no paradox";
  EXPECT_EQ(AFTER(l.paradox = "tip"), CaseVerdict::resolves);
  EXPECT_EQ(AFTER(l.paradox = "tip"; r.error = 1), CaseVerdict::wrong);
  EXPECT_EQ(AFTER(l.paradox = "tip"; r.error = kNoNumber), CaseVerdict::wrong);
}

TEST(Verdict, EveryOneHasAWordOfItsOwn) {
  std::set<std::string> words;
  for (int v = 0; v <= static_cast<int>(CaseVerdict::crashed); ++v) {
    EXPECT_TRUE(words.insert(text_of(static_cast<CaseVerdict>(v)).word).second);
    EXPECT_NE(text_of(static_cast<CaseVerdict>(v)).meaning, nullptr);
  }
}

TEST(HardTables, TheSmallestErrorIsThatOfAMethodThatIsRight) {
  HardCell right, wrong;
  right.scene = wrong.scene = "case";
  right.labels = wrong.labels = {{"title", "t"}};
  right.limits = wrong.limits = limits();
  right.status = wrong.status = "success";
  right.error = 1e-4;
  right.values = wrong.values = good().values;
  right.method = "right";
  wrong.method = "wrong";
  wrong.error = 0.5 * right.error;
  wrong.values["penetration"] = 1;
  ASSERT_NE(wrong.verdict(), right.verdict());
  const Table table = case_table({right, wrong});
  ASSERT_EQ(table.rows.size(), 1u);
  EXPECT_EQ(table.rows[0][1], "1") << "right";
  EXPECT_EQ(table.rows[0][2], "1") << "not right";
  EXPECT_EQ(table.rows[0][5], "right") << "whose error is the smallest";
}

TEST(Isolated, EveryEndIsAnAnswer) {
  using Ending = IsolatedResult::Ending;
  const std::string large(1'000'000, 'x');  // more than a pipe holds
  const IsolatedResult fine = run_isolated([&] { return large; }, 60);
  EXPECT_EQ(fine.ending, Ending::returned);
  EXPECT_EQ(fine.text, large);

  const IsolatedResult threw = run_isolated([]() -> std::string { throw std::runtime_error("no such thing"); }, 60);
  EXPECT_EQ(threw.ending, Ending::crashed);
  EXPECT_EQ(threw.text, "no such thing");

  const IsolatedResult died = run_isolated(
      []() -> std::string {
        std::signal(SIGABRT, SIG_DFL);
        std::abort();
      },
      60);
  EXPECT_EQ(died.ending, Ending::crashed);
  EXPECT_FALSE(died.text.empty());

  const auto begin = std::chrono::steady_clock::now();
  const IsolatedResult endless = run_isolated(
      []() -> std::string {
        while (true) std::this_thread::sleep_for(std::chrono::milliseconds(1));
      },
      0.1);
  EXPECT_EQ(endless.ending, Ending::killed);
  EXPECT_LT(std::chrono::steady_clock::now() - begin, std::chrono::seconds(10)) << "0.1 s and a busy machine";
}

std::string message_of(const std::string& text) {
  try {
    const nlohmann::json document = nlohmann::json::parse(text);
    experiment_schema(find_study("hard_cases")).check(document, "FILE: ");
    read_hard_cases(document);
  } catch (const InputError& error) {
    return error.what();
  }
  return "no error";
}
#define EXPECT_SAYS(text, part) EXPECT_NE(message_of(text).find(part), std::string::npos) << message_of(text)

TEST(HardCaseFile, BadInputNamesTheField) {
  const std::string head = R"({"id": "x", "kind": "hard_cases", "title": "", "description": "", "also": [],
)";
  const std::string defaults = R"("defaults": {"steps": {"first_order": 10, "high_order": 5}, "tolerance": 1e-6}, )";
  const std::string a_case = R"("id": "a", "group": "g", "title": "t", "problem": "bouncing_ball")";
  EXPECT_SAYS(head + defaults + R"("time_limit": 0, "cases": []})", "time_limit = 0");
  EXPECT_SAYS(head + defaults + R"("time_limit": 1, "cases": [{)" + a_case + R"(, "limit": 1}]})", "'limit': unknown");
  EXPECT_SAYS(head + defaults + R"("time_limit": 1, "cases": [{)" + a_case +
                  R"(, "limits": {"error": {"limit": 1, "reason": ""}}}]})",
              "limits.error.reason = \"\": a text is required");
  EXPECT_SAYS(head + defaults + R"("time_limit": 1, "cases": [{)" + a_case +
                  R"(, "limits": {"error": {"limit": -1, "reason": "r"}}}]})",
              "limits.error.limit = -1");
  EXPECT_SAYS(head + defaults + R"("time_limit": 1, "cases": [{)" + a_case + R"(, "steps": {"high_order": 0}}]})",
              "steps.high_order = 0");
  EXPECT_EQ(message_of(head + defaults + R"("time_limit": 1, "cases": [{)" + a_case + "}]}"), "no error");
}

TEST(HardCaseFile, ClosedFormsAreStatesOfTheProblem) {
  int closed_forms = 0;
  for (const auto& hard_case : hard_cases().cases) {
    const auto problem = hard_case.make_problem();
    for (const auto& motion : hard_case.motions) {
      if (motion.contains("reference")) continue;
      ++closed_forms;
      HardCase closed = hard_case;
      closed.motions = nlohmann::json::array({motion});
      const auto motions = closed.true_motions(*problem);
      ASSERT_EQ(motions.size(), 1u) << hard_case.id;
      // Rounding of the closed contacts, whose gaps are differences of numbers below 10.
      if (problem->n_c() > 0) EXPECT_GE(problem->gap(motions[0].q).minCoeff(), -1e-12) << hard_case.id;
    }
  }
  EXPECT_GE(closed_forms, 10) << "the other motions are references";
}

// Every cell of the quick matrix ends with a status, within its limit, and no success is NaN.
TEST(HardCases, QuickMatrixIsBounded) {
  const HardCases cases = hard_cases({}, true);
  std::vector<HardCell> cells;
  for (const auto& hard_case : cases.cases) {
    const auto problem = hard_case.make_problem();
    const auto motions = hard_case.true_motions(*problem);
    for (const auto& method : cases.methods) {
      const HardCell cell = run_cell(hard_case, *problem, motions, method, cases.time_limit);
      const CaseVerdict verdict = cell.verdict();
      EXPECT_NE(verdict, CaseVerdict::crashed) << cell.command() << "\n" << cell.message;
      EXPECT_NE(verdict, CaseVerdict::killed) << cell.command();
      EXPECT_NE(verdict, CaseVerdict::not_finite) << cell.command();
      EXPECT_NE(verdict, CaseVerdict::wrong) << cell.command();
      EXPECT_EQ(cell.succeeded(), cell.message.empty()) << cell.command();
      if (cell.has_time()) EXPECT_LE(cell.timing.median, 2 * cases.time_limit) << cell.command();
      cells.push_back(cell);
      EXPECT_EQ(round_trip(cell).verdict(), verdict) << "the file keeps what the rule needs";
    }
  }
  EXPECT_EQ(cells.size(), cases.cases.size() * cases.methods.size());
  std::size_t in_matrix = 0;
  const nlohmann::json matrix = verdict_matrix(cells, "e");
  for (const auto& row : matrix.at("methods")) {
    for (const auto& cell : row.at("cells")) {
      if (cell.is_null()) continue;
      ++in_matrix;
      EXPECT_TRUE(matrix.at("meanings").contains(cell.at("verdict")));
      EXPECT_TRUE(std::ranges::any_of(cells, [&](const HardCell& c) { return c.command() == cell.at("command"); }));
    }
  }
  EXPECT_EQ(in_matrix, cells.size());
}

TEST(HardCases, SomethingIsKnownOfEach) {
  const double time_limit = hard_cases().time_limit;
  const auto verdict_on = [&](const std::string& id, const std::string& method) {
    const HardCase hard_case = hard_cases({"only_case=" + id}).cases.at(0);
    const auto problem = hard_case.make_problem();
    return run_cell(hard_case, *problem, hard_case.true_motions(*problem), method, time_limit).verdict();
  };
  EXPECT_EQ(verdict_on("zeno", "fesd_adaptive:radau-iia:4"), CaseVerdict::exact);
  EXPECT_EQ(verdict_on("wedge", "fesd:gauss:3"), CaseVerdict::exact);
  EXPECT_EQ(verdict_on("touching_row", "fesd:gauss:3"), CaseVerdict::exact);
  EXPECT_EQ(verdict_on("paradox_none", "fesd:radau-iia:3"), CaseVerdict::refuses);
  EXPECT_EQ(verdict_on("paradox_two", "cvode:adams"), CaseVerdict::refuses);
  EXPECT_EQ(verdict_on("paradox_none", "moreau_jean"), CaseVerdict::resolves);
  EXPECT_EQ(verdict_on("eight_feet", "fesd:radau-iia:3"), CaseVerdict::exact);
  EXPECT_EQ(verdict_on("kane", "fesd:gauss:3"), CaseVerdict::violates_energy) << "Newton's law, not the method";
  EXPECT_EQ(verdict_on("kane", "anitescu_potra"), CaseVerdict::keeps) << "Poisson's law";
  EXPECT_THROW(hard_cases({"only_case=zen"}), InputError);
  EXPECT_THROW(hard_cases({"only_method=moreau"}), InputError);
}

TEST(HardCases, ASuccessHasMetrics) {
  const HardCase hard_case = hard_cases({"only_case=wedge"}).cases.at(0);
  const auto problem = hard_case.make_problem();
  const auto motions = hard_case.true_motions(*problem);
  const ReferenceMotion motion = reference_motion(*problem, motions.at(0).reference());
  ASSERT_NE(motion.get(), nullptr) << motion.reason;
  const auto with_metrics = [&](const std::string& method, const ReferenceMotion& reference) {
    HardCell cell = run_cell(hard_case, *problem, motions, method, 10);
    add_metrics(*problem, reference, true, 10, cell);
    return round_trip(cell);
  };
  const HardCell fesd = with_metrics("fesd:gauss:3", motion);
  EXPECT_TRUE(fesd.metrics.are_known) << fesd.metrics.reason;
  EXPECT_LT(fesd.metrics.position_error, 1e-9) << "free flight is a polynomial, which the method integrates exactly";
  EXPECT_LT(fesd.metrics.event_time_error, 1e-9);
  EXPECT_EQ(fesd.metrics.missed_events, 0);
  EXPECT_GT(fesd.solution_size, 0.1);
  EXPECT_EQ(fesd.peak_bytes > 0, counts_allocations()) << fesd.peak_bytes;
  const HardCell stepping = with_metrics("moreau_jean", motion);
  EXPECT_GT(stepping.metrics.position_error, 1e-6) << "a method of first order";

  const HardCell alone = with_metrics("fesd:gauss:3", {{}, "nobody knows it"});
  EXPECT_EQ(alone.metrics.reason, "nobody knows it");
  EXPECT_TRUE(std::isnan(alone.metrics.position_error));
  EXPECT_FALSE(std::isnan(alone.metrics.penetration)) << "needs no truth";

  HardCell failed = fesd;
  failed.status = "infeasible";
  EXPECT_EQ(measured_runs({fesd, stepping, failed}).size(), 2u) << "a run that failed has no motion to look at";
}

}  // namespace
}  // namespace ricochet
