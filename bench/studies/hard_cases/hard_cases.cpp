#include "bench/studies/hard_cases/hard_cases.h"

#include <fmt/format.h>

#include <algorithm>
#include <set>
#include <stdexcept>

#include "bench/experiment/experiment_file.h"
#include "methods/registry.h"
#include "problems/input_error.h"
#include "problems/names.h"
#include "problems/scene_file/expression.h"

namespace ricochet {
namespace {

using nlohmann::json;

const std::vector<std::pair<std::string, double CaseLimits::*>> kLimits = {
    {"exact", &CaseLimits::exact}, {"error", &CaseLimits::error},       {"energy", &CaseLimits::energy},
    {"cone", &CaseLimits::cone},   {"momentum", &CaseLimits::momentum}, {"penetration", &CaseLimits::penetration}};

void read_limits(const json& limits, const std::string& place, CaseLimits& to) {
  for (const auto& [name, value] : limits.items()) {
    const auto known = std::ranges::find(kLimits, name, &decltype(kLimits)::value_type::first);
    if (known == kLimits.end())
      throw_unknown_name("limit of " + place, name, {"exact", "error", "energy", "penetration", "momentum", "cone"});
    const double limit = value.at("limit");
    if (!(limit >= 0)) throw InputError(place + ": limits." + name, limit, "a number >= 0 is required");
    if (value.at("reason").get<std::string>().empty())
      throw InputError(place + ": limits." + name + ".reason", "''", "a reason is required");
    to.*(known->second) = limit;
  }
}

void read_settings(const json& j, const std::string& place, HardCase& to) {
  if (j.contains("steps")) {
    to.first_order_steps = j["steps"].value("first_order", to.first_order_steps);
    to.high_order_steps = j["steps"].value("high_order", to.high_order_steps);
  }
  to.tolerance = j.value("tolerance", to.tolerance);
  if (j.contains("limits")) read_limits(j["limits"], place, to.limits);
}

HardCase read_case(const json& j, HardCase hard_case) {
  hard_case.id = j.at("id");
  const std::string place = fmt::format("case {}", hard_case.id);
  j.at("title").get_to(hard_case.title);
  j.at("group").get_to(hard_case.group);
  j.at("problem").get_to(hard_case.problem);
  hard_case.parameters = j.value("parameters", ParameterChanges{});
  hard_case.motions = j.value("motions", json::array());
  hard_case.limits.paradox = j.value("paradox", "");
  hard_case.limits.conserves_energy = j.value("conserves_energy", false);
  read_settings(j, place, hard_case);
  if (hard_case.first_order_steps < 1 || hard_case.high_order_steps < 1)
    throw InputError(place + ": steps", std::min(hard_case.first_order_steps, hard_case.high_order_steps),
                     "numbers of steps >= 1 are required");
  return hard_case;
}

template <class Known>
void require_known(const std::vector<std::string>& names, const Known& known, const std::string& kind) {
  for (const auto& name : names) {
    if (std::ranges::find(known, name) == known.end()) throw_unknown_name(kind, name, known);
  }
}

std::vector<std::string> ids_of(const std::vector<HardCase>& cases) {
  std::vector<std::string> ids;
  for (const auto& hard_case : cases) ids.push_back(hard_case.id);
  return ids;
}

Vector evaluate(const json& formulas, const ExpressionNames& names, const std::string& field, int n_q) {
  if (static_cast<int>(formulas.size()) != n_q)
    throw InputError(field + ", number of entries", formulas.size(), fmt::format("{} are required", n_q));
  Vector x(n_q);
  for (int k = 0; k < n_q; ++k) {
    const std::string place = fmt::format("{}[{}]", field, k);
    x[k] = formula_value(formulas[k].get<std::string>(), names, place);
  }
  return x;
}

}  // namespace

double TrueMotion::error_of(const Solution& solution) const {
  return reference::final_state_difference(solution.q, solution.v, q, v);
}

reference::Reference TrueMotion::reference() const {
  reference::Reference end;
  end.solution.q = q;
  end.solution.v = v;
  end.uncertainty = uncertainty;
  return end;
}

std::unique_ptr<Problem> HardCase::make_problem() const {
  return ricochet::make_problem(problem, parameters);
}

std::vector<TrueMotion> HardCase::true_motions(const Problem& the_problem) const {
  ExpressionNames names;
  for (const auto& parameter : the_problem.info().parameters) names.scalars[parameter.name] = parameter.value;
  for (const auto& [name, value] : parameters) names.scalars[name] = value;  // an assembled scene lists none
  std::vector<TrueMotion> list;
  for (std::size_t k = 0; k < motions.size(); ++k) {
    const json& motion = motions[k];
    const std::string field = fmt::format("case {}: motions[{}]", id, k);
    if (!motion.contains("reference")) {
      list.push_back({evaluate(motion.at("q"), names, field + ".q", the_problem.n_q()),
                      evaluate(motion.at("v"), names, field + ".v", the_problem.n_q())});
      continue;
    }
    ParameterChanges changed = parameters;
    for (const auto& [name, value] : motion.at("reference").items()) changed[name] = value;
    const auto reference = reference::truth_of(*ricochet::make_problem(problem, changed));
    if (reference.uncertainty > limits.error / 10)
      throw std::runtime_error(fmt::format("{}: its reference is known to {:.1e}, the limit of the error is {:.1e}",
                                           field, reference.uncertainty, limits.error));
    list.push_back({reference.solution.q, reference.solution.v, reference.uncertainty});
  }
  return list;
}

namespace {

/// Examples of the methods that are built, and those that the file adds, by name.
std::vector<std::string> methods_of(const json& experiment) {
  std::vector<std::string> specs;
  for (const auto& entry : methods()) {
    if (entry.make) specs.insert(specs.end(), entry.examples.begin(), entry.examples.end());
  }
  for (const std::string method : experiment.at("also")) {
    make_method(method);
    specs.push_back(method);
  }
  std::ranges::stable_sort(specs, {}, [](const std::string& method) { return MethodSpec(method).name(); });
  return specs;
}

void keep_cases(const std::vector<std::string>& ids, const std::string& kind, HardCases& all) {
  require_known(ids, ids_of(all.cases), kind);
  std::erase_if(all.cases, [&](const HardCase& c) { return std::ranges::find(ids, c.id) == ids.end(); });
}

std::vector<std::string> one_or_more(const json& names) {
  if (names.is_string()) return {names};
  return names;
}

}  // namespace

HardCases read_hard_cases(const json& experiment) {
  HardCases all;
  experiment.at("id").get_to(all.id);
  experiment.at("time_limit").get_to(all.time_limit);
  if (!(all.time_limit > 0)) throw InputError("time_limit", all.time_limit, "seconds > 0 are required");
  all.with_times = experiment.value("times", true);
  HardCase defaults;
  read_settings(experiment.at("defaults"), "defaults", defaults);
  for (const auto& j : experiment.at("cases")) all.cases.push_back(read_case(j, defaults));
  all.methods = methods_of(experiment);

  if (experiment.contains("only_case")) keep_cases(one_or_more(experiment["only_case"]), "hard case", all);
  if (experiment.contains("only_method")) {
    all.methods = one_or_more(experiment["only_method"]);
    for (const auto& method : all.methods) make_method(method);
  }
  return all;
}

}  // namespace ricochet
