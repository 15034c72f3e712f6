#pragma once

#include <memory>
#include <utility>
#include <vector>

#include "methods/complementarity/mpcc/homotopy.h"
#include "methods/control/control_trajectory.h"
#include "methods/fesd/pivoting_solver.h"
#include "methods/mpcc_equations/contact_equations.h"
#include "problems/control/optimal_control_problem.h"
#include "problems/solution.h"

namespace ricochet {

/// An optimal control problem as a mathematical program with complementarity constraints: a discretisation of the
/// plant, the costs and constraints at its points.
class Transcription {
 public:
  virtual ~Transcription() = default;

  const Mpcc& mpcc() const { return mpcc_; }
  Mpcc& mpcc() { return mpcc_; }
  /// Reads the motion out of a solution x.
  virtual ControlTrajectory trajectory(const Vector& x) const = 0;
  /// What is known of a solved program's point, "S, B, 3 biactive pairs". Where an element has its least length, the
  /// program holds an impact or a switch that the plant lets move: the point is stationary for the program only, and the
  /// text names the element. @param solved  by MpccSolver
  std::string stationarity(const MpccSolution& solved) const;
  /// (q, v) of a solution x at the boundaries of the intervals, before an impact there: 2 n_q x (N + 1).
  Matrix states(const Vector& x) const;
  /// Sets the guess of all variables from these controls and the motion of the pivoting solver under them.
  /// @param u  n_u x N. @return its status; variables after a failure keep the plain guess
  Status guess_from_simulation(const Matrix& u);
  /// Guess from a simulation with the problem's guess of the control.
  Status guess_from_simulation();

  /// Lets interval k begin at (q, v), before an impact there. This state and everything before it become constant, with
  /// the values of x, and their rows are left out. Variables, rows and pairs keep their numbers.
  /// @param k  from 0, not less than in an earlier call. @param is_closed  n_c: contacts that touch, whatever rounding
  /// their gap has
  void start_at(int k, const Vector& x, const Vector& q, const Vector& v, const std::vector<bool>& is_closed);

  /// How the plant is simulated with the pivoting solver.
  struct Simulation {
    ButcherTableau tableau;
    PivotingSolver::Options options;
  };
  const Simulation& simulation() const { return simulation_; }

 protected:
  Transcription(const OptimalControlProblem& problem, Simulation simulation)
      : problem_(problem), simulation_(std::move(simulation)) {}

  /// Means of the forces over the time of a step, impacts included.
  struct MeanForces {
    Vector lambda_n, lambda_t;
  };
  static MeanForces mean_forces(const FesdStep& step, const ButcherTableau& tableau);

  /// Simulates interval k, of length H, and uses its motion as the guess. @param solver  started at the interval's
  /// start. @param q, v  the state there; at its end on return
  virtual Status guess_interval(PivotingSolver& solver, double H, int k, Vector& q, Vector& v) = 0;

  /// Variables of the lengths of elements, of intervals that have several.
  virtual std::vector<int> lengths() const { return {}; }

  /// Is called before the initial state is added.
  void begin_sections();
  /// Is called after the initial state and after every interval. @param end  its last point
  void end_section(const ContactEquations::Point& end);

  /// Variables of every interval's control.
  std::vector<std::vector<int>> add_controls();
  /// T as a variable, or -1 when it is fixed.
  int add_time();
  /// Path constraints of problem_ at (q, v, u).
  void add_path(const std::vector<int>& q, const std::vector<int>& v, const std::vector<int>& u,
                const std::string& name);
  /// Terminal cost and constraints at (q, v).
  void add_terminal(const std::vector<int>& q, const std::vector<int>& v);
  /// The controls and T of a ControlTrajectory.
  ControlTrajectory read_controls(const Vector& x) const;

  const OptimalControlProblem& problem_;
  const Simulation simulation_;
  Mpcc mpcc_;
  std::vector<std::vector<int>> u_;
  int T_ = -1;

 private:
  /// The initial state, then one interval each.
  struct Section {
    int first_variable, first_row, end_variable, end_row;
    ContactEquations::Point end;
  };
  int next_variable_ = 0, next_row_ = 0;  // the first of the next section
  std::vector<Section> sections_;
};

}  // namespace ricochet
