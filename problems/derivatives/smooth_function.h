#pragma once

#include <ginac/ginac.h>

#include <vector>

#include "problems/derivatives/tape.h"

namespace ricochet {

/// A vector function y = f(x) given by formulas, with exact first and second derivatives from GiNaC.
class SmoothFunction {
 public:
  using Expressions = std::vector<GiNaC::ex>;

  SmoothFunction() = default;  ///< no outputs
  /// @param constants  every symbol in `outputs` that is not in `inputs`
  SmoothFunction(const Expressions& outputs, const std::vector<GiNaC::symbol>& inputs,
                 const std::vector<Tape::Constant>& constants);

  int n_inputs() const { return n_inputs_; }
  int n_outputs() const { return n_outputs_; }
  const Expressions& formulas() const { return formulas_; }

  /// @param y  n_outputs
  void evaluate(const double* x, double* y) const;
  /// @param J  n_outputs x n_inputs, column-major, zero on entry: entries that are identically zero are not written
  void jacobian(const double* x, double* J) const;
  /// Hessian of sum_k weights[k] y_k. @param H  n_inputs x n_inputs, zero on entry, as above; both triangles
  void hessian(const double* x, const double* weights, double* H) const;

 private:
  Expressions formulas_;
  int n_inputs_ = 0, n_outputs_ = 0;
  Tape value_, jacobian_, hessian_;
  std::vector<int> jacobian_positions_, hessian_positions_;
};

}  // namespace ricochet
