#include "bench/experiment/experiment_schema.h"

#include <algorithm>
#include <map>
#include <optional>

#include "bench/experiment/experiment_file.h"
#include "bench/measure/data_folder.h"
#include "bench/measure/environment.h"
#include "reports/text_file.h"

namespace ricochet {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;
using nlohmann::ordered_json;

constexpr const char* kDraft = "https://json-schema.org/draft/2020-12/schema";

constexpr const char* kCommonFields = R"~({
  "id": {"type": "string", "minLength": 1, "description": "Name of the results file.", "examples": ["my_experiment"]},
  "kind": {"type": "string", "description": "Kind of the study, see `ricochet list studies` (default: method_grid).", "examples": ["zeno"]},
  "title": {"type": "string", "description": "Title of the results.", "examples": ["Order through two impacts"]},
  "description": {"type": "string", "description": "Purpose of the experiment, for the page of the results.", "examples": ["Two balls fall on the floor."]},
  "quick_part": {"type": "object", "description": "Fields that replace those of the file in a --quick run (JSON merge patch, RFC 7396).", "examples": [{"times": false}]},
  "quick": {"type": "boolean", "description": "Set by --quick, if the study has its own short form.", "examples": [true]},
  "times": {"type": "boolean", "description": "false: CPU times are not measured; set by --no-times.", "examples": [false]},
  "time_limit": {"type": "number", "exclusiveMinimum": 0, "description": "Limit of the wall time of a run [s]; set by --time-limit.", "examples": [60]}
})~";

constexpr const char* kGroup = R"~({
  "type": "object", "additionalProperties": false, "required": ["parts"],
  "properties": {
    "id": {"type": "string", "minLength": 1, "description": "Its name.", "examples": ["all_of_mine"]},
    "title": {"type": "string", "description": "Title of the results.", "examples": ["Peers"]},
    "description": {"type": "string", "description": "What is run and why.", "examples": ["Two scenes beside peers."]},
    "parts": {"type": "array", "minItems": 1, "items": {"type": "string"}, "description": "Names of experiments, which are run one after the other.", "examples": [["zeno", "friction_ramp"]]},
    "also_shown": {"type": "array", "items": {"type": "string"}, "description": "Names of experiments whose results are shown on the page if they exist.", "examples": [["scale"]]}
  }
})~";

constexpr const char* kShared = R"~({
  "method": {"type": "string", "minLength": 1, "format": "method", "description": "NAME:ARGUMENT,OPTION=VALUE of `ricochet list methods`; @FILE is a tableau file beside the experiment."},
  "problem": {"type": "string", "minLength": 1, "format": "scene", "description": "A scene of `ricochet list problems`, or FILE.json or FILE.json#ID beside the experiment."},
  "parameters": {"type": "object", "additionalProperties": {"type": "number"}, "description": "Changed parameters of the problem, in its units."},
  "range": {
    "type": "object", "additionalProperties": false, "required": ["from", "to", "per_decade"],
    "description": "A logarithmic grid.",
    "properties": {
      "from": {"type": "number", "exclusiveMinimum": 0, "description": "First value.", "examples": [0.01]},
      "to": {"type": "number", "exclusiveMinimum": 0, "description": "Last value, or the grid ends before it.", "examples": [1e-10]},
      "per_decade": {"type": "number", "exclusiveMinimum": 0, "description": "Values per decade.", "examples": [4]}
    }
  },
  "steps": {
    "anyOf": [
      {"$ref": "#/$defs/range"},
      {"type": "string"},
      {"type": "array", "minItems": 1, "items": {"anyOf": [{"type": "integer", "minimum": 1}, {"type": "string"}, {"$ref": "#/$defs/range"}]}}],
    "description": "Numbers of steps, a range of them, the name of one of the grids, or a list of those."
  },
  "tolerances": {"type": "array", "minItems": 1, "items": {"type": "number", "minimum": 1e-15, "exclusiveMaximum": 1}, "description": "Tolerances of an error-controlled method."}
})~";

/// The fields of a study with those of every experiment.
json object_of(const Study& study) {
  json object = {{"type", "object"}, {"additionalProperties", false}};
  const json own = study.fields.empty() ? json::object() : json::parse(study.fields);
  object["description"] = study.summary;
  object["required"] = own.value("required", json::array());
  object["required"].push_back("id");
  object["properties"] = json::parse(kCommonFields);
  object["properties"].update(own.value("properties", json::object()));
  object["properties"]["kind"]["enum"] = object["properties"]["kind"]["examples"] = {study.kind};
  if (study.kind != kDefaultStudy) object["required"].push_back("kind");
  return object;
}

fs::path beside(const fs::path& folder, const std::string& path) {
  std::error_code error;
  if (path.empty() || fs::path(path).is_absolute() || !fs::exists(folder / path, error)) return path;
  const fs::path found = fs::absolute(folder / path).lexically_normal();
  const fs::path from_here = found.lexically_relative(fs::current_path());
  return from_here.empty() || *from_here.begin() == ".." ? found : from_here;
}

/// The part of `text` between two positions is a path.
std::string with_path(const std::string& text, std::size_t begin, std::size_t end, const fs::path& folder) {
  return text.substr(0, begin) + beside(folder, text.substr(begin, end - begin)).string() + text.substr(end);
}

/// [begin, end) of the path in a text of this format, where it names a file.
std::optional<std::pair<std::size_t, std::size_t>> path_in(const std::string& text, const std::string& format) {
  if (format == "path") return std::pair(std::size_t{0}, text.size());
  if (format == "scene" && text.find(".json") != std::string::npos)
    return std::pair(std::size_t{0}, std::min(text.rfind('#'), text.size()));
  if (const auto at = text.find('@'); format == "method" && at != std::string::npos)
    return std::pair(at + 1, std::min(text.find(',', at), text.size()));
  return std::nullopt;
}

}  // namespace

const JsonSchema& experiment_schema(const Study& study) {
  static std::map<std::string, JsonSchema> schemas;
  const auto known = schemas.find(study.kind);
  if (known != schemas.end()) return known->second;
  json document = object_of(study);
  document["$defs"] = json::parse(kShared);
  return schemas.emplace(study.kind, JsonSchema(std::move(document))).first->second;
}

const JsonSchema& experiment_group_schema() {
  static const JsonSchema schema = JsonSchema::parse(kGroup);
  return schema;
}

ordered_json all_experiments_schema() {
  ordered_json all = {{"$schema", kDraft},
                      {"title", "An experiment of Ricochet"},
                      {"description", "Written by `ricochet schema experiment`. One alternative per study."},
                      {"anyOf", ordered_json::array({ordered_json::parse(kGroup)})},
                      {"$defs", ordered_json::parse(kShared)}};
  for (const Study& study : studies()) {
    if (!study.fields.empty()) all["anyOf"].emplace_back(ordered_json(object_of(study)));
  }
  return all;
}

void resolve_paths(json& document, const JsonSchema& schema, const fs::path& folder) {
  schema.for_each_text(document, [&](std::string& text, const std::string& format) {
    if (const auto place = path_in(text, format)) text = with_path(text, place->first, place->second, folder);
  });
}

json file_hashes(json document, const JsonSchema& schema) {
  json hashes = json::object();
  schema.for_each_text(document, [&](const std::string& text, const std::string& format) {
    const auto place = path_in(text, format);
    if (!place) return;
    const std::string path = text.substr(place->first, place->second - place->first);
    hashes[path] = hash_of(read_text(find_project_file(path)));
  });
  return hashes;
}

}  // namespace ricochet
