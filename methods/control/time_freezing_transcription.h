#pragma once

#include "methods/control/transcription.h"
#include "methods/mpcc_equations/time_freezing_equations.h"

namespace ricochet {

/// Optimal control with time freezing (time_freezing_equations.h): on every control interval as much pseudo time as its
/// motion needs. The running cost counts while time runs,
///
///   int L dt = sum over elements n and stages j of b_j theta_nj L(q_nj, v_nj, u),   theta = h s.            (1)
///
/// Source: Nurkanovic, Albrecht, Brogliato, Diehl, Automatica 158 (2023) 111295, section 5.
class TimeFreezingTranscription final : public Transcription {
 public:
  struct Options {
    double a_n = 100;        ///< [m/s^2], of a push
    double bounce = 1;       ///< pseudo time of a bounce without damping, as part of a control interval
    double rho = 1;          ///< weight of equal lengths [1/s^2]
    bool no_capture = true;  ///< (9) of time_freezing_equations.h
  };

  TimeFreezingTranscription(const OptimalControlProblem& problem, const ButcherTableau& tableau,
                            const Options& options);

  ControlTrajectory trajectory(const Vector& x) const override;

 private:
  Status guess_interval(PivotingSolver& solver, double H, int k, Vector& q, Vector& v) override;

  const ButcherTableau tableau_;
  const int n_fe_;
  TimeFreezingEquations equations_;
};

}  // namespace ricochet
