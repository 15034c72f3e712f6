#include "problems/scene_file/scene_file.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cctype>
#include <charconv>
#include <cmath>
#include <filesystem>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <utility>

#include "problems/derivatives/symbolic_problem.h"
#include "problems/geometry_equations.h"
#include "problems/initial_state.h"
#include "problems/input_error.h"
#include "problems/input_text.h"
#include "problems/names.h"
#include "problems/scene_file/control_fields.h"
#include "problems/scene_file/control_file.h"
#include "problems/scene_file/expression.h"
#include "problems/scene_file/field.h"
#include "problems/scene_file/geometry_fields.h"
#include "problems/scene_file/scene_schema.h"

namespace ricochet {
namespace {

using GiNaC::ex;
using nlohmann::json;
using Expressions = SymbolicModel::Expressions;

constexpr double kLeastSine = 1e-8;  // of the angle between tangents: half the digits of their cone are lost below

class SceneReader {
 public:
  SceneReader(const Field& scene, const ParameterChanges& changes) : scene_(scene), changes_(changes) {}

  SymbolicModel read() {
    scene_schema().check(scene_.value(), scene_.name(), scene_schema().definition("scene"));
    read_parameters();
    const auto n_q = read_state();
    read_impact_law();
    if (scene_.has("geometry")) model_.geometry = read_geometry(scene_.at("geometry"), model_, constants_, in_q_);
    read_dynamics(n_q);
    if (scene_.has("contacts")) {
      const Field contacts = scene_.at("contacts");
      for (std::size_t i = 0; i < contacts.size(); ++i) read_contact(contacts.at(i), n_q);
    }
    if (scene_.has("friction")) {
      const Field elements = scene_.at("friction");
      for (std::size_t i = 0; i < elements.size(); ++i) read_friction(elements.at(i), n_q);
    }
    if (scene_.has("until")) model_.until = scene_.at("until").expression(in_state_);
    if (scene_.has("potential_energy")) model_.potential_energy = scene_.at("potential_energy").expression(in_q_);
    return std::move(model_);
  }

  /// After read().
  const ExpressionNames& names_in_state() const { return in_state_; }

 private:
  void read_parameters() {
    ParameterChanges unused = changes_;
    if (scene_.has("params")) {
      const Field params = scene_.at("params");
      for (const auto& [name, unused_value] : params.value().items()) {
        const Field field = params.at(name);
        require_free_name(name, field);
        constants_.scalars[name] = GiNaC::symbol(name);
      }
      std::map<std::string, ex> formulas;
      for (const auto& [name, symbol] : constants_.scalars) {
        const Field field = params.at(name);
        const ParameterValue stated = parameter_value(field);
        double value = stated.number;
        if (const auto change = unused.find(name); change != unused.end()) {
          value = change->second;
          unused.erase(change);
        } else if (stated.formula) {
          formulas[name] = *stated.formula;
          continue;
        } else if (stated.exact) {
          model_.exact_values[name] = *stated.exact;
        }
        model_.parameters.push_back({name, value, ""});
        model_.parameter_symbols.push_back(GiNaC::ex_to<GiNaC::symbol>(symbol));
      }
      insert_formulas(params, formulas);
    }
    if (!unused.empty()) throw_unknown_name("parameter", unused.begin()->first, keys_of(constants_.scalars));
    if (!scene_.has("units")) return;
    const Field units = scene_.at("units");
    for (const auto& [name, unit] : units.value().items()) {
      if (!constants_.scalars.contains(name))
        throw_unknown_name("parameter of " + units.name(), name, keys_of(constants_.scalars));
    }
    for (auto& parameter : model_.parameters) {
      if (units.has(parameter.name)) parameter.unit = units.at(parameter.name).text();
    }
  }

  /// A number, a formula of numbers, or a formula of other parameters.
  struct ParameterValue {
    double number = 0;
    std::optional<ex> formula = {};  ///< of other parameters
    std::optional<ex> exact = {};    ///< of numbers
  };

