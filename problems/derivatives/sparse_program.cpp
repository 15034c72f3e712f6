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

template <class Number>
void SparseProgram::evaluate_in(std::initializer_list<const Number*> inputs, Number* dense) const {
  const int n = static_cast<int>(positions_.size());
  if (n < size_) std::fill_n(dense, size_, Number(0.0));
  if (program_.is_constant()) {
    for (int k = 0; k < n; ++k) dense[positions_[k]] = constants_[k];
    return;
  }
  const std::span<const Number* const> groups(inputs.begin(), inputs.size());
  program_.evaluate(groups, dense, n < size_ ? positions_.data() : nullptr);
}

template void SparseProgram::evaluate_in(std::initializer_list<const double*>, double*) const;
template void SparseProgram::evaluate_in(std::initializer_list<const Interval*>, Interval*) const;

}  // namespace ricochet
