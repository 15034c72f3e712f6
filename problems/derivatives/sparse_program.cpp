#include "problems/derivatives/sparse_program.h"

#include <algorithm>

namespace ricochet {

SparseProgram::SparseProgram(const std::vector<GiNaC::ex>& dense, const StraightLineProgram::InputGroups& inputs,
                             const std::vector<StraightLineProgram::Constant>& parameter_values)
    : size_(static_cast<int>(dense.size())) {
  std::vector<GiNaC::ex> nonzero;
  for (std::size_t k = 0; k < dense.size(); ++k) {
    if (dense[k].is_zero()) continue;
    nonzero.push_back(dense[k]);
    positions_.push_back(static_cast<int>(k));
  }
  program_ = StraightLineProgram(nonzero, inputs, parameter_values);
  if (!program_.is_constant()) return;
  constants_.resize(nonzero.size());
  program_.constant_outputs(constants_.data());
}

void SparseProgram::set_constants(std::span<const double> values) {
  program_.set_constants(values);
  if (program_.is_constant()) program_.constant_outputs(constants_.data());
}

void SparseProgram::evaluate(std::initializer_list<const double*> inputs, double* dense) const {
  const int n = static_cast<int>(positions_.size());
  if (program_.is_constant()) {
    if (n < size_) std::fill_n(dense, size_, 0.0);
    for (int k = 0; k < n; ++k) dense[positions_[k]] = constants_[k];
  } else if (n == size_) {
    program_.evaluate({inputs.begin(), inputs.size()}, dense);
  } else {
    std::fill_n(dense, size_, 0.0);
    program_.evaluate({inputs.begin(), inputs.size()}, dense, positions_.data());
  }
}

}  // namespace ricochet