  /// @throws InputError for a value that is neither
  ParameterValue parameter_value(const Field& field) const {
    const std::string text = field.text();
    double value = 0;
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
    if (error == std::errc() && end == text.data() + text.size()) return {value};
    const ex formula = parse_expression(text, constants_, fmt::format("{} = '{}'", field.name(), text.substr(0, 100)));
    for (const auto& [name, symbol] : constants_.scalars) {
      if (formula.has(symbol)) return {.formula = formula};
    }
    return {.number = formula_value(text, constants_, field.name()), .exact = formula};
  }

  /// Parameters with `formulas` of other parameters follow them: other formulas take the formula in place of the name.
  /// @throws InputError for those that refer to each other in a circle
  void insert_formulas(const Field& params, std::map<std::string, ex> formulas) {
    while (!formulas.empty()) {
      std::vector<std::string> ready;
      for (const auto& [name, formula] : formulas) {
        const bool waits = std::ranges::any_of(
            formulas, [&, &f = formula](const auto& other) { return f.has(constants_.scalars.at(other.first)); });
        if (!waits) ready.push_back(name);
      }
      if (ready.empty())
        throw InputError(params.at(formulas.begin()->first).name(), params.at(formulas.begin()->first).text(),
                         fmt::format("circular reference: {} have no values", fmt::join(keys_of(formulas), ", ")));
      for (const auto& name : ready) formulas.erase(name);
      for (const auto& name : ready) constants_.scalars[name] = params.at(name).expression(constants_);
    }
  }

  void read_impact_law() {
    if (!scene_.has("impact_law")) return;
    const Field field = scene_.at("impact_law");
    ImpactLaw& law = model_.impact_law;
    const bool is_name = field.value().is_string();
    law.hypothesis = impact_hypothesis(is_name ? field.text() : field.at("hypothesis").text());
    if (is_name) return;
    if (field.has("eta")) law.eta = number_of(field.at("eta"));
    if (!field.has("stiffness")) return;
    const Field stiffness = field.at("stiffness");
    for (std::size_t i = 0; i < stiffness.size(); ++i) law.stiffness.push_back(number_of(stiffness.at(i)));
  }

  /// A formula of the parameters with a positive value.
  ex positive_number(const Field& field) const {
    const ex formula = field.expression(constants_);
    if (const double value = model_.number(formula); !(value > 0))
      throw InputError(field.name(), value, "a number > 0 is required");
    return formula;
  }

  /// A formula of the parameters, as a number.
  double number_of(const Field& field) const { return model_.number(field.expression(constants_)); }

  std::size_t read_state() {
    const auto n_q = scene_.at("q0").size();
    model_.q0 = scene_.at("q0").expressions(n_q, constants_);
    model_.v0 = scene_.at("v0").expressions(n_q, constants_);
    model_.end_time = scene_.at("T").expression(constants_);
    for (std::size_t k = 0; k < n_q; ++k) {
      model_.q.emplace_back(fmt::format("q[{}]", k));
      model_.v.emplace_back(fmt::format("v[{}]", k));
    }
    in_q_ = constants_;
    in_q_.vectors["q"] = model_.q;
    of_time_ = constants_;
    in_q_and_time_ = in_q_;
    for (auto* names : {&of_time_, &in_q_and_time_}) names->scalars["t"] = model_.t;
    of_speed_ = constants_;
    of_speed_.scalars.try_emplace("vn", model_.v_n);  // a parameter may have this name
    in_state_ = in_q_and_time_;
    in_state_.vectors["v"] = model_.v;
    return n_q;
  }

