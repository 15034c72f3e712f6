#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <cmath>
#include <cstdio>
#include <random>

#include "bench/commands/commands.h"
#include "bench/commands/number_checks.h"
#include "bench/control/control_guess.h"
#include "methods/control/shrinking_horizon.h"
#include "problems/input_error.h"
#include "reports/quantile.h"

namespace ricochet {
namespace {

struct MpcArguments {
  ControlOptions control;
  int updates = 0;
  double disturbance = 0;
};

int control_in_closed_loop(const MpcArguments& options) {
  const auto problem = options.control.make_problem();
  const int N = problem->n_intervals, updates = options.updates > 0 ? options.updates : N - 1;
  if (updates >= N) throw InputError("--updates", updates, fmt::format("a number from 1 to {} is required", N - 1));
  if (!(options.disturbance >= 0) || !std::isfinite(options.disturbance))
    throw InputError("--disturbance", options.disturbance, "a finite number >= 0 is required");
  if (!(options.control.update_limit >= 0) || !std::isfinite(options.control.update_limit))
    throw InputError("--update-limit", options.control.update_limit, "a finite number >= 0 is required");
  const PreparedMethod method = prepared_method(options.control, *problem);
  for (const auto& note : method.notes) fmt::print("{}\n", note);
  ShrinkingHorizon horizon(*problem, *method.solver);
  fmt::print("problem    {}: {}\nprogram    {}: {} variables, {} complementarity pairs\n", problem->id, problem->title,
             options.control.describe(*problem), method.solver->n_variables(), method.solver->n_pairs());
  const ControlSolution first = horizon.solve();
  fmt::print("first      {}{}, {:.2f} s, {} iterations, cost {:.8g}\n", to_string(first.status),
             first.message.empty() ? "" : ": " + first.message, first.seconds, first.iterations,
             horizon.plan().objective);
  if (!first.has_plan()) return 1;

  fmt::print("\n  {:>8}  {:>8}  {:>8}  {:>10}  {:>12}  {:>12}  {:>8}  {}\n", "t [s]", "by", "s", "iterations",
             "cost before", "and to go", "violated", "status");
  const bool is_shooting = options.control.is_shooting();
  std::mt19937 random(options.control.exploration.seed);
  std::vector<double> seconds;
  int kept = 0, without_plan = 0;
  while (horizon.interval() < N) {
    const Status status = horizon.advance();
    if (status != Status::success) {
      fmt::print("plant      no motion in interval {}: {}\n", horizon.interval() + 1, to_string(status));
      return 1;
    }
    if (horizon.interval() > updates || horizon.interval() == N) continue;
    if (options.disturbance > 0) horizon.disturb(options.disturbance, random);
    const ControlSolution again = horizon.resolve();
    fmt::print("  {:8.4f}  {:>8}  {:8.3f}  {:10}  {:12.8g}  {:12.8g}  {:8.1e}  {}{}\n",
               horizon.interval() * horizon.plan().T / N,
               is_shooting         ? "shooting"
               : again.kept_branch ? "branch"
                                   : "homotopy",
               again.seconds, again.iterations, horizon.cost_so_far(), horizon.cost_to_go(), again.violation,
               to_string(again.status), again.message.empty() ? "" : ": " + again.message);
    std::fflush(stdout);
    seconds.push_back(again.seconds);
    kept += is_shooting ? again.succeeded() : again.kept_branch;
    without_plan += !again.has_plan();
  }
  fmt::print("\nplant      cost {:.8g} at T, {:.8g} in the first plan\n",
             horizon.cost_so_far() + horizon.terminal_cost(), first.trajectory.objective);
  fmt::print("re-solves  {} of {} {}, {} {}; median {:.3g} s, longest {:.3g} s, first solve {:.2f} s\n", kept,
             seconds.size(), is_shooting ? "are stationary" : "keep the branch", without_plan,
             is_shooting ? "have no plan" : "are not solved", median(seconds), std::ranges::max(seconds),
             first.seconds);
  return without_plan == 0 ? 0 : 1;
}

}  // namespace

void add_mpc_command(CLI::App& app, int& exit_code) {
  static MpcArguments o;
  o = {};  // a test reads many command lines
  auto* command = app.add_subcommand("mpc", "model predictive control with contacts: re-plan after every interval");
  o.control.add(*command);
  command
      ->add_option("--updates", o.updates,
                   "number of intervals after which the rest is planned again (default: all but the last)")
      ->check(positive_number());
  command
      ->add_option(
          "--disturbance", o.disturbance,
          "largest random disturbance before an update: of positions in m or rad, of velocities relative; drawn with "
          "--seed")
      ->capture_default_str();
  command
      ->add_option("--sigma-warm", o.control.homotopy.sigma_warm,
                   "first relaxation parameter if the branch of the plan has no solution")
      ->capture_default_str()
      ->group(ControlOptions::kOfHomotopy);
  command
      ->add_option("--update-limit", o.control.update_limit,
                   "limit of the wall time of an update [s]; 0 for none. After it the previous plan stays in force, or "
                   "with shooting the last iterate is the plan")
      ->capture_default_str();
  command->footer(
      "Examples:\n"
      "  ricochet mpc two_carts --simulate --sigma-0 0.01 --updates 3 --disturbance 0.001\n"
      "  ricochet mpc two_carts --method shooting --explore 12 --disturbance 0.03 --update-limit 0.005");
  command->callback([&exit_code] { exit_code = control_in_closed_loop(o); });
}

}  // namespace ricochet
