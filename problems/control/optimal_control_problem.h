#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "problems/derivatives/smooth_function.h"
#include "problems/problem.h"
#include "problems/registry.h"

namespace ricochet {

/// Optimal control of a complementarity Lagrangian system, SI units:
///
///   min  int_0^T L(q, v, u) dt + E(q(T), v(T))                                          (1)
///   s.t. the plant's equations (problem.h), (q, v)(0) = (q_0, v_0),                     (2)
///        lower <= q, v, u <= upper,   p(q, v, u) >= 0,   r(q(T), v(T)) = 0              (3)
///
/// u is constant on N control intervals of equal length; (3) is imposed at the stages.
struct OptimalControlProblem {
  struct Bounds {
    Vector lower, upper;  ///< infinite if there is no bound

    /// The nearest values within the bounds. @param values  a column of the size of a bound each
    Matrix clamp(const Matrix& values) const {
      return values.cwiseMax(lower.replicate(1, values.cols())).cwiseMin(upper.replicate(1, values.cols()));
    }
  };

  std::string id, title, source, hard_feature;
  std::unique_ptr<Problem> plant;  ///< end_time is T; u is the guess of the control
  bool is_time_free = false;       ///< T is an unknown in [T_lower, T_upper] with the guess plant->info().end_time
  double T_lower = 0, T_upper = 0;

  Bounds q, v, u;
  SmoothFunction running_cost;   ///< (q, v, u) -> L
  SmoothFunction terminal_cost;  ///< (q, v) -> E
  /// Residuals whose squares are part of L: (q, v, u) -> rho, with L - rho' rho the rest. No outputs if none is stated.
  /// A method that knows them has the convex part 2 rho_x' rho_x of the Hessian exactly (Gauss-Newton).
  SmoothFunction running_residuals;
  SmoothFunction terminal_residuals;  ///< (q, v) -> rho, likewise of E
  SmoothFunction path;                ///< (q, v, u) -> p
  SmoothFunction terminal;            ///< (q, v) -> r
  std::vector<std::string> path_names, terminal_names;

  Matrix u_guess;  ///< guess of the controls, one column per interval of equal length; empty: plant->info().u in all
  Vector goal;     ///< q where the bodies have to go, for drawings; empty where the problem states none

  // Default discretisation, from the source of the problem or chosen by us.
  int n_intervals = 1;  ///< N
  int n_fe = 2;         ///< finite elements in each
  std::string tableau = "radau-iia:2";

  /// The guess of the controls on N intervals, n_u x N: each takes the column of u_guess at its middle.
  Matrix guess(int N) const;
};

struct ControlEntry {
  std::string id, title, source, hard_feature;
  std::function<std::unique_ptr<OptimalControlProblem>(const ParameterChanges&)> make;
};

/// Called by register_control_problem() in the file of each problem.
bool add_control_problem(ControlEntry entry);

/// All optimal control problems, by id.
std::vector<ControlEntry> control_problems();

/// Makes a registered problem, or reads that of a file (problems/scene_file/control_file.h).
/// @param id  of `control_problems()`, or the path of a file: a text with '.' or '/'
/// @throws InputError for an unknown id or parameter, inconsistent sizes, lower > upper, or an initial state outside
/// its bounds or path constraints; as read_control_file()
std::unique_ptr<OptimalControlProblem> make_control_problem(const std::string& id,
                                                            const ParameterChanges& changes = {});

/// The checks of make_control_problem(), for problems that are made in other ways.
void validate(const OptimalControlProblem& problem);

}  // namespace ricochet
