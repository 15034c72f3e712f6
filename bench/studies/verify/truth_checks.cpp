#include <fmt/format.h>

#include <algorithm>

#include "bench/studies/verify/check.h"
#include "reference/truths.h"

namespace ricochet {
namespace {

using nlohmann::json;

/// Settings, and the errors that are allowed with them.
struct TruthRule {
  int first_order_steps, steps;
  double tolerance;
  double first_order_error, error;  ///< max-norm of (q, v), relative to the solution where that is larger than 1
};
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(TruthRule, first_order_steps, steps, tolerance, first_order_error, error)

struct TruthCase {
  KnownProblem known;
  TruthRule rule;
  std::int64_t impacts;
};

CheckResult meets_truth(const TruthCase& c, const Subject& subject) {
  Run run =
      subject.planned(c.known.choice(), subject.setting(c.rule.first_order_steps, c.rule.steps, c.rule.tolerance));
  const Solution solution = measure_run({.problem = c.known.problem(), .time_limit = subject.time_limit * 0.9}, run);
  const std::string command = run.command();
  if (run.status == "declined") return CheckResult::not_applicable(run.message);
  if (run.failed()) return CheckResult::fail(fmt::format("{}: {}", run.status, run.message), command);
  const auto& truth = c.known.reference();
  const double error = truth.error_of(solution),
               allowed =
                   (subject.is_first_order() ? c.rule.first_order_error : c.rule.error) * std::max(1.0, truth.size());
  std::string text = fmt::format("error {:.1e}, {:.0e} allowed; {}", error, allowed, truth.title());
  if (!(error <= allowed)) return CheckResult::fail(text, command);
  // Time stepping may need several steps for an impact, and knows of no other events.
  if (!subject.is_first_order()) {
    const auto impacts = std::ranges::count(solution.events, EventKind::impact, &Event::kind);
    text += fmt::format("; {} impacts", impacts);
    if (impacts != c.impacts) return CheckResult::fail(text + fmt::format(", {} are true", c.impacts), command);
  }
  return CheckResult::pass(text, command);
}

}  // namespace

void add_truth_checks(const json& experiment, std::vector<Check>& battery) {
  const json& truth = experiment.at("truth");
  const auto rule = truth.get<TruthRule>();
  for (const auto& solved : reference::certified_cases()) {
    const auto& left_out = truth.at("except");
    if (std::ranges::find(left_out, json(solved.id)) != left_out.end()) continue;
    const auto c = std::make_shared<TruthCase>(
        TruthCase{KnownProblem(read_problem_choice(json{{"problem", solved.id}})), rule,
                  std::ranges::count(solved.events, std::string("impact"), &reference::GroundTruth::Event::kind)});
    battery.push_back({"truth", solved.id, [c] { c->known.reference(); },
                       [c](const Subject& subject) { return meets_truth(*c, subject); }});
  }
}

}  // namespace ricochet
