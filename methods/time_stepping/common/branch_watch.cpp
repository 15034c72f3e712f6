#include "methods/time_stepping/common/branch_watch.h"

#include <algorithm>
#include <cmath>

namespace ricochet {
namespace {

constexpr double kRoundedZero = 1e-12;  // of the terms of psi

}  // namespace

BranchWatch::BranchWatch(const Problem& problem) : problem_(problem) {
  const auto n_s = std::ssize(problem.info().switches);
  left_.setZero(n_s);
  psi_.setZero(n_s);
}

void BranchWatch::begin(const Vector& q, const Vector& v) {
  if (psi_.size() > 0) problem_.switching(q.data(), v.data(), left_.data());
}

bool BranchWatch::changes(const Vector& q, const Vector& v) {
  if (psi_.size() == 0) return false;
  problem_.switching(q.data(), v.data(), psi_.data());
  if ((left_.array() * psi_.array() >= 0).all()) return false;
  const Vector size = problem_.switching_sizes(q, v);
  for (Eigen::Index k = 0; k < psi_.size(); ++k) {
    if (left_[k] * psi_[k] >= 0 || std::min(std::abs(left_[k]), std::abs(psi_[k])) <= kRoundedZero * size[k]) continue;
    changed_ = static_cast<int>(k);
    return true;
  }
  return false;
}

}  // namespace ricochet
