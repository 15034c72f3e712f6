#pragma once

#include <algorithm>

#include "methods/time_stepping/common/explicit_step.h"
#include "methods/time_stepping/common/fixed_step_run.h"

namespace ricochet {

/// The contacts of a step whose law holds for gaps at its end: all of them, whatever their gap is now,
///
///   0 <= Lambda_n^i  _|_  J_n^i' v+ + s^i >= 0,   s^i a multiple of f_c^i(q_k) / h         (1)
///
/// (with the associated law minus mu^i ||J_t^i' v+||). Most contacts of a step stay open. The law is solved for those
/// that the free velocity would close; those that the result would close are added, until (1) holds for all. In a row
/// of touching bodies each contact would add only the next one. If any contact closes, those of the previous step and
/// those that the free velocity leaves just closed are therefore included from the beginning.
class GapContacts {
 public:
  GapContacts(FixedStepRun& run, FrictionLaw law) : run_(run), law_(law), v_free_(run.v) {}

  /// Replaces the free velocity by v+; directions are those of the last ContactStep::set_position().
  /// @param shift, slip_shift  of ContactStep::solve()
  bool solve(const BlockInverse& W, const Vector& shift, Vector& v, const Vector& slip_shift = {}) {
    v_free_ = v;
    begin(v, shift);
    bool is_complete = !run_.has_contact_problem();
    while (!is_complete) {
      run_.clear_impulses();
      v = v_free_;
      if (!run_.prepare_contacts(W) || !run_.solve_contacts(v, shift, {}, slip_shift)) return false;
      is_complete = !add_closing(v, shift);
    }
    return true;
  }

 private:
  /// The side of (1) that is complementary to Lambda_n^i.
  double opening(int i, const Vector& v, const Vector& shift) const {
    const double normal = run_.contacts.normal_velocity(i, v) + shift[i];
    return law_ == FrictionLaw::coulomb ? normal
                                        : normal - run_.problem.info().contacts[i].mu * run_.contacts.slip_speed(i, v);
  }

  /// The contacts to begin with; none, when no gap ends below zero by more than its rounding.
  void begin(const Vector& v, const Vector& shift) {
    run_.active.clear();
    bool closes = false;
    for (const int i : run_.problem.info().unilateral) {
      const double u = opening(i, v, shift), tie = run_.touching(i) / run_.h;
      closes = closes || u < -tie;
      if (u <= tie || run_.was_pressed(i)) run_.active.push_back(i);
    }
    if (!closes) run_.active.clear();
  }

  /// Contacts that violate (1) become active. @return whether there are new ones
  bool add_closing(const Vector& v, const Vector& shift) {
    const auto before = run_.active.size();
    for (const int i : run_.problem.info().unilateral) {
      if (opening(i, v, shift) < 0 && !std::binary_search(run_.active.begin(), run_.active.begin() + before, i))
        run_.active.push_back(i);
    }
    std::sort(run_.active.begin(), run_.active.end());  // inplace_merge would allocate
    return run_.active.size() > before;
  }

  FixedStepRun& run_;
  FrictionLaw law_;
  Vector v_free_;
};

}  // namespace ricochet
