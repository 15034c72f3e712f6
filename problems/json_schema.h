#pragma once

#include <functional>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

namespace ricochet {

/// What a JSON file may hold, as JSON Schema (draft 2020-12) says it, so that editors and other programs can check a
/// file as we do. Known are type, enum, required, properties, additionalProperties, items, minItems, maxItems, minimum,
/// maximum, exclusiveMinimum, exclusiveMaximum, minLength, anyOf, and $ref to "#/$defs/NAME"; words that only describe
/// are skipped; any other is refused, since what it says would not be checked.
class JsonSchema {
 public:
  /// @throws std::logic_error for a word that is not known
  explicit JsonSchema(nlohmann::json document);
  static JsonSchema parse(const char* text) { return JsonSchema(nlohmann::json::parse(text)); }

  const nlohmann::json& document() const { return document_; }
  /// A part below "$defs".
  const nlohmann::json& definition(const std::string& name) const { return document_.at("$defs").at(name); }

  /// @param part   of the document, or all of it
  /// @param place  of the value for messages: "scene.json: " for a whole file, "scene.json: contacts[0]" inside
  /// @throws InputError with the field, its value and what is required
  void check(const nlohmann::json& value, const std::string& place, const nlohmann::json& part) const;
  void check(const nlohmann::json& value, const std::string& place) const { check(value, place, document_); }

  /// Calls visit(text, format) for every text in a value that fits the schema and has a "format" there.
  void for_each_text(nlohmann::json& value,
                     const std::function<void(std::string& text, const std::string& format)>& visit) const;

  /// The schema that a $ref stands for, or `part` itself.
  const nlohmann::json& resolved(const nlohmann::json& part) const;

 private:
  /// Of the alternatives of `part`, the first whose type the value has; null for none.
  const nlohmann::json* choice(const nlohmann::json& value, const nlohmann::json& part) const;
  void check_object(const nlohmann::json& value, const std::string& place, const nlohmann::json& part) const;
  void check_list(const nlohmann::json& value, const std::string& place, const nlohmann::json& part) const;
  void check_number(const nlohmann::json& value, const std::string& place, const nlohmann::json& part) const;

  nlohmann::json document_;
};

/// A field of a place: "scene.json: " or "scene.json: contacts[0]", and "e".
std::string place_of(const std::string& place, const std::string& field);

}  // namespace ricochet
