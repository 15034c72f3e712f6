#include "problems/derivatives/rolling_friction.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <exception>

#include "problems/derivatives/real_functions.h"
#include "problems/input_error.h"
#include "problems/scene_file/expression_text.h"

namespace ricochet {
namespace {

using GiNaC::ex;
using GiNaC::symbol;
using Contact = SymbolicModel::Contact;
using FrictionElement = SymbolicModel::FrictionElement;

bool depends_on_place(const SymbolicModel& model, const ex& e) {
  return e.has(model.t) || std::ranges::any_of(model.q, [&](const symbol& q) { return e.has(q); });
}

/// m of (3); 1 if the gap has no slope at q0, which validate() rejects.
ex lever_mass(const SymbolicModel& model, const ex& gap) {
  GiNaC::exmap start{{model.t, 0}};
  for (std::size_t k = 0; k < model.q.size(); ++k) start[model.q[k]] = model.q0[k];
  ex mobility = 0;
  for (std::size_t k = 0; k < model.q.size(); ++k) {
    const ex slope = gap.diff(model.q[k]);
    if (!slope.is_zero()) mobility += slope * slope / model.mass[k][k];
  }
  try {
    mobility = mobility.subs(start, GiNaC::subs_options::no_pattern);
    const double value = model.number(mobility);
    return value > 0 && std::isfinite(value) ? 1 / mobility : ex(1);
  } catch (const std::exception&) {  // a division by zero
    return 1;
  }
}

/// Requires the contact and the coefficient of an element as (2) has them.
void require_contact(const FrictionElement& element, const SymbolicModel& model) {
  const Contact& contact = model.contacts[static_cast<std::size_t>(element.contact)];
  const std::string field = fmt::format("friction '{}': contact", element.name);
  if (contact.is_bilateral)
    throw InputError(field, contact.name, "it is bilateral; a contact whose force only pushes is required");
  if (contact.eps_r.has(model.v_n))
    throw InputError(field, contact.name, "its e is a formula of vn; a contact whose e is a number is required");
  if (depends_on_place(model, element.bound) && may_bend(element.bound))
    throw InputError(fmt::format("friction '{}': coefficient", element.name), expression_text(element.bound),
                     "a formula of q and t without abs, sign, min, max and if is required");
}

/// Contact i of (2). @param part  f / (n + 1)
Contact bounded_contact(const FrictionElement& element, const Contact& whole, const ex& part,
                        const SymbolicModel& model) {
  Contact contact;
  contact.name = element.name;
  contact.gap = part;
  contact.tangents = element.tangents;
  contact.drives = element.drives;
  contact.eps_r = whole.eps_r;
  contact.mu = element.bound;
  contact.mu_varies = depends_on_place(model, element.bound);
  if (contact.mu_varies) return contact;
  const double c = model.number(element.bound);
  if (!(c >= 0))
    throw InputError(fmt::format("friction '{}': coefficient", element.name), c, "a number >= 0 is required");
  if (c > 0) return contact;
  contact.tangents.clear();
  contact.drives.clear();
  return contact;
}

}  // namespace

int n_levers(const SymbolicModel& model) {
  return static_cast<int>(std::ranges::count_if(model.frictions, [](const auto& e) { return e.contact >= 0; }));
}

SymbolicModel with_rolling_friction(SymbolicModel model) {
  const auto n_theta = static_cast<std::size_t>(n_levers(model));
  if (n_theta == 0) return model;
  const std::size_t n = model.q.size();
  std::vector<int> n_parts(model.contacts.size(), 1);  // n + 1 of (2)
  for (const FrictionElement& element : model.frictions) {
    if (element.contact < 0) continue;
    require_contact(element, model);
    ++n_parts[static_cast<std::size_t>(element.contact)];
  }
  std::vector<ex> masses, parts;
  for (std::size_t i = 0; i < n_parts.size(); ++i) {
    ex& gap = model.contacts[i].gap;
    masses.push_back(n_parts[i] > 1 ? lever_mass(model, gap) : ex(0));
    gap /= n_parts[i];
    parts.push_back(gap);
  }
  std::vector<Contact> bounded;
  std::vector<FrictionElement> others;
  std::vector<std::size_t> divided;  // contacts, by lever
  for (auto& row : model.mass) row.resize(n + n_theta, 0);
  for (FrictionElement& element : model.frictions) {
    if (element.contact < 0) {
      others.push_back(std::move(element));
      continue;
    }
    const auto i = static_cast<std::size_t>(element.contact), k = model.q.size();
    const symbol theta(fmt::format("theta[{}]", k - n)), rate(fmt::format("v_theta[{}]", k - n));
    Contact& whole = model.contacts[i];
    bounded.push_back(bounded_contact(element, whole, parts[i] - theta / n_parts[i], model));
    whole.gap += theta / n_parts[i];
    model.q.push_back(theta);
    model.v.push_back(rate);
    model.q0.emplace_back(0);
    model.v0.emplace_back(0);
    model.mass.emplace_back(n + n_theta, 0);
    for (std::size_t other = 0; other < divided.size(); ++other) {
      if (divided[other] == i) model.mass[n + other][k] = model.mass[k][n + other] = masses[i] / n_parts[i];  // (3)
    }
    model.mass[k][k] = 2 * masses[i] / n_parts[i];
    divided.push_back(i);
    model.force.emplace_back(0);
    if (!model.input.empty()) model.input.emplace_back(model.u.size(), 0);
  }
  model.frictions = std::move(others);
  for (Contact& contact : bounded) model.contacts.push_back(std::move(contact));
  const auto extend = [&](auto& list) {
    for (auto& entry : list) {
      for (auto& direction : entry.tangents) direction.resize(model.q.size(), 0);
    }
  };
  extend(model.contacts);
  extend(model.frictions);
  return model;
}

}  // namespace ricochet
