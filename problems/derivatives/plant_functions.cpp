#include "problems/derivatives/plant_functions.h"

#include <fmt/format.h>

#include "problems/derivatives/symbolic_problem.h"
#include "problems/input_error.h"
#include "problems/join.h"
#include "problems/levers.h"

namespace ricochet {
namespace {

using GiNaC::ex;
using GiNaC::symbol;
using Symbols = std::vector<symbol>;
using Expressions = SmoothFunction::Expressions;

Symbols symbols(int count) {
  return Symbols(static_cast<std::size_t>(count));
}

/// Row `k` of M x.
ex mass_times(const SymbolicModel& model, int k, const Expressions& x) {
  ex sum = 0;
  for (std::size_t column = 0; column < x.size(); ++column) sum += model.mass[k][column] * x[column];
  return sum;
}

/// Row `k` of J_n lambda_n + J_t lambda_t.
ex contact_force(const SymbolicModel& model, int k, const Symbols& lambda_n, const Symbols& lambda_t) {
  ex sum = 0;
  std::size_t t = 0;
  for (std::size_t i = 0; i < model.contacts.size(); ++i) {
    sum += model.contacts[i].gap.diff(model.q[k]) * lambda_n[i];
    for (const auto& direction : model.contacts[i].tangents) sum += direction[k] * lambda_t[t++];
  }
  return sum;
}

/// Row `k` of f_v + B_u u.
ex load(const SymbolicModel& model, int k) {
  ex force = model.force[k];
  for (std::size_t c = 0; c < model.u.size(); ++c) force += model.input[k][c] * model.u[c];
  return force;
}

/// @throws InputError
const SymbolicModel& model_of(const Problem& problem) {
  const SymbolicProblem* symbolic = problem.symbolic();
  if (!symbolic)
    throw InputError("problem", problem.info().id, "a problem with formulas is required: a scene or a scene file");
  if (has_levers(problem.info()))
    throw InputError("friction", "a contact",
                     "equations of a mathematical program require a bound, not the force of a contact");
  for (const ContactInfo& contact : problem.info().contacts) {
    if (contact.mu_static != 0)
      throw InputError(fmt::format("contact '{}': mu_static", contact.name), contact.mu_static,
                       "equations of a mathematical program require the same coefficient while it sticks and slips");
  }
  for (const auto& contact : symbolic->equations().contacts) {
    if (contact.eps_r.has(symbolic->equations().v_n))
      throw InputError(fmt::format("contact '{}': e", contact.name), "a formula of vn",
                       "equations of a mathematical program require a coefficient that does not depend on vn");
  }
  return symbolic->equations();
}

}  // namespace

SmoothFunction pseudo_time_dynamics(const Problem& problem) {
  const SymbolicModel& model = model_of(problem);
  const auto& info = problem.info();
  const Symbols w = symbols(info.n_q), lambda_n = symbols(info.n_c()), lambda_t = symbols(info.n_lambda_t);
  const symbol s;
  Expressions dynamics;
  for (int k = 0; k < info.n_q; ++k) {
    const ex contact = k == info.clock ? ex(0) : contact_force(model, k, lambda_n, lambda_t);
    dynamics.push_back(mass_times(model, k, Expressions(w.begin(), w.end())) - s * load(model, k) - contact);
  }
  return {dynamics, join<symbol>({model.q, model.v, w, {s}, lambda_n, lambda_t, model.u}), model.constants()};
}

PlantFunctions plant_functions(const Problem& problem, double eps) {
  const SymbolicModel& model = model_of(problem);
  const auto& info = problem.info();
  const int n_q = info.n_q, n_c = info.n_c();
  const auto constants = model.constants();
  const Symbols w = symbols(n_q), v_plus = symbols(n_q), v_minus = symbols(n_q), lambda_n = symbols(n_c),
                lambda_t = symbols(info.n_lambda_t);
  const symbol h;

  PlantFunctions functions;
  Expressions dynamics, impulse, jump, gap, ahead, slip, restitution, normal_velocity;
  for (int k = 0; k < n_q; ++k) jump.push_back(v_plus[k] - v_minus[k]);
  for (int k = 0; k < n_q; ++k) {
    const ex contact = k == info.clock ? ex(0) : contact_force(model, k, lambda_n, lambda_t);
    dynamics.push_back(mass_times(model, k, Expressions(w.begin(), w.end())) - load(model, k) - contact);
    impulse.push_back(mass_times(model, k, jump) - contact);
  }
  GiNaC::exmap step;
  for (int k = 0; k < n_q; ++k) step[model.q[k]] = model.q[k] + eps * h * model.v[k];
  for (const auto& contact : model.contacts) {
    gap.push_back(contact.gap);
    ahead.push_back(contact.gap.subs(step));
    ex rate = 0, after = 0;
    for (int k = 0; k < n_q; ++k) {
      rate += contact.gap.diff(model.q[k]) * (v_plus[k] + contact.eps_r * v_minus[k]);
      after += contact.gap.diff(model.q[k]) * model.v[k];
    }
    restitution.push_back(rate);
    normal_velocity.push_back(after);
    for (const auto& direction : contact.tangents) {
      ex sum = 0;
      for (int k = 0; k < n_q; ++k) sum += direction[k] * model.v[k];
      slip.push_back(sum);
    }
  }
  functions.dynamics = {dynamics, join<symbol>({model.q, model.v, w, lambda_n, lambda_t, model.u}), constants};
  functions.gap = {gap, model.q, constants};
  functions.slip = {slip, join<symbol>({model.q, model.v}), constants};
  functions.impulse = {impulse, join<symbol>({model.q, v_plus, v_minus, lambda_n, lambda_t}), constants};
  functions.restitution = {restitution, join<symbol>({model.q, v_plus, v_minus}), constants};
  functions.normal_velocity = {normal_velocity, join<symbol>({model.q, model.v}), constants};
  functions.ahead = {ahead, join<symbol>({model.q, model.v, {h}}), constants};
  return functions;
}

}  // namespace ricochet
