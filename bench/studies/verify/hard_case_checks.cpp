#include <algorithm>
#include <optional>

#include "bench/experiment/experiment_file.h"
#include "bench/studies/hard_cases/run_hard_cases.h"
#include "bench/studies/verify/check.h"

namespace ricochet {
namespace {

using nlohmann::json;

/// A hard case with its problem and motions, which are made once.
struct KnownCase {
  HardCase hard_case;
  double time_limit;
  std::unique_ptr<Problem> problem;
  std::optional<std::vector<TrueMotion>> motions;

  void prepare() {
    if (!problem) problem = hard_case.make_problem();
    if (!motions) motions = hard_case.true_motions(*problem);
  }
};

CheckResult survives(const KnownCase& known, const Subject& subject) {
  const double limit = std::min(known.time_limit, subject.time_limit / 3);  // it is killed after twice that
  const HardCell cell = run_cell(known.hard_case, *known.problem, *known.motions, subject.spec, limit);
  const CaseVerdict verdict = cell.verdict();
  const VerdictText& text = text_of(verdict);
  if (verdict == CaseVerdict::declined) return CheckResult::not_applicable(cell.message);
  const std::string reason = std::string(text.word) + ": " + decisive_number(verdict, cell);
  return text.grade == Grade::good ? CheckResult::pass(reason, cell.command())
                                   : CheckResult::fail(reason, cell.command());
}

}  // namespace

void add_hard_case_checks(const json& experiment, std::vector<Check>& battery) {
  json file = read_experiment_file("hard_cases").document;
  file["only_case"] = experiment.at("hard_cases");
  for (auto& hard_case : read_hard_cases(file).cases) {
    const auto known = std::make_shared<KnownCase>();
    known->time_limit = experiment.at("time_limit");
    known->hard_case = std::move(hard_case);
    battery.push_back({"hard case", known->hard_case.id, [known] { known->prepare(); },
                       [known](const Subject& subject) { return survives(*known, subject); }});
  }
}

}  // namespace ricochet
