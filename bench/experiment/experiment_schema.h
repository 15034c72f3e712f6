#pragma once

#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>

#include "bench/studies/study.h"
#include "problems/json_schema.h"

namespace ricochet {

// What an experiment file may hold: the fields of every experiment, and those that its study states (Study::fields).
// Fields that studies share are parts "#/$defs/NAME" of the schema: method, problem, parameters, reference, range.

/// Of the experiments of a study.
const JsonSchema& experiment_schema(const Study& study);
/// Of an experiment with "parts".
const JsonSchema& experiment_group_schema();

/// One schema for every experiment file, bench/experiments/schema/experiment.schema.json.
nlohmann::ordered_json all_experiments_schema();

/// Files that an experiment names are those beside it: problems FILE.json#ID, tableaus @FILE of methods, ground truths.
/// A name of which there is no file there stays as it is, for a file of the source tree (find_project_file).
/// @param document  that fits the schema
void resolve_paths(nlohmann::json& document, const JsonSchema& schema, const std::filesystem::path& folder);

/// By path, hashes of the files that an experiment names, as resolve_paths() has left them: what its results depend on
/// besides its own text and the program.
nlohmann::json file_hashes(nlohmann::json document, const JsonSchema& schema);

}  // namespace ricochet
