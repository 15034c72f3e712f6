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
  if (program_.is_constant()) {
    constants_.resize(nonzero.size());
    std::size_t longest = 0;
    for (const auto& group : inputs) longest = std::max(longest, group.size());
    const std::vector<double> unread(longest);
    const std::vector<const double*> groups(inputs.size(), unread.data());
    program_.evaluate(groups, constants_.data());
  }
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
