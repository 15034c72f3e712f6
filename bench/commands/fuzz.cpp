#include "bench/fuzz/fuzz.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <CLI/CLI.hpp>
#include <fstream>

#include "bench/commands/commands.h"
#include "bench/commands/number_checks.h"
#include "bench/fuzz/families.h"
#include "problems/input_error.h"
#include "problems/input_text.h"
#include "reports/text_file.h"

namespace ricochet {
namespace {

struct FuzzArguments {
  FuzzOptions fuzz;
  int number = -1;
  std::string scene;
  bool print = false;
};

std::string fuzz_command_line(const FuzzOptions& options) {
  std::string text = fmt::format("ricochet fuzz --scenes {} --seed {}", options.scenes, options.seed);
  for (const auto& family : options.families) text += " --family " + family;
  return text +
         fmt::format(" --time-limit {:g} --proof-limit {:g}", options.judge.time_limit, options.judge.proof_limit);
}

nlohmann::ordered_json read_scene(const std::string& path) {
  const std::string text = read_input_text(path, "--scene");
  if (!parse_input_json(text, path).is_object()) throw InputError("--scene", path, "an object is required");
  const auto scene = nlohmann::ordered_json::parse(text, nullptr, true, /*ignore_comments=*/true);
  return scene.contains("problem") ? scene["problem"] : scene;
}

nlohmann::ordered_json chosen_scene(const FuzzArguments& options) {
  if (!options.scene.empty()) return read_scene(options.scene);
  if (options.fuzz.families.size() != 1) throw InputError("--number", options.number, "needs exactly one --family");
  options.fuzz.validate();
  for (const auto& family : scene_families()) {
    if (family.name == options.fuzz.families.front()) return random_scene(family, options.fuzz.seed, options.number);
  }
  return {};
}

void print_opinions(const FuzzScene& scene) {
  fmt::print("verdict    {}{}{}\n", word_of(scene.verdict), scene.detail.empty() ? "" : ": ", scene.detail);
  fmt::print("difference {:.2e}, sensitivity {:.2e}\n", scene.difference, scene.sensitivity);
  const FuzzTruth& truth = scene.truth;
  if (!truth.grade.empty())
    fmt::print("ricochet truth --scene SCENE\n  {:.3f} s, {}{}{}\n", truth.seconds, truth.grade,
               truth.is_known() ? fmt::format(" to {} decimals", truth.decimals) : "",
               truth.reason.empty() ? "" : ": " + truth.reason);
  if (truth.is_known()) fmt::print("  q {:.12g}\n  v {:.12g}\n", fmt::join(truth.q, "  "), fmt::join(truth.v, "  "));
  for (const auto& o : scene.results) {
    fmt::print("{}\n  {:.3f} s, {}\n", o.command("SCENE"), o.seconds,
               o.succeeded() ? fmt::format("error allowed {:.1e}", o.error) : o.reason_class());
    if (o.succeeded())
      fmt::print("  q {:.12g}\n  v {:.12g}\n", fmt::join(o.q, "  "), fmt::join(o.v, "  "));
    else
      fmt::print("  {}\n", o.message);
  }
}

}  // namespace

void add_fuzz_command(CLI::App& app, int& exit_code) {
  static FuzzArguments options;
  auto* command = app.add_subcommand(
      "fuzz",
      "compare fesd_adaptive, fesd, CVODE, Moreau-Jean, event_driven and, where forces bend or jump, five others on "
      "random scenes, with a proof where there is one; exit code 1 if they disagree without an explanation, or one is "
      "wrong or hangs");
  command->add_option("--scenes", options.fuzz.scenes, "number of scenes")
      ->capture_default_str()
      ->check(positive_number());
  command->add_option("--seed", options.fuzz.seed, "seed of the scenes")->capture_default_str();
  command->add_option("--time", options.fuzz.time, "wall time after which no new scene is started [s]")
      ->check(non_negative_number());
  command->add_option("--family", options.fuzz.families, "draw only this family of scenes; may be repeated")
      ->allow_extra_args(false);
  command
      ->add_option("--time-limit", options.fuzz.judge.time_limit,
                   "limit of the wall time of a run [s]; after twice this time it is killed")
      ->capture_default_str()
      ->check(positive_number());
  command
      ->add_option("--proof-limit", options.fuzz.judge.proof_limit,
                   "limit of the wall time of a proof [s], ten times as long where methods disagree; 0: no proofs")
      ->capture_default_str()
      ->check(non_negative_number());
  command
      ->add_option("--minimise-time", options.fuzz.minimise_time, "limit of the wall time for minimising a scene [s]")
      ->capture_default_str()
      ->check(non_negative_number());
  command->add_option("--number", options.number, "judge only the scene of the family with this number");
  command->add_option("--scene", options.scene, "judge only the scene in this file");
  command->add_flag("--print", options.print, "with --number: print the scene and run nothing");
  command->add_option("-o,--out", options.fuzz.folder, "folder of results and scenes")->capture_default_str();
  command->footer(
      "Examples:\n"
      "  ricochet fuzz --scenes 20 --seed 1 -o out/fuzz\n"
      "  ricochet fuzz --family columns --number 17 --print");
  command->callback([&exit_code] {
    if (options.number >= 0 || !options.scene.empty()) {
      const auto scene = chosen_scene(options);
      if (options.print) {
        fmt::print("{}\n", scene.dump(1));
        return;
      }
      const FuzzScene result = judge(scene, options.fuzz.judge);
      print_opinions(result);
      if (is_finding(result.verdict)) exit_code = 1;
      return;
    }
    require_writable_folder("results folder", options.fuzz.folder);
    options.fuzz.command_line = fuzz_command_line(options.fuzz);
    const std::vector<FuzzScene> scenes = run_fuzz(options.fuzz);
    fmt::print("{}\n{}\n", fuzz_table(scenes).text(), fuzz_reasons(scenes).list());
    if (const Table accuracy = fuzz_accuracy(scenes); !accuracy.rows.empty()) fmt::print("{}\n", accuracy.text());
    if (const Table findings = fuzz_findings(scenes); !findings.rows.empty()) {
      fmt::print("{}\n", findings.list());
      exit_code = 1;
    }
    if (static_cast<int>(scenes.size()) < options.fuzz.scenes)
      fmt::print("{} of {} scenes: time limit reached; repeat the command to continue\n", scenes.size(),
                 options.fuzz.scenes);
    fmt::print("results: {}\n", options.fuzz.folder);
  });
}

}  // namespace ricochet