  /// Reads M, f and the control; M and f follow from the geometry if they are not stated.
  void read_dynamics(std::size_t n_q) {
    const bool has_geometry = model_.geometry.has_value();
    model_.mass = has_geometry && !scene_.has("M") ? mass_from_geometry(model_) : rows(scene_.at("M"), n_q, n_q, in_q_);
    if (has_geometry && !scene_.has("f")) {
      model_.force = force_from_geometry(model_);
      model_.potential_energy = potential_from_geometry(model_);
    } else {
      model_.force = scene_.at("f").expressions(n_q, in_state_);
    }
    if (!scene_.has("Bu") && !scene_.has("u")) return;
    const auto n_u = scene_.at("u").size();
    model_.control = scene_.at("u").expressions(n_u, of_time_);
    model_.input = rows(scene_.at("Bu"), n_q, n_u, in_state_);
    for (std::size_t k = 0; k < n_u; ++k) model_.u.emplace_back(fmt::format("u[{}]", k));
  }

  void read_contact(const Field& field, std::size_t n_q) {
    SymbolicModel::Contact contact;
    contact.name = name_of(field, fmt::format("contact {}", model_.contacts.size()),
                           fmt::format("contacts[{}]", model_.contacts.size()));
    if (field.has("shapes")) read_shapes(field, contact);
    if (field.has("gap") || !field.has("shapes")) read_gap(field.at("gap"), contact);
    if (field.has("e") && field.has("eps_r"))
      throw InputError(field.at("eps_r").name(), field.at("eps_r").text(), "e is also given and means the same");
    for (const char* name : {"e", "eps_r"}) {
      if (field.has(name)) contact.eps_r = field.at(name).expression(of_speed_);
    }
    if (field.has("mu")) contact.mu = field.at("mu").expression(in_q_and_time_);
    if (field.has("mu_static")) contact.mu_static = positive_number(field.at("mu_static"));
    if (field.has("Jt")) contact.tangents = directions_of(field.at("Jt"), n_q);
    if (field.has("vt_drive"))
      contact.drives = field.at("vt_drive").expressions(contact.tangents.size(), in_q_and_time_);
    if (field.has("bilateral")) contact.is_bilateral = field.at("bilateral").value().get<bool>();
    if (field.has("Jn")) compare_normal(field.at("Jn"), contact.gap, n_q);
    model_.contacts.push_back(std::move(contact));
  }

  void read_friction(const Field& field, std::size_t n_q) {
    const std::size_t number = model_.frictions.size();
    SymbolicModel::FrictionElement element;
    element.name = name_of(field, fmt::format("friction {}", number), fmt::format("friction[{}]", number));
    const Field directions = field.at("Jt");
    element.tangents = directions_of(directions, n_q);
    if (element.tangents.empty())
      throw InputError(directions.name() + ", number of entries", 0, "one or two directions are required");
    if (field.has("contact"))
      read_bounding_contact(field, element);
    else
      read_bound(field, element);
    if (field.has("static_ratio")) {
      const Field ratio = field.at("static_ratio");
      if (element.contact >= 0)
        throw InputError(ratio.name(), ratio.text(), "an element with a bound, not with a contact, is required");
      element.static_ratio = positive_number(ratio);
    }
    if (field.has("vt_drive"))
      element.drives = field.at("vt_drive").expressions(element.tangents.size(), in_q_and_time_);
    model_.frictions.push_back(std::move(element));
  }

  void read_bound(const Field& field, SymbolicModel::FrictionElement& element) {
    if (field.has("coefficient"))
      throw InputError(field.at("coefficient").name(), field.at("coefficient").text(),
                       "the contact whose force it multiplies is required in the field contact");
    if (!field.has("bound"))
      throw InputError(field.name(), "no bound", "a bound, or a contact and a coefficient, is required");
    const Field bound = field.at("bound");
    element.bound = bound.expression(in_state_);
    if (const double F = model_.number_at_start(element.bound); !(F >= 0))
      throw InputError(bound.name(), F, "a bound >= 0 at q0, v0 and t = 0 is required");
    if (element.bound.is_zero())
      throw InputError(bound.name(), bound.text(), "a bound that is not zero at all times is required");
  }

