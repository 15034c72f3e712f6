#include "problems/derivatives/restitution_formula.h"

#include <fmt/format.h>

#include "problems/input_error.h"

namespace ricochet {
namespace {

void evaluate_at_speed(const StraightLineProgram& program, double v_n, double* outputs) {
  const double* const inputs[] = {&v_n};
  program.evaluate<double>(inputs, outputs);
}

}  // namespace

RestitutionFormula::RestitutionFormula(const SymbolicModel& model, const SymbolicModel::Contact& contact)
    : contact_(contact.name) {
  const auto constants = model.constants(true);
  const StraightLineProgram::InputGroups inputs{{model.v_n}};
  SymbolicModel::Expressions derivatives;
  for (const auto& p : model.parameter_symbols) derivatives.push_back(contact.eps_r.diff(p));
  value_ = StraightLineProgram({contact.eps_r}, inputs, constants);
  slope_ = StraightLineProgram({contact.eps_r.diff(model.v_n)}, inputs, constants);
  parameter_derivative_ = StraightLineProgram(derivatives, inputs, constants);
  std::vector<double> values;
  for (const auto& parameter : model.parameters) values.push_back(parameter.value);
  set_parameters(values);
}

double RestitutionFormula::value(double v_n) const {
  double e = 0;
  evaluate_at_speed(value_, v_n, &e);
  if (!(e >= 0 && e <= 1))
    throw InputError(fmt::format("contact '{}': e at the approach speed vn = {:.6g} m/s", contact_, v_n), e,
                     "a value in [0, 1] is required at every speed of an impact");
  return e;
}

double RestitutionFormula::slope(double v_n) const {
  double slope = 0;
  evaluate_at_speed(slope_, v_n, &slope);
  return slope;
}

void RestitutionFormula::parameter_derivative(double v_n, double* d) const {
  evaluate_at_speed(parameter_derivative_, v_n, d);
}

std::shared_ptr<const RestitutionFormula> RestitutionFormula::with_parameters(std::span<const double> values) const {
  auto changed = std::make_shared<RestitutionFormula>(*this);
  changed->set_parameters(values);
  return changed;
}

void RestitutionFormula::set_parameters(std::span<const double> values) {
  for (StraightLineProgram* program : {&value_, &slope_, &parameter_derivative_}) program->set_constants(values);
}

}  // namespace ricochet
