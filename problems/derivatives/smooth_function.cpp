#include "problems/derivatives/smooth_function.h"

#include <algorithm>

#include "problems/derivatives/real_functions.h"

namespace ricochet {

SmoothFunction::SmoothFunction(Expressions outputs, const std::vector<GiNaC::symbol>& inputs,
                               const std::vector<StraightLineProgram::Constant>& constants)
    : n_inputs_(static_cast<int>(inputs.size())) {
  std::transform(outputs.begin(), outputs.end(), outputs.begin(), with_real_symbols);
  value_ = SparseProgram(outputs, {inputs}, constants);

  Expressions slopes;
  for (const auto& x : inputs) {
    for (const auto& output : outputs) slopes.push_back(output.diff(x));
  }
  jacobian_ = SparseProgram(slopes, {inputs}, constants);

  const std::vector<GiNaC::symbol> weights(outputs.size());
  GiNaC::ex sum = 0;
  for (std::size_t k = 0; k < outputs.size(); ++k) sum += weights[k] * outputs[k];
  const std::size_t n = inputs.size();
  Expressions curvatures(n * n);
  for (std::size_t c = 0; c < n; ++c) {
    const GiNaC::ex slope = sum.diff(inputs[c]);
    for (std::size_t r = 0; r <= c; ++r) curvatures[c * n + r] = curvatures[r * n + c] = slope.diff(inputs[r]);
  }
  hessian_ = SparseProgram(curvatures, {inputs, weights}, constants);
  formulas_ = std::move(outputs);
}

}  // namespace ricochet
