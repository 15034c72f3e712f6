#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <filesystem>

#include "bench/commands/commands.h"
#include "bench/commands/number_checks.h"
#include "bench/commands/problem_options.h"
#include "bench/contacts/contact_recorder.h"
#include "bench/contacts/contact_sampler.h"
#include "bench/contacts/contact_set.h"
#include "bench/contacts/contact_set_tables.h"
#include "bench/contacts/contact_solutions.h"
#include "bench/contacts/impact_law_study.h"
#include "bench/contacts/merit_study.h"
#include "methods/registry.h"
#include "methods/time_stepping/common/time_stepping_method.h"
#include "problems/input_error.h"
#include "reports/render/gnuplot.h"
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
  auto* command = contacts.add_subcommand("export", "write the contact problem of one step as an FCLib file");
  options.problem.add_problem(*command);
  options.problem.add_settings(*command);
  command->add_option("-m,--method", options.method, "time-stepping method, see `ricochet list methods`")->required();
  command->add_option("--step", options.step, "number of the step, from 1 (default: the first with the most contacts)")
      ->check(positive_number());
  command->add_option("-o,--out", options.path, "file to be written")->required();
  command->footer(
      "Example:\n  ricochet contacts export --problem sphere_pile --set n=30 --method moreau_jean --steps 100 -o "
      "pile.hdf5");
  command->callback([] { export_contacts(options); });
}

struct SolveOptions {
  std::vector<std::string> paths, solvers;
  bool from_guess = false, as_json = false;
  double accuracy = 1e-8;
  int least_contacts = 1;
  std::string svg;
};

/// Problems one by one, all solvers side by side.
void solve_each(const SolveOptions& options, std::vector<StoredContactProblem>& problems, int& exit_code) {
  for (auto& stored : problems) {
    stored.math_info = math_info(stored.problem);
    std::vector<ContactSolution> solutions;
    for (const auto& solver :
         options.solvers.empty() ? usual_solvers(stored.problem.G.n_contacts()) : options.solvers) {
      try {
        solutions.push_back(solve_stored(stored, solver, options.from_guess));
      } catch (const InputError&) {
        if (!options.solvers.empty()) throw;  // that was asked for; the usual ones may decline
        continue;
      }
      if (solutions.back().status != ContactStatus::solved) exit_code = 1;
    }
    if (options.as_json) {
      for (const auto& solution : solutions)
        fmt::print(
            "{}\n",
            contact_solution_json(stored, solution).dump(-1, ' ', false, nlohmann::json::error_handler_t::replace));
    } else {
      fmt::print("{}\n{}\n", contact_solution_table(stored, solutions).text(),
                 contact_residual_table(solutions).text());
    }
  }
}

/// Problems as a set: how hard they are, performance profiles, internal forces.
void solve_together(const SolveOptions& options, const std::vector<StoredContactProblem>& problems, int& exit_code) {
  const auto solvers = options.solvers.empty() ? usual_solvers() : options.solvers;
  if (!options.as_json) {
    std::vector<Conditioning> conditioning;
    for (const auto& stored : problems) conditioning.push_back(conditioning_of(stored));
    fmt::print("{}\n", conditioning_table(conditioning).text());
  }
  const ContactSetSolutions set = solve_set(problems, solvers, options.from_guess);
  if (!set.all_are_solved()) exit_code = 1;
  if (options.as_json) {
    for (std::size_t p = 0; p < problems.size(); ++p) {
      for (const auto& of_solver : set.solutions)
        fmt::print("{}\n", contact_solution_json(problems[p], of_solver[p])
                               .dump(-1, ' ', false, nlohmann::json::error_handler_t::replace));
    }
  }
  const PerformanceProfile profile = set.profile(options.accuracy);
  if (!options.as_json) {
    fmt::print("{}\n{}\n",
               profile
                   .table(fmt::format("Performance profiles: CPU time from {} to a violation of {:g}",
                                      options.from_guess ? "the guess" : "zero", options.accuracy))
                   .text(),
               internal_force_table(problems, set, options.accuracy).text());
  }
  if (options.svg.empty()) return;
  const std::filesystem::path file(options.svg);
  if (file.extension() != ".svg") throw InputError("--svg", options.svg, "a name that ends with .svg is required");
  const FigureFolder folder(file.has_parent_path() ? file.parent_path().string() : ".");
  const std::string caption = "Performance profiles of Dolan and Moré";
  draw_chart(folder, profile.chart("profile", file.stem().string(), "Performance profiles", caption));
  if (!options.as_json) fmt::print("figure: {}\n", options.svg);
}

