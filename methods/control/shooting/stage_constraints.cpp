#include "methods/control/shooting/stage_constraints.h"

#include <fmt/format.h>

#include <cmath>

namespace ricochet {

StageConstraints::StageConstraints(const OptimalControlProblem& problem)
    : problem_(problem), n_q_(problem.plant->info().n_q), n_path_(problem.path.n_outputs()) {
  Eigen::Index begin = 0;
  for (const auto* bounds : {&problem.q, &problem.v}) {
    for (Eigen::Index k = 0; k < bounds->lower.size(); ++k) {
      if (std::isfinite(bounds->lower[k])) bounds_.push_back({begin + k, 1, bounds->lower[k]});
      if (std::isfinite(bounds->upper[k])) bounds_.push_back({begin + k, -1, bounds->upper[k]});
    }
    begin += n_q_;
  }
}

void StageConstraints::values(const Vector& x, Vector& c) const {
  c.resize(size());
  if (n_path_ > 0) problem_.path.evaluate(x.data(), c.data());
  for (std::size_t k = 0; k < bounds_.size(); ++k)
    c[n_path_ + static_cast<Eigen::Index>(k)] = bounds_[k].sign * (x[bounds_[k].index] - bounds_[k].limit);
}

void StageConstraints::jacobian(const Vector& x, Matrix& J) const {
  J.setZero(size(), x.size());
  if (n_path_ > 0) {
    Matrix of_path(n_path_, x.size());
    problem_.path.jacobian(x.data(), of_path.data());
    J.topRows(n_path_) = of_path;
  }
  for (std::size_t k = 0; k < bounds_.size(); ++k)
    J(n_path_ + static_cast<Eigen::Index>(k), bounds_[k].index) = bounds_[k].sign;
}

std::string StageConstraints::name(int row) const {
  if (row < n_path_) return fmt::format("path constraint '{}'", problem_.path_names[static_cast<std::size_t>(row)]);
  const Bound& bound = bounds_[static_cast<std::size_t>(row - n_path_)];
  return fmt::format("{} bound of {}[{}]", bound.sign > 0 ? "lower" : "upper", bound.index < n_q_ ? "q" : "v",
                     bound.index % n_q_);
}

}  // namespace ricochet
