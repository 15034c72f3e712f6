#include <filesystem>

#include "bench/experiment/study.h"
#include "bench/measure/data_folder.h"
#include "bench/measure/problem_choice.h"
#include "problems/input_text.h"
#include "reference/certified/certified_motion.h"

/// @file
/// Which scenes have a proven motion: grade, decimals and cost of `ricochet truth` for every compiled scene and for the
/// scenes of files.

namespace ricochet::proofs {
namespace {

namespace fs = std::filesystem;
namespace certified = reference::certified;
using certified::CertifiedMotion;
using certified::Grade;
using nlohmann::json;

/// The proof of one scene.
struct Proof {
  static constexpr const char* kKind = "proof";

  std::string group;  ///< "compiled", or the file or folder of the experiment
  std::string scene;  ///< id, or FILE.json#ID
  std::string grade;  ///< name_of(Grade)
  bool bends = false;
  int decimals = 0, events = 0, steps = 0;
  long bits = 0;
  double seconds = 0;      ///< wall time
  std::string assumption;  ///< the first
  std::string reason;      ///< why it is open

  bool is_known() const { return grade == "proven" || grade == "assumed"; }
};
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE_WITH_DEFAULT(Proof, group, scene, grade, bends, decimals, events, steps, bits,
                                                seconds, assumption, reason)

struct Scene {
  std::string group, name;
};

/// The scenes of a file: its cases, or the file itself.
void add_scenes_of(const fs::path& file, const std::string& group, std::vector<Scene>& list) {
  const json document = read_input_json(file, "scene file");
  if (!document.contains("cases")) {
    if (document.contains("problem") || document.contains("T"))  // no tableau
      list.push_back({group, file});
    return;
  }
  for (const json& entry : document["cases"]) {
    if (entry.contains("problem")) list.push_back({group, fmt::format("{}#{}", file.string(), entry.at("id"))});
  }
}

std::vector<Scene> scenes_of(const json& experiment) {
  std::vector<Scene> list;
  for (const auto& entry : scenes()) list.push_back({entry.solution.empty() ? "compiled" : "ground truth", entry.id});
  for (const std::string group : experiment.at("files")) {
    const fs::path place = find_project_file(group);
    std::vector<fs::path> files{place};
    if (fs::is_directory(place)) {
      files.clear();
      for (const auto& entry : fs::directory_iterator(place))
        if (entry.path().extension() == ".json") files.push_back(entry.path());
      std::ranges::sort(files);
    }
    for (const auto& file : files) add_scenes_of(file, group, list);
  }
  return list;
}

Proof prove(const Scene& scene, const certified::Options& options, bool with_times) {
  const ProblemChoice choice{.problem = scene.name};
  const CertifiedMotion motion = certified::certified_motion(*choice.make_problem(), options);
  Proof row;
  row.group = scene.group;
  row.scene = choice.is_scene_file() ? scene.name.substr(scene.name.rfind('/') + 1) : scene.name;
  row.grade = name_of(motion.grade);
  row.bends = motion.bends;
  row.decimals = motion.grade == Grade::open ? 0 : motion.decimals();
  row.events = static_cast<int>(motion.events.size());
  row.steps = motion.n_steps;
  row.bits = motion.bits;
  row.seconds = with_times ? motion.seconds : std::numeric_limits<double>::quiet_NaN();
  if (!motion.assumptions.empty()) row.assumption = motion.assumptions.front();
  row.reason = motion.reason;
  return row;
}

void run_proofs(const json& experiment, ResultsFile& file) {
  if (!certified::can_certify()) file.header()["not_built"].push_back("proofs");
  const certified::Options options{.digits = experiment.at("digits"), .max_seconds = experiment.at("seconds")};
  const bool with_times = experiment.value("times", true);
  const auto list = scenes_of(experiment);
  file.each<Proof>(
      list.size(), [&](std::size_t k) { return prove(list[k], options, with_times); }, [](std::size_t) {});
}

/// A group of scenes, or all of them.
struct Coverage {
  std::string group;
  std::vector<Proof> proofs;

  int count(const std::string& grade) const {
    return static_cast<int>(std::ranges::count(proofs, grade, &Proof::grade));
  }
  int bends() const { return static_cast<int>(std::ranges::count(proofs, true, &Proof::bends)); }
  double share() const {  // of those without corners and jumps
    return 100.0 * (count("proven") + count("assumed")) / (static_cast<double>(proofs.size()) - bends());
  }
  double within_a_second() const {
    const auto known = rows_where(proofs, &Proof::is_known);
    const auto fast = rows_where(known, [](const Proof& p) { return p.seconds <= 1; });
    return 100.0 * static_cast<double>(fast.size()) / static_cast<double>(known.size());
  }
};

void show_proofs(const Results& results, Section& section) {
  const auto proofs = results.all<Proof>();
  std::vector<Coverage> groups;
  for (const auto& group : different(proofs, &Proof::group))
    groups.push_back({group, rows_where(proofs, [&](const Proof& p) { return p.group == group; })});
  groups.push_back({"all", proofs});
  static const std::vector<Column<Coverage>> coverage = {
      {"scenes of", &Coverage::group},
      {"scenes", "", "{}", [](const Coverage& c) { return c.proofs.size(); }},
      {"proven", "", "{}", [](const Coverage& c) { return c.count("proven"); }},
      {"assumed", "", "{}", [](const Coverage& c) { return c.count("assumed"); }},
      {"computed", "", "{}", [](const Coverage& c) { return c.count("computed"); }},
      {"open", "", "{}", [](const Coverage& c) { return c.count("open") - c.bends(); }},
      {"bend or jump", "", "{}", &Coverage::bends},
      {"known", "%", "{:.0f}", &Coverage::share},
      {"of them within 1 s", "%", "{:.0f}", &Coverage::within_a_second},
  };
  section.result(
      "coverage",
      table_of("Scenes with a proven motion", coverage, groups,
               "Grades: reference/certified/README.md. Known: proven or assumed, of the scenes whose formulas "
               "neither bend nor jump."));
  static const std::vector<Column<Proof>> columns = {
      {"scene", &Proof::scene},
      {"of", &Proof::group},
      {"grade", &Proof::grade},
      {"decimals", "", "{}", [](const Proof& p) { return when(p.grade != "open", p.decimals); }},
      {"events", "", "{}", &Proof::events},
      {"steps", "", "{}", &Proof::steps},
      {"bits", "", "{}", &Proof::bits},
      {"time", "s", "{:.3f}", &Proof::seconds},
      {"reason or assumption", [](const Proof& p) { return p.reason.empty() ? p.assumption : p.reason; }},
  };
  section.result("proofs", table_of("Every scene", columns, proofs));
}

constexpr const char* kFields = R"~({
  "required": ["digits", "seconds", "files"],
  "properties": {
    "digits": {"type": "integer", "minimum": 1, "description": "Proven decimal places that are wanted.", "examples": [30]},
    "seconds": {"type": "number", "exclusiveMinimum": 0, "description": "Limit of the wall time of a proof [s].", "examples": [10]},
    "files": {"type": "array", "items": {"type": "string"}, "description": "Scene files, and folders of scene files, besides the compiled scenes.", "examples": [["reference/data/moving_scenes.json"]]}
  }
})~";

const bool registered = register_study({.kind = "proofs",
                                        .summary = "which scenes have a proven motion",
                                        .fields = kFields,
                                        .rows = {Proof::kKind},
                                        .times = Times::in_rows,
                                        .run = run_proofs,
                                        .show = show_proofs,
                                        .unexpected_failures = {}});

}  // namespace
}  // namespace ricochet::proofs
