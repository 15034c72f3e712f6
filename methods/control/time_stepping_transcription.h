#pragma once

#include "methods/control/transcription.h"
#include "methods/mpcc_equations/time_stepping_equations.h"

namespace ricochet {

/// Optimal control with time stepping (time_stepping_equations.h): steps of equal length on every control interval, the
/// running cost by the right rectangle rule,
///
///   int L dt = sum over steps of h L(q_{k+1}, v_{k+1}, u).                                                  (1)
///
/// This is contact-implicit trajectory optimisation, with which FESD-J is compared.
class TimeSteppingTranscription final : public Transcription {
 public:
  struct Options {
    int steps = 10;  ///< per control interval
    TimeSteppingEquations::Options equations = {};
  };

  TimeSteppingTranscription(const OptimalControlProblem& problem, const Options& options);

  ControlTrajectory trajectory(const Vector& x) const override;

 private:
  Status guess_interval(PivotingSolver& solver, double H, int k, Vector& q, Vector& v) override;

  const int steps_;
  TimeSteppingEquations equations_;
};

}  // namespace ricochet
