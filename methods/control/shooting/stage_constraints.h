#pragma once

#include <string>
#include <vector>

#include "problems/control/optimal_control_problem.h"

namespace ricochet {

/// The inequalities (3) of optimal_control_problem.h at one stage, as numbers that are not negative:
///
///   p(q, v, u),   then for each finite bound   x - lower   or   upper - x,   x a component of q or v.        (1)
class StageConstraints {
 public:
  /// @param problem  must outlive this object
  explicit StageConstraints(const OptimalControlProblem& problem);

  int size() const { return n_path_ + static_cast<int>(bounds_.size()); }
  /// @param x  (q, v, u) of a stage; @param c  size()
  void values(const Vector& x, Vector& c) const;
  /// @param J  size() x (2 n_q + n_u), derivatives of values()
  void jacobian(const Vector& x, Matrix& J) const;
  /// "path constraint 'clearance'", "upper bound of q[1]"
  std::string name(int row) const;

 private:
  struct Bound {
    Eigen::Index index;  // in (q, v)
    double sign, limit;  // sign (x - limit) >= 0
  };

  const OptimalControlProblem& problem_;
  const int n_q_, n_path_;
  std::vector<Bound> bounds_;
};

}  // namespace ricochet