  /// Reads the contact whose normal force, times a coefficient, is the bound.
  void read_bounding_contact(const Field& field, SymbolicModel::FrictionElement& element) {
    const Field contact = field.at("contact"), coefficient = field.at("coefficient");
    if (field.has("bound"))
      throw InputError(field.at("bound").name(), field.at("bound").text(),
                       "the contact is the bound: one of both is required");
    const std::string name = contact.text();
    const auto named = std::ranges::find(model_.contacts, name, &SymbolicModel::Contact::name);
    if (named == model_.contacts.end()) {
      std::vector<std::string> names;
      for (const auto& each : model_.contacts) names.push_back(each.name);
      throw InputError(contact.name(), name,
                       names.empty() ? "the scene has no contacts"
                                     : fmt::format("the name of a contact is required: {}", fmt::join(names, ", ")));
    }
    element.contact = static_cast<int>(named - model_.contacts.begin());
    element.bound = coefficient.expression(in_q_and_time_);
    if (const double c = model_.number_at_start(element.bound); !(c >= 0))
      throw InputError(coefficient.name(), c, "a coefficient >= 0 at q0 and t = 0 is required");
  }

  /// The name of a contact or friction element, which no other one has. @param place  in messages about others
  std::string name_of(const Field& field, const std::string& fallback, const std::string& place) {
    const std::string name = field.has("name") ? field.at("name").text() : fallback;
    const auto [other, is_new] = contact_names_.try_emplace(name, place);
    if (!is_new)
      throw InputError(place_of(field.name(), "name"), name,
                       fmt::format("{} has this name, another one is required", other->second));
    return name;
  }

  std::vector<Expressions> directions_of(const Field& field, std::size_t n_q) const {
    std::vector<Expressions> directions;
    for (std::size_t d = 0; d < field.size(); ++d) directions.push_back(field.at(d).expressions(n_q, in_q_and_time_));
    require_directions(field, directions);
    return directions;
  }

  /// Rejects directions that are zero or parallel at q0 and t = 0: friction would act along none, or along one of them
  /// twice.
  void require_directions(const Field& field, const std::vector<Expressions>& directions) const {
    std::vector<StraightLineProgram::Constant> start = model_.constants();
    start.push_back({model_.t, 0});
    for (std::size_t k = 0; k < model_.q.size(); ++k) start.push_back({model_.q[k], model_.number(model_.q0[k])});
    Matrix J(static_cast<Eigen::Index>(model_.q.size()), static_cast<Eigen::Index>(directions.size()));
    for (std::size_t d = 0; d < directions.size(); ++d) {
      auto column = J.col(static_cast<Eigen::Index>(d));
      StraightLineProgram(directions[d], {}, start).evaluate({}, column.data());
      if (!column.allFinite()) throw InputError(field.at(d).name(), "not finite", "finite entries at q0 are required");
      if (column.isZero(0)) throw InputError(field.at(d).name(), 0, "a direction that is not zero at q0 is required");
      column.normalize();
    }
    if (directions.size() < 2) return;
    const double apart = (J.col(1) - J.col(0) * J.col(0).dot(J.col(1))).norm();
    if (!(apart > kLeastSine))
      throw InputError(field.at(1).name(), field.at(1).value().dump(),
                       "a direction that is not parallel to Jt[0] at q0 is required");
  }

  /// Reads the pair of shapes that touch; gap and tangents follow from it.
  void read_shapes(const Field& field, SymbolicModel::Contact& contact) {
    if (!model_.geometry)
      throw InputError(field.at("shapes").name(), field.at("shapes").value().dump(), "the scene has no geometry");
    const ShapePair pair = read_pair(field, *model_.geometry, static_cast<int>(model_.contacts.size()));
    model_.geometry->pairs.push_back(pair);
    const SymbolicModel::Contact touching = contact_from_geometry(model_, pair);
    contact.gap = touching.gap;
    if (field.has("mu")) contact.tangents = touching.tangents;
  }

  /// Reads a stated gap, which must agree with that of the shapes at t = 0.
  void read_gap(const Field& field, SymbolicModel::Contact& contact) {
    const ex of_shapes = std::exchange(contact.gap, field.expression(in_q_and_time_));
    if (model_.geometry && !model_.geometry->pairs.empty() &&
        model_.geometry->pairs.back().contact == static_cast<int>(model_.contacts.size()))
      compare(field, contact.gap, of_shapes, 0, "that of the shapes");
  }

