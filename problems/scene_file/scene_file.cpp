#include "problems/scene_file/scene_file.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <cmath>
#include <cstdlib>
#include <fstream>
#include <nlohmann/json.hpp>
#include <set>

#include "problems/derivatives/symbolic_problem.h"
#include "problems/initial_state.h"
#include "problems/input_error.h"
#include "problems/names.h"
#include "problems/scene_file/expression.h"

namespace ricochet {
namespace {

using GiNaC::ex;
using nlohmann::json;
using Expressions = SymbolicModel::Expressions;

/// @param text  a string or a stream
json parse_json(auto&& text, const std::string& name) {
  try {
    return json::parse(text, nullptr, true, /*ignore_comments=*/true);
  } catch (const json::exception& error) {
    throw InputError(fmt::format("{}: not valid JSON: {}", name, error.what()));
  }
}

json read_json(const std::string& path) {
  std::ifstream file(path);
  if (!file) throw InputError("scene file", path, "cannot be opened");
  return parse_json(file, path);
}

/// A place in the file: the value and its name for messages.
class Field {
 public:
  Field(const json& value, std::string name) : value_(&value), name_(std::move(name)) {}

  const std::string& name() const { return name_; }
  const json& value() const { return *value_; }
  bool has(const std::string& key) const { return value_->contains(key); }
  std::size_t size() const { return value_->size(); }

  Field at(const std::string& key) const {
    const std::string child = name_.ends_with(": ") ? name_ + key : name_ + "." + key;
    if (!has(key)) throw InputError(child + ": this field is missing");
    return {(*value_)[key], child};
  }
  Field at(std::size_t index) const { return {(*value_)[index], fmt::format("{}[{}]", name_, index)}; }

  void require_object() const {
    if (!value_->is_object()) throw InputError(name_, value_->type_name(), "an object is required");
  }
  void require_list(std::size_t length) const {
    require_list();
    if (size() != length) {
      throw InputError(name_ + ", number of entries", size(), fmt::format("{} are required", length));
    }
  }
  void require_list() const {
    if (!value_->is_array()) throw InputError(name_, value_->type_name(), "a list is required");
  }
  /// An unknown field is a misspelt one: a scene that silently loses its friction would be worse.
  void allow_only(const std::set<std::string>& known) const {
    require_object();
    for (const auto& [key, unused] : value_->items()) {
      if (!known.contains(key))
        throw_unknown_name("field of " + name_.substr(0, name_.find_last_not_of(": ") + 1), key,
                           {known.begin(), known.end()});
    }
  }

  std::string text() const {
    if (value_->is_string()) return value_->get<std::string>();
    if (value_->is_number()) return value_->dump();
    throw InputError(name_, value_->type_name(), "a number, or an expression in quotes, is required");
  }

 private:
  const json* value_;
  std::string name_;
};

class SceneReader {
 public:
  SceneReader(const Field& scene, const ParameterChanges& changes) : scene_(scene), changes_(changes) {}

  SymbolicModel read() {
    scene_.allow_only({"id", "title", "source", "hard_feature", "params", "units", "q0", "v0", "T", "M", "f", "Bu", "u",
                       "contacts", "potential_energy"});
    read_parameters();
    const auto n_q = read_state();
    read_dynamics(n_q);
    if (scene_.has("contacts")) {
      const Field contacts = scene_.at("contacts");
      contacts.require_list();
      for (std::size_t i = 0; i < contacts.size(); ++i) read_contact(contacts.at(i), n_q);
    }
    if (scene_.has("potential_energy")) model_.potential_energy = expression(scene_.at("potential_energy"), in_q_);
    return std::move(model_);
  }

 private:
  void read_parameters() {
    ParameterChanges unused = changes_;
    if (scene_.has("params")) {
      const Field params = scene_.at("params");
      params.require_object();
      for (const auto& [name, unused_value] : params.value().items()) {
        const Field field = params.at(name);
        if (name == "t") throw InputError(field.name(), field.text(), "t is the time; another name is required");
        double value = decimal(field);
        if (const auto change = unused.find(name); change != unused.end()) {
          value = change->second;
          unused.erase(change);
        }
        model_.parameters.push_back({name, value, ""});
        model_.parameter_symbols.emplace_back(name);
        constants_.scalars[name] = model_.parameter_symbols.back();
      }
    }
    if (!unused.empty()) throw_unknown_name("parameter", unused.begin()->first, keys_of(constants_.scalars));
    if (!scene_.has("units")) return;
    const Field units = scene_.at("units");
    const auto names = keys_of(constants_.scalars);
    units.allow_only({names.begin(), names.end()});
    for (auto& parameter : model_.parameters) {
      if (units.has(parameter.name)) parameter.unit = units.at(parameter.name).text();
    }
  }

