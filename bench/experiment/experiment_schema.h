#pragma once

#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>

#include "bench/experiment/study.h"
#include "problems/json_schema.h"

namespace ricochet {

// Schemas of experiment files: the fields of every experiment, and the fields of its study (Study::fields). Fields that
// several studies have are parts "#/$defs/NAME" of the schema: method, problem, parameters, reference, range.

/// Schema of the experiments of a study.
const JsonSchema& experiment_schema(const Study& study);
/// Schema of an experiment with "parts".
const JsonSchema& experiment_group_schema();

/// One schema for every experiment file, bench/experiments/schema/experiment.schema.json.
nlohmann::ordered_json all_experiments_schema();

/// Makes the paths in an experiment relative to its folder: problems FILE.json#ID, tableaus @FILE of methods, ground
/// truths. A path without a file there is not changed; it is one of the source tree (find_project_file).
/// @param document  that satisfies the schema
void resolve_paths(nlohmann::json& document, const JsonSchema& schema, const std::filesystem::path& folder);

/// Hashes of the files of an experiment by path, after resolve_paths(). Together with its own text and the program they
/// determine its results.
nlohmann::json file_hashes(nlohmann::json document, const JsonSchema& schema);

}  // namespace ricochet
