#pragma once

#include "methods/contact_laws/contact_problem.h"
#include "methods/time_stepping/common/fixed_step_run.h"
#include "methods/time_stepping/common/time_stepping_method.h"

namespace ricochet {

/// A time-stepping method whose contact law holds for gaps at the end of the step:
///
///   M (v_{k+1} - v_k) = h f(q_k, v_k) + J_n Lambda_n + J_t Lambda_t,   M, J_n, J_t at q_k   (1)
///   Lambda_n, Lambda_t by the law of gap_contacts.h with a shift s                        (2)
///   q_{k+1} = q_k + h v_{k+1}                                                             (3)
///
/// The order is 1. Unless the method says otherwise, s = f_c(q_k) / h: a contact that closes stays closed.
class GapSteppingMethod : public TimeSteppingMethod {
 public:
  MethodInfo info() const override;
  Support supports(const ProblemInfo& problem) const override;

 protected:
  /// @param title, source  of MethodInfo
  GapSteppingMethod(const MethodSpec& spec, std::string title, std::string source, FrictionLaw law);

  Solution do_solve(const Problem& problem, const Settings& settings) const override;

  /// @param shift  in: f_c(q_k), n_c; out: s of (2)
  virtual void set_shift(const FixedStepRun& run, Vector& shift) const;

 private:
  const std::string title_, source_;
  const FrictionLaw law_;
};

}  // namespace ricochet