  std::size_t read_state() {
    scene_.at("q0").require_list();
    const auto n_q = scene_.at("q0").size();
    if (n_q == 0) throw InputError("length of " + scene_.at("q0").name(), 0, "at least one coordinate is required");
    model_.q0 = expressions(scene_.at("q0"), n_q, constants_);
    model_.v0 = expressions(scene_.at("v0"), n_q, constants_);
    model_.end_time = expression(scene_.at("T"), constants_);
    for (std::size_t k = 0; k < n_q; ++k) {
      model_.q.emplace_back(fmt::format("q[{}]", k));
      model_.v.emplace_back(fmt::format("v[{}]", k));
    }
    in_q_ = constants_;
    in_q_.vectors["q"] = model_.q;
    of_time_ = constants_;
    in_q_and_time_ = in_q_;
    for (auto* names : {&of_time_, &in_q_and_time_}) names->scalars["t"] = model_.t;
    in_state_ = in_q_and_time_;
    in_state_.vectors["v"] = model_.v;
    return n_q;
  }

  void read_dynamics(std::size_t n_q) {
    model_.mass = rows(scene_.at("M"), n_q, n_q, in_q_);
    model_.force = expressions(scene_.at("f"), n_q, in_state_);
    if (!scene_.has("Bu") && !scene_.has("u")) return;
    scene_.at("u").require_list();
    const auto n_u = scene_.at("u").size();
    model_.control = expressions(scene_.at("u"), n_u, of_time_);
    model_.input = rows(scene_.at("Bu"), n_q, n_u, in_q_and_time_);
    for (std::size_t k = 0; k < n_u; ++k) model_.u.emplace_back(fmt::format("u[{}]", k));
  }

  void read_contact(const Field& field, std::size_t n_q) {
    field.allow_only({"name", "gap", "e", "mu", "Jt", "vt_drive", "Jn", "bilateral"});
    SymbolicModel::Contact contact;
    contact.name = field.has("name") ? field.at("name").text() : fmt::format("contact {}", model_.contacts.size());
    contact.gap = expression(field.at("gap"), in_q_and_time_);
    if (field.has("e")) contact.eps_r = expression(field.at("e"), constants_);
    if (field.has("mu")) contact.mu = expression(field.at("mu"), constants_);
    if (field.has("Jt")) {
      const Field directions = field.at("Jt");
      directions.require_list();
      if (directions.size() > 2)
        throw InputError("length of " + directions.name(), directions.size(),
                         "at most 2 tangent directions are possible");
      for (std::size_t d = 0; d < directions.size(); ++d)
        contact.tangents.push_back(expressions(directions.at(d), n_q, in_q_and_time_));
    }
    if (field.has("vt_drive"))
      contact.drives = expressions(field.at("vt_drive"), contact.tangents.size(), in_q_and_time_);
    if (field.has("bilateral")) contact.is_bilateral = truth(field.at("bilateral"));
    if (field.has("Jn")) compare_normal(field.at("Jn"), contact.gap, n_q);
    model_.contacts.push_back(std::move(contact));
  }

  /// J_n is derived from the gap; a file that also states it must agree at q0 and t = 0 and at two points near it.
  void compare_normal(const Field& field, const ex& gap, std::size_t n_q) {
    const auto stated = expressions(field, n_q, in_q_and_time_);
    for (const double shift : {0.0, 0.137, -0.0731}) {
      std::vector<StraightLineProgram::Constant> values = model_.constants();
      values.push_back({model_.t, shift});
      for (std::size_t k = 0; k < n_q; ++k) {
        values.push_back({model_.q[k], model_.number(model_.q0[k]) + shift * (1 + 0.3 * static_cast<double>(k))});
      }
      for (std::size_t k = 0; k < n_q; ++k) {
        double pair[2];
        StraightLineProgram({stated[k], gap.diff(model_.q[k])}, {}, values).evaluate({}, pair);
        // a few roundings of two ways to write one formula
        if (std::abs(pair[0] - pair[1]) > 1e-10 * (std::abs(pair[0]) + std::abs(pair[1]))) {
          throw InputError(field.at(k).name(), field.at(k).text(),
                           fmt::format("the gradient of the gap is {:.17g} there, not {:.17g}", pair[1], pair[0]));
        }
      }
    }
  }

