#pragma once

#include <vector>

#include "methods/event_driven/collocation_polynomial.h"
#include "methods/event_driven/mode_dynamics.h"
#include "methods/event_driven/step_scheme.h"
#include "methods/runge_kutta/butcher_tableau.h"
#include "problems/small_complex.h"

namespace ricochet {

/// One step of Radau IIA with s = 3 or 5 stages, of order 2 s - 1, for q' = v, v' = a(q, v). The unknowns are
/// w_i = v_i - v_0, n_q per stage,
///
///   q_i = q_0 + h c_i v_0 + h sum_j A_ij w_j                                             (1)
///   h^-1 sum_j (A^-1)_ij w_j = a(q_i, v_0 + w_i)                                         (2)
///
/// and the last stage is the right end. Simplified Newton iterations have the matrix
/// h^-1 A^-1 x I - I x a_v - h A x a_q, which the eigenvalues l of A take apart: with w = T y, A = T diag(l) T^-1,
///
///   (I / (h l) - a_v - h l a_q) dy = -(T^-1 x I) (residual of (2))                        (3)
///
/// for the real l and one of each pair. They end where what is left, theta / (1 - theta) of the last correction with
/// theta its contraction, is a hundredth of the tolerance; in the first one the factor is that of the last step to the
/// power 0.8. a_q and a_v are those of the left end, kept while they contract by 1e-3; the first guess is the polynomial
/// of the last step.
///
/// The error is estimated by a formula of order s that has the real l = g as its weight at the left end,
///
///   e = (I - h g J)^-1 (h g (v_0, a_0) + sum_i e_i (q_i - q_0, w_i)),   e' = d' A^-1       (4)
///   sum_i d_i c_i^(k-1) = -g for k = 1, else 0,   k = 1, .., s                           (5)
///
/// with J the Jacobian of the first-order system, so that the matrix is that of (3) for g. It has order s,
/// the step 2 s - 1, so that a tolerance of
///
///   0.1 tolerance^((s + 1) / (2 s))                                                      (6)
///
/// for e keeps the error of the step in proportion to the tolerance. Besides e_q and e_v,
///
///   |(e_q)_k (a_q e_q)_k|^(1/2)                                                          (7)
///
/// counts as an error of v_k: the velocity that belongs to the potential energy of e_q. An oscillation that a step does
/// not resolve can have its whole error in q at the right end, where it is smaller than that of v by the frequency; with
/// (7) the estimate does not depend on the phase. Where a step is rejected, (8.20) of the source filters e once more;
/// it is left out, since of an oscillation of frequency y / h it lets the part 1 / (g y) through: after an impact steps
/// would damp what they should follow.
///
/// Source: Hairer, Wanner, Solving Ordinary Differential Equations II, section IV.8, (8.13)-(8.19), and RADAU for (6).
class RadauStep final : public StepScheme {
 public:
  /// @param tableau  Radau IIA with an odd number of stages
  RadauStep(const ButcherTableau& tableau, int n_q, ModeDynamics& dynamics);
  RadauStep(const RadauStep&) = delete;  // `ends` has a pointer to a member

  void start(double tolerance) override;
  bool take(double h, EventFunctions* watched) override;
  bool finish() override;
  double error(double tolerance) const override;

 private:
  /// An eigenvalue of A with its column of T, doubled where it stands for a pair, and its row of T^-1; (3) for it.
  struct Mode {
    Complex l;
    std::vector<Complex> column, inverse_row;  // n_s
    ComplexFactors factors;
  };

  bool linearize();
  bool factorize();
  void predict();
  bool iterate();
  bool set_accelerations();
  void set_positions();
  double correct();
  void estimate();

  const int n_q_, n_s_;
  ModeDynamics& dynamics_;
  double tolerance_ = 0;
  const Vector c_;
  const Matrix A_transposed_, A_inverse_transposed_;
  std::vector<Mode> modes_;
  std::size_t real_ = 0;  // of modes_: the real one
  double g_ = 0;          // its l
  Vector weights_;        // e_i of (4)

  Matrix w_, q_, a_, residual_, correction_, moved_;  // n_q x n_s
  Vector stage_v_, e_q_, e_v_, e_energy_;             // n_q
  std::vector<Complex> y_;                            // n_q
  Matrix a_q_, a_v_;
  double h_factors_ = 0;    // [s], of the factors; 0: none
  bool is_linear_ = false;  // a_q_, a_v_ are there
  bool is_fresh_ = false;   // and those of the left end
  double contraction_ = 1;  // theta of the last iteration
  double left_ = 1;         // theta / (1 - theta), for the first correction of the next
  int mode_changes_ = -1;   // of the dynamics, that a_q_, a_v_ belong to

  CollocationPolynomial polynomial_;
  // The last step that counts.
  CollocationPolynomial last_polynomial_;
  Vector last_v0_, last_a0_, last_v1_, last_a1_;
  double last_h_ = 0;
};

}  // namespace ricochet
