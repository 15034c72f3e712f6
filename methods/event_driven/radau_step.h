#pragma once

#include "methods/event_driven/collocation_guess.h"
#include "methods/event_driven/radau_error.h"
#include "methods/event_driven/radau_system.h"
#include "methods/modes/mode_dynamics.h"
#include "methods/modes/step_scheme.h"

namespace ricochet {

/// One step of Radau IIA with s = 3 or 5 stages, of order 2 s - 1, for q' = v, v' = a(q, v). The unknowns are
/// w_i = v_i - v_0, n_q per stage,
///
///   q_i = q_0 + h c_i v_0 + h sum_j A_ij w_j                                             (1)
///   h^-1 sum_j (A^-1)_ij w_j = a(q_i, v_0 + w_i)                                         (2)
///
/// and the last stage is the right end. Simplified Newton iterations (radau_system.h) end if the remaining error is a
/// hundredth of the tolerance. It is estimated as theta / (1 - theta) times the last correction, theta its contraction;
/// in the first iteration the factor is that of the last step to the power 0.8. a_q and a_v are those of the left end,
/// kept while they contract by 1e-3; the first guess is the polynomial of the last step. The estimate of the error is
/// in radau_error.h.
///
/// Source: Hairer, Wanner, Solving Ordinary Differential Equations II, section IV.8, (8.13)-(8.19).
class RadauStep final : public StepScheme {
 public:
  /// @param tableau  Radau IIA with an odd number of stages
  RadauStep(const ButcherTableau& tableau, int n_q, ModeDynamics& dynamics);
  RadauStep(const RadauStep&) = delete;  // `ends` has a pointer to a member

  void start(double tolerance) override;
  bool take(double h, EventFunctions* watched) override;
  bool finish() override;
  double error(double tolerance) const override { return error_.in_parts_of(tolerance, ends); }

 private:
  /// a_q and a_v at a left end.
  struct Jacobians {
    Matrix q, v;
    bool is_known = false;
    bool is_fresh = false;  ///< they are those of the left end
    int mode_changes = -1;  ///< of the dynamics that they belong to
  };

  bool linearize();
  bool factorize();
  bool iterate();
  bool set_accelerations();
  double correct();

  ModeDynamics& dynamics_;
  double tolerance_ = 0;
  const Vector c_;
  const Matrix A_transposed_, A_inverse_transposed_;
  RadauSystem system_;
  RadauError error_;
  CollocationGuess last_;
  CollocationPolynomial polynomial_;
  Jacobians J_;
  Matrix w_, q_, a_;                      // n_q x n_s: stages
  Matrix residual_, correction_, moved_;  // n_q x n_s
  Vector stage_v_;                        // n_q
  double contraction_ = 1;                // theta of the last iteration
  double left_ = 1;                       // theta / (1 - theta), for the first correction of the next
};

}  // namespace ricochet