  static std::vector<Expressions> rows(const Field& field, std::size_t n_rows, std::size_t n_columns,
                                       const ExpressionNames& names) {
    field.require_list(n_rows);
    std::vector<Expressions> matrix;
    for (std::size_t row = 0; row < n_rows; ++row) matrix.push_back(expressions(field.at(row), n_columns, names));
    return matrix;
  }

  static Expressions expressions(const Field& field, std::size_t length, const ExpressionNames& names) {
    field.require_list(length);
    Expressions list;
    for (std::size_t k = 0; k < length; ++k) list.push_back(expression(field.at(k), names));
    return list;
  }

  static ex expression(const Field& field, const ExpressionNames& names) {
    return parse_expression(field.text(), names, field.name());
  }

  static bool truth(const Field& field) {
    if (!field.value().is_boolean()) throw InputError(field.name(), field.value().dump(), "true or false is required");
    return field.value().get<bool>();
  }

  static double decimal(const Field& field) {
    const std::string text = field.text();
    char* end = nullptr;
    const double value = std::strtod(text.c_str(), &end);
    if (text.empty() || *end != '\0') throw InputError(field.name(), "'" + text + "'", "a decimal number is required");
    return value;
  }

  Field scene_;
  const ParameterChanges& changes_;
  SymbolicModel model_;
  ExpressionNames constants_, of_time_, in_q_, in_q_and_time_, in_state_;
};

/// The scene that `FILE` or `FILE#id` means, with the object around it that may hold id and title.
std::pair<json, json> select(const json& document, const std::string& path, const std::string& id) {
  if (document.is_object() && document.contains("cases")) {
    std::vector<std::string> known;
    for (const auto& entry : document["cases"]) {
      known.push_back(entry.value("id", ""));
      if (known.back() == id) return {entry.value("problem", json()), entry};
    }
    if (id.empty()) {
      throw InputError(fmt::format("{}: this file holds several scenes; choose one with {}#ID. Known: {}", path, path,
                                   fmt::join(known, ", ")));
    }
    throw_unknown_name("scene in " + path, id, known);
  }
  if (document.is_object() && document.contains("problem")) return {document["problem"], document};
  return {document, document};
}

std::unique_ptr<Problem> make_problem_of(const json& scene, const json& around, const std::string& path,
                                         const ParameterChanges& changes, double depth) {
  SymbolicModel model = SceneReader(Field(scene, path + ": "), changes).read();
  const auto label = [&](const char* key, const std::string& fallback) {
    const auto& holder = scene.contains(key) ? scene : around;
    return holder.contains(key) && holder[key].is_string() ? holder[key].get<std::string>() : fallback;
  };
  model.id = label("id", path);
  model.title = label("title", "scene file " + path);
  model.source = label("source", path);
  model.hard_feature = label("hard_feature", "");
  std::unique_ptr<Problem> problem;
  try {
    problem = std::make_unique<SymbolicProblem>(std::move(model));
    validate(*problem, depth);
  } catch (const InputError& error) {
    throw InputError(fmt::format("{}: {}", path, error.what()));
  }
  return problem;
}

}  // namespace

std::unique_ptr<Problem> read_scene_file(const std::string& path_and_id, const ParameterChanges& changes) {
  return read_scene_file(path_and_id, changes, 0);
}

std::unique_ptr<Problem> read_scene_file(const std::string& path_and_id, const ParameterChanges& changes,
                                         double depth) {
  const auto hash = path_and_id.rfind('#');
  const std::string path = path_and_id.substr(0, hash);
  const std::string id = hash == std::string::npos ? "" : path_and_id.substr(hash + 1);
  const auto [scene, around] = select(read_json(path), path, id);
  return make_problem_of(scene, around, path, changes, depth);
}

std::unique_ptr<Problem> read_scene_text(const std::string& text, const std::string& name,
                                         const ParameterChanges& changes) {
  const auto [scene, around] = select(parse_json(text, name), name, "");
  return make_problem_of(scene, around, name, changes, 0);
}

}  // namespace ricochet
