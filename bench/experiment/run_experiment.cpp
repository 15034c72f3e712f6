#include "bench/experiment/run_experiment.h"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <filesystem>
#include <optional>
#include <set>

#include "bench/experiment/experiment_file.h"
#include "bench/experiment/experiment_schema.h"
#include "bench/experiment/study.h"
#include "bench/measure/environment.h"
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
  if (options.times != TimesMark::unspecified) command += " --times " + to_string(options.times);
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
  throw InputError("--method, --problem", experiment.name, "no run matches all patterns");
}

bool measures_times(const Study& study, const json& document) {
  return study.times != Times::none && document.value("times", true);
}

/// Reason why rows cannot be shared as the options require; empty if they can.
/// @param alone  value of the option that shares nothing
/// @param marks  options that allow times
std::string reason_not_shared(const Study& study, const json& document, TimesMark mark, const std::string& alone,
                              const std::string& marks) {
  const bool is_marked = mark != TimesMark::unspecified;
  switch (study.times) {
    case Times::none:
      return "";
    case Times::session:
      return fmt::format(
          "{} is required: experiments of kind {} measure all times in one session, which alone can "
          "compare them",
          alone, study.kind);
    case Times::always:
      if (is_marked) return "";
      return fmt::format("{}{} is required: experiments of kind {} say nothing without times", marks,
                         document.value("times", true) ? "" : ", and not --no-times,", study.kind);
    case Times::in_rows:
    case Times::after:
      if (is_marked || !document.value("times", true)) return "";
      return fmt::format("--no-times is required, or {}, since runs beside each other would spoil the times", marks);
  }
  return "";
}

/// @throws InputError for several processes, or machines, where times are measured without --times
void require_shareable(const Study& study, const json& document, const RunOptions& options) {
  const auto require = [&](const std::string& option, const std::string& value, const std::string& alone,
                           const std::string& marks) {
    const std::string reason = reason_not_shared(study, document, options.times, alone, marks);
    if (!reason.empty()) throw InputError(option, value, reason);
  };
  const std::string any = "--times exclusive or --times shared";
  if (options.jobs > 1) {
    const bool is_beside = study.times == Times::in_rows || study.times == Times::always;
    require("--jobs", std::to_string(options.jobs), "1", is_beside ? "--times shared" : any);
    if (is_beside && measures_times(study, document) && options.times == TimesMark::exclusive)
      throw InputError(
          "--times", "exclusive",
          fmt::format("shared is required with --jobs {}, because its processes run at the same time", options.jobs));
  }
  if (!options.shard.is_all())
    require("--shard", fmt::format("{}/{}", options.shard.number, options.shard.of), "1/1", any);
  if (!options.shards.empty() && (study.times == Times::session || study.times == Times::after))
    require("--from-shards", options.shards, "one process", any);
}

/// Rows of shards, and what their headers say of their times: the merge has measured none but those after the pieces.
ShardRows take_shards(const RunOptions& options, const Study& study, const json& document, json& header) {
  std::vector<json> headers;
  ShardRows rows = read_shards(options.shards, header.at("experiment"), header.at("key"), headers);
  if (!measures_times(study, document) || study.times == Times::after) return rows;
  TimesMark mark = options.times == TimesMark::shared ? TimesMark::shared : TimesMark::exclusive;
  std::set<std::string> processors;
  for (const json& of_shard : headers) {
    mark = std::min(mark, times_mark(of_shard));
    processors.insert(of_shard.at("environment").value("processor", "unknown"));
  }
  set_times_mark(header, mark);
  header["processors"] = processors;
  return rows;
}

/// Prints the failure of an unexpectedly failed run as soon as its row is made.
void tell_failure(const Study& study, const std::string& id, const json& line) {
  if (!study.failure) return;
  if (const std::string reason = study.failure(line); !reason.empty())
    fmt::print(stderr, "{}{}: {}\n", isatty(STDERR_FILENO) != 0 ? "\r\033[K" : "", id, reason);
}

}  // namespace

TimesMark read_times_mark(const std::string& text) {
  const TimesMark mark = times_mark_of(text);
  if (mark == TimesMark::unspecified) throw InputError("--times", text, "exclusive or shared is required");
  return mark;
}

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
  require_shareable(find_study(experiment.kind()), document, options);
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
    json header = {{"kind", "header"},
                   {"schema", kResultsSchema},
                   {"study", study.kind},
                   {"experiment", id},
                   {"title", document.value("title", id)},
                   {"description", document.value("description", "")},
                   {"quick", document.value("quick", false)},
                   {"command", command_of(experiment.name, options)},
                   {"environment", environment()},
                   {"files", files},
                   {"key", key}};
    if (measures_times(study, document)) set_times_mark(header, options.times);
    std::optional<ShardRows> shards;
    if (!options.shards.empty()) shards = take_shards(options, study, document, header);
    ResultsFile file(options.folder, options.shard.name(id), header, options.force);
    if (!file.message().empty()) fmt::print(stderr, "{}\n", file.message());
    if (file.is_complete()) return file.path();
    file.set_processes(options.jobs);
    file.set_shard(options.shard);
    if (shards) file.set_shards(std::move(*shards));
    file.set_observer([&](const json& line) { tell_failure(study, id, line); });
    try {
      study.run(document, file);
    } catch (const ResultsFile::ShardIsMade&) {
    }
    file.finish();
    return file.path();
  } catch (const json::exception& error) {
    throw_no_experiment(experiment, error);
  }
}

}  // namespace ricochet
