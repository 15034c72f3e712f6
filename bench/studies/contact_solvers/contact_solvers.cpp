#include <fmt/format.h>

#include <algorithm>
#include <limits>

#include "bench/contacts/contact_sampler.h"
#include "bench/contacts/contact_set_tables.h"
#include "bench/experiment/study.h"
#include "bench/rows/progress.h"
#include "bench/studies/contact_solvers/contact_solve.h"
#include "problems/input_error.h"

namespace ricochet {
namespace {

constexpr int kQuickPerScene = 2;

ContactSolve row_of(const StoredContactProblem& stored, const Conditioning& how_hard, const std::string& solver,
                    bool with_times) {
  const ContactSolution solution = solve_of_set(stored, solver, false, with_times ? Timer::a_few_runs : Timer::one_run);
  ContactSolve row{how_hard, stored.title, solver, ""};
  if (!with_times) row.seconds = std::numeric_limits<double>::quiet_NaN();
  if (!solution.declined.empty()) {
    row.status = "declined";
    row.violation = std::numeric_limits<double>::quiet_NaN();
    return row;
  }
  row.status = solution.status == ContactStatus::solved ? "solved" : reason_of(solution.status);
  row.violation = solution.violation;
  if (with_times) row.seconds = solution.seconds;
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

/// The contact problems of the scene that was asked for last.
class RecordedProblems {
 public:
  RecordedProblems(std::string method, int steps, int per_scene)
      : scenes_(sampled_scenes()), method_(std::move(method)), steps_(steps), per_scene_(per_scene) {}

  std::size_t n_scenes() const { return scenes_.size(); }
  std::string name(std::size_t scene) const { return scenes_[scene].name(); }
  const std::vector<StoredContactProblem>& of(std::size_t scene) {
    if (scene != at_hand_) problems_ = sample_scene(scenes_[scene], method_, steps_, per_scene_);
    at_hand_ = scene;
    return problems_;
  }

 private:
  std::vector<SampledScene> scenes_;
  std::string method_;
  int steps_, per_scene_;
  std::size_t at_hand_ = std::numeric_limits<std::size_t>::max();
  std::vector<StoredContactProblem> problems_;
};

/// A piece is one contact problem, by all solvers side by side. A scene has fewer than "per_scene" where its run is
/// short: the pieces of those that are not there have no rows, so that nobody has to record all of them to count.
void run_contact_solvers(const nlohmann::json& experiment, ResultsFile& file) {
  const auto solvers = solvers_of(experiment, file);
  file.header()["accuracy"] = experiment.at("accuracy");
  const int most = experiment.value("quick", false) ? kQuickPerScene : experiment.at("per_scene").get<int>();
  const bool with_times = experiment.value("times", true);
  RecordedProblems recorded(experiment.at("method"), experiment.at("steps"), most);
  recorded.of(0);  // a method that steps nothing throws here
  const auto per_scene = static_cast<std::size_t>(most), n = recorded.n_scenes() * per_scene;
  Progress progress(experiment.at("id").get<std::string>());
  const auto n_rows = [&](std::size_t k) {
    return k % per_scene < recorded.of(k / per_scene).size() ? solvers.size() : 0;
  };
  const auto solve = [&](std::size_t k) {
    std::vector<ContactSolve> rows;
    const auto& problems = recorded.of(k / per_scene);
    if (k % per_scene >= problems.size()) return rows;
    const StoredContactProblem& stored = problems[k % per_scene];
    const Conditioning how_hard = conditioning_of(stored);
    for (const auto& solver : solvers) rows.push_back(row_of(stored, how_hard, solver, with_times));
    return rows;
  };
  file.sessions<ContactSolve>(n, n_rows, solve, [&](std::size_t k) {
    progress.update(static_cast<double>(k + 1) / static_cast<double>(n), recorded.name(k / per_scene));
  });
}

void show_contact_solvers(const Results& results, Section& section) {
  constexpr int kMany = 4;
  const auto solves = results.all<ContactSolve>();
  const double accuracy = results.header.value("accuracy", 1e-8);
  Table solvers = solver_table(solves, accuracy);
  for (const std::string name : results.header.value("not_built", nlohmann::json::array()))
    solvers.note += fmt::format(" {} was not built.", name);
  section.result("solvers", solvers);
  const bool is_timed = std::ranges::any_of(solves, &ContactSolve::is_timed);
  for (const int least : {1, kMany}) {
    if (!is_timed) break;
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
    "solvers": {"type": "array", "minItems": 1, "items": {"type": "string"}, "description": "Contact solvers, as in the option solver= of a method.", "examples": [["pgs", "lemke,facets=16"]]},
    "accuracy": {"type": "number", "exclusiveMinimum": 0, "description": "Violation of the laws, relative, up to which a problem is solved.", "examples": [1e-8]}
  }
})~";

// The study counts unsolved problems, so that none of them is unexpected.
const bool contact_solvers_is_registered =
    register_study({.kind = "contact_solvers",
                    .summary = "contact problems of single steps of all scenes, by every contact solver",
                    .fields = kContactSolversFields,
                    .rows = {ContactSolve::kKind},
                    .reads_quick = true,
                    .times = Times::in_rows,
                    .run = run_contact_solvers,
                    .show = show_contact_solvers,
                    .unexpected_failures = {}});

}  // namespace
}  // namespace ricochet
