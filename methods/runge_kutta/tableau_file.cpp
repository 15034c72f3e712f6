#include "methods/runge_kutta/tableau_file.h"

#include <fmt/format.h>

#include "problems/input_error.h"
#include "problems/input_text.h"
#include "problems/names.h"
#include "problems/scene_file/expression.h"

namespace ricochet {
namespace {

double number(const nlohmann::json& value, const std::string& field) {
  if (value.is_number()) return value;
  if (!value.is_string()) throw InputError(field, value.type_name(), "a number or an expression in quotes is required");
  const std::string text = value;
  return formula_value(text, {}, field);
}

Vector numbers(const nlohmann::json& values, const std::string& field, int size) {
  if (!values.is_array() || static_cast<int>(values.size()) != size)
    throw InputError(field, values.dump(), fmt::format("a list of {} numbers is required", size));
  Vector result(size);
  for (int k = 0; k < size; ++k) result[k] = number(values[k], fmt::format("{}[{}]", field, k));
  return result;
}

}  // namespace

bool is_pair_file(const std::string& path) {
  const nlohmann::json json = read_input_json(path, "tableau file");
  return json.contains("b_hat") || json.contains("e");
}

TableauFile::TableauFile(const std::string& path, const std::set<std::string>& required,
                         const std::set<std::string>& optional)
    : path_(path) {
  json_ = read_input_json(path, "tableau file");
  if (!json_.is_object()) throw InputError(path, json_.type_name(), "an object is required");

  std::set<std::string> known = optional;
  known.insert(required.begin(), required.end());
  for (const auto& [key, value] : json_.items()) {
    if (!known.contains(key)) throw_unknown_name("field of " + path, key, {known.begin(), known.end()});
  }
  for (const std::string& key : required) {
    if (!has(key)) throw InputError(field(key) + ": this field is missing");
  }
}

std::string TableauFile::text(const std::string& key, const std::string& otherwise) const {
  if (!has(key)) return otherwise;
  if (!json_[key].is_string()) throw InputError(field(key), json_[key].dump(), "a text in quotes is required");
  return json_[key];
}

int TableauFile::stages() const {
  const nlohmann::json& b = json_["b"];
  if (!b.is_array() || b.empty()) throw InputError(field("b"), b.dump(), "a list of weights is required");
  return static_cast<int>(b.size());
}

Vector TableauFile::vector(const std::string& key, int size) const {
  return numbers(json_[key], field(key), size);
}

Matrix TableauFile::square_matrix(const std::string& key, int size) const {
  const nlohmann::json& rows = json_[key];
  if (!rows.is_array() || static_cast<int>(rows.size()) != size)
    throw InputError(field(key), rows.dump(), fmt::format("{} rows are required", size));
  Matrix A(size, size);
  for (int i = 0; i < size; ++i) A.row(i) = numbers(rows[i], fmt::format("{}[{}]", field(key), i), size);
  return A;
}

Vector TableauFile::abscissae(const Matrix& A, double tolerance) const {
  const Vector sums = A.rowwise().sum();
  if (!has("c")) return sums;
  const Vector c = vector("c", static_cast<int>(A.rows()));
  if ((c - sums).cwiseAbs().maxCoeff() > tolerance)
    throw InputError(field("c"), json_["c"].dump(), "c must be the row sums of A");
  return c;
}

int TableauFile::order(const std::string& key, int confirmed) const {
  if (!has(key)) return confirmed;
  const double stated = number(json_[key], field(key));
  if (stated < 1 || stated != std::floor(stated))
    throw InputError(field(key), stated, "a whole number, at least 1, is required");
  if (stated > confirmed)
    throw InputError(field(key), stated, fmt::format("the order conditions confirm order {} only", confirmed));
  return static_cast<int>(stated);
}

}  // namespace ricochet
