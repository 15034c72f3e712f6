#pragma once

#include <algorithm>

#include "methods/time_stepping/explicit_step.h"
#include "methods/time_stepping/fixed_step_run.h"

namespace ricochet {

/// The contacts of a step whose law holds for gaps at its end: all of them, whatever their gap is now,
///
///   0 <= Lambda_n^i  _|_  J_n^i' v+ + s^i >= 0,   s^i a multiple of f_c^i(q_k) / h         (1)
///
/// (with the associated law minus mu^i ||J_t^i' v+||). Most contacts of a step stay open. Those that the free velocity
/// would close are solved for, those that the result closes are added, until (1) holds for all. In a row of bodies that
/// touch each contact would add the next one so: where there is any, contacts of the step before, and those that the
/// free velocity leaves just closed, are there from the beginning.
class GapContacts {
 public:
  GapContacts(FixedStepRun& run, FrictionLaw law) : march_(run), law_(law), v_free_(run.v) {}

  /// Replaces the free velocity by v+; directions are those of the last ContactStep::set_position(). @param shift  n_c
  bool solve(const BlockInverse& W, const Vector& shift, Vector& v) {
    v_free_ = v;
    begin(v, shift);
    bool is_complete = !march_.has_contact_problem();
    while (!is_complete) {
      march_.clear_impulses();
      v = v_free_;
      if (!march_.prepare_contacts(W) || !march_.solve_contacts(v, shift, {})) return false;
      is_complete = !add_closing(v, shift);
    }
    return true;
  }

 private:
  /// Of (1).
  double opening(int i, const Vector& v, const Vector& shift) const {
    const double normal = march_.contacts.normal_velocity(i, v) + shift[i];
    return law_ == FrictionLaw::coulomb
               ? normal
               : normal - march_.problem.info().contacts[i].mu * march_.contacts.slip_speed(i, v);
  }

  /// The contacts to begin with; none, when no gap ends below zero by more than its rounding.
  void begin(const Vector& v, const Vector& shift) {
    march_.active.clear();
    bool closes = false;
    for (const int i : march_.problem.info().unilateral) {
      const double u = opening(i, v, shift), tie = march_.touching(i) / march_.h;
      closes = closes || u < -tie;
      if (u <= tie || march_.was_pressed(i)) march_.active.push_back(i);
    }
    if (!closes) march_.active.clear();
  }

  /// Contacts that violate (1) become active. @return whether there are new ones
  bool add_closing(const Vector& v, const Vector& shift) {
    const auto before = march_.active.size();
    for (const int i : march_.problem.info().unilateral) {
      if (opening(i, v, shift) < 0 && !std::binary_search(march_.active.begin(), march_.active.begin() + before, i))
        march_.active.push_back(i);
    }
    std::sort(march_.active.begin(), march_.active.end());  // inplace_merge would allocate
    return march_.active.size() > before;
  }

  FixedStepRun& march_;
  FrictionLaw law_;
  Vector v_free_;
};

/// Steps with forces and directions at their beginning, (1), and
///
///   q_{k+1} = q_k + h v_{k+1}.                                                           (2)
///
/// @param to_shift  (run, s): turns s = f_c(q_k) into the shift of (1)
template <class ToShift>
Solution run_with_gaps(const Problem& problem, const Settings& settings, const ContactSolverOptions& solver,
                       FrictionLaw law, ToShift to_shift) {
  FixedStepRun run(problem, settings, solver, {.friction = law});
  ExplicitStep free(run);
  GapContacts contacts(run, law);
  Vector shift(problem.n_c());
  return run.take_steps([&](Vector& v_plus) {
    v_plus = run.v + free.change(run.q, run.v);
    problem.gap(run.q.data(), shift.data());
    run.contacts.set_position(run.q);
    to_shift(run, shift);
    if (!contacts.solve(free.W, shift, v_plus)) return false;  // (1)
    run.q += run.h * v_plus;                                   // (2)
    return true;
  });
}

}  // namespace ricochet
