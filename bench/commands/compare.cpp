#include <fmt/format.h>

#include <CLI/CLI.hpp>

#include "bench/commands.h"
#include "bench/studies/study.h"
#include "reports/tables.h"

namespace ricochet {

void add_compare_command(CLI::App& app, int&) {
  static std::string experiment, folder = "out/results";
  auto* command = app.add_subcommand("compare", "run a study and print its tables");
  command
      ->add_option("experiment", experiment,
                   "optimal_control, control_gradient, control_growth, control_seeds, zeno, friction_ramp, scale, or a "
                   "file")
      ->required();
  command->add_option("-o,--out", folder, "folder for the results file")->capture_default_str();
  command->callback([] {
    const std::string path = run_study(experiment, folder);
    const Results results = read_results(path);
    fmt::print("{}\nresults: {}\n\n", results.header.value("title", experiment), path);
    if (!results.control_runs.empty()) {
      fmt::print("{}\n", control_table(results.control_runs).text());
      const Table failed = control_failures(results.control_runs);
      if (!failed.rows.empty()) fmt::print("{}\n", failed.list());
    }
    if (!results.growth.empty())
      fmt::print("{}\n{}\n", growth_table(results.growth).text(), homotopy_steps(results.growth).text());
    if (!results.zeno_captures.empty()) fmt::print("{}\n", zeno_capture_table(results.zeno_captures).text());
    if (!results.zeno_runs.empty()) fmt::print("{}\n", zeno_table(results.zeno_runs).text());
    if (!results.ramps.empty()) fmt::print("{}\n", ramp_table(results.ramps).text());
    if (!results.ramp_facets.empty()) fmt::print("{}\n", ramp_facets_table(results.ramp_facets).text());
    if (!results.gradients.empty()) fmt::print("{}\n", gradient_table(results.gradients).text());
    if (!results.scale_runs.empty()) {
      fmt::print("{}\n", scale_table(results.scale_runs).text());
      const Table failed = scale_failures(results.scale_runs);
      if (!failed.rows.empty()) fmt::print("{}\n", failed.list());
    }
    if (!results.seed_runs.empty()) {
      fmt::print("{}\n", seed_table(results.seed_runs).list());
      const Table failed = seed_failures(results.seed_runs);
      if (!failed.rows.empty()) fmt::print("{}\n", failed.list());
    }
  });
}

}  // namespace ricochet
