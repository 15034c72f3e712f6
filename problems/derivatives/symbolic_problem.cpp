#include "problems/derivatives/symbolic_problem.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <set>

#include "problems/derivatives/friction_elements.h"
#include "problems/derivatives/real_functions.h"
#include "problems/derivatives/restitution_formula.h"
#include "problems/derivatives/rolling_friction.h"
#include "problems/derivatives/varying_friction.h"
#include "problems/input_error.h"
#include "problems/join.h"
#include "problems/regions/switching_functions.h"

namespace ricochet {
namespace {

using GiNaC::ex;
using GiNaC::symbol;

std::vector<symbol> make_symbols(const char* name, int count) {
  std::vector<symbol> symbols;
  for (int k = 0; k < count; ++k) symbols.emplace_back(fmt::format("{}[{}]", name, k));
  return symbols;
}

/// ContactInfo::mu_static: 0 if it is no other than `mu`.
double larger_coefficient(double mu_static, double mu) {
  return mu_static == mu ? 0 : mu_static;
}

bool depends_on(const ex& expression, const std::vector<symbol>& symbols) {
  return std::any_of(symbols.begin(), symbols.end(), [&](const symbol& s) { return expression.has(s); });
}

bool depends_on(const std::vector<ex>& expressions, const std::vector<symbol>& symbols) {
  return std::any_of(expressions.begin(), expressions.end(), [&](const ex& e) { return depends_on(e, symbols); });
}

/// Column-major derivative of `values` with respect to `variables`.
std::vector<ex> jacobian(const std::vector<ex>& values, const std::vector<symbol>& variables) {
  std::vector<ex> entries;
  for (const auto& x : variables) {
    for (const auto& value : values) entries.push_back(value.diff(x));
  }
  return entries;
}

std::vector<ex> hessian(const ex& value, const std::vector<symbol>& variables) {
  std::vector<ex> gradient;
  for (const auto& x : variables) gradient.push_back(value.diff(x));
  return jacobian(gradient, variables);
}

ex dot(const std::vector<ex>& x, const std::vector<symbol>& y) {
  ex total = 0;
  for (std::size_t k = 0; k < x.size(); ++k) total += x[k] * y[k];
  return total;
}

/// Calls visit(expressions) with every list of expressions of a model.
void for_each_list(SymbolicModel& model, const auto& visit) {
  for (auto* list : {&model.q0, &model.v0}) visit(*list);
  for (auto* rows : {&model.mass, &model.input}) {
    for (auto& row : *rows) visit(row);
  }
  visit(model.force);
  visit(model.control);
  for (auto& contact : model.contacts) {
    for (auto& direction : contact.tangents) visit(direction);
    visit(contact.drives);
  }
  for (auto& element : model.frictions) {
    for (auto& direction : element.tangents) visit(direction);
    visit(element.drives);
  }
}

/// Adds the clock, Problem (7), as the last coordinate if the model depends on time. @return whether it does
bool add_clock(SymbolicModel& model) {
  add_control_of_time(model);
  bool has_time = model.has_clock || (model.until && model.until->has(model.t));
  for_each_list(model, [&](const std::vector<ex>& list) { has_time = has_time || depends_on(list, {model.t}); });
  for (const auto& contact : model.contacts) {
    has_time = has_time || contact.gap.has(model.t) ||
               std::any_of(contact.drives.begin(), contact.drives.end(), [](const ex& e) { return !e.is_zero(); });
  }
  if (!has_time) return false;
  const std::size_t n = model.q.size();
  model.q.push_back(model.t);
  model.v.emplace_back("v_clock");
  model.q0.emplace_back(0);
  model.v0.emplace_back(1);
  for (auto& row : model.mass) row.emplace_back(0);
  model.mass.emplace_back(n + 1, 0);
  model.mass[n][n] = 1;
  model.force.emplace_back(0);
  if (!model.input.empty()) model.input.emplace_back(model.u.size(), 0);
  for (auto& contact : model.contacts) {
    for (std::size_t d = 0; d < contact.tangents.size(); ++d)
      contact.tangents[d].push_back(contact.drives.empty() ? ex(0) : contact.drives[d]);
  }
  return true;
}

}  // namespace

std::mutex& formulas_mutex() {
  static std::mutex mutex;
  return mutex;
}

void add_control_of_time(SymbolicModel& model) {
  if (!depends_on(model.control, {model.t})) return;
  for (std::size_t row = 0; row < model.input.size(); ++row) {
    for (std::size_t k = 0; k < model.control.size(); ++k) model.force[row] += model.input[row][k] * model.control[k];
  }
  model.input.clear();
  model.control.clear();
  model.u.clear();
}

SymbolicModel normalized(SymbolicModel model) {
  const auto make_real = [](ex& e) { e = with_real_symbols(e); };
  for_each_list(model, [&](std::vector<ex>& list) { std::for_each(list.begin(), list.end(), make_real); });
  make_real(model.end_time);
  for (auto& contact : model.contacts) {
    for (ex* expression : {&contact.gap, &contact.eps_r, &contact.mu, &contact.mu_static}) make_real(*expression);
    contact.mu_varies = contact.mu_varies || depends_on(contact.mu, model.q) || contact.mu.has(model.t);
    if (contact.mu_varies || model.number(contact.mu) != 0) continue;
    contact.tangents.clear();
    contact.drives.clear();
  }
  for (auto& element : model.frictions) {
    make_real(element.bound);
    make_real(element.static_ratio);
  }
  if (model.potential_energy) make_real(*model.potential_energy);
  if (model.until) make_real(*model.until);
  if (model.geometry) model.geometry->for_each_number(make_real);
  return model;
}

std::vector<StraightLineProgram::Constant> SymbolicModel::constants(bool may_change) const {
  std::vector<StraightLineProgram::Constant> constants;
  for (std::size_t k = 0; k < parameters.size(); ++k)
    constants.push_back({parameter_symbols[k], parameters[k].value, may_change});
  return constants;
}

double SymbolicModel::number(const GiNaC::ex& expression) const {
  double value = 0;
  StraightLineProgram({expression}, {}, constants()).evaluate({}, &value);
  return value;
}

double SymbolicModel::number_at_start(const GiNaC::ex& formula) const {
  std::vector<StraightLineProgram::Constant> start = constants();
  start.push_back({t, 0});
  for (std::size_t k = 0; k < q.size(); ++k) {
    start.push_back({q[k], number(q0[k])});
    start.push_back({v[k], number(v0[k])});
  }
  double value = 0;
  StraightLineProgram({formula}, {}, start).evaluate({}, &value);
  return value;
}

const GiNaC::ex* SymbolicModel::exact_value(const ParameterInfo& parameter) const {
  const auto exact = exact_values.find(parameter.name);
  return exact != exact_values.end() && number(exact->second) == parameter.value ? &exact->second : nullptr;
}

SymbolicProblem::SymbolicProblem(SymbolicModel model)
    : stated_(normalized(std::move(model))),
      model_(with_friction_coordinates(with_jumps_as_friction(with_varying_friction(with_rolling_friction(stated_))))) {
  info_.n_friction_elements = n_levers(stated_) + static_cast<int>(model_.frictions.size());
  if (add_clock(model_)) info_.clock = static_cast<int>(model_.q.size()) - 1;
  const int n_q = static_cast<int>(model_.q.size());

  info_.id = model_.id;
  info_.title = model_.title;
  info_.source = model_.source;
  info_.hard_feature = model_.hard_feature;
  info_.parameters = model_.parameters;
  info_.impact_law = model_.impact_law;
  info_.n_q = n_q;
  info_.n_u = static_cast<int>(model_.u.size());
  const auto numbers = [&](const Expressions& expressions) {
    Vector values(static_cast<Eigen::Index>(expressions.size()));
    for (std::size_t k = 0; k < expressions.size(); ++k)
      values[static_cast<Eigen::Index>(k)] = model_.number(expressions[k]);
    return values;
  };
  info_.q0 = numbers(model_.q0);
  info_.v0 = numbers(model_.v0);
  info_.u = numbers(model_.control);
  info_.end_time = model_.number(model_.end_time);
  if (model_.geometry) {
    Expressions formulas;
    model_.geometry->for_each_number([&](const ex& number) { formulas.push_back(number); });
    const Vector values = numbers(formulas);
    auto geometry = std::make_shared<Geometry>(Geometry{without_numbers<double>(*model_.geometry)});
    geometry->for_each_number([next = values.data()](double& number) mutable { number = *next++; });
    info_.geometry = std::move(geometry);
  }

  info_.region = model_.region;
  if (SwitchedModel switched = with_switching_functions(with_jumps_as_friction(stated_)); !switched.functions.empty()) {
    info_.switches = switched.described;
    if (model_.until) info_.until = static_cast<int>(std::ssize(info_.switches)) - 1;
    switched_ = std::make_shared<const SwitchedModel>(std::move(switched));
  }

  total_force_ = model_.force;
  for (std::size_t row = 0; row < model_.input.size(); ++row) total_force_[row] += dot(model_.input[row], model_.u);

  describe_contacts();
  const int n_c = info_.n_c();
  a_ = make_symbols("a", n_q);
  w_ = make_symbols("w", n_q);
  w_c_ = make_symbols("w_c", n_c);
  lambda_n_ = make_symbols("lambda_n", n_c);
  lambda_t_ = make_symbols("lambda_t", info_.n_lambda_t);
  make_programs(model_.constants());
  describe_structure();
}

void SymbolicProblem::describe_structure() {
  const int n_q = info_.n_q;
  auto& structure = info_.structure;
  structure.constant_mass = mass_.is_constant();
  structure.diagonal_mass =
      std::all_of(mass_.positions().begin(), mass_.positions().end(), [&](int k) { return k % (n_q + 1) == 0; });
  structure.force_uses_position = depends_on(total_force_, model_.q);
  structure.force_uses_velocity = depends_on(total_force_, model_.v);
  structure.constant_force_jacobian = force_jacobian_.is_constant();
  std::set<std::pair<int, int>> couplings;
  for (const SparseProgram* program : {&mass_, &force_jacobian_, &mass_q_}) {  // columns of n_q entries
    for (const int at : program->positions()) {
      const int row = at % n_q, column = at / n_q % n_q;
      if (row != column && column != info_.clock) couplings.emplace(std::min(row, column), std::max(row, column));
    }
  }
  structure.couplings.assign(couplings.begin(), couplings.end());
  structure.has_potential = model_.potential_energy.has_value();
  structure.has_formulas = structure.has_bounds = true;
  structure.force_jumps = std::ranges::any_of(total_force_, may_jump);
}

void SymbolicProblem::make_programs(const std::vector<StraightLineProgram::Constant>& constants) {
  const int n_q = info_.n_q;

  // Values.
  Expressions mass, gaps, normals, tangents;
  for (int column = 0; column < n_q; ++column) {
    for (int row = 0; row < n_q; ++row) mass.push_back(model_.mass[row][column]);
  }
  for (std::size_t i = 0; i < model_.contacts.size(); ++i) {
    const auto& contact = model_.contacts[i];
    gaps.push_back(contact.gap);
    for (const int k : info_.contacts[i].support) normals.push_back(contact.gap.diff(model_.q[k]));
    for (const auto& direction : contact.tangents) {
      for (const int k : info_.contacts[i].support) tangents.push_back(direction[k]);
    }
  }
  mass_ = SparseProgram(mass, {model_.q}, constants);
  force_ = SparseProgram(total_force_, {model_.q, model_.v, model_.u}, constants);
  gap_ = SparseProgram(gaps, {model_.q}, constants);
  normal_ = SparseProgram(normals, {model_.q}, constants);
  tangent_ = SparseProgram(tangents, {model_.q}, constants);
  Expressions coefficients;
  if (!varying_.empty()) {
    const SymbolicModel stated = with_rolling_friction(stated_);
    for (const int i : varying_) coefficients.push_back(stated.contacts[static_cast<std::size_t>(i)].mu);
  }
  varying_mu_ = SparseProgram(coefficients, {model_.q}, constants);
  potential_ = SparseProgram({model_.potential_energy.value_or(0)}, {model_.q}, constants);

  // First derivatives.
  Expressions momentum(n_q), contact_force;
  for (int row = 0; row < n_q; ++row) momentum[row] = dot(model_.mass[row], a_);
  const ex work = contact_force_work(w_);
  for (const auto& weight : w_) contact_force.push_back(work.diff(weight));
  Expressions bias;
  for (const auto& gap : gaps) {
    ex gap_velocity = 0;
    for (int k = 0; k < n_q; ++k) gap_velocity += gap.diff(model_.q[k]) * model_.v[k];
    ex value = 0;
    for (int k = 0; k < n_q; ++k) value += gap_velocity.diff(model_.q[k]) * model_.v[k];
    bias.push_back(value);
  }
  std::vector<symbol> state = model_.q;
  state.insert(state.end(), model_.v.begin(), model_.v.end());
  force_jacobian_ = SparseProgram(jacobian(total_force_, state), {model_.q, model_.v, model_.u}, constants);
  mass_q_ = SparseProgram(jacobian(momentum, model_.q), {model_.q, a_}, constants);
  contact_q_ = SparseProgram(jacobian(contact_force, model_.q), {model_.q, lambda_n_, lambda_t_}, constants);
  gap_bias_ = SparseProgram(bias, {model_.q, model_.v}, constants);
  Expressions slip;
  for (const auto& contact : model_.contacts) {
    for (const auto& direction : contact.tangents) slip.push_back(dot(direction, model_.v));
  }
  slip_q_ = SparseProgram(jacobian(slip, model_.q), {model_.q, model_.v}, constants);

  Expressions functions = model_.switching;
  if (switched_) {
    GiNaC::exmap values;  // of signs inside of other arguments
    for (std::size_t k = 0; k < switched_->functions.size(); ++k) {
      functions.push_back(switched_->functions[k].subs(values));
      values[switched_->signs[k]] = sign(functions.back());
    }
  }
  switching_ = SparseProgram(functions, {model_.q, model_.v}, constants);
  state.insert(state.end(), model_.parameter_symbols.begin(), model_.parameter_symbols.end());
  switching_derivative_ = SparseProgram(jacobian(functions, state), {model_.q, model_.v}, constants);
}

void SymbolicProblem::open_parameters() {
  are_parameters_open_ = true;
  const auto constants = model_.constants(are_parameters_open_);
  make_programs(constants);
  describe_structure();
  Expressions numbers = join<ex>({model_.q0, model_.v0, model_.control, {model_.end_time}});
  for (const auto& contact : model_.contacts) numbers.push_back(eps_r_of(contact));
  for (const auto& contact : model_.contacts) numbers.push_back(contact.mu);
  for (const auto& contact : model_.contacts) numbers.push_back(contact.mu_static);
  if (model_.geometry) model_.geometry->for_each_number([&](const ex& number) { numbers.push_back(number); });
  GiNaC::exmap start{{model_.t, 0}};
  for (std::size_t k = 0; k < stated_.q.size(); ++k) {
    start[stated_.q[k]] = stated_.q0[k];
    start[stated_.v[k]] = stated_.v0[k];
  }
  for (const auto& element : model_.frictions)
    numbers.push_back(element.bound.subs(start, GiNaC::subs_options::no_pattern));
  numbers_ = SparseProgram(numbers, {}, constants);
  number_values_.resize(numbers.size());
}

bool SymbolicProblem::set_parameters(std::span<const double> values) {
  numbers_.set_constants(values);
  numbers_.evaluate({}, number_values_.data());
  const auto n_c = static_cast<std::size_t>(info_.n_c());
  const double* mu = number_values_.data() + info_.q0.size() + info_.v0.size() + info_.u.size() + 1 + info_.n_c();
  for (std::size_t i = 0; i < n_c; ++i) {
    if (!info_.contacts[i].is_bilateral && (mu[i] != 0) != (info_.contacts[i].mu != 0)) return false;
  }
  const std::span bounds(number_values_.end() - std::ssize(model_.frictions), number_values_.end());
  if (std::ranges::any_of(bounds, [](double F) { return !(F > 0); }))
    return false;  // of jumps that are no friction then
  for (SparseProgram* program : {&mass_, &force_, &gap_, &normal_, &tangent_, &varying_mu_, &potential_,
                                 &force_jacobian_, &mass_q_, &contact_q_, &gap_bias_, &slip_q_, &switching_,
                                 &switching_derivative_, &dynamics_hessian_, &gap_hessian_, &parameter_derivative_}) {
    program->set_constants(values);
  }
  const double* next = number_values_.data();
  const auto take = [&](Vector& x) {
    std::copy_n(next, x.size(), x.data());
    next += x.size();
  };
  take(info_.q0);
  take(info_.v0);
  stated_q0_ = stated_v0_ = Vector();
  take(info_.u);
  info_.end_time = *next++;
  for (auto& contact : info_.contacts) contact.eps_r = *next++;
  for (auto& contact : info_.contacts) contact.mu = *next++;
  for (auto& contact : info_.contacts) contact.mu_static = larger_coefficient(*next++, contact.mu);
  for (std::size_t i = 0; i < n_c; ++i) {
    ContactInfo& contact = info_.contacts[i];
    if (const auto* formula = dynamic_cast<const RestitutionFormula*>(contact.eps_r_of_speed.get()))
      contact.eps_r_of_speed = formula->with_parameters(values);
    if (contact.bound) contact.bound = bounds[i + bounds.size() - n_c];
  }
  if (info_.geometry) {
    auto geometry = std::make_shared<Geometry>(*info_.geometry);
    geometry->for_each_number([&](double& number) { number = *next++; });
    info_.geometry = std::move(geometry);
  }
  for (std::size_t k = 0; k < values.size(); ++k)
    info_.parameters[k].value = model_.parameters[k].value = stated_.parameters[k].value = values[k];
  parameters_changed();
  return true;
}

void SymbolicProblem::describe_contacts() {
  for (auto& contact : model_.contacts) {
    ContactInfo described;
    described.name = contact.name;
    described.is_bilateral = contact.is_bilateral;
    described.is_friction_element = contact.is_friction_element;
    if (contact.is_friction_element) {
      const auto n_stated = model_.contacts.size() - model_.frictions.size();
      described.bound = constant_bound(model_.frictions[info_.contacts.size() - n_stated]);
    }
    described.eps_r = model_.number(eps_r_of(contact));
    if (contact.eps_r.has(model_.v_n)) described.eps_r_of_speed = std::make_shared<RestitutionFormula>(model_, contact);
    described.mu = model_.number(contact.mu);
    described.mu_varies = contact.mu_varies;
    if (contact.mu_varies) varying_.push_back(info_.n_c());
    described.n_t = static_cast<int>(contact.tangents.size());
    described.mu_static = larger_coefficient(model_.number(contact.mu_static), described.mu);
    if (described.mu_static != 0 && (contact.mu_varies || described.n_t != 1))
      throw InputError(contact.is_friction_element ? fmt::format("friction '{}': static_ratio", contact.name)
                                                   : fmt::format("contact '{}': mu_static", contact.name),
                       described.mu_static,
                       "a coefficient mu > 0 that does not vary, and one tangent direction, are required");
    if (described.mu > 0 && contact.tangents.empty() && !contact.is_bilateral) {
      throw InputError(fmt::format("contact '{}': mu", contact.name), described.mu,
                       "friction needs tangent directions Jt");
    }
    std::set<int> support;
    const bool jumps = may_jump(contact.gap);  // where its derivative is zero
    bool is_affine = !jumps;
    bool has_corners = false;
    for (int k = 0; k < info_.n_q; ++k) {
      const auto& x = model_.q[k];
      const ex slope = contact.gap.diff(x);
      has_corners = has_corners || may_jump(slope);
      const bool in_gap = !slope.is_zero() || (jumps && contact.gap.has(x));
      bool in_tangents = false;
      for (const auto& direction : contact.tangents) {
        in_tangents = in_tangents || !direction[k].is_zero() ||
                      std::any_of(direction.begin(), direction.end(), [&](const ex& e) { return e.has(x); });
        is_affine = is_affine && !depends_on(direction[k], model_.q);
      }
      if (in_gap || in_tangents) support.insert(k);
      is_affine = is_affine && !depends_on(slope, model_.q);
    }
    described.support.assign(support.begin(), support.end());
    described.is_moving = support.contains(info_.clock);
    described.is_affine = is_affine;
    described.has_corners = has_corners;
    described.normal_begin = info_.n_normal_entries;
    described.tangent_begin = info_.n_tangent_entries;
    described.tangent_index = info_.n_lambda_t;
    const int entries = static_cast<int>(described.support.size());
    info_.n_normal_entries += entries;
    info_.n_tangent_entries += entries * described.n_t;
    info_.n_lambda_t += described.n_t;
    (described.is_bilateral ? info_.bilateral : info_.unilateral).push_back(info_.n_c());
    info_.contacts.push_back(std::move(described));
  }
}

/// The bound of an element as a number; null if it depends on the motion.
std::optional<double> SymbolicProblem::constant_bound(const SymbolicModel::FrictionElement& element) const {
  if (depends_on(element.bound, model_.q) || depends_on(element.bound, model_.v) || element.bound.has(model_.t))
    return std::nullopt;
  return model_.number(element.bound);
}

/// The coefficient of restitution as a formula of the parameters, with ContactInfo::kVaries if it depends on the speed.
ex SymbolicProblem::eps_r_of(const SymbolicModel::Contact& contact) const {
  return contact.eps_r.has(model_.v_n) ? ex(ContactInfo::kVaries) : contact.eps_r;
}

/// weight' (J_n lambda_n + J_t lambda_t), without the clock
ex SymbolicProblem::contact_force_work(const std::vector<symbol>& weight) const {
  ex work = 0;
  for (std::size_t i = 0; i < model_.contacts.size(); ++i) {
    const auto& contact = model_.contacts[i];
    for (int k = 0; k < info_.n_q; ++k) {
      if (k == info_.clock) continue;
      work += weight[k] * contact.gap.diff(model_.q[k]) * lambda_n_[i];
      for (std::size_t d = 0; d < contact.tangents.size(); ++d) {
        work += weight[k] * contact.tangents[d][k] * lambda_t_[info_.contacts[i].tangent_index + d];
      }
    }
  }
  return work;
}

void SymbolicProblem::mass_matrix(const double* q, double* M) const {
  mass_.evaluate({q}, M);
}

void SymbolicProblem::force(const double* q, const double* v, const double* u, double* f) const {
  force_.evaluate({q, v, u}, f);
}

void SymbolicProblem::gap(const double* q, double* f_c) const {
  gap_.evaluate({q}, f_c);
}

void SymbolicProblem::normal_jacobian(const double* q, double* J_n) const {
  normal_.evaluate({q}, J_n);
}

void SymbolicProblem::tangent_jacobian(const double* q, double* J_t) const {
  tangent_.evaluate({q}, J_t);
  if (varying_.empty()) return;
  thread_local std::vector<double> mu;
  mu.resize(varying_.size());
  varying_mu_.evaluate({q}, mu.data());
  for (std::size_t k = 0; k < varying_.size(); ++k) {
    const ContactInfo& contact = info_.contacts[static_cast<std::size_t>(varying_[k])];
    if (!(mu[k] > 0)) std::fill_n(J_t + contact.tangent_begin, contact.support.size() * contact.n_t, std::nan(""));
  }
}

void SymbolicProblem::friction_coefficients(const double* q, double* mu) const {
  Problem::friction_coefficients(q, mu);
  if (varying_.empty()) return;
  std::vector<double> varying(varying_.size());
  varying_mu_.evaluate({q}, varying.data());
  for (std::size_t k = 0; k < varying_.size(); ++k) mu[varying_[k]] = varying[k];
}

void SymbolicProblem::mass_bounds(const Interval* q, Interval* M) const {
  mass_.evaluate({q}, M);
}

void SymbolicProblem::force_bounds(const Interval* q, const Interval* v, const double* u, Interval* f) const {
  thread_local std::vector<Interval> control;
  control.assign(u, u + info_.n_u);
  force_.evaluate({q, v, static_cast<const Interval*>(control.data())}, f);
}

// The contacts of a scene share subexpressions in one program, which computes all of them.

void SymbolicProblem::gap_bounds(std::span<const int>, const Interval* q, Interval* f_c) const {
  gap_.evaluate({q}, f_c);
}

void SymbolicProblem::normal_bounds(std::span<const int>, const Interval* q, Interval* J_n) const {
  normal_.evaluate({q}, J_n);
}

void SymbolicProblem::tangent_bounds(std::span<const int>, const Interval* q, Interval* J_t) const {
  tangent_.evaluate({q}, J_t);
}

void SymbolicProblem::gap_bias_bounds(std::span<const int>, const Interval* q, const Interval* v, Interval* b) const {
  gap_bias_.evaluate({q, v}, b);
}

void SymbolicProblem::slip_derivative_bounds(std::span<const int>, const Interval* q, const Interval* v,
                                             Interval* T) const {
  slip_q_.evaluate({q, v}, T);
}

void SymbolicProblem::switching(const double* q, const double* v, double* psi) const {
  switching_.evaluate({q, v}, psi);
}

void SymbolicProblem::switching_derivative(const double* q, const double* v, double* D) const {
  switching_derivative_.evaluate({q, v}, D);
}

std::unique_ptr<Problem> SymbolicProblem::in_region(std::span<const int> signs) const {
  if (!switched_) return nullptr;
  return as_here(ricochet::in_region(*switched_, signs));
}

std::unique_ptr<Problem> SymbolicProblem::without_until() const {
  SymbolicModel model = stated_;
  model.has_clock = info_.clock >= 0;
  model.until.reset();
  return as_here(std::move(model));
}

std::unique_ptr<Problem> SymbolicProblem::in_friction_state(std::span<const char> sticks) const {
  SymbolicModel model = stated_;
  model.has_clock = info_.clock >= 0;
  for (std::size_t i = 0; i < model.contacts.size(); ++i) {
    const ex mu_static = std::exchange(model.contacts[i].mu_static, 0);
    if (sticks[i] != 0) model.contacts[i].mu = mu_static;
  }
  std::size_t of_element = model.contacts.size() + static_cast<std::size_t>(n_levers(model));
  for (auto& element : model.frictions) {
    if (element.contact >= 0) continue;
    const ex ratio = std::exchange(element.static_ratio, 0);
    if (sticks[of_element++] != 0) element.bound *= ratio;
  }
  return as_here(std::move(model));
}

/// The problem of a `model` that follows from this one, with what has been set here.
std::unique_ptr<Problem> SymbolicProblem::as_here(SymbolicModel model) const {
  for (std::size_t k = 0; k < model.parameters.size(); ++k) model.parameters[k].value = info_.parameters[k].value;
  auto problem = std::make_unique<SymbolicProblem>(std::move(model));
  problem->info_.u = info_.u;
  problem->info_.end_time = info_.end_time;
  problem->info_.impact_law = info_.impact_law;
  problem->set_initial_state(info_.q0, info_.v0);
  return problem;
}

void SymbolicProblem::switching_bounds(const Interval* q, const Interval* v, Interval* psi) const {
  switching_.evaluate({q, v}, psi);
}

double SymbolicProblem::potential_energy(const double* q) const {
  double energy = 0;
  potential_.evaluate({q}, &energy);
  return energy;
}

void SymbolicProblem::force_jacobians(const double* q, const double* v, const double* u, double* f_q,
                                      double* f_v) const {
  thread_local std::vector<double> both;  // one program: sines and the like occur in both
  both.resize(static_cast<std::size_t>(force_jacobian_.size()));
  force_jacobian_.evaluate({q, v, u}, both.data());
  const auto half = static_cast<std::ptrdiff_t>(both.size() / 2);
  std::copy(both.begin(), both.begin() + half, f_q);
  std::copy(both.begin() + half, both.end(), f_v);
}

void SymbolicProblem::mass_derivative(const double* q, const double* a, double* Ma_q) const {
  mass_q_.evaluate({q, a}, Ma_q);
}

void SymbolicProblem::contact_force_derivative(const double* q, const double* lambda_n, const double* lambda_t,
                                               double* Jl_q) const {
  contact_q_.evaluate({q, lambda_n, lambda_t}, Jl_q);
}

void SymbolicProblem::gap_acceleration_bias(const double* q, const double* v, double* b) const {
  gap_bias_.evaluate({q, v}, b);
}

void SymbolicProblem::slip_velocity_derivative(const double* q, const double* v, double* T) const {
  slip_q_.evaluate({q, v}, T);
}

void SymbolicProblem::dynamics_hessian(const double* q, const double* v, const double* u, const double* a,
                                       const double* lambda_n, const double* lambda_t, const double* w,
                                       double* H) const {
  std::call_once(dynamics_hessian_once_, [this] {
    ex value = -contact_force_work(w_);
    for (int row = 0; row < info_.n_q; ++row) value += w_[row] * (dot(model_.mass[row], a_) - total_force_[row]);
    dynamics_hessian_ = SparseProgram(hessian(value, join<symbol>({model_.q, model_.v})),
                                      {model_.q, model_.v, model_.u, a_, lambda_n_, lambda_t_, w_},
                                      model_.constants(are_parameters_open_));
  });
  dynamics_hessian_.evaluate({q, v, u, a, lambda_n, lambda_t, w}, H);
}

void SymbolicProblem::gap_hessian(const double* q, const double* w, double* H) const {
  std::call_once(gap_hessian_once_, [this] {
    ex value = 0;
    for (int i = 0; i < info_.n_c(); ++i) value += w_c_[i] * model_.contacts[i].gap;
    gap_hessian_ = SparseProgram(hessian(value, model_.q), {model_.q, w_c_}, model_.constants(are_parameters_open_));
  });
  gap_hessian_.evaluate({q, w}, H);
}

void SymbolicProblem::parameter_derivative(const double* q, const double* v, const double* a, const double* lambda_n,
                                           const double* lambda_t, double* D) const {
  std::call_once(parameter_derivative_once_, [this] {
    Expressions entries;
    const ex contact_work = contact_force_work(w_);
    for (const auto& p : model_.parameter_symbols) {
      for (int row = 0; row < info_.n_q; ++row) {
        ex value = (dot(model_.mass[row], a_) - total_force_[row] - contact_work.diff(w_[row])).diff(p);
        for (std::size_t k = 0; k < model_.control.size() && !model_.input.empty(); ++k)
          value -= model_.input[row][k] * model_.control[k].diff(p);
        entries.push_back(value);
      }
      for (const auto& contact : model_.contacts) entries.push_back(contact.gap.diff(p));
      for (const auto& contact : model_.contacts) {
        ex rate = 0;
        for (int k = 0; k < info_.n_q; ++k) rate += contact.gap.diff(model_.q[k]) * model_.v[k];
        entries.push_back(rate.diff(p));
      }
      for (const auto& contact : model_.contacts) {
        for (const auto& direction : contact.tangents) entries.push_back(dot(direction, model_.v).diff(p));
      }
    }
    parameter_derivative_ = SparseProgram(entries, {model_.q, model_.v, model_.u, a_, lambda_n_, lambda_t_},
                                          model_.constants(are_parameters_open_));
  });
  parameter_derivative_.evaluate({q, v, info_.u.data(), a, lambda_n, lambda_t}, D);
}

void SymbolicProblem::parameter_derivative_of_constants(double* C) const {
  for (const auto& p : model_.parameter_symbols) {
    for (const auto& value : model_.q0) *C++ = model_.number(value.diff(p));
    for (const auto& value : model_.v0) *C++ = model_.number(value.diff(p));
    for (const auto& contact : model_.contacts) *C++ = model_.number(eps_r_of(contact).diff(p));
    for (const auto& contact : model_.contacts) *C++ = model_.number(contact.mu.diff(p));
    *C++ = model_.number(model_.end_time.diff(p));
  }
}

}  // namespace ricochet
