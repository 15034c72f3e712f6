#include "methods/time_stepping/common/contact_step.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "methods/contact_laws/conflicting_contacts.h"

namespace ricochet {

ContactStep::ContactStep(const Problem& problem, const ContactSolverOptions& options, const ContactLaws& laws,
                         Counters& counters, ContactObserver* observer)
    : info_(problem.info()),
      counters_(counters),
      observer_(observer),
      has_bilateral_(info_.has_bilateral()),
      options_(options_for(info_, options)),
      is_affine_(std::ranges::all_of(info_.contacts, &ContactInfo::is_affine)),
      operator_(problem, laws.normal_only),
      solver_(make_contact_solver(options_)) {
  const int n_c = info_.n_c(), rows = n_c + info_.n_lambda_t;
  problem_.law = laws.friction;
  if (n_c <= kMaxDenseContacts) problem_.G.reserve(n_c, rows);
  problem_.b.setZero(rows);
  problem_.contacts.reserve(n_c);
  active_.reserve(n_c);
  for (auto* x : {&r_, &w_, &terms_}) x->setZero(rows);
  last_n_.setZero(n_c);
  velocity_rounding_.setZero(n_c);
  last_t_.setZero(info_.n_lambda_t);
  Lambda_n_.setZero(n_c);
  Lambda_t_.setZero(info_.n_lambda_t);
}

double ContactStep::slip_speed(int contact, const Vector& v) const {
  const int n = operator_.n_t(contact);
  const auto slip = [&](int d) { return operator_.dot(contact, d, v); };
  return n == 0 ? 0 : n == 1 ? std::abs(slip(1)) : std::hypot(slip(1), slip(2));
}

void ContactStep::slip_velocities(const Vector& v, Vector& slip) const {
  for (int i = 0; i < info_.n_c(); ++i) {
    for (int d = 1; d <= operator_.n_t(i); ++d) slip[info_.contacts[i].tangent_index + d - 1] = operator_.dot(i, d, v);
  }
}

void ContactStep::set_position(const Vector& q) {
  if (is_affine_ && has_position_) return;
  operator_.set_directions(q);
  has_position_ = is_new_ = true;
}

void ContactStep::set_active(std::span<const int> active) {
  if (std::ranges::equal(active_, active)) return;
  is_new_ = true;
  active_.assign(active.begin(), active.end());
  problem_.contacts.clear();
  for (const int i : active_)
    problem_.contacts.push_back({.id = i, .n_t = operator_.n_t(i), .mu = info_.contacts[i].mu});
}

ContactStatus ContactStep::set_inverse_mass(const BlockInverse& W) {
  if (!is_new_ && W_ == &W && W_version_ == W.version()) return ContactStatus::solved;
  is_new_ = false;
  W_ = &W;
  W_version_ = W.version();
  if (!operator_.set_responses(active_, W)) return ContactStatus::dependent;
  operator_.assemble(active_, problem_.G);
  return ContactStatus::solved;
}

void ContactStep::add_normal_impulse(std::size_t k, double impulse, Vector& v, Vector& Lambda_n) const {
  operator_.push(active_[k], 0, impulse, v, Lambda_n);
  Lambda_n[active_[k]] += impulse;
}

void ContactStep::add_impulses(double factor, const Vector& r_n, const Vector& r_t, Vector& v, Vector& Lambda_n) const {
  for (std::size_t k = 0; k < active_.size(); ++k) {
    const int i = active_[k];
    for (int d = 0; d <= n_t(static_cast<int>(k)); ++d) {
      const double impulse = factor * (d == 0 ? r_n[i] : r_t[info_.contacts[i].tangent_index + d - 1]);
      if (impulse != 0) operator_.push(i, d, impulse, v, Lambda_n);
    }
  }
}

/// Rounding error of a sum J_n' v that is zero, relative to its terms: some units in the last place.
constexpr double kRounding = 4 * std::numeric_limits<double>::epsilon();

ContactStatus ContactStep::solve(Vector& v, const Vector& shift, const Vector& present, const Vector& slip_shift) {
  Lambda_n_.setZero();
  Lambda_t_.setZero();
  velocity_rounding_.setZero();
  if (has_bilateral_) operator_.bilateral().impose(v, shift.data(), Lambda_n_);  // (3)
  const int n_active = static_cast<int>(active_.size());
  if (n_active == 0) return ContactStatus::solved;
  for (int k = 0; k < n_active; ++k) {
    const int i = active_[k], row = problem_.G.row(k);
    problem_.contacts[k].present = present.size() > 0 ? present[k] : 0;
    for (int d = 0; d <= n_t(k); ++d) {
      problem_.b[row + d] = operator_.dot(i, d, v) + shift_of(i, d, shift, slip_shift);
      r_[row + d] = d == 0 ? last_n_[i] : last_t_[info_.contacts[i].tangent_index + d - 1];
    }
  }
  if (observer_) observer_->before(counters_.steps, problem_, r_);
  const ContactStatus status = solver_->solve(problem_, r_);
  if (observer_) observer_->after(problem_, r_, status);
  ++counters_.complementarity_solves;
  solver_->count(counters_);
  if (status != ContactStatus::solved) return status;
  const bool iterates = options_.kind != ContactSolverKind::lemke;
  const double largest = iterates ? scale_of(problem_, r_).velocity : 0;
  for (int k = 0; k < n_active; ++k) {
    const int i = active_[k];
    for (int d = 0; d <= n_t(k); ++d) {
      const int row = problem_.G.row(k) + d;
      const double impulse = r_[row];
      if (d == 0) {
        Lambda_n_[i] = last_n_[i] = impulse;
        if (impulse > 0)
          velocity_rounding_[i] =
              options_.tolerance * (std::abs(problem_.b[row]) + problem_.G.diagonal(k, 0) * impulse + largest) +
              kRounding * operator_.terms(i, 0, v);
      } else {
        Lambda_t_[info_.contacts[i].tangent_index + d - 1] = last_t_[info_.contacts[i].tangent_index + d - 1] = impulse;
      }
      if (impulse != 0) operator_.push(i, d, impulse, v, Lambda_n_);  // (1), (3)
    }
  }
  return status;
}

std::string ContactStep::reason(ContactStatus status) {
  if (status == ContactStatus::solved || status == ContactStatus::dependent) return reason_of(status);
  const auto quoted = [&](std::vector<int> contacts) {
    for (int& contact : contacts) contact = active_[contact];
    return quoted_contacts(info_, contacts);
  };
  if (const auto conflict = conflicting_contacts(problem_); !conflict.empty())
    return fmt::format("no impulses keep {} from closing: the contact problem has no solution", quoted(conflict));
  problem_.G.times(r_, problem_.b, w_);
  const int worst = worst_contact(problem_, r_, w_, solver_->polygon());
  return worst < 0 ? reason_of(status) : fmt::format("{}, {}", reason_of(status), quoted({worst}));
}

double ContactStep::residual(const Vector& v_plus, const Vector& shift, const Vector& slip_shift) {
  const double bilateral = has_bilateral_ ? operator_.bilateral().residual(v_plus, shift.data(), Lambda_n_) : 0;
  if (active_.empty()) return bilateral;
  // Velocities are known to the rounding of their terms, |J|' |v+|.
  for (int k = 0; k < static_cast<int>(active_.size()); ++k) {
    const int i = active_[k];
    for (int d = 0; d <= n_t(k); ++d) {
      const int row = problem_.G.row(k) + d;
      w_[row] = operator_.dot(i, d, v_plus) + shift_of(i, d, shift, slip_shift);
      terms_[row] = operator_.terms(i, d, v_plus);
    }
  }
  return std::max(bilateral, violation(problem_, r_, w_, solver_->polygon(), terms_));
}

}  // namespace ricochet
