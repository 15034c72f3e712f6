#include "bench/studies/verify/public_report_checks.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>

#include "bench/experiment/experiment_file.h"
#include "bench/measure/data_folder.h"
#include "methods/method_spec.h"
#include "problems/input_error.h"
#include "problems/input_text.h"

namespace ricochet {
namespace {

using nlohmann::json;

std::vector<double> numbers(const json& texts) {
  std::vector<double> list;
  if (!texts.is_array()) return list;
  for (const auto& text : texts) list.push_back(std::stod(text.get<std::string>()));
  return list;
}

/// Largest error of (q, v) without the clock.
double error_of(const PublicReport& report, const Solution& solution) {
  double largest = 0;
  for (std::size_t k = 0; k < report.q.size(); ++k) {
    const auto i = static_cast<Eigen::Index>(k);
    largest = std::max({largest, std::abs(solution.q[i] - report.q[k]), std::abs(solution.v[i] - report.v[k])});
  }
  return largest;
}

PublicReportRule rule_of(const json& field) {
  return {
      field.at("first_order_steps"), field.at("steps"), field.at("tolerance"), field.at("error"), field.at("factor"),
      field.at("multistep_factor")};
}

}  // namespace

double PublicReport::size() const {
  double largest = 1;
  for (const double x : q) largest = std::max(largest, std::abs(x));
  for (const double x : v) largest = std::max(largest, std::abs(x));
  return largest;
}

std::vector<PublicReport> read_public_reports(const std::string& file) {
  std::vector<PublicReport> reports;
  const std::filesystem::path folder = std::filesystem::path(file).parent_path();
  for (const auto& entry : read_input_json(find_project_file(file), "public reports")) {
    reports.push_back({entry.at("name"), (folder / entry.at("scene").get<std::string>()).string(),
                       numbers(entry.at("q")), numbers(entry.at("v")), entry.at("tolerance"),
                       entry.value("corners", false), entry.at("must_succeed")});
  }
  return reports;
}

namespace {

/// @param steps  of a fixed-step method
CheckResult answer_with(int steps, const PublicReport& report, const PublicReportRule& rule, const Subject& subject) {
  const auto declined = [](const std::string& why) { return CheckResult::not_applicable("declined: " + why); };
  const ProblemChoice choice{.problem = report.scene};
  Run run = subject.planned(choice, subject.setting(steps, steps, rule.tolerance));
  const double time_limit = subject.time_limit * 0.9;
  Solution solution;
  try {
    const auto problem = choice.make_problem();
    solution = measure_run({.problem = *problem, .recording = Recording::final_state, .time_limit = time_limit}, run);
  } catch (const InputError& error) {  // of the scene
    return declined(error.what());
  }
  const std::string command = run.command();
  if (run.status == "declined") return declined(run.message);
  if (solution.status == Status::time_limit)
    return CheckResult::fail(fmt::format("no end within {:g} s", time_limit), command);
  if (run.failed()) return declined(fmt::format("{}: {}", run.status, run.message));
  if (!report.has_motion()) return CheckResult::fail("success, where no motion exists until the end time", command);

  const std::string name = MethodSpec(subject.spec).name();
  const bool is_loose = name == "cvode" || name == "ida" || subject.info.order_impacts == 1;
  const double factor = is_loose ? rule.multistep_factor : rule.factor;
  const double allowed = (run.setting.is_tolerance() ? factor * report.tolerance : rule.error) * report.size();
  const double error = error_of(report, solution);
  const std::string text = fmt::format("error {:.1e}, {:.0e} allowed", error, allowed);
  if (error <= allowed) return CheckResult::pass(text, command);
  if (report.has_corners && !subject.info.has_regions)
    return CheckResult::not_judged(text + "; a formula bends or jumps, which the method does not locate itself");
  if (subject.is_first_order())
    return CheckResult::not_judged(fmt::format("{} with {} steps of first order", text, run.setting.steps));
  return CheckResult::fail(text, command);
}

}  // namespace

CheckResult answer_of(const PublicReport& report, const PublicReportRule& rule, const Subject& subject) {
  if (subject.info.is_adaptive || subject.is_first_order())
    return answer_with(rule.first_order_steps, report, rule, subject);
  const CheckResult answer = answer_with(rule.steps, report, rule, subject);
  return answer.verdict == CheckVerdict::fail ? answer_with(rule.first_order_steps, report, rule, subject) : answer;
}

void add_public_report_checks(const json& experiment, std::vector<Check>& battery) {
  const json& field = experiment.at("public_reports");
  const PublicReportRule rule = rule_of(field);
  const json only = field.value("only", json::array());
  for (const auto& report : read_public_reports(field.at("cases"))) {
    if (!only.empty() && std::ranges::find(only, json(report.name)) == only.end()) continue;
    battery.push_back({kPublicReportGroup, report.name, {}, [report, rule](const Subject& subject) {
                         return answer_of(report, rule, subject);
                       }});
  }
}

Table public_report_table(const std::vector<CheckRow>& rows) {
  Table table{
      .title = "Scenes made from public reports",
      .note =
          "Answers by method: correct; declined with a reason; wrong, which includes runs that do not end; and shown "
          "only, which are wrong answers on scenes with corners, or of first-order methods whose steps are too long "
          "for the 1 % required of fixed steps.",
      .columns = {{"method", true}, {"correct"}, {"declined"}, {"wrong"}, {"not judged"}},
      .rows = {},
      .is_whole = true};
  std::vector<std::string> known;
  for (const auto& row : rows) {
    if (row.group == kPublicReportGroup && std::ranges::find(known, row.method) == known.end())
      known.push_back(row.method);
  }
  for (const auto& method : known) {
    int correct = 0, declined = 0, wrong = 0, shown = 0;
    for (const auto& row : rows) {
      if (row.method != method || row.group != kPublicReportGroup) continue;
      ++(row.verdict == CheckVerdict::pass   ? correct
         : row.verdict == CheckVerdict::fail ? wrong
         : row.is_judged                     ? declined
                                             : shown);
    }
    table.rows.push_back(
        {method, std::to_string(correct), std::to_string(declined), std::to_string(wrong), std::to_string(shown)});
  }
  return table;
}

}  // namespace ricochet
