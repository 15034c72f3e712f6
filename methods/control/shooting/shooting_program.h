#pragma once

#include <functional>
#include <utility>
#include <vector>

#include "methods/control/shooting/convex_hessian.h"
#include "methods/control/shooting/guards.h"
#include "methods/control/shooting/horizon_qp.h"
#include "methods/control/shooting/linearised_interval.h"

namespace ricochet {

/// The quadratic program of a step of shooting, in dx_k = change of (q, v), and of H behind them if the end time is
/// free, and du_k:
///
///   min  sum h b_j (grad L' D z + 1/2 (D z)' (L'')+ D z) + L b_j dh + grad E' dx_N + 1/2 dx_N' (E'')+ dx_N          (1)
///   s.t. c + c' D z >= 0 at every stage,   r + r' dx_N = 0,   both with slacks of the cost nu each                   (2)
///        lower <= u + du <= upper,   |du| <= Delta s,   guard + guard' z >= 0                                        (3)
///
/// with slacks of the guards, which cost so much more that they are zero unless guards contradict each other. Here D are
/// the derivatives of a stage's (q, v, u) by z = (dx_k, du_k), c are those of stage_constraints.h and ()+ is
/// the projection to the positive semidefinite part: the generalised Gauss-Newton matrix. s are half the distances of
/// the bounds of a control, or 1. A change of h_n changes the cost in first order only.
///
/// What curves the motion itself, as a switch whose time depends strongly on the state, is not in (1). It is learned: with the
/// multipliers lambda of the dynamics, the Lagrangian of interval k has the gradient a_k = g_k + (A_k B_k)' lambda_k+1 by
/// z. From one motion to the next, a step s_k apart and with the same sequence in the interval,
///
///   S_k += w w' / (w' s_k),   w = (change of a_k at fixed lambda) - (H_k + S_k) s_k                                 (4)
///
/// and the program has the convex part of H_k + S_k, where H_k is that of (1). Sources: Nocedal, Wright, Numerical
/// Optimization (2006), section 6.2, the update of symmetric rank one; Griewank, Toint, Partitioned variable metric
/// updates, Numer. Math. 39 (1982), one for each part of a sum.
class ShootingProgram {
 public:
  /// @param runner  must outlive this object
  explicit ShootingProgram(PlantRunner& runner);

  /// Sets lower and upper bound of H [s], which are used where the end time is free.
  void set_H_bounds(double lower, double upper);
  double H_lower() const { return H_lower_; }
  double H_upper() const { return H_upper_; }
  /// Sets everything but Delta, nu and the guards. @param linearised  of the motion
  void set(const PlantMotion& motion, const MotionLineariser& linearised);
  /// Appends the guards of the motion to (3), once.
  void add_guards(const PlantMotion& motion, const MotionLineariser& linearised);
  bool has_guards() const { return has_guards_; }

  /// Ends solve() and correct() where this returns true, with QpStatus::interrupted. @param is_interrupted  empty for never
  void set_interrupt(std::function<bool()> is_interrupted) { is_interrupted_ = std::move(is_interrupted); }
  /// Solves the program with Delta and nu. Of the rows of (2) and (3), those that its solution violates are added one
  /// after the other: most rows of most stages never matter. @return valid until the next call
  /// @param margin  by which the guards have to stay away from zero, in units of their rows
  /// @param tolerance  of HorizonQpOptions
  const HorizonQpSolution& solve(double Delta, double nu, double margin, double tolerance);

  /// Solves it once more, after solve(), with what the linearisation misses at a step: dynamics, constraints and r get the
  /// differences between their values in the motion `trial` and those that their slopes predict there. Such a step stays on
  /// curved constraints, which a step along their tangents violates by its square (Fletcher 1987, section 14.4).
  /// @param motion  of set(); @param trial  after a step, with the same sequence. @return valid until the next call
  const HorizonQpSolution& correct(const PlantMotion& motion, const PlantMotion& trial, double margin,
                                   double tolerance);

