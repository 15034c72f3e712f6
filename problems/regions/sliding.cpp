#include "problems/regions/sliding.h"

#include <algorithm>

#include "problems/input_error.h"

namespace ricochet {
namespace {

using GiNaC::ex;
using GiNaC::symbol;
using Expressions = SymbolicModel::Expressions;

constexpr std::size_t kMostCoupled = 4;  // coordinates of one block of M, whose inverse is a formula

/// The formulas of a region that slides.
class SlidingRegion {
 public:
  SlidingRegion(const SwitchedModel& switched, std::span<const int> signs)
      : switched_(switched), model_(switched.model), signs_(signs) {
    for (std::size_t k = 0; k < signs.size(); ++k) {
      if (signs[k] == 0)
        sliding_.push_back(k);
      else
        values_[switched.signs[k]] = signs[k];
    }
    functions_ = switched.functions;
    require_signs_in_force_only();
  }

  SymbolicModel take() {
    set_multipliers();
    set_forces();
    const Expressions s = signs_that_slide();
    find_contacts_that_act();
    for (std::size_t row = 0; row < model_.force.size(); ++row) {
      model_.force[row] = constant_[row];
      for (std::size_t l = 0; l < sliding_.size(); ++l) model_.force[row] += slope_[l][row] * s[l];
    }
    for (auto& row : model_.input) std::ranges::fill(row, 0);  // B_u u is part of f_0
    for (std::size_t l = 0; l < sliding_.size(); ++l) functions_[sliding_[l]] = 1 - pow(s[l], 2);  // (2)
    model_.switching = functions_;
    for (const int sign : signs_) model_.region.push_back(sign < 0 ? -1 : 1);
    model_.until.reset();  // it is one of `switching`
    return std::move(model_);
  }

 private:
  const std::string& name(std::size_t l) const { return switched_.described[sliding_[l]].formula; }

  [[noreturn]] void decline(std::size_t l, const std::string& why) const { throw InputError("sliding", name(l), why); }

  /// Sets the signs that are known, and requires that those of K occur in the force only.
  void require_signs_in_force_only() {
    const auto smooth = [&](ex& e) {
      e = e.subs(values_, GiNaC::subs_options::no_pattern);
      for (std::size_t l = 0; l < sliding_.size(); ++l) {
        if (e.has(switched_.signs[sliding_[l]])) decline(l, "only forces may jump there");
      }
    };
    const auto smooth_list = [&](Expressions& list) { std::ranges::for_each(list, smooth); };
    std::ranges::for_each(model_.mass, smooth_list);
    for (auto& contact : model_.contacts) {
      smooth(contact.gap);
      std::ranges::for_each(contact.tangents, smooth_list);
      smooth_list(contact.drives);
      smooth(contact.mu);
    }
    for (auto& element : model_.frictions) {
      smooth(element.bound);
      std::ranges::for_each(element.tangents, smooth_list);
      smooth_list(element.drives);
    }
    if (model_.potential_energy) smooth(*model_.potential_energy);
    smooth_list(functions_);
    smooth_list(model_.control);
  }

  /// y_k of (1), from the blocks of M that psi_k touches.
  void set_multipliers() {
    const std::size_t n = model_.q.size();
    for (std::size_t l = 0; l < sliding_.size(); ++l) {
      Expressions slope(n), y(n, 0);
      for (std::size_t i = 0; i < n; ++i) slope[i] = functions_[sliding_[l]].diff(model_.v[i]);
      std::vector<std::size_t> block;
      for (std::size_t i = 0; i < n; ++i) {
        if (!slope[i].is_zero()) block.push_back(i);
      }
      if (block.empty()) decline(l, "a motion slides where the function depends on v");
      for (std::size_t next = 0; next < block.size(); ++next) {
        for (std::size_t i = 0; i < n; ++i) {
          if (!model_.mass[block[next]][i].is_zero() && std::ranges::count(block, i) == 0) block.push_back(i);
        }
      }
      if (block.size() > kMostCoupled) decline(l, "M couples more than 4 coordinates there");
      const auto size = static_cast<unsigned>(block.size());
      GiNaC::matrix M(size, size), right(size, 1), unknowns(size, 1);
      for (unsigned i = 0; i < size; ++i) {
        for (unsigned j = 0; j < size; ++j) M(i, j) = model_.mass[block[i]][block[j]];
        right(i, 0) = slope[block[i]];
        unknowns(i, 0) = symbol();
      }
      const GiNaC::matrix solution = M.solve(unknowns, right);
      for (unsigned i = 0; i < size; ++i) y[block[i]] = solution(i, 0);
      y_.push_back(std::move(y));
    }
  }

