#include "problems/scene_file/scene_writer.h"

#include <fmt/format.h>

#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>

#include "problems/derivatives/symbolic_problem.h"
#include "problems/input_error.h"
#include "problems/scene_file/expression_text.h"
#include "problems/scene_file/geometry_fields.h"

namespace ricochet {
namespace {

using nlohmann::ordered_json;

constexpr const char* kConventions =
    "M(q) v' = f(q,v,t) + Bu u + sum_i Jn_i lambda_n_i + Jt_i lambda_t_i, q' = v, Jn_i = grad gap_i, gap >= 0 "
    "(bilateral: "
    "gap = 0); Newton's restitution e, Coulomb's friction mu against the slip velocity Jt_i v + vt_drive_i, "
    "|lambda_t_i| <= bound_i for 'friction' elements, or coefficient_i lambda_n of their contact. SI units: "
    "m, kg, s, rad; forces lambda in N, impulses "
    "Lambda in N s";

ordered_json texts(const SymbolicModel::Expressions& expressions) {
  ordered_json list = ordered_json::array();
  for (const auto& expression : expressions) list.push_back(expression_text(expression));
  return list;
}

ordered_json texts(const std::vector<SymbolicModel::Expressions>& rows) {
  ordered_json list = ordered_json::array();
  for (const auto& row : rows) list.push_back(texts(row));
  return list;
}

ordered_json contact_json(const SymbolicModel& model, const SymbolicModel::Contact& contact, bool with_normal) {
  ordered_json entry = {{"name", contact.name}, {"gap", expression_text(contact.gap)}};
  if (with_normal) {
    for (const auto& q : model.q) entry["Jn"].push_back(expression_text(contact.gap.diff(q)));
  }
  if (contact.is_bilateral) entry["bilateral"] = true;
  if (!contact.eps_r.is_zero()) entry["e"] = expression_text(contact.eps_r);
  if (!contact.tangents.empty()) {
    entry["mu"] = expression_text(contact.mu);
    if (!contact.mu_static.is_zero()) entry["mu_static"] = expression_text(contact.mu_static);
    entry["Jt"] = texts(contact.tangents);
    if (!contact.drives.empty()) entry["vt_drive"] = texts(contact.drives);
  }
  return entry;
}

ordered_json friction_json(const SymbolicModel& model, const SymbolicModel::FrictionElement& element) {
  ordered_json entry = {{"name", element.name}, {"Jt", texts(element.tangents)}};
  if (element.contact >= 0) entry["contact"] = model.contacts[static_cast<std::size_t>(element.contact)].name;
  entry[element.contact >= 0 ? "coefficient" : "bound"] = expression_text(element.bound);
  if (!element.static_ratio.is_zero()) entry["static_ratio"] = expression_text(element.static_ratio);
  if (!element.drives.empty()) entry["vt_drive"] = texts(element.drives);
  return entry;
}

/// Initial values as formulas; as numbers where those of the problem are others.
ordered_json start_texts(const SymbolicModel::Expressions& formulas, const Vector& stated, const Vector& current) {
  ordered_json list = ordered_json::array();
  for (std::size_t k = 0; k < formulas.size(); ++k) {
    const auto i = static_cast<Eigen::Index>(k);
    list.push_back(stated[i] == current[i] ? expression_text(formulas[k]) : fmt::format("{}", current[i]));
  }
  return list;
}

}  // namespace

std::string scene_text(const Problem& problem, const SceneTextOptions& options) {
  const SymbolicModel* formulas = problem.formulas();
  if (!formulas) throw InputError("problem", problem.info().id, "only a problem made of formulas can be written");
  const SymbolicModel& model = *formulas;

  const ProblemInfo& info = problem.info();

  ordered_json scene;
  for (const auto& parameter : model.parameters) {
    const GiNaC::ex* const exact = model.exact_value(parameter);
    scene["params"][parameter.name] =
        exact ? expression_text(*exact) : fmt::format("{}", parameter.value);  // the shortest that reads back exactly
    if (!parameter.unit.empty()) scene["units"][parameter.name] = parameter.unit;
  }
  const bool is_current = options.with_set_state;
  scene["q0"] = is_current ? start_texts(model.q0, problem.stated_q0(), info.q0) : texts(model.q0);
  scene["v0"] = is_current ? start_texts(model.v0, problem.stated_v0(), info.v0) : texts(model.v0);
  scene["T"] = expression_text(model.end_time);
  if (model.until && options.with_until) scene["until"] = expression_text(*model.until);
  if (model.geometry) scene["geometry"] = geometry_json(model);
  scene["M"] = texts(model.mass);
  scene["f"] = texts(model.force);
  if (!model.u.empty()) {
    scene["Bu"] = texts(model.input);
    scene["u"] = texts(model.control);
  }
  for (const auto& contact : model.contacts)
    scene["contacts"].push_back(contact_json(model, contact, options.with_normals));
  if (model.geometry) {
    for (const ShapePair& pair : model.geometry->pairs)
      add_pair(scene["contacts"][pair.contact], pair, *model.geometry);
  }
  for (const auto& element : model.frictions) scene["friction"].push_back(friction_json(model, element));
  if (const ImpactLaw& law = info.impact_law; law.hypothesis != ImpactHypothesis::newton) {
    scene["impact_law"] = {{"hypothesis", name_of(law.hypothesis)}};
    if (law.hypothesis == ImpactHypothesis::lzb) scene["impact_law"]["eta"] = fmt::format("{}", law.eta);
    for (const double K : law.stiffness) scene["impact_law"]["stiffness"].push_back(fmt::format("{}", K));
  }
  if (model.potential_energy) scene["potential_energy"] = expression_text(*model.potential_energy);

  if (!options.with_title) return ordered_json{{"problem", scene}}.dump();
  ordered_json document = {{"id", model.id}, {"title", model.title}, {"source", model.source}};
  if (!model.hard_feature.empty()) document["hard_feature"] = model.hard_feature;
  document["conventions"] = kConventions;
  document["problem"] = std::move(scene);
  return document.dump(2) + "\n";
}

void write_scene_file(const Problem& problem, const std::string& path) {
  const std::string text = scene_text(problem);
  if (std::filesystem::exists(path)) throw InputError("scene file", path, "the file exists; a new file is required");
  std::ofstream file(path);
  if (!(file << text).flush()) throw InputError("scene file", path, "cannot be written");
}

}  // namespace ricochet
