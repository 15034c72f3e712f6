// The battery of `ricochet verify` on a right method, and on copies of it with one fault each, which it must find.
#include "bench/studies/verify/verify.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>
#include <map>
#include <regex>
#include <thread>

#include "bench/experiment/experiment_file.h"
#include "bench/experiment/run_experiment.h"
#include "bench/experiment/selection.h"
#include "bench/measure/allocations.h"
#include "bench/studies/verify/scorecard.h"
#include "methods/registry.h"

namespace ricochet {
namespace {

using nlohmann::json;

/// moreau_jean with a fault: "spoiled:FAULT".
class Spoiled final : public Method {
 public:
  explicit Spoiled(const MethodSpec& spec)
      : id_(spec.text()),
        fault_(spec.arguments().empty() ? "" : spec.arguments().front()),
        right_(make_method("moreau_jean")) {}

  MethodInfo info() const override {
    MethodInfo info = right_->info();
    info.id = id_;
    if (fault_ == "overclaims") info.order_smooth = info.order_impacts = 4;
    return info;
  }
  Support supports(const ProblemInfo& problem) const override {
    if (fault_ == "mute" && problem.has_bilateral()) return {false, ""};
    return right_->can_run(problem);
  }

 protected:
  Solution do_solve(const Problem& problem, const Settings& settings) const override {
    if (fault_ == "hangs") {
      while (true) std::this_thread::sleep_for(std::chrono::seconds(1));
    }
    if (fault_ == "aborts") std::abort();
    if (fault_ == "throws") throw std::runtime_error("a wrong index");
    Solution s = right_->solve(problem, settings);
    if (fault_ == "gains") {
      for (auto& sample : s.samples) sample.v_plus *= 1.5;
    }
    if (fault_ == "jumps") s.q[0] += 0.5;
    if (fault_ == "nan") s.v[0] = std::nan("");
    if (fault_ == "ends_early") s.t *= 0.5;
    if (fault_ == "silent") {
      s.status = Status::infeasible;
      s.t *= 0.5;
    }
    if (fault_ == "pulls") {
      for (auto& event : s.events) event.Lambda_n *= -1;
    }
    if (fault_ == "unordered") std::ranges::reverse(s.events);
    if (fault_ == "dice") s.q[0] += 1e-14 * ++runs_;
    if (fault_ == "allocates") {
      for (int k = 0; k < settings.steps; ++k) scratch_ = Vector::Zero(3 + k % 2);
    }
    if (fault_ == "watched" && settings.recording == Recording::final_state) s.q[0] += 1e-6;
    return s;
  }