  /// f_0 and c_l.
  void set_forces() {
    constant_ = model_.force;
    for (std::size_t row = 0; row < model_.input.size(); ++row) {
      for (std::size_t j = 0; j < model_.u.size(); ++j) constant_[row] += model_.input[row][j] * model_.u[j];
    }
    slope_.assign(sliding_.size(), Expressions(constant_.size(), 0));
    for (std::size_t row = 0; row < constant_.size(); ++row) {
      ex f = constant_[row].subs(values_, GiNaC::subs_options::no_pattern);
      Expressions of_sign(sliding_.size());
      for (std::size_t l = 0; l < sliding_.size(); ++l) {
        const symbol& sign = switched_.signs[sliding_[l]];
        const ex above = f.subs(sign == 1), below = f.subs(sign == -1);
        of_sign[l] = (above - below) / 2;
        f = (above + below) / 2;
        for (std::size_t m = 0; m < sliding_.size(); ++m) {
          if (of_sign[l].has(switched_.signs[sliding_[m]]) &&
              !of_sign[l].expand().diff(switched_.signs[sliding_[m]]).is_zero())
            decline(l, "the force is not affine in the signs of the functions that vanish together");
        }
      }
      constant_[row] = f;
      for (std::size_t l = 0; l < sliding_.size(); ++l) slope_[l][row] = of_sign[l];
    }
  }

  ex along(std::size_t l, const Expressions& force) const {
    ex sum = 0;
    for (std::size_t i = 0; i < force.size(); ++i) sum += y_[l][i] * force[i];
    return sum;
  }

  /// The solution of (1).
  Expressions signs_that_slide() const {
    const auto size = static_cast<unsigned>(sliding_.size());
    GiNaC::matrix A(size, size), right(size, 1), unknowns(size, 1);
    for (unsigned l = 0; l < size; ++l) {
      const ex& psi = functions_[sliding_[l]];
      ex rate = psi.diff(model_.t) + along(l, constant_);
      for (std::size_t i = 0; i < model_.q.size(); ++i) rate += psi.diff(model_.q[i]) * model_.v[i];
      right(l, 0) = -rate;
      unknowns(l, 0) = symbol();
      for (unsigned m = 0; m < size; ++m) A(l, m) = along(l, slope_[m]);
    }
    if (A.determinant().normal().is_zero()) decline(0, "the jump of the force does not change its rate");
    const GiNaC::matrix solution = A.solve(unknowns, right);
    Expressions s;
    for (unsigned l = 0; l < size; ++l) {
      s.push_back(solution(l, 0));
      if (std::ranges::any_of(model_.u, [&](const symbol& u) { return s[l].has(u); }))
        decline(l, "a control acts on it");
    }
    return s;
  }

  bool acts(const Expressions& direction) const {
    for (std::size_t l = 0; l < sliding_.size(); ++l) {
      if (!along(l, direction).normal().is_zero()) return true;
    }
    return false;
  }

  void find_contacts_that_act() {
    for (const auto& element : model_.frictions) {
      if (std::ranges::any_of(element.tangents, [&](const Expressions& d) { return acts(d); }))
        decline(0, "the friction of '" + element.name + "' acts on it");
    }
    for (const auto& contact : model_.contacts) {
      Expressions normal;
      for (const symbol& q : model_.q) normal.push_back(contact.gap.diff(q));
      const bool does =
          acts(normal) || std::ranges::any_of(contact.tangents, [&](const Expressions& d) { return acts(d); });
      if (does && contact.is_bilateral) decline(0, "the joint '" + contact.name + "' acts on it");
      model_.acting.push_back(does ? 1 : 0);
    }
  }

  const SwitchedModel& switched_;
  SymbolicModel model_;
  std::span<const int> signs_;
  GiNaC::exmap values_;                 // of signs that are known
  std::vector<std::size_t> sliding_;    // K
  Expressions functions_;               // psi
  std::vector<Expressions> y_, slope_;  // y_k, c_l
  Expressions constant_;                // f_0
};

}  // namespace

SymbolicModel sliding_region(const SwitchedModel& switched, std::span<const int> signs) {
  return SlidingRegion(switched, signs).take();
}

}  // namespace ricochet
