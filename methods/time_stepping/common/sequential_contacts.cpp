#include "methods/time_stepping/common/sequential_contacts.h"

#include <algorithm>

namespace ricochet {

SequentialContacts::SequentialContacts(FixedStepRun& run)
    : run_(run),
      info_(run.problem.info()),
      is_constant_(info_.structure.constant_mass && std::ranges::all_of(info_.contacts, &ContactInfo::is_affine)),
      mass_(run.problem, run.solution.counters),
      operator_(run.problem, false, ContactOperator::Joints::as_contacts),
      blocks_(info_.n_c()) {
  for (auto* list : {&list_, &last_}) list->reserve(info_.n_c());
  is_chosen_.assign(info_.n_c(), 0);
  gap_.setZero(info_.n_c());
  none_.setZero(info_.n_c());
  change_.setZero(info_.n_q);
  mass_.set_position(run.q);
}

void SequentialContacts::choose(const Vector& q, const Vector& v, const Vector& dv, double h, FrictionLaw law) {
  constexpr double kReach = 2;
  if (info_.n_c() == 0) return;
  if (!has_directions_ || !is_constant_) {
    operator_.set_directions(q);
    has_directions_ = true;
  }
  run_.problem.gap(q.data(), gap_.data());
  last_ = list_;
  list_ = info_.bilateral;
  for (const int i : info_.unilateral) {
    double reach = operator_.terms(i, 0, v) + operator_.terms(i, 0, dv);
    for (int d = 1; d <= n_t(i) && law == FrictionLaw::associated; ++d)
      reach += info_.contacts[i].mu * (operator_.terms(i, d, v) + operator_.terms(i, d, dv));
    if (gap_[i] <= run_.touching(i) || gap_[i] <= kReach * h * reach) list_.push_back(i);  // (1)
  }
  if (list_ == last_) return;
  has_blocks_ = false;
  std::ranges::fill(is_chosen_, 0);
  for (const int i : list_) is_chosen_[i] = 1;
}

bool SequentialContacts::set_mass(const Vector& q) {
  return mass_.set_position(q) || run_.fail("the mass matrix is not positive definite");
}

bool SequentialContacts::set_position(const Vector& q) {
  if (!set_mass(q)) return false;
  if (list_.empty() || (is_constant_ && has_blocks_)) return true;
  if (!is_constant_) operator_.set_directions(q);
  operator_.set_responses(list_, mass_);
  for (const int i : list_) set_block(i);
  has_blocks_ = true;
  return true;
}

/// A contact that nothing moves has mass 0, and so no impulse.
void SequentialContacts::set_block(int i) {
  Block& block = blocks_[i];
  const double g = operator_.own_delassus(i, 0, 0);
  block.mass = g > 0 ? 1 / g : 0;
  double trace = g;
  if (n_t(i) == 1) {
    const double t = operator_.own_delassus(i, 1, 1);
    block.tangent[0] = t > 0 ? 1 / t : 0;
    trace += t;
  } else if (n_t(i) == 2) {
    const double a = operator_.own_delassus(i, 1, 1), b = operator_.own_delassus(i, 1, 2),
                 c = operator_.own_delassus(i, 2, 2), determinant = a * c - b * b;
    const double inverse = determinant > 0 ? 1 / determinant : 0;
    block.tangent[0] = c * inverse;
    block.tangent[1] = -b * inverse;
    block.tangent[2] = a * inverse;
    trace += a + c;
  }
  block.mean_delassus = trace / (1 + n_t(i));
}

const Vector& SequentialContacts::free_change(const Vector& q, const Vector& v, double h) {
  run_.problem.force(q.data(), v.data(), info_.u.data(), change_.data());
  change_ *= h;
  mass_.solve_in_place(change_);
  ++run_.solution.counters.force_evaluations;
  return change_;
}

}  // namespace ricochet
