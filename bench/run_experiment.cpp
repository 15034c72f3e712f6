#include "bench/run_experiment.h"

#include <fmt/format.h>
#include <unistd.h>

#include <filesystem>

#include "bench/environment.h"
#include "bench/experiment_file.h"
#include "bench/experiment_schema.h"
#include "bench/studies/study.h"
#include "problems/input_error.h"

namespace ricochet {
namespace {

using nlohmann::json;

/// As the file and the command line say, with every method by its name. @throws InputError for a document that does not
/// fit the study's schema, with its quick part or without
json changed_document(ExperimentFile experiment, const RunOptions& options, bool& has_quick_part) {
  const Study& study = find_study(experiment.kind());
  const JsonSchema& schema = experiment_schema(study);
  const std::string place = experiment.path + ": ";
  ExperimentFile in_full = experiment;
  in_full.take_quick_part(!options.quick);
  schema.check(in_full.document, place);
  has_quick_part = experiment.take_quick_part(options.quick) || study.reads_quick;
  for (const auto& change : options.changes) experiment.change(change);
  schema.check(experiment.document, place);
  if (!options.selection.empty() && study.name_methods) study.name_methods(experiment.document);
  return experiment.document;
}

std::string quoted(const std::string& text) {
  return text.find_first_of("*'\" []{}") == std::string::npos ? text : fmt::format("'{}'", text);
}

std::string command_of(const std::string& name, const RunOptions& options) {
  std::string command = "ricochet run-experiment " + name;
  if (options.quick) command += " --quick";
  if (!options.with_times) command += " --no-times";
  if (options.time_limit > 0) command += fmt::format(" --time-limit {:g}", options.time_limit);
  if (!options.data.empty()) command += " --data " + options.data;
  for (const auto& method : options.selection.methods) command += " --method " + quoted(method);
  for (const auto& problem : options.selection.problems) command += " --problem " + quoted(problem);
  for (const auto& change : options.changes) command += fmt::format(" --set '{}'", change);
  return command;
}

[[noreturn]] void throw_no_experiment(const ExperimentFile& experiment, const json::exception& error) {
  throw InputError(fmt::format("{}: not an experiment: {}", experiment.path, error.what()));
}

[[noreturn]] void throw_nothing_selected(const ExperimentFile& experiment) {
  throw InputError("--method, --problem", experiment.name, "it has no run that fits both");
}

/// @param option  by which rows are shared, with its value
/// @param alone  value that shares nothing
/// @throws InputError for several processes, or machines, where times are measured
void require_no_times(const Study& study, const json& document, const std::string& option, const std::string& value,
                      const std::string& alone) {
  if (study.times == Times::none) return;
  if (study.times == Times::always)
    throw InputError(option, value,
                     fmt::format("{} is required: experiments of kind {} measure times, which runs beside each other "
                                 "would spoil",
                                 alone, study.kind));
  if (document.value("times", true))
    throw InputError(option, value, "--no-times is required, since runs beside each other would spoil the times");
}

void require_no_times(const Study& study, const json& document, const RunOptions& options) {
  if (options.jobs > 1) require_no_times(study, document, "--jobs", std::to_string(options.jobs), "1");
  if (!options.shard.is_all())
    require_no_times(study, document, "--shard", fmt::format("{}/{}", options.shard.number, options.shard.of), "1/1");
  if (!options.shards.empty()) require_no_times(study, document, "--from-shards", options.shards, "one process");
}

/// What a row says of a run that failed unexpectedly, as soon as it is made.
void tell_failure(const Study& study, const std::string& id, const json& line) {
  if (!study.failure) return;
  if (const std::string reason = study.failure(line); !reason.empty())
    fmt::print(stderr, "{}{}: {}\n", isatty(STDERR_FILENO) != 0 ? "\r\033[K" : "", id, reason);
}

}  // namespace

json experiment_document(const ExperimentFile& experiment, const RunOptions& options) try {
  bool has_quick_part = false;
  json document = changed_document(experiment, options, has_quick_part);
  if (!options.selection.empty() && !select(document, options.selection)) throw_nothing_selected(experiment);
  resolve_paths(document, experiment_schema(find_study(experiment.kind())),
                std::filesystem::path(experiment.path).parent_path());
  if (!options.changes.empty() || !options.selection.empty()) document["id"] = document.value("id", "") + "_part";
  if (options.quick && has_quick_part) document["quick"] = true;
  if (!options.with_times) document["times"] = false;
  if (options.time_limit > 0) document["time_limit"] = options.time_limit;
  if (!options.data.empty()) document["data"] = std::filesystem::absolute(options.data).lexically_normal().string();
  require_no_times(find_study(experiment.kind()), document, options);
  return document;
} catch (const json::exception& error) {
  throw_no_experiment(experiment, error);
}

std::vector<ExperimentFile> selected_parts(const std::vector<ExperimentFile>& parts, const RunOptions& options) {
  if (options.selection.empty()) return parts;
  ListedNames names;
  std::vector<ExperimentFile> selected;
  for (const auto& part : parts) {
    bool has_quick_part = false;
    json document = changed_document(part, options, has_quick_part);
    names.merge(names_in(document));
    if (select(document, options.selection)) selected.push_back(part);
  }
  require_matches(options.selection, names);
  if (selected.empty()) throw_nothing_selected(parts.front());
  return selected;
}

std::string run_experiment(const std::string& name, const RunOptions& options) {
  return run_experiment(read_experiment_file(name), options);
}

std::string run_experiment(const ExperimentFile& experiment, const RunOptions& options) {
  try {
    const Study& study = find_study(experiment.kind());
    const json document = experiment_document(experiment, options);
    const std::string id = document.at("id");
    const json files = file_hashes(document, experiment_schema(study));
    const std::string key = hash_of(document.dump() + files.dump() + program_hash());
    ResultsFile file(options.folder, options.shard.name(id),
                     {{"kind", "header"},
                      {"schema", kResultsSchema},
                      {"study", study.kind},
                      {"experiment", id},
                      {"title", document.value("title", id)},
                      {"description", document.value("description", "")},
                      {"quick", document.value("quick", false)},
                      {"command", command_of(experiment.name, options)},
                      {"environment", environment()},
                      {"files", files},
                      {"key", key}},
                     options.force);
    if (!file.said().empty()) fmt::print(stderr, "{}\n", file.said());
    if (file.is_complete()) return file.path();
    file.set_processes(options.jobs);
    file.set_shard(options.shard);
    if (!options.shards.empty()) file.set_shards(read_shards(options.shards, id, key));
    file.set_observer([&](const json& line) { tell_failure(study, id, line); });
    try {
      study.run(document, file);
      file.finish();
    } catch (const ResultsFile::ShardIsMade&) {
    }
    return file.path();
  } catch (const json::exception& error) {
    throw_no_experiment(experiment, error);
  }
}

}  // namespace ricochet
