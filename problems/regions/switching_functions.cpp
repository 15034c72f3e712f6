#include "problems/regions/switching_functions.h"

#include <algorithm>
#include <optional>
#include <sstream>

#include "problems/derivatives/real_functions.h"

namespace ricochet {
namespace {

using GiNaC::ex;
using GiNaC::symbol;

/// Calls visit(expression) for every formula that is evaluated along a motion.
void for_each_formula(SymbolicModel& model, const auto& visit) {
  for (auto* rows : {&model.mass, &model.input}) {
    for (auto& row : *rows) std::ranges::for_each(row, visit);
  }
  std::ranges::for_each(model.force, visit);
  std::ranges::for_each(model.control, visit);
  for (auto& contact : model.contacts) {
    visit(contact.gap);
    for (auto& direction : contact.tangents) std::ranges::for_each(direction, visit);
    std::ranges::for_each(contact.drives, visit);
  }
  for (auto& element : model.frictions) {
    visit(element.bound);
    for (auto& direction : element.tangents) std::ranges::for_each(direction, visit);
    std::ranges::for_each(element.drives, visit);
  }
  if (model.potential_energy) visit(*model.potential_energy);
}

std::string branch_function(const ex& e) {
  if (!GiNaC::is_a<GiNaC::function>(e)) return {};
  const std::string name = GiNaC::ex_to<GiNaC::function>(e).get_name();
  return name == "magnitude" || name == "sign" || name == "choose" ? name : std::string();
}

/// Replaces branches by signs (2), innermost first, and collects their arguments (1).
class Branches : public GiNaC::map_function {
 public:
  Branches(const SymbolicModel& model, SwitchedModel& found) : model_(model), found_(found) {}

  ex operator()(const ex& e) override {
    const ex inner = e.map(*this);
    const std::string name = branch_function(inner);
    if (name.empty() || !depends_on_state(inner.op(0))) return inner;
    const ex sign = sign_of(inner.op(0));
    if (name == "sign") return sign;
    if (name == "magnitude") return sign * inner.op(0);
    return (1 + sign) / 2 * inner.op(1) + (1 - sign) / 2 * inner.op(2);
  }

 private:
  bool depends_on_any(const ex& e, const std::vector<symbol>& symbols) const {
    return std::ranges::any_of(symbols, [&](const symbol& s) { return e.has(s); });
  }
  bool depends_on_state(const ex& e) const {
    if (depends_on_any(e, model_.u)) return false;  // a control is no function of the state
    return e.has(model_.t) || depends_on_any(e, model_.q) || depends_on_any(e, model_.v);
  }
  /// The factor c of x = c y, if both are equal up to a number that is not zero.
  static std::optional<ex> factor_of(const ex& x, const ex& y) {
    const ex ratio = (x / y).normal();
    if (!GiNaC::is_a<GiNaC::numeric>(ratio) || ratio.is_zero()) return std::nullopt;
    return ratio;
  }

  ex sign_of(const ex& x) {
    for (std::size_t k = 0; k < found_.functions.size(); ++k) {
      if (x.is_equal(found_.functions[k])) return found_.signs[k];
      if (const auto c = factor_of(x, found_.functions[k]))
        return GiNaC::ex_to<GiNaC::numeric>(*c).is_positive() ? ex(found_.signs[k]) : -ex(found_.signs[k]);
    }
    SwitchInfo info;
    std::ostringstream text;
    text << x;
    info.formula = text.str();
    info.is_of_time = !depends_on_any(x, model_.q) && !depends_on_any(x, model_.v) && !depends_on_any(x, found_.signs);
    found_.functions.push_back(x);
    found_.signs.emplace_back("sigma[" + std::to_string(found_.signs.size()) + "]");
    found_.described.push_back(std::move(info));
    return found_.signs.back();
  }

  const SymbolicModel& model_;
  SwitchedModel& found_;
};

}  // namespace

SwitchedModel with_switching_functions(const SymbolicModel& model) {
  SwitchedModel result;
  bool has_branches = false;
  SymbolicModel searched = model;
  for_each_formula(searched, [&](const ex& e) {
    for (auto part = e.preorder_begin(); part != e.preorder_end() && !has_branches; ++part)
      has_branches = !branch_function(*part).empty();
  });
  if (!has_branches) return result;
  result.model = std::move(searched);
  Branches branches(model, result);
  bool has_time = false;
  for_each_formula(result.model, [&](ex& e) {
    has_time = has_time || e.has(model.t);
    e = branches(e);
  });
  result.model.has_clock = has_time;
  return result;
}

SymbolicModel in_region(const SwitchedModel& switched, std::span<const int> signs) {
  GiNaC::exmap values;
  for (std::size_t k = 0; k < signs.size(); ++k) values[switched.signs[k]] = signs[k];
  SymbolicModel model = switched.model;
  for_each_formula(model, [&](ex& e) { e = e.subs(values); });
  for (const ex& function : switched.functions) model.switching.push_back(function.subs(values));
  model.region.assign(signs.begin(), signs.end());
  return model;
}

}  // namespace ricochet
