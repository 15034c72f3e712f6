#include "problems/derivatives/smooth_function.h"

#include <array>

namespace ricochet {

SmoothFunction::SmoothFunction(const Expressions& outputs, const std::vector<GiNaC::symbol>& inputs,
                               const std::vector<Tape::Constant>& constants)
    : formulas_(outputs), n_inputs_(static_cast<int>(inputs.size())), n_outputs_(static_cast<int>(outputs.size())) {
  value_ = Tape(outputs, {inputs}, constants);

  Expressions entries;
  for (int c = 0; c < n_inputs_; ++c) {
    for (int r = 0; r < n_outputs_; ++r) {
      const GiNaC::ex slope = outputs[r].diff(inputs[c]);
      if (slope.is_zero()) continue;
      entries.push_back(slope);
      jacobian_positions_.push_back(c * n_outputs_ + r);
    }
  }
  jacobian_ = Tape(entries, {inputs}, constants);

  std::vector<GiNaC::symbol> weights(static_cast<std::size_t>(n_outputs_));
  GiNaC::ex sum = 0;
  for (int r = 0; r < n_outputs_; ++r) sum += weights[r] * outputs[r];
  entries.clear();
  for (int c = 0; c < n_inputs_; ++c) {
    const GiNaC::ex slope = sum.diff(inputs[c]);
    for (int r = 0; r <= c; ++r) {
      const GiNaC::ex curvature = slope.diff(inputs[r]);
      if (curvature.is_zero()) continue;
      entries.push_back(curvature);
      hessian_positions_.push_back(c * n_inputs_ + r);
    }
  }
  hessian_ = Tape(entries, {inputs, weights}, constants);
}

void SmoothFunction::evaluate(const double* x, double* y) const {
  if (n_outputs_ > 0) value_.evaluate(std::array{x}, y);
}

void SmoothFunction::jacobian(const double* x, double* J) const {
  if (!jacobian_positions_.empty()) jacobian_.evaluate(std::array{x}, J, jacobian_positions_.data());
}

void SmoothFunction::hessian(const double* x, const double* weights, double* H) const {
  if (hessian_positions_.empty()) return;
  hessian_.evaluate(std::array{x, weights}, H, hessian_positions_.data());
  for (const int upper : hessian_positions_) {
    const int row = upper % n_inputs_, column = upper / n_inputs_;
    H[row * n_inputs_ + column] = H[upper];
  }
}

}  // namespace ricochet
