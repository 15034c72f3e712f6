#pragma once

#include <fmt/format.h>

#include <nlohmann/json.hpp>
#include <string>
#include <utility>

#include "problems/derivatives/symbolic_problem.h"
#include "problems/input_error.h"
#include "problems/json_schema.h"
#include "problems/scene_file/expression.h"

namespace ricochet {

/// A place in a scene file: the value and its name for messages.
class Field {
 public:
  Field(const nlohmann::json& value, std::string name) : value_(&value), name_(std::move(name)) {}

  const std::string& name() const { return name_; }
  const nlohmann::json& value() const { return *value_; }
  bool has(const std::string& key) const { return value_->contains(key); }
  std::size_t size() const { return value_->size(); }

  /// @throws InputError if the field is missing
  Field at(const std::string& key) const {
    const std::string child = place_of(name_, key);
    if (!has(key)) throw InputError(child + ": this field is missing");
    return {(*value_)[key], child};
  }
  Field at(std::size_t index) const { return {(*value_)[index], fmt::format("{}[{}]", name_, index)}; }

  /// @throws InputError for another number of entries
  void require_size(std::size_t length) const {
    if (size() != length) {
      throw InputError(name_ + ", number of entries", size(), fmt::format("{} are required", length));
    }
  }

  /// The text of a string or a number.
  std::string text() const { return value_->is_string() ? value_->get<std::string>() : value_->dump(); }

  /// The value as a formula of these `names`. @throws InputError as parse_expression()
  GiNaC::ex expression(const ExpressionNames& names) const { return parse_expression(text(), names, name_); }
  /// A list of `length` formulas.
  SymbolicModel::Expressions expressions(std::size_t length, const ExpressionNames& names) const {
    require_size(length);
    SymbolicModel::Expressions list;
    for (std::size_t k = 0; k < length; ++k) list.push_back(at(k).expression(names));
    return list;
  }

 private:
  const nlohmann::json* value_;
  std::string name_;
};

/// Rejects a `name`, stated at this `field`, that cannot occur in formulas or is a word of them. @throws InputError
void require_free_name(const std::string& name, const Field& field);

}  // namespace ricochet
