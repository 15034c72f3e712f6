#include "bench/fuzz/fuzz.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <chrono>

#include "bench/experiment/study.h"
#include "bench/fuzz/evidence.h"
#include "bench/fuzz/families.h"
#include "bench/measure/environment.h"
#include "bench/rows/progress.h"
#include "bench/rows/results_file.h"
#include "problems/input_error.h"
#include "problems/names.h"

namespace ricochet {
namespace {

std::vector<SceneFamily> chosen_families(const FuzzOptions& options) {
  std::vector<SceneFamily> chosen;
  std::vector<std::string> known;
  for (const auto& family : scene_families()) known.emplace_back(family.name);
  for (const auto& name : options.families) {
    if (std::ranges::find(known, name) == known.end()) throw_unknown_name("family", name, known);
  }
  for (const auto& family : scene_families()) {
    if (options.families.empty() || std::ranges::find(options.families, family.name) != options.families.end())
      chosen.push_back(family);
  }
  return chosen;
}

/// Every finding; of the scenes that fesd_adaptive declines the first two per reason.
bool is_new_evidence(const FuzzScene& scene, const std::vector<FuzzScene>& before) {
  if (is_finding(scene.verdict)) return true;
  const FuzzResult& adaptive = scene.results.front();
  if (adaptive.succeeded()) return false;
  return std::ranges::count_if(before, [&](const FuzzScene& other) {
           return other.results.front().reason_class() == adaptive.reason_class();
         }) < 2;
}

}  // namespace

void FuzzOptions::validate() const {
  chosen_families(*this);
}

std::vector<FuzzScene> run_fuzz(const FuzzOptions& options) {
  const auto begin = std::chrono::steady_clock::now();
  const std::vector<SceneFamily> families = chosen_families(options);
  const std::string name = fmt::format("fuzz_{}", options.seed);
  const std::string key =
      fmt::format("{} {} {} {} {} {}", program_hash(), options.seed, options.scenes, fmt::join(options.families, " "),
                  options.judge.time_limit, options.judge.proof_limit);
  ResultsFile file(options.folder, name,
                   {{"kind", "header"},
                    {"schema", kResultsSchema},
                    {"study", "fuzz"},
                    {"experiment", name},
                    {"title", "Random scenes"},
                    {"description", "Random scenes, on which methods that share little are compared"},
                    {"command", options.command_line},
                    {"environment", environment()},
                    {"key", hash_of(key)}});
  if (file.is_complete()) return read_results(file.path()).all<FuzzScene>();

  std::vector<FuzzScene> done;
  Progress progress(name);
  for (int k = 0; k < options.scenes; ++k) {
    const double spent = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
    if (options.time > 0 && spent >= options.time) return done;
    const auto n = static_cast<int>(families.size());
    const SceneFamily& family = families[static_cast<std::size_t>(k % n)];
    done.push_back(file.row<FuzzScene>([&] {
      const auto scene = random_scene(family, options.seed, k / n);
      FuzzScene result = judge(scene, options.judge);
      result.family = family.name;
      result.seed = options.seed;
      result.number = k / n;
      if (is_new_evidence(result, done))
        result.file = save_evidence(scene, result, options.folder, options.minimise_time, options.judge);
      return result;
    }));
    progress.update(static_cast<double>(k + 1) / options.scenes, fmt::format("{} {}", family.name, k / n));
  }
  progress.finish();
  file.finish();
  return done;
}

namespace {

void show_fuzz(const Results& results, Section& section) {
  const auto scenes = results.all<FuzzScene>();
  section.result("verdicts", fuzz_table(scenes));
  section.result("reasons", fuzz_reasons(scenes));
  section.result("accuracy", fuzz_accuracy(scenes));
  section.failures("findings", fuzz_findings(scenes));
}

const bool fuzz_is_registered = register_study(
    {.kind = "fuzz",
     .summary = "random scenes, on which methods that share little are compared: by `ricochet fuzz`",
     .fields = {},
     .rows = {FuzzScene::kKind},
     .run =
         [](const nlohmann::json& experiment, ResultsFile&) {
           throw InputError("kind", experiment.at("kind").dump(), "`ricochet fuzz` draws the scenes of this kind");
         },
     .show = show_fuzz,
     .unexpected_failures = {}});

}  // namespace
}  // namespace ricochet
