#pragma once

#include <functional>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

namespace ricochet {

/// A JSON Schema (draft 2020-12) that a JSON file has to satisfy; editors and other programs can use the same schema.
/// Supported keywords are type, enum, required, properties, additionalProperties, items, minItems, maxItems, minimum,
/// maximum, exclusiveMinimum, exclusiveMaximum, minLength, anyOf, and $ref to "#/$defs/NAME". Keywords that only
/// describe are ignored. All others are rejected, because they would not be checked.
class JsonSchema {
 public:
  /// @throws std::logic_error for an unsupported keyword
  explicit JsonSchema(nlohmann::json document);
  static JsonSchema parse(const char* text) { return JsonSchema(nlohmann::json::parse(text)); }

  const nlohmann::json& document() const { return document_; }
  /// The part with this name in "$defs".
  const nlohmann::json& definition(const std::string& name) const { return document_.at("$defs").at(name); }

  /// @param part   part of the schema, or the whole schema
  /// @param place  place of the value, for messages: "scene.json: " for a whole file, "scene.json: contacts[0]" inside
  /// @throws InputError with the field, its value and what is required
  void check(const nlohmann::json& value, const std::string& place, const nlohmann::json& part) const;
  void check(const nlohmann::json& value, const std::string& place) const { check(value, place, document_); }

  /// Calls visit(text, format) for every text with a "format" in a value that satisfies the schema.
  void for_each_text(nlohmann::json& value,
                     const std::function<void(std::string& text, const std::string& format)>& visit) const;

  /// The schema to which $ref refers, or `part` itself.
  const nlohmann::json& resolved(const nlohmann::json& part) const;

 private:
  /// The first alternative of `part` with the type of the value; null for none.
  const nlohmann::json* choice(const nlohmann::json& value, const nlohmann::json& part) const;
  void check_object(const nlohmann::json& value, const std::string& place, const nlohmann::json& part) const;
  void check_list(const nlohmann::json& value, const std::string& place, const nlohmann::json& part) const;
  void check_number(const nlohmann::json& value, const std::string& place, const nlohmann::json& part) const;

  nlohmann::json document_;
};

/// The place of a `field` inside a `place`, which is "scene.json: " or "scene.json: contacts[0]".
std::string place_of(const std::string& place, const std::string& field);

}  // namespace ricochet
