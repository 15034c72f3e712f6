#pragma once

#include "methods/control/transcription.h"
#include "methods/mpcc_equations/fesd_equations.h"

namespace ricochet {

/// Optimal control with FESD-J (fesd_equations.h) on every control interval; the running cost by the tableau's
/// quadrature,
///
///   int L dt = sum over elements n and stages j of h_n b_j L(q_nj, v_nj, u).                                 (1)
///
/// Source: paper section 4.
class FesdTranscription final : public Transcription {
 public:
  FesdTranscription(const OptimalControlProblem& problem, const ButcherTableau& tableau,
                    const FesdEquations::Options& options);

  ControlTrajectory trajectory(const Vector& x) const override;

 private:
  Status guess_interval(PivotingSolver& solver, double H, int k, Vector& q, Vector& v) override;
  std::vector<int> lengths() const override;
  Status sample(PivotingSolver& solver, double H, Vector q, Vector v, FesdStep& step) const;

  const ButcherTableau tableau_;
  const int n_fe_;
  FesdEquations equations_;
};

}  // namespace ricochet
