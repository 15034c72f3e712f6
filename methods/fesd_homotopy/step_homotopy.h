#pragma once

#include <optional>
#include <string>
#include <vector>

#include "methods/complementarity/mpcc/homotopy.h"
#include "methods/fesd/pivoting_solver.h"
#include "methods/fesd_homotopy/side_check.h"
#include "methods/mpcc_equations/fesd_equations.h"

namespace ricochet {

/// Solves the FESD-J equations of one step after the other as MPCCs (methods/mpcc_equations/fesd_equations.h) by
/// homotopy, as published: every step is a feasibility problem, with the equilibration of the lengths as the only
/// objective. One program serves all steps; initial state and guess change.
///
/// A contact that is closed at the end of a step is closed at the beginning of the next one: an impact at the right end
/// of a step is one at the left end of the next (correction 7 in methods/fesd/DIFFERENCES.md).
///
/// A guess is a motion q' = v,
///
///   M(q) v' = f_v(q, v) + B_u u + J_n lambda_n + J_t lambda_t,   0 <= lambda_n of contacts that rest,        (1)
///   lambda_t = -F v_t / max(|v_t|, H G F) of friction elements, G = J_t' M^-1 J_t                            (2)
///
/// whose friction (2) brakes small slip over a step and reverses none. It bounces by the impact law where a gap closes
/// first; nothing closes exactly, and no contact slips. Elements of the guess end where a formula of the flight changes
/// its branch. A solution that does not stay on the sides that it states (side_check.h) is none. A step that fails is
/// tried again, as published, with a guess that has an impulse Lambda_n > 0 in any case: where the motion comes nearest
/// to a contact. Retries begin with a sigma of their own.
class StepHomotopy {
 public:
  enum class Guess {
    cold,       ///< the state at the step's start, everywhere
    ballistic,  ///< the motion (1)
    pivoting,   ///< the step of the pivoting solver; ballistic after a step where that has failed
  };

  struct Options {
    FesdEquations::Options equations;
    HomotopyOptions homotopy;
    Guess guess = Guess::ballistic;
    int retries = 3;
  };

  /// @param H  length of every step [s]
  /// @throws InputError for Guess::pivoting with formulas that bend or jump, and as FesdEquations
  StepHomotopy(const Problem& problem, const ButcherTableau& tableau, const Options& options, double H);
  StepHomotopy(const StepHomotopy&) = delete;
  StepHomotopy& operator=(const StepHomotopy&) = delete;

  /// Starts a run at (q, v), v before an impact at this instant.
  void start(const Vector& q, const Vector& v);
  /// Solves the next step. @param seconds  wall time for it and its retries; 0 is no limit
  Status advance(double seconds = 0);

  const FesdStep& step() const { return steps_[current_]; }
  const FesdStep* previous_step() const { return n_steps_ > 1 ? &steps_[1 - current_] : nullptr; }
  /// The program's solution at the last step, or at its last attempt.
  const MpccSolution& solution() const { return solution_; }
  int attempts() const { return attempts_; }  ///< at the last step
  NlpEvaluator::Work work() const { return solver_.work(); }

 private:
  /// A contact that the flight meets, or comes nearest to.
  struct Approach {
    int contact = -1;
    double t = 0, gap = 0;
  };
  struct Forces {
    Vector n, t;  // n_c, n_lambda_t
  };
  /// The end of an element in the guess.
  struct Boundary {
    double t = 0;      // from the begin of the step
    int contact = -1;  // that is hit; -1: a formula changes its branch
  };

  std::vector<int> add_control();
  FesdStep cold() const;
  FesdStep flight(bool has_impact);
  double bounce(int contact, const Vector& q, Vector& v) const;
  void capture(int contact, double h, const Vector& q, Vector& v);
  Vector element_friction(const Vector& q, const Vector& v, const Vector& force, const Matrix& J_t,
                          const Matrix& M_J_t) const;
  Vector acceleration(const Vector& q, const Vector& v, Forces& lambda) const;
  void fly(double h, Vector& q, Vector& v) const;
  void fly_element(double h, Vector& q, Vector& v, Element& element) const;
  Approach nearest_approach(Vector q, Vector v) const;
  void add_branch_changes(double from, double to, Vector& q, Vector& v, std::vector<Boundary>& boundaries) const;
  std::vector<Boundary> boundaries(const Vector& q, const Vector& v, bool has_impact) const;
  void check_sides();
  HomotopyOptions attempt_options(double seconds) const;
  void accept();

  const Problem& problem_;
  const ProblemInfo& info_;
  const ButcherTableau tableau_;
  const Options options_;
  const double H_;
  Mpcc mpcc_;
  FesdEquations equations_;
  FesdEquations::Point initial_, right_;
  MpccSolver solver_;
  std::optional<SideCheck> side_check_;  // of forces that bend or jump
  Counters pivoting_counters_;
  std::optional<PivotingSolver> pivoting_;

  Vector q_, v_;
  std::vector<bool> is_closed_, is_resting_;
  FesdStep steps_[2];
  int current_ = 0;
  int n_steps_ = 0, attempts_ = 0;
  MpccSolution solution_;
};

}  // namespace ricochet
