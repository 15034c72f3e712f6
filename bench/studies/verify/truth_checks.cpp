#include <fmt/format.h>

#include <algorithm>

#include "bench/studies/verify/check.h"
#include "methods/registry.h"
#include "problems/input_error.h"
#include "reference/ground_truth.h"

namespace ricochet {
namespace {

using nlohmann::json;

/// Settings and what is asked of the error with them.
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
  const auto method = make_method(subject.spec);
  const Problem& problem = c.known.problem();
  if (const Support support = method->can_run(problem.info()); !support.ok)
    return CheckResult::not_applicable(support.reason);
  Settings settings;
  if (subject.info.is_adaptive)
    settings.tolerance = c.rule.tolerance;
  else
    settings.steps = subject.steps(subject.is_first_order() ? c.rule.first_order_steps : c.rule.steps);
  settings.time_limit = subject.time_limit * 0.9;
  const std::string command =
      run_command(c.known.choice().arguments(), subject.spec, settings.steps, settings.tolerance);
  Solution solution;
  try {
    solution = method->solve(problem, settings);
  } catch (const InputError& error) {  // a method that cannot tell before it runs
    return CheckResult::not_applicable(error.what());
  }
  if (!solution.succeeded())
    return CheckResult::fail(fmt::format("{}: {}", to_string(solution.status), solution.message), command);
  const auto& truth = c.known.reference();
  const double error = truth.error_of(solution),
               allowed =
                   (subject.is_first_order() ? c.rule.first_order_error : c.rule.error) * std::max(1.0, truth.size());
  std::string text = fmt::format("error {:.1e}, {:.0e} allowed", error, allowed);
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