void add_solve(CLI::App& contacts, int& exit_code) {
  static SolveOptions options;
  static bool each = false;
  auto* command = contacts.add_subcommand("solve", "solve contact problems with every contact solver and compare them");
  command
      ->add_option("paths", options.paths,
                   "FCLib files, files with one JSON problem per line (.json, .jsonl), or folders of them")
      ->required();
  command
      ->add_option("--solver", options.solvers,
                   "contact solver, as in the option solver= of a method, for example lemke,facets=16; may be repeated "
                   "(default: all; lemke up to 100 contacts)")
      ->allow_extra_args(false);
  command->add_flag("--guess", options.from_guess, "start from the guess in the file instead of zero");
  command->add_flag("--each", each, "print each problem, even if there are more than 8");
  command->add_flag("--json", options.as_json, "print one line of JSON per problem and solver instead of tables");
  command
      ->add_option(
          "--accuracy", options.accuracy,
          "relative violation of the laws up to which a problem counts as solved in performance profiles (default: "
          "1e-8)")
      ->check(positive_number());
  command->add_option("--min-contacts", options.least_contacts, "ignore problems with fewer contacts (default: 1)")
      ->check(CLI::Range(1, 1'000'000));
  command->add_option("--svg", options.svg, "write a figure of the performance profiles");
  command->footer(
      "More than 8 problems are summarised: conditioning, performance profiles, internal forces.\n"
      "Examples:\n"
      "  ricochet contacts solve pile.hdf5 --solver newton --solver lemke,facets=16\n"
      "  ricochet contacts solve out/contacts --svg out/profile.svg");
  command->callback([&exit_code] {
    constexpr std::size_t kMostOneByOne = 8;
    std::vector<StoredContactProblem> problems;
    for (const auto& path : options.paths) std::ranges::move(read_contact_problems(path), std::back_inserter(problems));
    std::erase_if(problems, [](const auto& stored) {
      return static_cast<int>(stored.problem.contacts.size()) < options.least_contacts;
    });
    if (problems.empty())
      throw InputError("--min-contacts", options.least_contacts, "no problem has that many contacts");
    if (each || (problems.size() <= kMostOneByOne && options.svg.empty()))
      solve_each(options, problems, exit_code);
    else
      solve_together(options, problems, exit_code);
  });
}

struct RecordOptions {
  std::string folder, method = "moreau_jean";
  int steps = 300, most = 40;
};

void record(const RecordOptions& options) {
  require_writable_folder("contact problems", options.folder);
  std::filesystem::create_directories(options.folder);
  std::size_t total = 0;
  const auto sets =
      sample_scenes(options.method, options.steps, options.most, [&](const std::string& scene, std::size_t n) {
        fmt::print("{:32} {}\n", scene, n);
        total += n;
      });
  for (const auto& problems : sets) {
    std::string name = problems.front().title.substr(0, problems.front().title.find(',')), text;
    std::ranges::replace(name, ' ', '_');
    for (const auto& stored : problems) text += contact_problem_json(stored).dump() + "\n";
    write_text("contact problems", std::filesystem::path(options.folder) / (name + ".jsonl"), text);
  }
  fmt::print("{} contact problems in {}\n", total, options.folder);
}

void add_record(CLI::App& contacts) {
  static RecordOptions options;
  auto* command =
      contacts.add_subcommand("record", "record contact problems of all scenes, evenly distributed over their runs");
  command->add_option("folder", options.folder, "folder to be written, with one file per scene")->required();
  command->add_option("-m,--method", options.method, "time-stepping method (default: moreau_jean)");
  command->add_option("-N,--steps", options.steps, "number of steps of each run (default: 300)")
      ->check(CLI::Range(1, 1'000'000));
  command->add_option("--per-scene", options.most, "maximum number of problems per scene (default: 40)")
      ->check(CLI::Range(1, 100'000));
  command->footer(
      "Example:\n  ricochet contacts record out/contacts\n  ricochet contacts solve out/contacts --svg out/profile.svg");
  command->callback([] { record(options); });
}

void add_merit(CLI::App& contacts) {
  static int draws = 100;
  auto* command =
      contacts.add_subcommand("merit", "compare merit functions with true distances on perturbed exact solutions");
  command->add_option("--draws", draws, "number of problems of each kind (default: 100)")
      ->check(CLI::Range(1, 100'000));
  command->footer("Example:\n  ricochet contacts merit");
  command->callback([] {
    const MeritStudy study = run_merit_study(draws);
    fmt::print("{}\n{}\n{}\n", study.values.text(), study.of_velocities.text(), study.of_both.text());
  });
}

void add_impact_laws(CLI::App& contacts) {
  static double restitution = 0.5;
  static int beads = 5;
  auto* command = contacts.add_subcommand(
      "impact-laws", "print the kinetic energy after an impact under each law: which laws create energy");
  command->add_option("-e,--restitution", restitution, "coefficient of restitution of every contact (default: 0.5)")
      ->check(CLI::Range(0.01, 1.0));
  command->add_option("--beads", beads, "number of beads of the longest row (default: 5)")->check(CLI::Range(2, 12));
  command->footer("Example:\n  ricochet contacts impact-laws -e 0.9");
  command->callback([] {
    const ImpactLawStudy study = run_impact_law_study(restitution, beads);
    fmt::print("{}\n{}\n", study.kane.text(), study.cradle.text());
  });
}

}  // namespace

void add_contacts_command(CLI::App& app, int& exit_code) {
  auto* command = app.add_subcommand("contacts", "export, record and solve contact problems of single steps");
  command->footer(
      "Examples:\n"
      "  ricochet contacts export --problem sphere_pile --method moreau_jean --steps 100 -o pile.hdf5\n"
      "  ricochet contacts solve pile.hdf5\n"
      "  ricochet contacts record out/contacts");
  command->require_subcommand(1);
  add_export(*command);
  add_solve(*command, exit_code);
  add_record(*command);
  add_merit(*command);
  add_impact_laws(*command);
}

}  // namespace ricochet
