#include <fmt/format.h>

#include <limits>

#include "bench/contacts/contact_sampler.h"
#include "bench/contacts/contact_set_tables.h"
#include "bench/progress.h"
#include "bench/studies/contact_solvers/contact_solve.h"
#include "bench/studies/study.h"
#include "problems/input_error.h"

namespace ricochet {
namespace {

constexpr int kQuickPerScene = 2;

ContactSolve row_of(const StoredContactProblem& stored, const Conditioning& how_hard, const std::string& solver) {
  const ContactSolution solution = solve_of_set(stored, solver);
  ContactSolve row{how_hard};
  row.problem = stored.title;
  row.solver = solver;
  if (!solution.declined.empty()) {
    row.status = "declined";
    row.violation = std::numeric_limits<double>::quiet_NaN();
    return row;
  }
  row.status = solution.status == ContactStatus::solved ? "solved" : reason_of(solution.status);
  row.violation = solution.violation;
  row.seconds = solution.seconds;
  row.pivots = solution.work.pivots;
  row.iterations = solution.work.inner_iterations;
  row.factorizations = solution.work.matrix_factorizations;
  return row;
}

/// Solvers of this build; those that it lacks are said in the header.
std::vector<std::string> solvers_of(const nlohmann::json& experiment, ResultsFile& file) {
  std::vector<std::string> solvers;
  for (const auto& solver : experiment.at("solvers").get<std::vector<std::string>>()) {
    if (solver.starts_with("siconos") && !has_siconos_contact_solver()) {
      file.header()["not_built"].push_back(solver);
      continue;
    }
    contact_solver_options(solver);  // a bad one throws here
    solvers.push_back(solver);
  }
  if (solvers.empty()) throw InputError("solvers", experiment.at("solvers").dump(), "one of this build is required");
  return solvers;
}

void run_contact_solvers(const nlohmann::json& experiment, ResultsFile& file) {
  const auto solvers = solvers_of(experiment, file);
  file.header()["accuracy"] = experiment.at("accuracy");
  const int most = experiment.value("quick", false) ? kQuickPerScene : experiment.at("per_scene").get<int>();
  const auto sets = sample_scenes(experiment.at("method"), experiment.at("steps"), most, [](const auto&, auto) {});
  Progress progress(experiment.at("id").get<std::string>());
  for (std::size_t k = 0; k < sets.size(); ++k) {
    for (const auto& stored : sets[k]) {
      file.rows<ContactSolve>(solvers.size(), [&] {
        const Conditioning how_hard = conditioning_of(stored);
        std::vector<ContactSolve> rows;
        for (const auto& solver : solvers) rows.push_back(row_of(stored, how_hard, solver));
        return rows;
      });
    }
    progress.update(static_cast<double>(k + 1) / static_cast<double>(sets.size()), sets[k].front().title);
  }
}

void show_contact_solvers(const Results& results, Section& section) {
  constexpr int kMany = 4;
  const auto solves = results.all<ContactSolve>();
  const double accuracy = results.header.value("accuracy", 1e-8);
  Table solvers = solver_table(solves, accuracy);
  for (const std::string name : results.header.value("not_built", nlohmann::json::array()))
    solvers.note += fmt::format(" {} was not built.", name);
  section.result("solvers", solvers);
  for (const int least : {1, kMany}) {
    const std::string of = least == 1 ? "" : fmt::format(" with {} contacts or more", least);
    const std::string name = least == 1 ? "profile" : fmt::format("profile_{}_contacts", least);
    const PerformanceProfile profile = contact_profile(solves, least, accuracy);
    if (profile.n_problems() == 0) continue;
    profile.show(
        section, name, "Performance profiles over recorded contact problems" + of,
        fmt::format("Share of {} contact problems{} that are solved from zero, to a violation of the laws of at "
                    "most {:g}, in at most tau times the CPU time of the fastest; one that is not takes "
                    "infinitely long (Dolan, Moré 2002).",
                    profile.n_problems(), of, accuracy),
        results.experiment() + "_" + name);
  }
  section.details("conditioning", recorded_conditioning(solves));
  section.details("scenes", solver_scene_table(solves, accuracy));
}

constexpr const char* kContactSolversFields = R"~({
  "required": ["method", "steps", "per_scene", "solvers", "accuracy"],
  "properties": {
    "method": {"$ref": "#/$defs/method", "description": "Of time stepping, whose contact problems are recorded.", "examples": ["moreau_jean"]},
    "steps": {"type": "integer", "minimum": 1, "description": "Of each run.", "examples": [300]},
    "per_scene": {"type": "integer", "minimum": 1, "description": "Most problems of a scene, evenly over its run.", "examples": [40]},
    "solvers": {"type": "array", "minItems": 1, "items": {"type": "string"}, "description": "As behind solver= of a method.", "examples": [["pgs", "lemke,facets=16"]]},
    "accuracy": {"type": "number", "exclusiveMinimum": 0, "description": "Violation of the laws, relative, up to which a problem is solved.", "examples": [1e-8]}
  }
})~";

// How many problems a solver does not solve is what is counted.
const bool contact_solvers_is_registered =
    register_study({.kind = "contact_solvers",
                    .summary = "contact problems of single steps of all scenes, by every contact solver",
                    .fields = kContactSolversFields,
                    .rows = {ContactSolve::kKind},
                    .reads_quick = true,
                    .run = run_contact_solvers,
                    .show = show_contact_solvers,
                    .surprises = {}});

}  // namespace
}  // namespace ricochet
