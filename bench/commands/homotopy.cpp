#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>

#include "bench/commands.h"
#include "bench/experiment.h"
#include "bench/progress.h"
#include "bench/studies/homotopy_study.h"
#include "methods/fesd_homotopy/options.h"
#include "reports/quantile.h"
#include "reports/table.h"

namespace ricochet {
namespace {

// Problem, reference and grid: those of the first FESD-J method that has nothing but the published grid.
const char* const kExperiment = "two_balls_order";
const char* const kGridOf = "fesd:radau-iia:2,switches=published";
// Of the sweep: coarse to fine, with both N where pivoting finds impacts near the end of a step.
const std::vector<int> kSweepGrid = {50, 80, 125, 300, 750};
const std::vector<std::string> kFamilies = {"radau-iia", "gauss"};
constexpr int kStages = 4;
// A stretch of steps that ends farther from the pivoting solver has followed another solution of the equations.
constexpr double kOther = 1e-6;

struct HomotopyArguments {
  std::vector<int> steps;
  std::vector<std::string> guesses{"pivoting", "ballistic", "cold"};
  std::vector<std::string> relaxations{"scholtes",    "fischer_burmeister", "lin_fukushima",
                                       "kadrani",     "steffensen_ulbrich", "elastic_1",
                                       "elastic_inf", "scholtes_equality"};
  std::vector<std::string> sigmas{"1", "1e-1", "1e-3", "1e-5"};
  std::vector<std::string> factors{"0.1", "0.01"};
  std::string more;
  int margin = 2;
  bool all = false, list = false;
};

StepHomotopy::Options parse(const std::string& options, const std::string& more) {
  const MethodSpec spec("fesd_homotopy:radau-iia:2," + options + (more.empty() ? "" : "," + more));
  StepHomotopy::Options result = step_homotopy_options(spec);
  spec.finish(2);
  return result;
}

std::vector<int> published_grid(const Experiment& experiment) {
  return std::ranges::find(experiment.methods, kGridOf, &Experiment::MethodGrid::method)->steps;
}

std::vector<PivotingRun> pivoting_runs(const Problem& problem, const std::string& family,
                                       const std::vector<int>& steps) {
  std::vector<PivotingRun> runs;
  for (int n_s = 1; n_s <= kStages; ++n_s) {
    for (const int N : steps) runs.push_back(run_pivoting(problem, make_tableau(family, n_s), N));
  }
  return runs;
}

std::vector<std::string> cells(const HomotopySummary& s) {
  const double largest = s.all.distances.empty() ? std::nan("") : *std::ranges::max_element(s.all.distances);
  return {fmt::format("{} of {}", s.failed_runs, s.runs),
          fmt::format("{} of {}", s.all.failed, s.all.steps),
          std::to_string(s.all.retried),
          fmt::format("{:.2f}", median(s.all.milliseconds[0])),
          fmt::format("{:.2f}", median(s.all.milliseconds[1])),
          scientific(median(s.all.distances)),
          scientific(largest),
          std::to_string(std::ranges::count_if(s.all.distances, [](double d) { return d > kOther; }))};
}

double error_of(const reference::Reference& reference, const Vector& q, const Vector& v) {
  Solution solution;
  solution.q = q;
  solution.v = v;
  return reference.error_of(solution);
}

const std::vector<Table::Column> kColumns = {{"runs failed"},       {"steps failed"},       {"tried again"},
                                             {"ms per free step"},  {"ms per impact step"}, {"distance, median"},
                                             {"distance, largest"}, {"other solutions"}};

void grid(const HomotopyArguments& options) {
  const Experiment experiment = read_experiment(kExperiment);
  const auto problem = experiment.make_problem();
  const auto reference = experiment.make_reference(*problem);
  const std::vector<int> steps = options.steps.empty() ? published_grid(experiment) : options.steps;
  Table table;
  table.title = "FESD-J by homotopy and by pivoting: two balls, n_s = 1..4, N_FE = 2";
  table.note =
      "Times: CPU, medians. Distance: of (q, v) to the pivoting solver, at the end of every stretch of steps. Error: "
      "of "
      "the final state, median of complete runs.";
  table.columns = {{"family", true}, {"solver", true}};
  table.columns.insert(table.columns.end(), kColumns.begin(), kColumns.end());
  table.columns.push_back({"error"});
  std::vector<std::string> failures;
  Progress progress("homotopy");
  double done = 0;
  const double total = static_cast<double>(kFamilies.size() * options.guesses.size() * kStages * steps.size());
  for (const auto& family : kFamilies) {
    const auto runs = pivoting_runs(*problem, family, steps);
    std::vector<double> milliseconds[2];
    int failed = 0, n_steps = 0;
    std::vector<double> errors;
    for (const auto& run : runs) {
      n_steps += static_cast<int>(run.has_impact.size());
      for (std::size_t k = 0; k < run.has_impact.size(); ++k)
        milliseconds[run.has_impact[k]].push_back(run.milliseconds[k]);
      if (run.status == Status::success) {
        errors.push_back(error_of(reference, run.q.back(), run.v.back()));
        continue;
      }
      ++failed;
      failures.push_back(fmt::format("pivoting, {}, N = {}, {}", run.tableau.name, run.steps, run.message));
    }
    table.rows.push_back({family, "pivoting", fmt::format("{} of {}", failed, runs.size()),
                          fmt::format("{} of {}", failed, n_steps + failed), "-",
                          fmt::format("{:.4f}", median(milliseconds[0])),
                          fmt::format("{:.4f}", median(milliseconds[1])), "-", "-", "-", scientific(median(errors))});
    for (const auto& guess : options.guesses) {
      const StepHomotopy::Options homotopy = parse("guess=" + guess, options.more);
      HomotopySummary summary;
      errors.clear();
      for (const auto& run : runs) {
        const HomotopyRun result = run_homotopy(*problem, run, homotopy, options.all ? -1 : options.margin);
        if (result.is_complete) errors.push_back(error_of(reference, result.q, result.v));
        if (result.solves_infeasible)
          failures.push_back(fmt::format("{}, {}, N = {}: solves the step that pivoting does not", guess,
                                         run.tableau.name, run.steps));
        summary.add(result);
        progress.update(++done / total, fmt::format("{} {}, {} N = {}", family, guess, run.tableau.name, run.steps));
      }
      table.rows.push_back({family, "homotopy, guess " + guess});
      const auto values = cells(summary);
      table.rows.back().insert(table.rows.back().end(), values.begin(), values.end());
      table.rows.back().push_back(scientific(median(errors)));
      for (const auto& failure : summary.all.failures) failures.push_back(guess + ", " + failure);
    }
  }
  progress.finish();
  fmt::print("{}\n", table.text());
  for (const auto& failure : failures) fmt::print("  {}\n", failure);
}

void sweep(const HomotopyArguments& options) {
  const auto problem = read_experiment(kExperiment).make_problem();
  const std::vector<int> steps = options.steps.empty() ? kSweepGrid : options.steps;
  std::vector<PivotingRun> runs;
  for (const auto& family : kFamilies) {
    auto more = pivoting_runs(*problem, family, steps);
    std::ranges::move(more, std::back_inserter(runs));
  }
  Table table;
  table.title = "Impact steps of the two balls, each from the state of the pivoting solver";
  table.columns = {{"guess", true}, {"relaxation", true}, {"sigma_0", true}, {"factor", true}};
  table.columns.insert(table.columns.end(), kColumns.begin() + 1, kColumns.end());
  Progress progress("homotopy");
  double done = 0;
  const double total = static_cast<double>(options.guesses.size() * options.relaxations.size() * options.sigmas.size() *
                                           options.factors.size());
  for (const auto& guess : options.guesses) {
    for (const auto& relaxation : options.relaxations) {
      for (const auto& sigma : options.sigmas) {
        for (const auto& factor : options.factors) {
          const StepHomotopy::Options homotopy =
              parse(fmt::format("guess={},relaxation={},sigma_0={},factor={}", guess, relaxation, sigma, factor),
                    options.more);
          HomotopySummary summary;
          for (const auto& run : runs) summary.add(run_homotopy(*problem, run, homotopy, 0));
          table.rows.push_back({guess, relaxation, sigma, factor});
          const auto values = cells(summary);
          table.rows.back().insert(table.rows.back().end(), values.begin() + 1, values.end());
          if (options.list) {
            for (const auto& failure : summary.all.failures) fmt::print("  {}\n", failure);
          }
          progress.update(++done / total, fmt::format("{} {} {} {}", guess, relaxation, sigma, factor));
        }
      }
    }
  }
  progress.finish();
  fmt::print("{}\n", table.text());
}

}  // namespace

void add_homotopy_command(CLI::App& app, int&) {
  static HomotopyArguments options;
  auto* command = app.add_subcommand("homotopy", "FESD-J by homotopy against the pivoting solver: failures, times");
  command->require_subcommand(1);
  const auto add_common = [](CLI::App* study) {
    study->add_option("--guess", options.guesses, "pivoting, ballistic, cold")->delimiter(',')->capture_default_str();
    study->add_option("--steps", options.steps, "N_sim, instead of the published grid")->delimiter(',');
    study->add_option("--options", options.more, "of the method, as in its name: \"sigma_0=1,retry=0\"");
  };
  auto* on_grid = command->add_subcommand("grid", "two balls on the published grid");
  add_common(on_grid);
  on_grid->add_flag("--all", options.all, "every step of every run, not only those near impacts");
  on_grid->add_option("--margin", options.margin, "steps before and behind an impact")->capture_default_str();
  on_grid->callback([] { grid(options); });
  auto* in_sweep = command->add_subcommand("sweep", "impact steps, relaxation x sigma_0 x factor x guess");
  add_common(in_sweep);
  in_sweep->add_option("--relaxation", options.relaxations, "names")->delimiter(',');
  in_sweep->add_option("--sigma-0", options.sigmas, "first relaxation parameters")->delimiter(',');
  in_sweep->add_option("--factor", options.factors, "from one sigma to the next")->delimiter(',');
  in_sweep->add_flag("--list", options.list, "every failed step with its reason");
  in_sweep->callback([] { sweep(options); });
}

}  // namespace ricochet