  /// What the cost of (1) with nu times the violation falls by, according to the solution.
  double predicted_decrease(const HorizonQpSolution& solution) const;
  /// Slacks of (2) in the solution, and at z = 0.
  double slack(const HorizonQpSolution& solution) const { return sums(solution).constraints; }
  double slack() const { return slack_at_0_; }
  /// The largest multiplier of (2).
  double largest_multiplier(const HorizonQpSolution& solution) const;
  /// The largest change of a control, relative to s; of H, relative to its own range.
  double step_size(const HorizonQpSolution& solution) const;
  /// Gradient of the cost, without constraints, by all controls, n_u x N, and by H.
  struct Gradient {
    Matrix u;
    double H = 0;
  };
  Gradient gradient() const;
  /// The same after a step, by the quadratic model (1) of the cost. @param du  n_u x N; @param dH  [s]
  Gradient gradient_after(const Matrix& du, double dH) const;
  /// Second derivative of that model along a step.
  double curvature(const Matrix& du, double dH) const;
  /// Gradient of a function with the given slope by theta of one interval, by all controls and by H.
  Gradient gradient(int interval, const Eigen::RowVectorXd& by_theta) const;

  struct ConstraintGradient {
    Gradient gradient;
    double value = 0;  ///< of the constraint
  };
  /// Gradients of those inequalities (2) of all stages whose value is at most `largest`, by all controls and H.
  std::vector<ConstraintGradient> constraint_gradients(double largest) const;
  /// Gradients of r.
  std::vector<Gradient> terminal_gradients() const;

  const std::vector<Guard>& guards() const { return guards_; }
  const Vector& scale() const { return scale_; }
  double H_scale() const { return H_scale_; }
  int n_x() const { return n_x_; }

 private:
  /// All rows of (2), then of (3), of one stage.
  struct Rows {
    Matrix C;
    Vector d, correction;            // of correct(), else zero
    std::vector<int> origin;         // numbers of the rows of (2) among all constraints of all stages
    Eigen::Index n_constraints = 0;  // of (2)
    std::vector<char> is_used;       // in qp_
  };
  void add_stage(const Element& e, const Sensitivity::ElementDerivatives& derivatives, int j, HorizonStage& stage,
                 Rows& rows);
  void add_cost_before_switch(const PlantMotion& motion, const LinearisedInterval& interval, std::size_t k,
                              HorizonStage& stage);
  void set_end(const PlantMotion& motion);
  void learn(const PlantMotion& motion, const std::vector<HorizonStage>& before);
  struct Slacks {
    double constraints = 0, guards = 0;
  };
  Slacks sums(const HorizonQpSolution& solution) const;
  void set_bounds(double Delta, double nu);
  const HorizonQpSolution& solve(double margin, double tolerance);
  void constraints_of(const PlantMotion& motion, int k, Vector& values);
  void use_rows(double margin);
  bool add_violated(const HorizonQpSolution& solution, double margin);
  Vector by_z(const Eigen::RowVectorXd& by_theta) const;
  std::vector<Vector> stages_after(const Matrix& du, double dH) const;
  Gradient adjoint(int from, Vector lambda, const std::vector<Vector>* g) const;

  PlantRunner& runner_;
  const OptimalControlProblem& problem_;
  const Eigen::Index n_q_, n_u_, n_theta_;
  const bool is_time_free_;
  const int n_x_;
  Vector scale_;  // s
  double H_scale_ = 1, H_lower_ = 0, H_upper_ = 0;

  HorizonQp qp_;                   // its rows are the used ones
  std::vector<Matrix> curvature_;  // S_k of (4)
  std::vector<Vector> lambda_;     // of the last solution
  PlantMotion last_;               // of the last set(), whose cost is in qp_
  HorizonQpSolver solver_;
  std::function<bool()> is_interrupted_;
  std::vector<Rows> rows_;
  int n_seen_ = 0;  // constraints of the interval at hand so far
  Matrix u_;
  double H_ = 0;
  double slack_at_0_ = 0, nu_ = 0, guard_weight_ = 0;
  bool has_guards_ = false;
  std::vector<Guard> guards_;

  ConvexHessian running_, terminal_;
  Vector point_, gradient_L_, c_;
  Matrix D_, D_theta_, J_;
};

}  // namespace ricochet