  /// J_n is derived from the gap. If a file states it, too, both must agree at q0 and t = 0 and at two points near it.
  void compare_normal(const Field& field, const ex& gap, std::size_t n_q) {
    const auto stated = field.expressions(n_q, in_q_and_time_);
    for (std::size_t k = 0; k < n_q; ++k)
      compare(field.at(k), stated[k], gap.diff(model_.q[k]), 1, "the gradient of the gap");
  }

  /// Requires `stated` in this field to equal `expected` at q0 and at two points near it. t is 0 there, and
  /// at the two points larger if `rate` is 1.
  void compare(const Field& field, const ex& stated, const ex& expected, double rate, const char* what) const {
    if (const auto values = difference_near_start(model_, stated, expected, rate))
      throw InputError(field.name(), field.text(),
                       fmt::format("{} is {:.17g} there, not {:.17g}", what, values->second, values->first));
  }

  static std::vector<Expressions> rows(const Field& field, std::size_t n_rows, std::size_t n_columns,
                                       const ExpressionNames& names) {
    field.require_size(n_rows);
    std::vector<Expressions> matrix;
    for (std::size_t row = 0; row < n_rows; ++row) matrix.push_back(field.at(row).expressions(n_columns, names));
    return matrix;
  }

  Field scene_;
  const ParameterChanges& changes_;
  SymbolicModel model_;
  std::map<std::string, std::string> contact_names_;  ///< with their places in the file
  ExpressionNames constants_, of_time_, of_speed_, in_q_, in_q_and_time_, in_state_;
};

/// The scene of `FILE` or `FILE#id`, with the object around it, which may contain id and title.
std::pair<json, json> select(const json& document, const std::string& path, const std::string& id) {
  const JsonSchema& schema = scene_schema();
  const std::string place = path + ": ";
  if (!document.is_object()) throw InputError(path, document.type_name(), "an object with a scene is required");
  if (document.contains("cases")) {
    schema.check(document, place, schema.definition("set"));
    std::vector<std::string> known;
    for (const auto& entry : document["cases"]) {
      known.push_back(entry.value("id", ""));
      if (known.back() == id && !id.empty()) return {entry["problem"], entry};
    }
    if (id.empty()) {
      throw InputError(fmt::format("{}: this file holds several scenes; choose one with {}#ID. Known: {}", path, path,
                                   fmt::join(known, ", ")));
    }
    throw_unknown_name("scene in " + path, id, known);
  }
  if (!document.contains("problem")) return {document, document};
  schema.check(document, place, schema.definition("labelled"));
  return {document["problem"], document};
}

/// The title of a scene and where it comes from; they may stand in the object around it.
void read_labels(const json& scene, const json& around, const std::string& path, SymbolicModel& model) {
  const auto label = [&](const char* key, const std::string& fallback) {
    const auto& holder = scene.contains(key) ? scene : around;
    return holder.value(key, fallback);
  };
  model.id = label("id", path);
  model.title = label("title", "scene file " + path);
  model.source = label("source", path);
  model.hard_feature = label("hard_feature", "");
}

std::unique_ptr<Problem> make_problem_of(const json& scene, const json& around, const std::string& path,
                                         const ParameterChanges& changes, double depth) {
  SymbolicModel model = SceneReader(Field(scene, path + ": "), changes).read();
  read_labels(scene, around, path, model);
  std::unique_ptr<Problem> problem;
  try {
    problem = std::make_unique<SymbolicProblem>(std::move(model));
    validate(*problem, depth);
  } catch (const InputError& error) {
    throw InputError(fmt::format("{}: {}", path, error.what()));
  }
  return problem;
}

std::unique_ptr<OptimalControlProblem> make_control_problem_of(const json& scene, const json& around,
                                                               const std::string& path,
                                                               const ParameterChanges& changes) {
  const Field field(scene, path + ": ");
  SceneReader reader(field, changes);
  SymbolicModel model = reader.read();
  if (!field.has("control"))
    throw InputError(place_of(field.name(), "control") +
                     ": this field is missing, which states the costs and bounds of a control problem");
  read_labels(scene, around, path, model);
  if (model.id == path) model.id = std::filesystem::path(path).stem().string();  // it names files of figures
  try {
    auto problem = make_control_problem(field.at("control"), std::move(model), reader.names_in_state(),
                                        std::filesystem::path(path).parent_path());
    validate(*problem);
    return problem;
  } catch (const InputError& error) {
    const std::string message = error.what();
    throw InputError(message.starts_with(field.name()) ? message : field.name() + message);
  }
}

/// A path and the id after '#'.
std::pair<std::string, std::string> split_path(const std::string& path_and_id) {
  const auto hash = path_and_id.rfind('#');
  return {path_and_id.substr(0, hash), hash == std::string::npos ? "" : path_and_id.substr(hash + 1)};
}

}  // namespace

void require_free_name(const std::string& name, const Field& field) {
  const auto is_word = [](unsigned char c) { return std::isalnum(c) || c == '_'; };
  if (name == "t") throw InputError(field.name(), field.text(), "t is the time; another name is required");
  if (words_of_formulas().contains(name))
    throw InputError(field.name(), field.text(),
                     fmt::format("'{}' is a word of formulas; another name is required", name));
  if (name.empty() || std::isdigit(static_cast<unsigned char>(name.front())) || !std::ranges::all_of(name, is_word))
    throw InputError(field.name(), field.text(),
                     fmt::format("'{}' cannot stand in a formula; a name of letters, digits and _ is required", name));
}

std::unique_ptr<Problem> read_scene_file(const std::string& path_and_id, const ParameterChanges& changes) {
  return read_scene_file(path_and_id, changes, 0);
}

std::unique_ptr<Problem> read_scene_file(const std::string& path_and_id, const ParameterChanges& changes,
                                         double depth) {
  const auto [path, id] = split_path(path_and_id);
  const auto [scene, around] = select(read_input_json(path, "scene file"), path, id);
  return make_problem_of(scene, around, path, changes, depth);
}

std::unique_ptr<Problem> read_scene_text(const std::string& text, const std::string& name,
                                         const ParameterChanges& changes) {
  const auto [scene, around] = select(parse_input_json(text, name), name, "");
  return make_problem_of(scene, around, name, changes, 0);
}

std::unique_ptr<OptimalControlProblem> read_control_file(const std::string& path_and_id,
                                                         const ParameterChanges& changes) {
  const auto [path, id] = split_path(path_and_id);
  const auto [scene, around] = select(read_input_json(path, "control problem"), path, id);
  return make_control_problem_of(scene, around, path, changes);
}

std::unique_ptr<OptimalControlProblem> read_control_text(const std::string& text, const std::string& name,
                                                         const ParameterChanges& changes) {
  const auto [scene, around] = select(parse_input_json(text, name), name, "");
  return make_control_problem_of(scene, around, name, changes);
}

bool is_control_file(const std::string& path_and_id) {
  const auto [path, id] = split_path(path_and_id);
  return select(read_input_json(path, "scene file"), path, id).first.contains("control");
}

std::unique_ptr<Problem> with_until(const Problem& problem, const std::string& formula) {
  if (!problem.formulas()) throw InputError("until", formula, "only runs of a problem made of formulas can end there");
  SymbolicModel model = *problem.formulas();
  ExpressionNames names;
  for (const auto& parameter : model.parameter_symbols) names.scalars[parameter.get_name()] = parameter;
  names.scalars["t"] = model.t;
  names.vectors = {{"q", model.q}, {"v", model.v}};
  model.until = parse_expression(formula, names, "until");
  auto changed = std::make_unique<SymbolicProblem>(std::move(model));
  changed->set_impact_law(problem.info().impact_law);
  changed->set_initial_state(problem.info().q0, problem.info().v0);
  return changed;
}

}  // namespace ricochet
