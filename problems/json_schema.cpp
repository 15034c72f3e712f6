#include "problems/json_schema.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <map>
#include <set>
#include <stdexcept>

#include "problems/input_error.h"
#include "problems/names.h"

namespace ricochet {
namespace {

using nlohmann::json;

constexpr std::size_t kMostOfAValue = 80;  // characters of it in a message

/// The keywords of a schema, and which of them contain schemas: one, a list, or an object of them.
const std::map<std::string, std::string> kWords = {
    {"type", ""},      {"enum", ""},        {"required", ""},         {"minItems", ""},
    {"maxItems", ""},  {"minimum", ""},     {"maximum", ""},          {"exclusiveMinimum", ""},
    {"minLength", ""}, {"$ref", ""},        {"exclusiveMaximum", ""}, {"$schema", ""},
    {"title", ""},     {"description", ""}, {"examples", ""},         {"default", ""},
    {"format", ""},    {"$id", ""},         {"items", "one"},         {"additionalProperties", "one"},
    {"anyOf", "list"}, {"$defs", "object"}, {"properties", "object"}};

void require_known_words(const json& schema) {
  if (schema.is_boolean()) return;
  for (const auto& [word, value] : schema.items()) {
    const auto known = kWords.find(word);
    if (known == kWords.end()) throw std::logic_error("JSON schema: '" + word + "' is not known");
    if (known->second == "one") {
      require_known_words(value);
    } else if (known->second == "list" || known->second == "object") {
      for (const json& part : value) require_known_words(part);
    }
  }
}

std::vector<std::string> types_of(const json& schema) {
  if (!schema.contains("type")) return {};
  if (schema["type"].is_string()) return {schema["type"]};
  return schema["type"];
}

bool has_type(const json& value, const std::string& type) {
  if (type == "object") return value.is_object();
  if (type == "array") return value.is_array();
  if (type == "string") return value.is_string();
  if (type == "boolean") return value.is_boolean();
  if (type == "null") return value.is_null();
  if (type == "number") return value.is_number();
  return value.is_number_integer();
}

bool has_type_of(const json& value, const json& schema) {
  const auto types = types_of(schema);
  return types.empty() || std::ranges::any_of(types, [&](const auto& type) { return has_type(value, type); });
}

std::string words_of(const std::vector<std::string>& types) {
  static const std::map<std::string, std::string> words = {
      {"object", "an object"}, {"array", "a list"},           {"string", "a text in quotes"},
      {"number", "a number"},  {"integer", "a whole number"}, {"boolean", "true or false"},
      {"null", "null"}};
  std::vector<std::string> list;
  for (const auto& type : types) {
    if (std::ranges::find(list, words.at(type)) == list.end()) list.push_back(words.at(type));
  }
  return fmt::format("{}", fmt::join(list, " or "));
}

std::string shown(const json& value) {
  if (value.is_structured()) return value.type_name();
  std::string text = value.dump();
  return text.size() > kMostOfAValue ? text.substr(0, kMostOfAValue) + "..." : text;
}

}  // namespace

std::string place_of(const std::string& place, const std::string& field) {
  return place + (place.empty() || place.ends_with(": ") ? "" : ".") + field;
}

JsonSchema::JsonSchema(json document) : document_(std::move(document)) {
  require_known_words(document_);
}

const json& JsonSchema::resolved(const json& part) const {
  if (!part.contains("$ref")) return part;
  const std::string prefix = "#/$defs/", reference = part["$ref"];
  return resolved(definition(reference.substr(prefix.size())));
}

const json* JsonSchema::choice(const json& value, const json& part) const {
  for (const json& other : part["anyOf"]) {
    if (const json& candidate = resolved(other); has_type_of(value, candidate)) return &candidate;
  }
  return nullptr;
}

void JsonSchema::for_each_text(json& whole, const std::function<void(std::string&, const std::string&)>& visit) const {
  const std::function<void(json&, const json&)> walk = [&](json& value, const json& unresolved) {
    const json& part = resolved(unresolved);
    if (part.contains("anyOf")) {
      if (const json* meant = choice(value, part)) walk(value, *meant);
    } else if (value.is_string() && part.contains("format")) {
      visit(value.get_ref<std::string&>(), part["format"]);
    } else if (value.is_array() && part.contains("items")) {
      for (json& entry : value) walk(entry, part["items"]);
    } else if (value.is_object()) {
      for (auto& [field, entry] : value.items()) {
        if (part.contains("properties") && part["properties"].contains(field))
          walk(entry, part["properties"][field]);
        else if (part.contains("additionalProperties") && part["additionalProperties"].is_object())
          walk(entry, part["additionalProperties"]);
      }
    }
  };
  walk(whole, document_);
}

void JsonSchema::check(const json& value, const std::string& place, const json& unresolved) const {
  const json& part = resolved(unresolved);
  if (part.contains("anyOf")) {
    // The first alternative of its type was probably intended: its message is the most useful.
    if (const json* meant = choice(value, part)) return check(value, place, *meant);
    std::vector<std::string> types;
    for (const json& other : part["anyOf"]) {
      for (const auto& type : types_of(resolved(other))) types.push_back(type);
    }
    throw InputError(place, shown(value), words_of(types) + " is required");
  }
  if (!has_type_of(value, part)) throw InputError(place, shown(value), words_of(types_of(part)) + " is required");
  if (part.contains("enum") && std::ranges::find(part["enum"], value) == part["enum"].end()) {
    std::vector<std::string> allowed;
    for (const json& choice : part["enum"]) allowed.push_back(choice.dump());
    throw InputError(place, shown(value), fmt::format("{} is required", fmt::join(allowed, " or ")));
  }
  if (value.is_string() && part.contains("minLength") && value.get_ref<const std::string&>().empty())
    throw InputError(place, "\"\"", "a text is required");
  if (value.is_number()) check_number(value, place, part);
  if (value.is_array()) check_list(value, place, part);
  if (value.is_object()) check_object(value, place, part);
}

void JsonSchema::check_number(const json& value, const std::string& place, const json& part) const {
  const double x = value;
  bool is_allowed = true;
  std::vector<std::string> bounds;
  const auto require = [&](const char* word, const char* sign, const auto& holds) {
    if (!part.contains(word)) return;
    bounds.push_back(fmt::format("{} {}", sign, part[word].dump()));
    is_allowed = is_allowed && holds(x, part[word].get<double>());
  };
  require("minimum", ">=", std::greater_equal<>());
  require("exclusiveMinimum", ">", std::greater<>());
  require("maximum", "<=", std::less_equal<>());
  require("exclusiveMaximum", "<", std::less<>());
  if (is_allowed) return;
  const char* kind = part["type"] == "integer" ? "whole number" : "number";
  throw InputError(place, value.dump(), fmt::format("a {} {} is required", kind, fmt::join(bounds, " and ")));
}

void JsonSchema::check_list(const json& value, const std::string& place, const json& part) const {
  const std::size_t least = part.value("minItems", 0), most = part.value("maxItems", value.size());
  if (value.size() < least)
    throw InputError(place + ", number of entries", value.size(),
                     fmt::format("at least {} required", least == 1 ? "1 is" : fmt::format("{} are", least)));
  if (value.size() > most)
    throw InputError(place + ", number of entries", value.size(), fmt::format("at most {} are possible", most));
  if (!part.contains("items")) return;
  for (std::size_t k = 0; k < value.size(); ++k) check(value[k], fmt::format("{}[{}]", place, k), part["items"]);
}

void JsonSchema::check_object(const json& value, const std::string& place, const json& part) const {
  const json none = json::object();
  const json& properties = part.contains("properties") ? part["properties"] : none;
  for (const auto& [field, entry] : value.items()) {
    if (properties.contains(field)) {
      check(entry, place_of(place, field), properties[field]);
    } else if (part.contains("additionalProperties") && part["additionalProperties"].is_object()) {
      check(entry, place_of(place, field), part["additionalProperties"]);
    } else if (part.contains("additionalProperties")) {  // false
      throw_unknown_name("field of " + place.substr(0, place.find_last_not_of(": ") + 1), field,
                         keys_of(properties.get<std::map<std::string, json>>()));
    }
  }
  for (const std::string field : part.value("required", json::array())) {
    if (!value.contains(field)) throw InputError(place_of(place, field) + ": this field is missing");
  }
}

}  // namespace ricochet
