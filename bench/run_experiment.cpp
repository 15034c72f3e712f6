#include "bench/run_experiment.h"

#include <fmt/format.h>

#include <filesystem>

#include "bench/environment.h"
#include "bench/experiment_file.h"
#include "bench/experiment_schema.h"
#include "bench/studies/study.h"

namespace ricochet {
namespace {

using nlohmann::json;

/// The document of the file as the command line changes it. @throws InputError for one that does not fit the study's
/// schema, with its quick part or without
json document_of(ExperimentFile experiment, const Study& study, const RunOptions& options) {
  const JsonSchema& schema = experiment_schema(study);
  const std::string place = experiment.path + ": ";
  ExperimentFile in_full = experiment;
  in_full.take_quick_part(!options.quick);
  schema.check(in_full.document, place);
  const bool has_quick_part = experiment.take_quick_part(options.quick) || study.reads_quick;
  for (const auto& change : options.changes) experiment.change(change);
  schema.check(experiment.document, place);
  json document = experiment.document;
  resolve_paths(document, schema, std::filesystem::path(experiment.path).parent_path());
  if (!options.changes.empty()) document["id"] = document.value("id", "") + "_part";
  if (options.quick && has_quick_part) document["quick"] = true;
  if (!options.with_times) document["times"] = false;
  if (options.time_limit > 0) document["time_limit"] = options.time_limit;
  return document;
}

std::string command_of(const std::string& name, const RunOptions& options) {
  std::string command = "ricochet run-experiment " + name;
  if (options.quick) command += " --quick";
  if (!options.with_times) command += " --no-times";
  if (options.time_limit > 0) command += fmt::format(" --time-limit {:g}", options.time_limit);
  for (const auto& change : options.changes) command += fmt::format(" --set '{}'", change);
  return command;
}

}  // namespace

std::string run_experiment(const std::string& name, const RunOptions& options) {
  const ExperimentFile experiment = read_experiment_file(name);
  try {
    const Study& study = find_study(experiment.kind());
    const json document = document_of(experiment, study, options);
    const std::string id = document.at("id");
    const json files = file_hashes(document, experiment_schema(study));
    ResultsFile file(options.folder, id,
                     {{"kind", "header"},
                      {"schema", kResultsSchema},
                      {"study", study.kind},
                      {"experiment", id},
                      {"title", document.value("title", id)},
                      {"description", document.value("description", "")},
                      {"quick", document.value("quick", false)},
                      {"command", command_of(name, options)},
                      {"environment", environment()},
                      {"files", files},
                      {"key", hash_of(document.dump() + files.dump() + program_hash())}},
                     options.force);
    if (!file.said().empty()) fmt::print(stderr, "{}\n", file.said());
    if (file.is_complete()) return file.path();
    study.run(document, file);
    file.finish();
    return file.path();
  } catch (const json::exception& error) {
    throw InputError(fmt::format("{}: not an experiment: {}", experiment.path, error.what()));
  }
}

}  // namespace ricochet