 private:
  std::string id_, fault_;
  std::unique_ptr<Method> right_;
  mutable int runs_ = 0;
  mutable Vector scratch_;
};

const bool registered = register_method<Spoiled>({
    .name = "spoiled",
    .usage = "spoiled:FAULT",
    .max_arguments = 1,
    .summary = "moreau_jean with a fault",
    .examples = {},
});

json quick_battery() {
  RunOptions options;
  options.quick = true;
  options.time_limit = 60;
  return experiment_document(read_experiment_file("verify"), options);
}

/// @param patterns  of the checks that are run; all of them when it is empty
/// @param time_limit  of a check: long, so that a slow machine is no fault of the method
Scorecard card_of(const std::string& method, const std::vector<std::string>& patterns = {}, double time_limit = 60) {
  static const auto battery = battery_of(quick_battery());
  Scorecard card{method, {}, {}};
  const Subject subject = subject_of(method, time_limit);
  for (const auto& check : battery) {
    const auto fits = [&](const std::string& pattern) { return matches(check.full_name(), pattern); };
    if (patterns.empty() || std::ranges::any_of(patterns, fits)) card.rows.push_back(run_check(check, subject));
  }
  return card;
}

/// What of it fails, as lines "GROUP/CHECK: reason".
std::string failures_of(const Scorecard& card) {
  std::string text;
  for (const auto& row : card.rows) {
    if (row.verdict == CheckVerdict::fail) text += row.name() + ": " + row.reason + "\n";
  }
  return text;
}

TEST(Verify, ARightMethodPasses) {
  const Scorecard card = card_of("spoiled");
  EXPECT_TRUE(card.holds()) << failures_of(card);
  EXPECT_GE(card.count(CheckVerdict::pass), 20);
}

TEST(Verify, AnErrorControlledMethodPasses) {
  const Scorecard card = card_of("fesd_adaptive:radau-iia:4");
  EXPECT_TRUE(card.holds()) << failures_of(card);
  EXPECT_GE(card.count(CheckVerdict::pass), 20);
}

TEST(Verify, EachFaultIsFound) {
  // Fault, checks that are run, what one of them says.
  const std::vector<std::array<std::string, 3>> faults = {
      {"overclaims", "order/smooth motion", "no order: "},
      {"hangs", "truth/P1c_ball_e0", "no answer within 2 s"},
      {"aborts", "truth/P1c_ball_e0", "it ended with: Aborted"},
      {"throws", "truth/P1c_ball_e0", "the method threw an exception: a wrong index"},
      {"jumps", "truth/P1c_ball_e0", "error 5.0e-01, 2e-02 allowed"},
      {"gains", "promises/bouncing_ball", "it has gained"},
      {"nan", "promises/bouncing_ball", "the final state is not finite"},
      {"ends_early", "promises/bouncing_ball", "it ends at t = 1, not at 2"},
      {"silent", "promises/bouncing_ball", "a failure has no reason"},
      {"pulls", "promises/bouncing_ball", "has the impulse -"},
      {"unordered", "promises/bouncing_ball", "follows one at"},
      {"dice", "promises/bouncing_ball", "a second run has other bits"},
      {"dice", "promises/a kept solver forgets", "the solver has another result"},
      {"watched", "promises/bouncing_ball", "a run that records less ends elsewhere, by 1.0e-06"},
      {"mute", "bad input/scenes that it declines", "declined without a reason"},
      {"allocates", "allocation/two_balls_spring", "allocations in 1600 steps"},
  };
  for (const auto& [fault, check, reason] : faults) {
    const Scorecard card = card_of("spoiled:" + fault, {check}, fault == "hangs" ? 2 : 60);
    ASSERT_EQ(card.rows.size(), 1u) << check;
    EXPECT_FALSE(card.holds()) << fault;
    EXPECT_NE(failures_of(card).find(reason), std::string::npos) << fault << ": '" << reason << "' expected, in\n"
                                                                 << card.rows[0].reason;
  }
}

TEST(Verify, CountsAllocationsOfThisThreadAlone) {
  ASSERT_TRUE(counts_allocations());
  EXPECT_EQ(allocations_of([] { Vector x(100); }).count, 1);
  EXPECT_GE(allocations_of([] { Vector x(100); }).bytes, 800);
  EXPECT_EQ(allocations_of([] {}).count, 0);
  EXPECT_THROW(allocations_of([] { throw std::runtime_error("x"); }), std::runtime_error);
  EXPECT_EQ(allocations_of([] { std::thread([] { Vector x(100), y(100); }).join(); }).count,
            allocations_of([] { std::thread([] {}).join(); }).count);
}

/// A card with each kind of row, and with characters that XML and Markdown take for theirs.
Scorecard example_card() {
  const auto row = [](const char* check, CheckVerdict verdict, const char* reason) {
    CheckRow made;
    made.method = "mine:<2>";
    made.group = "order";
    made.check = check;
    made.verdict = verdict;
    made.reason = reason;
    made.command = "ricochet run";
    made.seconds = 0.5;
    return made;
  };
  return {"mine:<2>",
          {row("smooth", CheckVerdict::pass, "order 2"), row("impacts", CheckVerdict::fail, "order 1 & \"2\" claimed"),
           row("joint|s", CheckVerdict::fail, "it\nbreaks"), row("space", CheckVerdict::not_applicable, "declined")},
          {}};
}

TEST(Scorecard, KnownFailuresDoNotCount) {
  Scorecard card = example_card();
  EXPECT_FALSE(card.holds());
  card.known = {"order/impacts", "order/j*", "order/smooth"};
  EXPECT_TRUE(card.holds());
  EXPECT_EQ(card.known_failures(), 2);
  EXPECT_EQ(card.mended(), std::vector<std::string>{"order/smooth"}) << "it passes";
  card.rows.resize(0);
  EXPECT_FALSE(card.holds()) << "nothing was tried";
}

TEST(Scorecard, Outputs) {
  Scorecard card = example_card();
  card.known = {"order/joint*"};
  const std::string text = scorecard_text(card);
  for (const char* part :
       {"  pass   smooth", "  FAIL   impacts", "  known  joint|s", "  -      space", "order 1 & \"2\" claimed",
        "mine:<2>: 1 passed, 1 failed, 1 known to fail, 1 not applicable; 2.0 s"})
    EXPECT_NE(text.find(part), std::string::npos) << part << "\nin\n" << text;
  const json document = scorecard_json(card);
  EXPECT_EQ(document["schema"], "ricochet-scorecard-1");
  EXPECT_EQ(document["passed"], 1);
  EXPECT_EQ(document["failed"], 1);
  EXPECT_EQ(document["known"], 1);
  EXPECT_EQ(document["holds"], false);
  EXPECT_EQ(document["checks"].size(), 4u);
  EXPECT_EQ(document["checks"][2]["known"], true);
  const std::string junit = scorecard_junit(card);
  for (const char* part : {"tests=\"4\" failures=\"1\" skipped=\"2\"", "mine:&lt;2&gt;",
                           "<failure message=\"order 1 &amp; &quot;2&quot; claimed\">ricochet run</failure>",
                           "<skipped message=\"known: it&#10;breaks\">", "<skipped message=\"declined\">"})
    EXPECT_NE(junit.find(part), std::string::npos) << part << "\nin\n" << junit;
  const std::string markdown = scorecard_markdown(card);
  EXPECT_NE(markdown.find("| order/joint\\|s | known | it breaks |"), std::string::npos) << markdown;
  EXPECT_NE(scorecard_badge(card).find(">1 of 3<"), std::string::npos);
  EXPECT_NE(scorecard_badge(card).find("#b3261e"), std::string::npos);
  card.known.emplace_back("order/impacts");
  EXPECT_NE(scorecard_badge(card).find("#2a7d2e"), std::string::npos);
}

TEST(Scorecard, TableCountsWhatApplies) {
  auto rows = example_card().rows;
  CheckRow other = rows.front();
  other.method = "other";
  other.group = "truth";
  rows.push_back(other);
  const Table table = scorecard_table(rows);
  ASSERT_EQ(table.rows.size(), 2u);
  EXPECT_EQ(table.rows[0], (std::vector<std::string>{"mine:<2>", "1 of 3", "-", "1 of 3", "2.0"}));
  EXPECT_EQ(table.rows[1], (std::vector<std::string>{"other", "-", "1 of 1", "1 of 1", "0.5"}));
  EXPECT_EQ(check_table(rows, true).rows.size(), 2u);
  EXPECT_EQ(check_table(rows, false).rows.size(), 5u);
}

}  // namespace
}  // namespace ricochet
