#include "methods/mpcc_equations/contact_equations.h"

#include <fmt/format.h>

#include "methods/contact_laws/friction_polygon.h"
#include "methods/mpcc_equations/nlp_blocks.h"
#include "problems/input_error.h"
#include "problems/join.h"

namespace ricochet {
namespace {

using GiNaC::ex;
using GiNaC::symbol;
using Symbols = std::vector<symbol>;
using Expressions = SmoothFunction::Expressions;

// An initial gap up to here is rounding of a contact that touches [m].
constexpr double kTouching = 1e-12;

}  // namespace

ContactEquations::ContactEquations(const Problem& plant, Cone cone, int facets, double eps, Mpcc& mpcc)
    : step_functions_(make_step_functions(plant)),
      plant_(step_functions_.problem ? *step_functions_.problem : plant),
      info_(plant_.info()),
      mpcc_(mpcc),
      functions_(plant_functions(plant_, eps)),
      cone_(cone),
      facets_(facets) {
  if (!info_.bilateral.empty())
    throw InputError("plant", info_.id,
                     "a transcription has no bilateral constraints yet: one without them is required");
  const Vector infinite = Vector::Constant(info_.n_q, kInfinity);
  bounds_ = {-infinite, infinite, -infinite, infinite};
  for (const auto& contact : info_.contacts) {
    const auto n_t = static_cast<std::size_t>(contact.n_t);
    const symbol slack, lambda_n, gamma;
    const Symbols lambda_t(n_t), v_t(n_t);
    ex size = 0;
    Expressions law;
    for (std::size_t d = 0; d < n_t; ++d) {
      size += lambda_t[d] * lambda_t[d];
      law.push_back(cone == Cone::squared ? ex(-v_t[d] - 2 * gamma * lambda_t[d])
                                          : ex(contact.mu * lambda_n * v_t[d] + gamma * lambda_t[d]));
    }
    const Symbols slack_inputs = join<symbol>({{slack, lambda_n}, lambda_t});
    const Symbols law_inputs = join<symbol>({{lambda_n, gamma}, lambda_t, v_t});
    cone_slack_.emplace_back(Expressions{slack - contact.mu * contact.mu * lambda_n * lambda_n + size}, slack_inputs,
                             std::vector<StraightLineProgram::Constant>{});
    cone_law_.emplace_back(law, law_inputs, std::vector<StraightLineProgram::Constant>{});
  }
}

int ContactEquations::add_variable(double lower, double guess, const std::string& name) {
  return mpcc_.nlp.add_variable(lower, kInfinity, guess, name);
}

std::vector<int> ContactEquations::add_variables(int count, double lower, double guess, const std::string& name) {
  std::vector<int> numbers;
  for (int k = 0; k < count; ++k) numbers.push_back(add_variable(lower, guess, fmt::format("{}[{}]", name, k)));
  return numbers;
}

void ContactEquations::add_linear(const Terms& terms, double lower, double upper, const std::string& name) {
  const int row = mpcc_.nlp.add_row(lower, upper, name);
  mpcc_.nlp.add_block(std::make_unique<LinearBlock>(row, terms));
}

/// 0 = function(variables) - minus
void ContactEquations::add_equations(const SmoothFunction& function, const std::vector<int>& variables,
                                     const std::string& name, const std::vector<int>& minus) {
  if (function.n_outputs() == 0) return;
  std::vector<int> rows;
  for (int k = 0; k < function.n_outputs(); ++k) {
    rows.push_back(mpcc_.nlp.add_row(0, 0, fmt::format("{}[{}]", name, k)));
    if (!minus.empty()) mpcc_.nlp.add_block(std::make_unique<LinearBlock>(rows.back(), Terms{{minus[k], -1.0}}));
  }
  mpcc_.nlp.add_block(std::make_unique<FunctionBlock>(function, variables, rows));
}

void ContactEquations::add_split(const SmoothFunction& function, const std::vector<int>& variables,
                                 const std::string& name, const std::vector<int>& plus, const std::vector<int>& minus) {
  const int first_row = mpcc_.nlp.n_rows();
  add_equations(function, variables, name, plus);
  for (std::size_t k = 0; k < minus.size(); ++k) {
    if (minus[k] < 0) continue;
    mpcc_.nlp.add_block(std::make_unique<LinearBlock>(first_row + static_cast<int>(k), Terms{{minus[k], 1}}));
  }
}

ContactEquations::Point ContactEquations::add_initial_state(const Vector& q, const Vector& v) {
  Point point;
  for (int k = 0; k < info_.n_q; ++k)
    point.q.push_back(mpcc_.nlp.add_variable(q[k], q[k], q[k], fmt::format("q_0[{}]", k)));
  for (int k = 0; k < info_.n_q; ++k)
    point.v.push_back(mpcc_.nlp.add_variable(v[k], v[k], v[k], fmt::format("v_0[{}]", k)));
  initial_gap_row_ = mpcc_.nlp.n_rows();
  for (int i = 0; i < info_.n_c(); ++i) {
    const std::string name = "initial gap of " + info_.contacts[i].name;
    point.gap.push_back(mpcc_.nlp.add_variable(0, kInfinity, kPositive, name));
    add_linear({{point.gap[i], 1}}, -kInfinity, kInfinity, name);
  }
  const Vector gap = plant_.gap(q);
  std::vector<bool> is_closed(info_.contacts.size());
  for (int i = 0; i < info_.n_c(); ++i) is_closed[i] = gap[i] <= kTouching;
  set_initial_state(point, q, v, is_closed);
  return point;
}

void ContactEquations::set_initial_state(const Point& point, const Vector& q, const Vector& v,
                                         const std::vector<bool>& is_closed) {
  const auto fix = [&](int variable, double value) {
    auto& x = mpcc_.nlp.variables[variable];
    x.lower = x.upper = x.guess = value;
  };
  for (int k = 0; k < info_.n_q; ++k) {
    fix(point.q[k], q[k]);
    fix(point.v[k], v[k]);
  }
  // A gap that equations held at its bound would leave the program no interior: closed contacts are constants.
  const Vector gap = plant_.gap(q);
  for (int i = 0; i < info_.n_c(); ++i) {
    auto& row = mpcc_.nlp.rows[initial_gap_row_ + i];
    auto& variable = mpcc_.nlp.variables[point.gap[i]];
    variable.upper = is_closed[i] ? 0 : kInfinity;
    variable.guess = is_closed[i] ? 0 : gap[i];
    row.lower = is_closed[i] ? -kInfinity : gap[i];
    row.upper = is_closed[i] ? kInfinity : gap[i];
  }
}

void ContactEquations::fix_elements(const std::vector<int>& of_contacts) {
  for (std::size_t i = 0; i < of_contacts.size(); ++i) {
    if (!info_.contacts[i].is_friction_element || of_contacts[i] < 0) continue;
    auto& variable = mpcc_.nlp.variables[of_contacts[i]];
    variable.lower = variable.upper = variable.guess = 0;
  }
}

void ContactEquations::drop_elements(int first) {
  for (int i = 0; i < info_.n_c(); ++i) {
    if (!is_element(i)) continue;
    auto& row = mpcc_.nlp.rows[static_cast<std::size_t>(first + i)];
    row.lower = -kInfinity;
    row.upper = kInfinity;
  }
}

std::vector<int> ContactEquations::add_velocity(const std::string& name) {
  std::vector<int> v;
  for (int k = 0; k < info_.n_q; ++k)
    v.push_back(mpcc_.nlp.add_variable(is_of_element(k) ? 0 : bounds_.v_lower[k],
                                       is_of_element(k) ? 0 : bounds_.v_upper[k], is_of_element(k) ? 0 : info_.v0[k],
                                       fmt::format("{}, v[{}]", name, k)));
  return v;
}

ContactEquations::Point ContactEquations::add_point(const std::string& name) {
  Point point;
  for (int k = 0; k < info_.n_q; ++k)
    point.q.push_back(mpcc_.nlp.add_variable(is_of_element(k) ? 0 : bounds_.q_lower[k],
                                             is_of_element(k) ? 0 : bounds_.q_upper[k],
                                             is_of_element(k) ? 0 : info_.q0[k], fmt::format("{}, q[{}]", name, k)));
  point.v = add_velocity(name);
  return point;
}

/// (1)
void ContactEquations::add_gap(Point& point, const std::string& name) {
  const Vector gap = plant_.gap(info_.q0).cwiseMax(kPositive);
  for (int i = 0; i < info_.n_c(); ++i)
    point.gap.push_back(add_variable(0, gap[i], fmt::format("{}, gap of {}", name, info_.contacts[i].name)));
  fix_elements(point.gap);
  const int first = mpcc_.nlp.n_rows();
  add_equations(functions_.gap, point.q, name + ", gap", point.gap);
  drop_elements(first);
}

/// (1)
void ContactEquations::add_slip_velocity(Point& point, const std::string& name) {
  point.slip = add_variables(info_.n_lambda_t, -kInfinity, 0, name + ", slip velocity");
  add_equations(functions_.slip, join<int>({point.q, point.v}), name + ", slip", point.slip);
}

/// (5)
void ContactEquations::add_switching(Point& point, const std::vector<int>& theta, const std::string& name) {
  if (step_functions_.size() == 0) return;
  point.psi_plus = add_variables(step_functions_.size(), 0, kPositive, name + ", psi+");
  point.psi_minus = add_variables(step_functions_.size(), 0, kPositive, name + ", psi-");
  add_split(step_functions_.switching, join<int>({point.q, point.v, theta}), name + ", switching function",
            point.psi_plus, point.psi_minus);
}

/// The unknowns of (2)-(4) at a point. @param has_force  whether the law is stated there, so that gamma is determined
std::vector<ContactEquations::Slip> ContactEquations::add_slips(const Point& point, bool has_force,
                                                                const std::string& name) {
  std::vector<Slip> slips(info_.contacts.size());
  for (std::size_t i = 0; i < slips.size(); ++i) {
    const auto& contact = info_.contacts[i];
    if (contact.n_t == 0) continue;
    const std::string at = fmt::format("{}, {}", name, contact.name);
    const bool has_signs = cone_ == Cone::squared || (cone_ == Cone::exact && contact.n_t == 1);
    Slip& slip = slips[i];
    if (has_signs) {
      slip.xi_plus = add_variables(contact.n_t, 0, kPositive, at + ", xi+");
      slip.xi_minus = add_variables(contact.n_t, 0, kPositive, at + ", xi-");
      for (int d = 0; d < contact.n_t; ++d)
        add_linear({{point.slip[contact.tangent_index + d], 1}, {slip.xi_plus[d], -1}, {slip.xi_minus[d], 1}}, 0, 0,
                   at + ", v_t = xi+ - xi-");
    }
    if (cone_ == Cone::polyhedral) {
      const int facets = contact.n_t == 1 ? 2 : facets_;
      slip.gamma = add_variables(1, 0, kPositive, at + ", gamma");
      slip.rates = add_variables(facets, 0, kPositive, at + ", D' v_t + gamma");
      for (int f = 0; f < facets; ++f) {
        const auto direction = facet_direction(contact.n_t, f, facets);
        Terms terms{{slip.rates[f], -1}, {slip.gamma[0], 1}};
        for (int d = 0; d < contact.n_t; ++d) terms.emplace_back(point.slip[contact.tangent_index + d], direction[d]);
        add_linear(terms, 0, 0, at + ", facet velocity");
      }
    } else if (has_force && !(cone_ == Cone::exact && contact.n_t == 1)) {
      slip.gamma = add_variables(1, 0, kPositive, at + ", gamma");
    }
  }
  return slips;
}

/// lambda_t and the slacks of the cone, in terms of lambda_n.
std::vector<ContactEquations::Force> ContactEquations::add_forces(const std::vector<int>& lambda_n, bool is_impulse,
                                                                  const std::string& name) {
  std::vector<Force> forces(info_.contacts.size());
  for (std::size_t i = 0; i < forces.size(); ++i) {
    const auto& contact = info_.contacts[i];
    if (contact.n_t == 0) continue;
    const std::string at = fmt::format("{}, {}", name, contact.name);
    Force& force = forces[i];
    if (is_impulse && contact.is_friction_element) {
      for (int d = 0; d < contact.n_t; ++d)
        force.lambda_t.push_back(mpcc_.nlp.add_variable(0, 0, 0, fmt::format("{}, lambda_t[{}]", at, d)));
      continue;
    }
    force.lambda_t = add_variables(contact.n_t, -kInfinity, 0, at + ", lambda_t");
    if (cone_ == Cone::polyhedral) {
      const int facets = contact.n_t == 1 ? 2 : facets_;
      force.facets = add_variables(facets, 0, kPositive, at + ", l");
      force.slack = add_variables(1, 0, kPositive, at + ", cone slack");
      Terms sum{{lambda_n[i], contact.mu}, {force.slack[0], -1}};
      for (const int l : force.facets) sum.emplace_back(l, -1);
      add_linear(sum, 0, 0, at + ", cone");
      for (int d = 0; d < contact.n_t; ++d) {
        Terms terms{{force.lambda_t[d], -1}};
        for (int f = 0; f < facets; ++f)
          terms.emplace_back(force.facets[f], facet_direction(contact.n_t, f, facets)[d]);
        add_linear(terms, 0, 0, at + ", lambda_t = D l");
      }
    } else if (cone_ == Cone::exact && contact.n_t == 1) {
      force.slack = add_variables(2, 0, kPositive, at + ", cone slack");
      for (const int sign : {1, -1})
        add_linear({{lambda_n[i], contact.mu}, {force.lambda_t[0], sign}, {force.slack[sign > 0 ? 0 : 1], -1}}, 0, 0,
                   at + ", cone");
    } else {
      force.slack = add_variables(1, 0, kPositive, at + ", cone slack");
      add_equations(cone_slack_[i], join<int>({force.slack, {lambda_n[i]}, force.lambda_t}), at + ", cone");
    }
  }
  return forces;
}

/// The first half of (3), or its published form.
void ContactEquations::add_friction_laws(const Point& point, const std::vector<Slip>& slip,
                                         const std::vector<Force>& force, const std::vector<int>& lambda_n,
                                         const std::string& name) {
  for (std::size_t i = 0; i < slip.size(); ++i) {
    const auto& contact = info_.contacts[i];
    if (contact.n_t == 0 || cone_ == Cone::polyhedral || slip[i].gamma.empty() || force[i].slack.empty()) continue;
    const auto first = point.slip.begin() + contact.tangent_index;
    const std::vector<int> v_t(first, first + contact.n_t);
    add_equations(cone_law_[i], join<int>({{lambda_n[i]}, slip[i].gamma, force[i].lambda_t, v_t}),
                  fmt::format("{}, {}, friction law", name, contact.name));
  }
}

ContactEquations::Stage ContactEquations::add_stage(const std::vector<int>& u, bool has_gap, const std::string& name) {
  Stage stage;
  stage.point = add_point(name);
  stage.w = add_variables(info_.n_q, -kInfinity, 0, name + ", w");
  for (int k = 0; k < info_.n_q; ++k) {
    if (is_of_element(k)) mpcc_.nlp.variables[stage.w[k]].lower = mpcc_.nlp.variables[stage.w[k]].upper = 0;
  }
  stage.lambda_n = add_variables(info_.n_c(), 0, kPositive, name + ", lambda_n");
  if (has_gap) add_gap(stage.point, name);
  add_slip_velocity(stage.point, name);
  stage.slip = add_slips(stage.point, true, name);
  stage.force = add_forces(stage.lambda_n, false, name);
  add_friction_laws(stage.point, stage.slip, stage.force, stage.lambda_n, name);
  stage.theta = add_variables(step_functions_.size(), 0, 0.5, name + ", theta");
  stage.theta_rest = add_variables(step_functions_.size(), 0, 0.5, name + ", 1 - theta");
  for (std::size_t k = 0; k < stage.theta.size(); ++k)
    add_linear({{stage.theta[k], 1}, {stage.theta_rest[k], 1}}, 1, 1, name + ", theta");
  add_switching(stage.point, stage.theta, name);
  add_equations(
      functions_.dynamics,
      join<int>({stage.point.q, stage.point.v, stage.w, stage.lambda_n, tangential(stage.force), u, stage.theta}),
      name + ", dynamics");
  return stage;
}

void ContactEquations::add_friction_pairs(const Slip& slip, const Force& force, double bias, const std::string& name) {
  if (force.slack.size() == 2) {
    mpcc_.add_pair({force.slack[0]}, slip.xi_plus, name + ", cone _|_ xi+", bias);
    mpcc_.add_pair({force.slack[1]}, slip.xi_minus, name + ", cone _|_ xi-", bias);
    return;
  }
  if (!force.slack.empty()) mpcc_.add_pair(force.slack, slip.gamma, name + ", cone _|_ gamma", bias);
  for (std::size_t f = 0; f < force.facets.size(); ++f)
    mpcc_.add_pair({force.facets[f]}, {slip.rates[f]}, name + ", l _|_ D' v_t + gamma", bias);
}

std::vector<int> ContactEquations::tangential(const std::vector<Force>& forces) {
  std::vector<int> all;
  for (const auto& force : forces) all.insert(all.end(), force.lambda_t.begin(), force.lambda_t.end());
  return all;
}

void ContactEquations::guess_split(const Vector& values, const std::vector<int>& plus, const std::vector<int>& minus) {
  auto& variables = mpcc_.nlp.variables;
  for (std::size_t k = 0; k < plus.size(); ++k) {
    const double value = values[static_cast<Eigen::Index>(k)];
    if (plus[k] >= 0) variables[plus[k]].guess = minus[k] >= 0 ? std::max(value, 0.0) : value;
    if (minus[k] >= 0) variables[minus[k]].guess = std::max(-value, 0.0);
  }
}

Vector ContactEquations::restitution(const Matrix& J_n, const Vector& v_plus, const Vector& v_minus) const {
  Vector rate(info_.n_c());
  for (int i = 0; i < info_.n_c(); ++i) rate[i] = J_n.col(i).dot(v_plus + info_.contacts[i].eps_r * v_minus);
  return rate;
}

void ContactEquations::guess_point(const Point& point, const Vector& q, const Vector& v,
                                   const std::vector<Slip>& slips) {
  auto& variables = mpcc_.nlp.variables;
  for (int k = 0; k < info_.n_q; ++k) {
    variables[point.q[k]].guess = q[k];
    variables[point.v[k]].guess = v[k];
  }
  const Vector gap = plant_.gap(q), v_t = plant_.tangent_jacobian(q).transpose() * v;
  for (std::size_t i = 0; i < point.gap.size(); ++i)
    variables[point.gap[i]].guess = std::max(gap[static_cast<Eigen::Index>(i)], 0.0);
  for (int t = 0; t < info_.n_lambda_t; ++t) variables[point.slip[t]].guess = v_t[t];
  for (std::size_t i = 0; i < slips.size(); ++i) {
    const auto& contact = info_.contacts[i];
    const double* slip = v_t.data() + contact.tangent_index;
    guess_split(v_t.segment(contact.tangent_index, contact.n_t), slips[i].xi_plus, slips[i].xi_minus);
    const double speed = v_t.segment(contact.tangent_index, contact.n_t).norm();
    for (const int gamma : slips[i].gamma) variables[gamma].guess = speed;
    for (std::size_t f = 0; f < slips[i].rates.size(); ++f) {
      const auto direction = facet_direction(contact.n_t, static_cast<int>(f), static_cast<int>(slips[i].rates.size()));
      double rate = speed;
      for (int d = 0; d < contact.n_t; ++d) rate += direction[d] * slip[d];
      variables[slips[i].rates[f]].guess = std::max(rate, 0.0);
    }
  }
}

void ContactEquations::guess_forces(const std::vector<Force>& forces, const Vector& lambda_n, const Vector& lambda_t) {
  auto& variables = mpcc_.nlp.variables;
  for (std::size_t i = 0; i < forces.size(); ++i) {
    const auto& contact = info_.contacts[i];
    const auto tangential = lambda_t.segment(contact.tangent_index, contact.n_t);
    const double cone = contact.mu * lambda_n[static_cast<Eigen::Index>(i)];
    for (int d = 0; d < contact.n_t; ++d) variables[forces[i].lambda_t[d]].guess = tangential[d];
    const auto& slack = forces[i].slack;
    if (slack.size() == 2) {
      variables[slack[0]].guess = std::max(cone + tangential[0], 0.0);
      variables[slack[1]].guess = std::max(cone - tangential[0], 0.0);
    } else if (slack.size() == 1) {
      const double rest = forces[i].facets.empty() ? cone * cone - tangential.squaredNorm() : cone - tangential.norm();
      variables[slack[0]].guess = std::max(rest, 0.0);
    }
    for (std::size_t f = 0; f < forces[i].facets.size(); ++f) {
      const auto direction =
          facet_direction(contact.n_t, static_cast<int>(f), static_cast<int>(forces[i].facets.size()));
      double part = 0;
      for (int d = 0; d < contact.n_t; ++d) part += direction[d] * tangential[d];
      variables[forces[i].facets[f]].guess = std::max(part, 0.0);  // exact in the plane
    }
  }
}

void ContactEquations::guess_switching(const Point& point, const Vector& q, const Vector& v, const Vector& theta) {
  if (!point.psi_plus.empty()) guess_split(step_functions_.switching.at(q, v, theta), point.psi_plus, point.psi_minus);
}

void ContactEquations::guess_stage(const Stage& stage, const Vector& q, const Vector& v, const Vector& w,
                                   const Vector& lambda_n, const Vector& lambda_t, const Vector& theta) {
  auto& variables = mpcc_.nlp.variables;
  for (std::size_t k = 0; k < stage.theta.size(); ++k) {
    variables[stage.theta[k]].guess = theta[static_cast<Eigen::Index>(k)];
    variables[stage.theta_rest[k]].guess = 1 - theta[static_cast<Eigen::Index>(k)];
  }
  guess_switching(stage.point, q, v, theta);
  guess_point(stage.point, q, v, stage.slip);
  guess_forces(stage.force, lambda_n, lambda_t);
  for (int k = 0; k < info_.n_q; ++k) variables[stage.w[k]].guess = w[k];
  for (int i = 0; i < info_.n_c(); ++i) variables[stage.lambda_n[i]].guess = lambda_n[i];
}

Vector ContactEquations::values(const Vector& x, const std::vector<int>& variables) {
  Vector result(static_cast<Eigen::Index>(variables.size()));
  for (std::size_t k = 0; k < variables.size(); ++k) result[static_cast<Eigen::Index>(k)] = x[variables[k]];
  return result;
}

}  // namespace ricochet
