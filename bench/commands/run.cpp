#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <limits>

#include "bench/commands/commands.h"
#include "bench/commands/number_checks.h"
#include "bench/commands/problem_options.h"
#include "bench/commands/run_report.h"
#include "bench/measure/isolated_reference.h"
#include "bench/measure/sensitivities.h"
#include "bench/measure/timing.h"
#include "bench/measure/trajectory_of.h"
#include "bench/studies/grid/grid_tables.h"
#include "methods/registry.h"
#include "problems/input_error.h"
#include "reports/drawing/scene_drawing.h"
#include "reports/render/gnuplot.h"
#include "reports/text_file.h"

namespace ricochet {
namespace {

constexpr double kReferenceLimit = 20;  // wall time of the reference [s]; on the scenes of the suite it takes 3 at most

struct RunArguments {
  ProblemOptions problem;
  std::string method;
  std::string plot, csv, animation;
  int points = 1000;
  std::int64_t events = std::numeric_limits<std::int64_t>::max();
  std::vector<std::string> sensitivities;
  bool as_json = false, without_reference = false;
};

Settings settings_of(const RunArguments& options, const Problem& problem, const Method& method) {
  if (!method.info().is_adaptive && !options.problem.is_given("--steps") &&
      !options.problem.is_given("--step-length") && !options.problem.is_given("--tolerance"))
    throw InputError("--steps is required for fixed-step methods");
  Settings settings = options.problem.settings(problem, method);
  if (!options.plot.empty() || !options.csv.empty() || !options.animation.empty())
    settings.recording = Recording::motion;
  settings.sensitivities = options.sensitivities;
  return settings;
}

void check_outputs(const RunArguments& options, const Problem& problem) {
  if (!options.plot.empty()) {
    if (!can_draw()) throw InputError("--plot", options.plot, "gnuplot is needed for figures and was not found");
    require_writable_folder("--plot", options.plot);
  }
  if (!options.csv.empty()) require_writable("motion", options.csv);
  if (!options.animation.empty()) {
    if (!problem.info().geometry)
      throw InputError("--animate", options.animation,
                       fmt::format("problem {} states no geometry to be drawn", problem.info().id));
    require_writable("animation", options.animation);
  }
}

RunReport timed_run(const Problem& problem, const Method& method, const std::string& spec, const Settings& settings) {
  RunReport report{.problem = problem,
                   .method = spec,
                   .method_info = method.info(),
                   .settings = settings,
                   .solution = {},
                   .reference = {},
                   .without_reference = {}};
  report.by_differences = !settings.sensitivities.empty() && !report.method_info.has_sensitivities;
  report.seconds = seconds_of([&] { return solve_with_sensitivities(method, problem, settings); }, report.solution);
  return report;
}

/// As the studies find it.
void add_reference(const RunArguments& options, RunReport& report) {
  if (options.without_reference || !report.solution.succeeded()) {
    report.without_reference = options.without_reference ? "--no-reference" : "the run failed";
    return;
  }
  if (options.problem.kept_depth > 0) {
    report.without_reference = "no motion that obeys the laws begins in penetration";
    return;
  }
  ProblemChoice choice;
  choice.problem = options.problem.scene.empty() ? options.problem.problem : options.problem.scene;
  choice.parameters = parameter_changes(options.problem.changes);
  choice.is_changed = options.problem.depth > 0 || !options.problem.impact_law.empty();
  try {
    report.reference = isolated_reference(choice, report.problem, kReferenceLimit);
  } catch (const std::runtime_error& error) {
    report.without_reference = error.what();
  }
}

/// @throws InputError when the method says nothing of it
void write_motion(const RunArguments& options, const RunReport& report) {
  if (report.solution.motion.empty())
    throw InputError(fmt::format("method {} records no motion between its steps: there is nothing to draw or to write",
                                 report.method));
  FILE* to = options.as_json ? stderr : stdout;
  if (!options.plot.empty()) {
    const std::string setting = Setting{report.settings.steps, report.settings.tolerance}.text();
    const Trajectory trajectory = trajectory_of(report.problem, report.method, setting, report.solution);
    const auto figures = draw_chart(FigureFolder(options.plot), trajectory_chart(trajectory, "trajectory"));
    fmt::print(to, "figure     {}/{}\n", options.plot, figures.front().file);
  }
  if (!options.csv.empty()) {
    write_text("motion", options.csv, trajectory_csv(report.problem, report.solution, options.points));
    fmt::print(to, "motion     {}\n", options.csv);
  }
  if (!options.animation.empty()) {
    write_text("animation", options.animation, scene_svg(report.problem, report.solution));
    fmt::print(to, "animation  {}\n", options.animation);
  }
}

/// @returns the exit code
int run(const RunArguments& options) {
  const auto problem = options.problem.make_problem();
  const auto method = make_method(options.method);
  const Settings settings = settings_of(options, *problem, *method);
  check_outputs(options, *problem);
  RunReport report = timed_run(*problem, *method, options.method, settings);
  if (!options.as_json) print_run(report, static_cast<std::size_t>(options.events));
  if (settings.recording == Recording::motion) write_motion(options, report);
  add_reference(options, report);
  if (options.as_json)
    fmt::print("{}\n", run_json(report).dump(1, ' ', false, nlohmann::json::error_handler_t::replace));
  else if (!options.without_reference && report.solution.succeeded())
    print_error(report);
  return report.solution.succeeded() ? 0 : 1;
}

}  // namespace

void add_run_command(CLI::App& app, int& exit_code) {
  static RunArguments options;
  auto* command = app.add_subcommand("run", "run one method on one problem");
  options.problem.add_problem(*command);
  options.problem.add_settings(*command);
  command->add_option("--method,-m", options.method, "method, see `ricochet list methods`")->required();
  auto* as_json = command->add_flag("--json", options.as_json,
                                    "print everything in all digits as one JSON document, see `ricochet schema run`");
  command->add_option("--events", options.events, "print at most this many events (default: all)")
      ->check(non_negative_number())
      ->excludes(as_json);
  command->add_flag(
      "--no-reference", options.without_reference,
      "do not compute the error, which requires a certified solution or a reference that takes a few seconds");
  command->add_option("--plot", options.plot, "write a figure of the motion to FOLDER/trajectory.svg");
  command->add_option("--animate", options.animation,
                      "write an animated SVG of the scene to FILE (scenes with a geometry)");
  auto* csv = command->add_option("--csv", options.csv, "write t, q and v of the motion to FILE as CSV");
  command->add_option("--points", options.points, "number of equally spaced points in the CSV, besides the events")
      ->needs(csv)
      ->check(CLI::Range(1, 100'000'000));
  command
      ->add_option(
          "--sensitivity", options.sensitivities,
          "print derivatives with respect to q0:K or v0:K (initial values) or param:NAME (a parameter); may be "
          "repeated")
      ->allow_extra_args(false);
  command->footer(
      "Examples:\n"
      "  ricochet run --problem two_balls_spring --method fesd:gauss:4 --steps 200\n"
      "  ricochet run --problem bouncing_ball --set e=0.9 --method cvode:adams --tolerance 1e-10 --json\n"
      "  ricochet run --scene block.json --method event_driven --tolerance 1e-9 --csv out/motion.csv");
  command->callback([&exit_code] { exit_code = run(options); });
}

}  // namespace ricochet
