#include <fmt/format.h>

#include <CLI/CLI.hpp>

#include "bench/commands.h"
#include "bench/contact_recorder.h"
#include "bench/contact_solutions.h"
#include "bench/number_checks.h"
#include "bench/problem_options.h"
#include "methods/registry.h"
#include "methods/time_stepping/common/time_stepping_method.h"
#include "problems/input_error.h"
#include "reports/text_file.h"

namespace ricochet {
namespace {

struct ExportOptions {
  ProblemOptions problem;
  std::string method, path;
  int step = 0;  // from 1; 0: that with the most contacts
};

void export_contacts(const ExportOptions& options) {
  require_contact_files();
  require_new_file("contact file", options.path);
  const auto problem = options.problem.make_problem();
  const auto method = make_method(options.method);
  const Settings settings = options.problem.settings(*problem, *method);
  ContactRecorder recorder(options.step > 0 ? std::optional<std::int64_t>(options.step - 1) : std::nullopt);
  if (auto* stepping = dynamic_cast<TimeSteppingMethod*>(method.get())) stepping->set_contact_observer(&recorder);
  const Solution solution = method->solve(*problem, settings);
  if (!solution.succeeded()) fmt::print("run: {}: {}\n", to_string(solution.status), solution.message);
  if (!recorder.found()) {
    const std::string none =
        fmt::format("{} on {}: no contact problem of a time-stepping method", options.method, problem->info().id);
    if (options.step == 0) throw InputError(none);
    throw InputError("--step", options.step, none + " in this step");
  }
  StoredContactProblem& stored = recorder.stored();
  stored.title =
      fmt::format("{}, {}, step {} of {}", problem->info().id, options.method, recorder.step() + 1, settings.steps);
  stored.description = fmt::format(
      "{}; t = {:.6g} s at the beginning of the step; impulses r [N s] and velocities u = W "
      "r + q [m/s], q with the terms of the impact law or of the gap. Written by Ricochet.",
      problem->info().title, static_cast<double>(recorder.step()) * problem->info().end_time / settings.steps);
  stored.math_info = math_info(stored.problem);
  write_contact_file(stored, options.path);
  fmt::print(
      "contact file: {}\n{}\n{}\n{}\n", options.path, stored.title, stored.math_info,
      stored.solution.size() > 0 ? "with its solution" : fmt::format("not solved: {}", reason_of(recorder.status())));
}

void add_export(CLI::App& contacts) {
  static ExportOptions options;
  auto* command = contacts.add_subcommand("export", "the contact problem of one step as a file of FCLib");
  options.problem.add_problem(*command);
  options.problem.add_settings(*command);
  command->add_option("-m,--method", options.method, "time-stepping method, see `ricochet list methods`")->required();
  command->add_option("--step", options.step, "1, 2, ...; without it the first step with the most contacts")
      ->check(positive_number());
  command->add_option("-o,--out", options.path, "the new file")->required();
  command->footer(
      "Example:\n  ricochet contacts export --problem sphere_pile --set n=30 --method moreau_jean --steps 100 -o "
      "pile.hdf5");
  command->callback([] { export_contacts(options); });
}

void add_solve(CLI::App& contacts, int& exit_code) {
  static std::vector<std::string> paths, solvers;
  static bool from_guess = false;
  auto* command = contacts.add_subcommand("solve", "local problems of FCLib by the contact solvers, side by side");
  command->add_option("files", paths, "files of FCLib")->required();
  command
      ->add_option("--solver", solvers,
                   "as behind solver= of a method, for example lemke,facets=16; may be repeated. Without it all of "
                   "them, lemke up to 100 contacts")
      ->allow_extra_args(false);
  command->add_flag("--guess", from_guess, "start from the guess in the file instead of zero");
  command->footer("Example:\n  ricochet contacts solve pile.hdf5 --solver newton --solver lemke,facets=16");
  command->callback([&exit_code] {
    require_contact_files();
    for (const auto& path : paths) {
      StoredContactProblem stored = read_contact_file(path);
      if (stored.title.empty()) stored.title = path;
      stored.math_info = math_info(stored.problem);
      std::vector<ContactSolution> solutions;
      for (const auto& solver : solvers.empty() ? usual_solvers(stored.problem) : solvers) {
        solutions.push_back(solve_stored(stored, solver, from_guess));
        if (solutions.back().status != ContactStatus::solved) exit_code = 1;
      }
      fmt::print("{}\n", contact_solution_table(stored, solutions).text());
    }
  });
}

}  // namespace

void add_contacts_command(CLI::App& app, int& exit_code) {
  auto* command = app.add_subcommand("contacts", "contact problems of single steps: exchanged as files, solved");
  command->footer(
      "Examples:\n"
      "  ricochet contacts export --problem sphere_pile --method moreau_jean --steps 100 -o pile.hdf5\n"
      "  ricochet contacts solve pile.hdf5");
  command->require_subcommand(1);
  add_export(*command);
  add_solve(*command, exit_code);
}

}  // namespace ricochet
