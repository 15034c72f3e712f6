#include "problems/regions/switching_functions.h"

#include <algorithm>
#include <optional>

#include "problems/derivatives/canonical_order.h"
#include "problems/derivatives/real_functions.h"
#include "problems/input_error.h"
#include "problems/regions/sliding.h"

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
    visit(contact.mu);
  }
  for (auto& element : model.frictions) {
    visit(element.bound);
    for (auto& direction : element.tangents) std::ranges::for_each(direction, visit);
    std::ranges::for_each(element.drives, visit);
  }
  if (model.potential_energy) visit(*model.potential_energy);
  if (model.until) visit(*model.until);
}

std::string branch_function(const ex& e) {
  if (!GiNaC::is_a<GiNaC::function>(e)) return {};
  const std::string name = GiNaC::ex_to<GiNaC::function>(e).get_name();
  return name == "magnitude" || name == "sign" || name == "choose" ? name : std::string();
}

/// Replaces branches by signs (2) and collects their arguments (1), innermost first. Those of one level are in
/// canonical order, which is the same in every run.
class Branches {
 public:
  Branches(const SymbolicModel& model, SwitchedModel& found) : model_(model), found_(found) {}

  void replace_all() {
    while (collect_innermost()) {
      for_each_formula(found_.model, [&](ex& e) { e = replaced(e); });
    }
  }

  /// Adds the function at whose zero a run ends. @param text  as it is stated
  void add_until(std::string text) {
    if (!depends_on_state(*found_.model.until) && !depends_on_any(*found_.model.until, found_.signs))
      throw InputError("until", text, "a formula of q, v or t is required");
    add(*found_.model.until);
    found_.described.back().formula = std::move(text);
  }

 private:
  struct Replacement : GiNaC::map_function {
    explicit Replacement(Branches& branches) : branches_(branches) {}
    ex operator()(const ex& e) override { return branches_.replaced(e); }
    Branches& branches_;
  };

  static bool depends_on_any(const ex& e, const std::vector<symbol>& symbols) {
    return std::ranges::any_of(symbols, [&](const symbol& s) { return e.has(s); });
  }
  bool depends_on_state(const ex& e) const {
    if (depends_on_any(e, model_.u)) return false;  // a control is no function of the state
    return e.has(model_.t) || depends_on_any(e, model_.q) || depends_on_any(e, model_.v);
  }
  bool is_branch(const ex& e) const { return !branch_function(e).empty() && depends_on_state(e.op(0)); }
  bool is_innermost(const ex& e) const {
    return is_branch(e) && std::none_of(e.op(0).preorder_begin(), e.op(0).preorder_end(),
                                        [&](const ex& part) { return is_branch(part); });
  }

  bool collect_innermost() {
    std::vector<std::pair<CanonicalOrder::Shape, ex>> arguments;
    for_each_formula(found_.model, [&](const ex& e) {
      for (auto part = e.preorder_begin(); part != e.preorder_end(); ++part) {
        if (is_innermost(*part)) arguments.emplace_back(order_.shape(part->op(0)), part->op(0));
      }
    });
    std::ranges::stable_sort(arguments, {}, [](const auto& a) { return a.first.hash; });
    for (const auto& [shape, x] : arguments) {
      if (!sign_of(x)) add(shape.negative ? -x : x);
    }
    return !arguments.empty();
  }

  ex replaced(const ex& e) {
    Replacement inside(*this);
    if (!is_innermost(e)) return e.map(inside);
    const std::string name = branch_function(e);
    const ex sign = *sign_of(e.op(0));
    if (name == "sign") return sign;
    if (name == "magnitude") return sign * e.op(0);
    return (1 + sign) / 2 * replaced(e.op(1)) + (1 - sign) / 2 * replaced(e.op(2));
  }

  /// The sign of `x` in terms of those that are known: x = c psi_k with a number c.
  std::optional<ex> sign_of(const ex& x) const {
    for (std::size_t k = 0; k < found_.functions.size(); ++k) {
      const ex& psi = found_.functions[k];
      if (x.is_equal(psi)) return found_.signs[k];
      if ((-x).is_equal(psi)) return -ex(found_.signs[k]);  // normal() does not cancel sums of decimals
      const ex ratio = (x / psi).normal();
      if (!GiNaC::is_a<GiNaC::numeric>(ratio) || ratio.is_zero()) continue;
      return GiNaC::ex_to<GiNaC::numeric>(ratio).is_positive() ? ex(found_.signs[k]) : -ex(found_.signs[k]);
    }
    return std::nullopt;
  }

  void add(const ex& x) {
    SwitchInfo info;
    info.formula = printed(x);
    info.is_of_time = !depends_on_any(x, model_.q) && !depends_on_any(x, model_.v) && !depends_on_any(x, found_.signs);
    found_.functions.push_back(x);
    found_.signs.emplace_back("sigma[" + std::to_string(found_.signs.size()) + "]");
    found_.described.push_back(std::move(info));
  }

  const SymbolicModel& model_;
  SwitchedModel& found_;
  CanonicalOrder order_{printed};
};

}  // namespace

SwitchedModel with_switching_functions(const SymbolicModel& model) {
  SwitchedModel result;
  bool has_branches = false, has_time = false;
  SymbolicModel searched = model;
  for_each_formula(searched, [&](const ex& e) {
    has_time = has_time || e.has(model.t);
    has_branches = has_branches || may_bend(e);
  });
  if (!has_branches && !model.until) return result;
  result.model = std::move(searched);
  result.model.has_clock = has_time;
  Branches branches(model, result);
  branches.replace_all();
  if (model.until) branches.add_until(printed(*model.until));
  return result;
}

SymbolicModel in_region(const SwitchedModel& switched, std::span<const int> signs) {
  if (std::ranges::count(signs, 0) > 0) return sliding_region(switched, signs);
  GiNaC::exmap values;
  for (std::size_t k = 0; k < signs.size(); ++k) values[switched.signs[k]] = signs[k];
  SymbolicModel model = switched.model;
  for_each_formula(model, [&](ex& e) { e = e.subs(values); });
  for (const ex& function : switched.functions) model.switching.push_back(function.subs(values));
  model.region.assign(signs.begin(), signs.end());
  model.until.reset();  // it is one of `switching`
  return model;
}

}  // namespace ricochet
