#include "problems/derivatives/sparse_tape.h"

#include <algorithm>

namespace ricochet {

SparseTape::SparseTape(const std::vector<GiNaC::ex>& dense, const Tape::InputGroups& inputs,
                       const std::vector<Tape::Constant>& parameter_values)
    : size_(static_cast<int>(dense.size())) {
  std::vector<GiNaC::ex> nonzero;
  for (std::size_t k = 0; k < dense.size(); ++k) {
    if (dense[k].is_zero()) continue;
    nonzero.push_back(dense[k]);
    positions_.push_back(static_cast<int>(k));
  }
  tape_ = Tape(nonzero, inputs, parameter_values);
  if (tape_.is_constant()) {
    constants_.resize(nonzero.size());
    std::size_t longest = 0;
    for (const auto& group : inputs) longest = std::max(longest, group.size());
    const std::vector<double> unread(longest);
    const std::vector<const double*> groups(inputs.size(), unread.data());
    tape_.evaluate(groups, constants_.data());
  }
}

void SparseTape::evaluate(std::initializer_list<const double*> inputs, double* dense) const {
  const int n = static_cast<int>(positions_.size());
  if (tape_.is_constant()) {
    if (n < size_) std::fill_n(dense, size_, 0.0);
    for (int k = 0; k < n; ++k) dense[positions_[k]] = constants_[k];
  } else if (n == size_) {
    tape_.evaluate({inputs.begin(), inputs.size()}, dense);
  } else {
    std::fill_n(dense, size_, 0.0);
    tape_.evaluate({inputs.begin(), inputs.size()}, dense, positions_.data());
  }
}

}  // namespace ricochet
