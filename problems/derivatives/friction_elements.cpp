#include "problems/derivatives/friction_elements.h"

#include <fmt/format.h>

#include <algorithm>
#include <exception>
#include <optional>

#include "problems/derivatives/real_functions.h"
#include "problems/input_error.h"
#include "problems/scene_file/expression_text.h"

namespace ricochet {
namespace {

using GiNaC::ex;
using GiNaC::symbol;
using Expressions = SymbolicModel::Expressions;
using FrictionElement = SymbolicModel::FrictionElement;

bool is_call_of(const ex& e, const char* name) {
  return GiNaC::is_a<GiNaC::function>(e) && GiNaC::ex_to<GiNaC::function>(e).get_name() == name;
}

bool has_any(const ex& e, const std::vector<symbol>& symbols) {
  return std::ranges::any_of(symbols, [&](const symbol& s) { return e.has(s); });
}

/// Whether `e` is zero by the rules of algebra. If not, it may still be.
bool vanishes(const ex& e) {
  if (e.is_zero() || e.expand().is_zero()) return true;
  try {
    return e.normal().is_zero();
  } catch (const std::exception&) {  // no rational function
    return false;
  }
}

/// The sign of `first` / `second` if that is a number; else 0.
int relative_sign(const ex& first, const ex& second) {
  try {
    const ex ratio = (first / second).normal();
    return GiNaC::is_a<GiNaC::numeric>(ratio) ? GiNaC::ex_to<GiNaC::numeric>(ratio).csgn() : 0;
  } catch (const std::exception&) {  // a division by zero
    return 0;
  }
}

/// Signs and choices of a force that jump together, with one switching function.
struct JumpsOfForce {
  ex psi;
  GiNaC::exmap above, below;  ///< what takes the place of every sign and choice where psi > 0, psi < 0
};

/// The value of a sign or choice on the `positive` side of its argument, or the other one.
ex branch(const ex& call, bool positive) {
  if (is_call_of(call, "sign")) return positive ? 1 : -1;
  return call.op(positive ? 1 : 2);
}

std::vector<JumpsOfForce> jumps_of(const Expressions& force) {
  std::vector<JumpsOfForce> list;
  GiNaC::exset seen;
  for (const ex& row : force) {
    for (auto part = row.preorder_begin(); part != row.preorder_end(); ++part) {
      if (!is_call_of(*part, "sign") && !is_call_of(*part, "choose")) continue;
      if (!seen.insert(*part).second) continue;
      const ex psi = part->op(0);
      int direction = 1;
      auto same = std::ranges::find_if(list, [&](const JumpsOfForce& other) {
        direction = relative_sign(psi, other.psi);
        return direction != 0;
      });
      if (same == list.end()) {
        list.push_back({psi, {}, {}});
        same = std::prev(list.end());
        direction = 1;
      }
      same->above[*part] = branch(*part, direction > 0);
      same->below[*part] = branch(*part, direction < 0);
    }
  }
  return list;
}

/// Replaces calls by branches, which may contain further calls of the same switching function.
Expressions on_side(const Expressions& force, const GiNaC::exmap& side) {
  Expressions values;
  for (ex row : force) {
    for (ex next = row.subs(side, GiNaC::subs_options::no_pattern); !next.is_equal(row);
         next = row.subs(side, GiNaC::subs_options::no_pattern))
      row = next;
    values.push_back(row);
  }
  return values;
}

/// The element of the jumps with this psi, by (3), and the force without them; null if they are no dry friction.
std::optional<FrictionElement> element_of(const JumpsOfForce& jumps, SymbolicModel& model) {
  const std::size_t n = model.q.size();
  Expressions J;
  ex drive = jumps.psi;
  for (std::size_t k = 0; k < n; ++k) {
    J.push_back(jumps.psi.diff(model.v[k]));
    if (has_any(J[k], model.v)) return std::nullopt;
    drive -= J[k] * model.v[k];
  }
  drive = drive.expand();
  if (has_any(drive, model.v) || may_bend(jumps.psi)) return std::nullopt;
  const auto first = std::ranges::find_if(J, [](const ex& e) { return !vanishes(e); });
  if (first == J.end()) return std::nullopt;

  const Expressions above = on_side(model.force, jumps.above), below = on_side(model.force, jumps.below);
  Expressions half_jump;
  for (std::size_t k = 0; k < n; ++k) half_jump.push_back(((above[k] - below[k]) / 2).expand());
  const ex& of_first = half_jump[static_cast<std::size_t>(first - J.begin())];
  ex bound = -of_first / *first;
  if (!GiNaC::is_a<GiNaC::numeric>(*first)) bound = bound.normal();
  for (std::size_t k = 0; k < n; ++k) {
    if (!vanishes(half_jump[k] + bound * J[k])) return std::nullopt;
  }
  if (bound.is_zero() || may_jump(bound) || !may_jump(sign(jumps.psi) * bound)) return std::nullopt;
  if (!(model.number_at_start(bound) > 0)) return std::nullopt;

  for (std::size_t k = 0; k < n; ++k) {
    if (!half_jump[k].is_zero()) model.force[k] = ((above[k] + below[k]) / 2).expand();
  }
  FrictionElement element;
  element.name = fmt::format("sign({})", expression_text(jumps.psi));
  element.tangents = {J};
  if (!drive.is_zero()) element.drives = {drive};
  element.bound = bound;
  return element;
}

}  // namespace

SymbolicModel with_jumps_as_friction(SymbolicModel model) {
  if (std::ranges::none_of(model.force, may_jump)) return model;
  for (const JumpsOfForce& jumps : jumps_of(model.force)) {
    if (auto element = element_of(jumps, model)) model.frictions.push_back(std::move(*element));
  }
  return model;
}

SymbolicModel with_friction_coordinates(SymbolicModel model) {
  const std::size_t n = model.q.size(), n_z = model.frictions.size();
  if (n_z == 0) return model;
  for (auto& row : model.mass) row.resize(n + n_z, 0);
  for (auto& contact : model.contacts) {
    for (auto& direction : contact.tangents) direction.resize(n + n_z, 0);
  }
  for (std::size_t k = 0; k < n_z; ++k) {
    const FrictionElement& element = model.frictions[k];
    const bool is_constant =
        !has_any(element.bound, model.q) && !has_any(element.bound, model.v) && !element.bound.has(model.t);
    if (const double value = is_constant && model.region.empty() ? model.number(element.bound) : 1; !(value > 0))
      throw InputError(fmt::format("friction '{}': bound", element.name), value,
                       "a positive number, or a formula of q, v or t, is required");
    const symbol z(fmt::format("z[{}]", k)), rate(fmt::format("v_z[{}]", k));
    model.q.push_back(z);
    model.v.push_back(rate);
    model.q0.emplace_back(0);
    model.v0.emplace_back(0);
    model.mass.emplace_back(n + n_z, 0);
    model.mass.back()[n + k] = 1;
    model.force.push_back(-element.bound);  // (2)
    if (!model.input.empty()) model.input.emplace_back(model.u.size(), 0);
    SymbolicModel::Contact contact;
    contact.name = element.name;
    contact.gap = z;
    contact.tangents = element.tangents;
    contact.drives = element.drives;
    contact.mu = 1;
    contact.mu_static = element.static_ratio;
    contact.is_friction_element = true;
    for (auto& direction : contact.tangents) direction.resize(n + n_z, 0);
    model.contacts.push_back(std::move(contact));
  }
  return model;
}

}  // namespace ricochet
