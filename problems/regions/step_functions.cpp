#include "problems/regions/step_functions.h"

#include <fmt/format.h>

#include <algorithm>

#include "problems/derivatives/friction_elements.h"
#include "problems/input_error.h"
#include "problems/join.h"
#include "problems/regions/switching_functions.h"

namespace ricochet {
namespace {

using GiNaC::ex;
using GiNaC::symbol;
using Expressions = SymbolicModel::Expressions;

constexpr std::size_t kMostExpanded = 4;  // signs of one formula whose sum (2) is written out: 16 terms

/// @throws InputError if `formulas` have a sign
void require_smooth(const SwitchedModel& switched, const Expressions& formulas, const std::string& what) {
  for (std::size_t k = 0; k < switched.signs.size(); ++k) {
    if (std::ranges::any_of(formulas, [&](const ex& e) { return e.has(switched.signs[k]); }))
      throw InputError(what, switched.described[k].formula,
                       "a transcription takes abs, sign, min, max and if in forces only");
  }
}

void require_smooth_contacts(const SwitchedModel& switched) {
  const SymbolicModel& model = switched.model;
  for (const Expressions& row : model.mass) require_smooth(switched, row, "M");
  for (const auto& contact : model.contacts) {
    require_smooth(switched, {contact.gap}, fmt::format("gap of '{}'", contact.name));
    for (const auto& direction : contact.tangents)
      require_smooth(switched, direction, fmt::format("tangents of '{}'", contact.name));
    require_smooth(switched, contact.drives, fmt::format("vt_drive of '{}'", contact.name));
    require_smooth(switched, {contact.mu}, fmt::format("mu of '{}'", contact.name));
  }
  for (const auto& element : model.frictions) {
    for (const auto& direction : element.tangents)
      require_smooth(switched, direction, fmt::format("tangents of '{}'", element.name));
    require_smooth(switched, element.drives, fmt::format("vt_drive of '{}'", element.name));
  }
}

/// (2) for a formula `e`.
ex blended(ex e, const SwitchedModel& switched, const std::vector<symbol>& theta) {
  GiNaC::exmap affine;
  std::vector<std::size_t> expanded;
  for (std::size_t k = 0; k < theta.size(); ++k) {
    const symbol& sign = switched.signs[k];
    if (!e.has(sign)) continue;
    if (e.diff(sign).has(sign))
      expanded.push_back(k);
    else
      affine[sign] = 2 * theta[k] - 1;
  }
  if (expanded.size() > kMostExpanded)
    throw InputError("switching functions of one formula",
                     fmt::format("{} in whose signs it is not affine", expanded.size()),
                     fmt::format("at most {} are allowed in a transcription", kMostExpanded));
  for (const std::size_t k : expanded) {
    const symbol& sign = switched.signs[k];
    e = theta[k] * e.subs(sign == 1) + (1 - theta[k]) * e.subs(sign == -1);
  }
  return e.subs(affine, GiNaC::subs_options::no_pattern);
}

}  // namespace

Vector StepFunctions::sides(const Vector& q, const Vector& v) const {
  Vector theta = Vector::Ones(size());
  for (int k = 0; k < size(); ++k) theta[k] = switching.at(q, v, theta)[k] < 0 ? 0 : 1;  // inner ones come first
  return theta;
}

Vector StepFunctions::sizes(const Vector& q, const Vector& v, const Vector& theta) const {
  Vector x(q.size() + v.size() + theta.size());
  x << q, v, theta;
  Matrix J(size(), x.size());
  J.setZero();
  switching.jacobian(x.data(), J.data());
  const auto n = q.size() + v.size();
  return J.leftCols(n).cwiseAbs() * (1 + x.head(n).array().abs()).matrix();
}

StepFunctions make_step_functions(const Problem& problem) {
  const ProblemInfo& info = problem.info();
  if (info.switches.empty()) return {};
  const SymbolicModel* stated = problem.formulas();
  if (!stated) throw InputError("problem", info.id, "a problem with formulas is required: a scene or a scene file");
  SwitchedModel switched = with_switching_functions(with_jumps_as_friction(*stated));
  if (switched.model.until) {  // the last one, which changes no formula
    switched.functions.pop_back();
    switched.signs.pop_back();
    switched.described.pop_back();
    switched.model.until.reset();
    if (switched.functions.empty()) return {};
  }
  require_smooth_contacts(switched);
  std::vector<symbol> theta;
  for (std::size_t k = 0; k < switched.signs.size(); ++k) theta.emplace_back(fmt::format("theta[{}]", k));

  SymbolicModel& model = switched.model;
  add_control_of_time(model);
  for (ex& f : model.force) f = blended(f, switched, theta);
  model.input.resize(model.q.size());
  for (Expressions& row : model.input) {
    for (ex& entry : row) entry = blended(entry, switched, theta);
    row.resize(row.size() + theta.size(), 0);
  }
  for (auto& element : model.frictions) element.bound = blended(element.bound, switched, theta);
  model.u.insert(model.u.end(), theta.begin(), theta.end());
  model.control.resize(model.u.size(), 0);
  model.region.assign(theta.size(), 1);  // bounds of friction elements were checked with the problem
  model.potential_energy.reset();
  Expressions functions;
  for (const ex& function : switched.functions) functions.push_back(blended(function, switched, theta));

  StepFunctions result;
  result.problem = std::make_unique<SymbolicProblem>(std::move(model));
  result.problem->set_initial_state(info.q0, info.v0);
  result.problem->set_end_time(info.end_time);
  const SymbolicModel& equations = result.problem->equations();
  result.switching = {functions, join<symbol>({equations.q, equations.v, theta}), equations.constants()};
  return result;
}

}  // namespace ricochet
