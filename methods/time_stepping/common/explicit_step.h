#pragma once

#include "methods/linear_algebra/block_inverse.h"
#include "methods/time_stepping/common/fixed_step_run.h"

namespace ricochet {

/// v + h M^-1 f(q_k, v): the free velocity of the methods that take forces at the beginning of the step. A constant M
/// is inverted once.
class ExplicitStep {
 public:
  explicit ExplicitStep(FixedStepRun& run)
      : run_(run), problem_(run.problem), M_(problem_.n_q(), problem_.n_q()), f_(problem_.n_q()), Wf_(problem_.n_q()) {
    if (problem_.info().structure.constant_mass) invert();
  }

  /// Takes M and f at (q, v). @return h M^-1 f
  const Vector& change(const Vector& q, const Vector& v) {
    if (!problem_.info().structure.constant_mass) invert(q);
    return change_without_mass(q, v);
  }
  /// h M^-1 f with M of the last call, at the same q.
  const Vector& change_without_mass(const Vector& q, const Vector& v) {
    problem_.force(q.data(), v.data(), problem_.info().u.data(), f_.data());
    f_ *= run_.h;
    W.apply(f_, Wf_);
    ++run_.solution.counters.force_evaluations;
    ++run_.solution.counters.linear_solves;
    return Wf_;
  }

  BlockInverse W;  ///< M^-1

 private:
  void invert() { invert(run_.q); }
  void invert(const Vector& q) {
    problem_.mass_matrix(q.data(), M_.data());
    W.compute(M_, problem_.info().has_bilateral());
    ++run_.solution.counters.mass_factorizations;
  }

  FixedStepRun& run_;
  const Problem& problem_;
  Matrix M_;
  Vector f_, Wf_;
};

}  // namespace ricochet
