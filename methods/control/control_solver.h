#pragma once

#include <functional>
#include <vector>

#include "methods/complementarity/mpcc/homotopy.h"
#include "methods/control/control_solution.h"
#include "methods/control/shooting/shooting.h"
#include "methods/control/transcription.h"

namespace ricochet {

/// A method for one optimal control problem: it solves the task, and from then on what remains of it.
class ControlSolver {
 public:
  virtual ~ControlSolver() = default;

  /// Solves the whole task from the first guess.
  virtual ControlSolution solve() = 0;

  /// Solves the rest of the task again from the last plan, in which the plant has come to interval k.
  /// @param k  from 1 to N - 1, not less than in an earlier call. @param q, v  state of the plant there, before an impact
  /// @param is_closed  n_c: contacts that touch, whatever rounding their gap has
  /// @return with a trajectory of all N intervals, of which those before k are the past
  virtual ControlSolution resolve(int k, const Vector& q, const Vector& v, const std::vector<bool>& is_closed) = 0;

  /// How the plant is run.
  virtual Transcription::Simulation simulation() const = 0;

  virtual int n_variables() const = 0;
  virtual int n_pairs() const = 0;  ///< of complementarity; 0 for a method that has none
};

/// Solves by a homotopy of relaxations. resolve() keeps the program: the past becomes constant (Transcription::start_at),
/// so functions, structure and the numbers of variables are reused. The plan is the guess, and its branch is solved first
/// (MpccSolver::resolve). A solve that fails leaves no plan.
class HomotopyControlSolver final : public ControlSolver {
 public:
  /// @param transcription  with the first guess; must outlive this object
  /// @param options  of both solves. @param progress  called after every step. @throws InputError for options out of range
  HomotopyControlSolver(Transcription& transcription, const HomotopyOptions& options,
                        MpccSolver::Progress progress = {});

  ControlSolution solve() override;
  ControlSolution resolve(int k, const Vector& q, const Vector& v, const std::vector<bool>& is_closed) override;
  Transcription::Simulation simulation() const override { return transcription_.simulation(); }
  int n_variables() const override { return transcription_.mpcc().nlp.n_variables(); }
  int n_pairs() const override { return static_cast<int>(transcription_.mpcc().pairs.size()); }

  const MpccSolution& last() const { return last_; }

 private:
  ControlSolution take();

  Transcription& transcription_;
  MpccSolver solver_;
  const MpccSolver::Progress progress_;
  MpccSolution last_;
  Vector plan_;  // x of the last one that is solved
};

/// Solves by shooting (shooting/shooting.h). A solve that is not stationary yet, or has no time left, still yields a plan,
/// because its last iterate is a motion of the plant from its present state.
class ShootingControlSolver final : public ControlSolver {
 public:
  /// First guess of the first solve, and the limit of the next ones.
  struct Start {
    std::vector<Matrix> guesses;  ///< n_u x N / 2^refine each
    double T = 0;                 ///< first guess of the end time [s]; 0: the problem's
    int refine = 0;               ///< levels of solve_refined()
    double warm_time_limit = 0;   ///< wall time of a resolve() [s]; 0: no limit
  };

  /// @param problem  must outlive this object. @param tableau, options  as of Shooting. @param start  of the first solve
  /// @param progress  called after every iteration. @throws InputError as Shooting
  ShootingControlSolver(const OptimalControlProblem& problem, const ButcherTableau& tableau,
                        const ShootingOptions& options, Start start, Shooting::Progress progress = {});

  ControlSolution solve() override;
  ControlSolution resolve(int k, const Vector& q, const Vector& v, const std::vector<bool>& is_closed) override;
  Transcription::Simulation simulation() const override;
  int n_variables() const override;
  int n_pairs() const override { return 0; }

 private:
  const OptimalControlProblem& problem_;
  const ButcherTableau tableau_;
  const ShootingOptions options_;
  const Start start_;
  const Shooting::Progress progress_;
  Shooting shooting_;
  ControlTrajectory plan_;
  int first_ = 0;  // interval of the task with which the last motion begins
};

}  // namespace ricochet
