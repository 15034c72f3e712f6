#pragma once

#include <memory>
#include <span>
#include <string>

#include "problems/derivatives/straight_line_program.h"
#include "problems/derivatives/symbolic_problem.h"

namespace ricochet {

/// A coefficient of restitution as a formula of SymbolicModel::v_n and the parameters.
class RestitutionFormula final : public RestitutionOfSpeed {
 public:
  /// Differentiates the formula of the `contact` of the `model`.
  /// @throws InputError as StraightLineProgram's constructor
  RestitutionFormula(const SymbolicModel& model, const SymbolicModel::Contact& contact);

  double value(double v_n) const override;
  double slope(double v_n) const override;
  void parameter_derivative(double v_n, double* d) const override;

  /// The formula with other `values` of all parameters.
  std::shared_ptr<const RestitutionFormula> with_parameters(std::span<const double> values) const;

 private:
  void set_parameters(std::span<const double> values);

  std::string contact_;
  StraightLineProgram value_, slope_, parameter_derivative_;
};

}  // namespace ricochet
