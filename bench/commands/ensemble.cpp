#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <chrono>
#include <filesystem>
#include <thread>

#include "bench/commands/commands.h"
#include "bench/commands/number_checks.h"
#include "bench/commands/problem_options.h"
#include "bench/ensemble/ensemble_file.h"
#include "bench/experiment/experiment_file.h"
#include "bench/experiment/experiment_schema.h"
#include "bench/rows/progress.h"
#include "problems/input_error.h"

namespace ricochet {
namespace {

using nlohmann::json;

struct EnsembleArguments {
  std::string file, out, shard, shards;
  std::vector<std::string> vary, set;
  std::string problem, method;
  std::int64_t runs = 0;
  std::uint64_t seed = 0;
  int steps = 0, threads = 0;
  double tolerance = 0, time_limit = 0;
};

/// The file, with what the command line says instead.
json document_of(const CLI::App& command, const EnsembleArguments& options) {
  json document = options.file.empty() ? json::object() : read_json_object(options.file, "an ensemble");
  resolve_paths(document, ensemble_schema(), std::filesystem::path(options.file).parent_path());
  const auto replace = [&](const char* option, const char* field, const auto& value) {
    if (command.count(option) > 0) document[field] = value;
  };
  replace("--problem", "problem", options.problem);
  replace("--vary", "vary", options.vary);
  replace("--method", "method", options.method);
  replace("--runs", "runs", options.runs);
  replace("--seed", "seed", options.seed);
  replace("--time-limit", "time_limit", options.time_limit);
  if (command.count("--steps") + command.count("--tolerance") > 0) {
    document.erase("steps");
    document.erase("tolerance");
  }
  replace("--steps", "steps", options.steps);
  replace("--tolerance", "tolerance", options.tolerance);
  for (const auto& [name, value] : parameter_changes(options.set)) document["parameters"][name] = value;
  return document;
}

Ensemble read(const json& document) {
  try {
    return read_ensemble(document);
  } catch (const json::exception& error) {
    throw InputError(fmt::format("not an ensemble: {}", error.what()));
  }
}

/// @returns how many runs failed
std::int64_t print_endings(const EnsembleFile& file) {
  std::int64_t failed = file.end() - file.begin();
  for (const auto& [status, count] : file.endings()) {
    fmt::print("{:<10} {}\n", status, count);
    if (status == "success") failed -= count;
  }
  return failed;
}

void run(const CLI::App& command, const EnsembleArguments& options, int& exit_code) {
  const Ensemble ensemble = read(document_of(command, options));
  const int threads =
      options.threads > 0 ? options.threads : static_cast<int>(std::max(1u, std::thread::hardware_concurrency()));
  const Shard shard = options.shard.empty() ? Shard() : read_shard(options.shard);
  const std::string path = shard.is_all() ? options.out : shard_path(options.out, shard);
  auto workers = make_workers(ensemble, options.shards.empty() ? threads : 1);
  std::vector<std::string> shards;  // before the file is begun
  if (!options.shards.empty()) shards = complete_shards(options.out, options.shards, ensemble);
  EnsembleFile file(path, ensemble, workers.front()->base(), shard);
  const std::int64_t n_runs = file.end() - file.begin();
  if (file.n_done() > file.begin()) fmt::print("{} of {} runs already exist\n", file.n_done() - file.begin(), n_runs);
  if (!shards.empty()) merge_shards(file, shards, csv_header(ensemble, workers.front()->base()));
  Progress progress("ensemble");
  const auto begin = std::chrono::steady_clock::now();
  const std::int64_t made = run_ensemble(file, workers, [&](std::int64_t done) {
    progress.update(static_cast<double>(done - file.begin()) / static_cast<double>(n_runs), "");
  });
  const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  progress.finish();
  if (made > 0)
    fmt::print("{} runs in {:.3g} s by {} threads: {:.4g} runs per second\n", made, seconds, threads,
               static_cast<double>(made) / seconds);
  if (print_endings(file) > 0) exit_code = 1;
  fmt::print("{}\n", path);
}

}  // namespace

void add_ensemble_command(CLI::App& app, int& exit_code) {
  static EnsembleArguments options;
  auto* command = app.add_subcommand(
      "ensemble", "run one scene for many parameters and initial states and write CSV; exit code 1 if a run failed");
  command->add_option("file", options.file,
                      "JSON file with the options as fields: \"problem\", \"parameters\", \"vary\", "
                      "\"runs\", \"seed\", \"method\", \"steps\", \"tolerance\", \"time_limit\"");
  command->add_option("--problem,-p", options.problem,
                      "name of a problem, see `ricochet list problems`, or scene FILE.json#ID");
  command->add_option("--set", options.set, "NAME=VALUE: set a parameter in all runs; may be repeated")
      ->allow_extra_args(false);
  command
      ->add_option(
          "--vary", options.vary,
          "NAME=DISTRIBUTION: vary a parameter, or a component q0:K or v0:K of the initial state; may be repeated. "
          "Distributions: uniform:FROM:TO, log-uniform:FROM:TO, normal:MEAN:DEVIATION; grids: "
          "grid:FROM:TO:POINTS, log-grid:FROM:TO:PER_DECADE, values:A:B:...")
      ->allow_extra_args(false);
  command->add_option("--runs", options.runs, "number of random draws at each point of the grids");
  command->add_option("--seed", options.seed, "seed of the draws (default: 1)")->check(non_negative_number());
  command->add_option("--method,-m", options.method, "method, see `ricochet list methods`");
  auto* steps = command->add_option("--steps,-N", options.steps, "number of steps (fixed-step methods)");
  command->add_option("--tolerance", options.tolerance, "tolerance (error-controlled methods)")->excludes(steps);
  command->add_option("--time-limit", options.time_limit, "limit of the wall time of a run in seconds; 0 for none")
      ->check(non_negative_number());
  command
      ->add_option("--threads", options.threads,
                   "number of threads (default: all cores); the file does not depend on it")
      ->check(positive_number());
  auto* shard = command->add_option(
      "--shard", options.shard,
      "K/N: compute only the K-th of N equal parts and write NAME.shard-K-of-N.csv for --out NAME.csv");
  command
      ->add_option("--from-shards", options.shards, "merge the N shards in FOLDER; the CSV is that of a single process")
      ->excludes(shard);
  command->add_option("-o,--out", options.out, "CSV file to be written; an interrupted one is continued")->required();
  command->footer(
      "Examples:\n"
      "  ricochet ensemble -p two_balls_spring --vary k=log-uniform:1e3:1e5 --vary e=uniform:0.5:0.9 --runs 10000\n"
      "      -m fesd:radau-iia:4,elements=as_needed -N 100 -o out/spring.csv\n"
      "  ricochet ensemble -p sliding_block --vary mu=grid:0.1:0.8:71 -m event_driven --tolerance 1e-9 -o out/mu.csv");
  command->callback([&exit_code, command] { run(*command, options, exit_code); });
}

}  // namespace ricochet
