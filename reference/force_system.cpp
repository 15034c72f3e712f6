#include "reference/force_system.h"

#include <cmath>

#include "reference/force_equations.h"

namespace ricochet::reference {

void ForceSystem::resize(Eigen::Index n) {
  for (auto* matrix : {&A_, &scaled_}) matrix->resize(n, n);
  for (auto* vector : {&diagonal_, &scale_}) vector->resize(n);
}

void ForceSystem::factorize() {
  const Eigen::Index n = diagonal_.size();
  for (Eigen::Index row = 0; row < n; ++row) scale_[row] = 1 / std::sqrt(diagonal_[row]);
  for (Eigen::Index other = 0; other < n; ++other) {
    for (Eigen::Index row = 0; row < n; ++row) scaled_(row, other) = scale_[row] * A_(row, other) * scale_[other];
  }
  is_regular_ = factors_.compute(scaled_, kSingular);
}

}  // namespace ricochet::reference
