#pragma once

#include <Eigen/Core>
#include <vector>

#include "problems/derivatives/sparse_program.h"

namespace ricochet {

/// A vector function y = f(x) of real x, given by formulas, with exact first and second derivatives from GiNaC. See
/// real_functions.h for kinks and jumps.
class SmoothFunction {
 public:
  using Expressions = std::vector<GiNaC::ex>;

  SmoothFunction() = default;  ///< no outputs
  /// @param constants  every symbol in `outputs` that is not in `inputs`
  SmoothFunction(Expressions outputs, const std::vector<GiNaC::symbol>& inputs,
                 const std::vector<StraightLineProgram::Constant>& constants);

  int n_inputs() const { return n_inputs_; }
  int n_outputs() const { return static_cast<int>(formulas_.size()); }
  const Expressions& formulas() const { return formulas_; }

  /// @param y  n_outputs
  void evaluate(const double* x, double* y) const { value_.evaluate({x}, y); }
  /// The outputs for an input that is given as several vectors, one after the other.
  template <class... Parts>
  Eigen::VectorXd at(const Parts&... parts) const {
    Eigen::VectorXd x(n_inputs_), y(n_outputs());
    if (y.size() == 0) return y;
    Eigen::Index k = 0;
    ((x.segment(k, parts.size()) = parts, k += parts.size()), ...);
    evaluate(x.data(), y.data());
    return y;
  }
  /// @param J  n_outputs x n_inputs, column-major
  void jacobian(const double* x, double* J) const { jacobian_.evaluate({x}, J); }
  /// Hessian of sum_k weights[k] y_k. @param H  n_inputs x n_inputs
  void hessian(const double* x, const double* weights, double* H) const { hessian_.evaluate({x, weights}, H); }

 private:
  Expressions formulas_;
  int n_inputs_ = 0;
  SparseProgram value_, jacobian_, hessian_;
};

}  // namespace ricochet
