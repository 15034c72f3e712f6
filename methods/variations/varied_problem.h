#pragma once

#include <string>
#include <vector>

#include "methods/linear_algebra/scratch_pool.h"
#include "problems/problem.h"

namespace ricochet {

/// State, accelerations and forces at one instant.
struct PointOfMotion {
  Eigen::Ref<const Vector> q, v, a, lambda_n, lambda_t;
};

/// Effect of the variables theta, Settings::sensitivities, on a problem: on its initial state and its equations. One
/// column per theta; matrices of equations have one more, in which nothing varies directly, for the variation along the
/// motion.
class VariedProblem {
 public:
  /// Why a run with sensitivities ends where impacts follow each other at one instant: their number and their order
  /// change with any perturbation.
  static constexpr const char* kNoDerivative =
      "the impacts of several contacts accumulate, and the motion after them has no derivative";

  /// The problem has to outlive this. @throws InputError for a name that the problem does not have, and for one whose
  /// variation of the initial state violates a bilateral constraint
  VariedProblem(const Problem& problem, const std::vector<std::string>& names);
  /// The variables of a step of length H under a constant control: q and v at its start, u = info().u, and H, in this
  /// order, 2 n_q + n_u + 1. dq0() and dv0() are unit columns, also where they violate a constraint.
  static VariedProblem of_step(const Problem& problem);

  const Problem& problem() const { return problem_; }
  const ProblemInfo& info() const { return problem_.info(); }
  Eigen::Index n_theta() const { return dq0_.cols(); }

  const Matrix& dq0() const { return dq0_; }            ///< n_q x n_theta
  const Matrix& dv0() const { return dv0_; }            ///< n_q x n_theta
  const Vector& dt_final() const { return dt_final_; }  ///< n_theta, of end_time
  /// Adds `factor` times the derivatives of eps_r of a contact at the normal velocity `rate` before an impact.
  /// @param sum  up to n_theta + 1 columns
  void add_deps_r(int contact, double rate, double factor, Eigen::Ref<Eigen::RowVectorXd> sum) const;
  const Matrix& dmu() const { return dmu_; }  ///< n_c x (n_theta + 1)

  /// D: n_q + 2 n_c + n_lambda_t rows, one below the other the derivatives with respect to theta alone of
  /// M a - f_v - B_u u - J_n lambda_n - J_t lambda_t, of f_c, of J_n' v and of J_t' v; n_theta columns, or one more.
  void rows(const PointOfMotion& at, ScratchPool& pool, Eigen::Ref<Matrix> D) const;
  Eigen::Index n_rows() const { return problem_.n_q() + 2 * problem_.n_c() + info().n_lambda_t; }
  /// Whether some variable is a parameter of the equations: else only the rows of the motion are not zero, by controls.
  bool varies_parameters() const { return varies_parameters_; }
  Eigen::Index gap_row(int contact) const { return problem_.n_q() + contact; }
  Eigen::Index rate_row(int contact) const { return problem_.n_q() + problem_.n_c() + contact; }
  /// The first of a contact's n_t.
  Eigen::Index slip_row(int contact) const {
    return problem_.n_q() + 2 * problem_.n_c() + info().contacts[contact].tangent_index;
  }

  /// slope: n_q, d(J_n^i(q)' v)/dq
  void gap_curvature(int contact, const Eigen::Ref<const Vector>& q, const Eigen::Ref<const Vector>& v,
                     ScratchPool& pool, Eigen::Ref<Vector> slope) const;

 private:
  explicit VariedProblem(const Problem& problem) : problem_(problem) {}
  void require_consistent_start(const std::vector<std::string>& names) const;
  void subtract_input(const PointOfMotion& at, ScratchPool& pool, Eigen::Ref<Matrix> D) const;

  const Problem& problem_;
  Matrix parameters_;                 // parameters x (n_theta + 1): which column varies which parameter
  bool varies_parameters_ = false;    // some entry of it is not zero
  Eigen::Index control_column_ = -1;  // of the first control; -1 if none varies
  Matrix dq0_, dv0_, deps_r_, dmu_;
  Vector dt_final_;
};

}  // namespace ricochet
