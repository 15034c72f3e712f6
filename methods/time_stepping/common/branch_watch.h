#pragma once

#include "problems/problem.h"

namespace ricochet {

/// Whether a formula that bends or jumps changes its branch within a step (problems/regions/switching_functions.h): a
/// switching function has another sign than at the left end. Rounded zeros have no sign: |psi| is compared with 1e-12 of
/// the terms of psi. Costs nothing in scenes without such formulas.
class BranchWatch {
 public:
  explicit BranchWatch(const Problem& problem);

  void begin(const Vector& q, const Vector& v);    ///< The left end.
  bool changes(const Vector& q, const Vector& v);  ///< Whether the branch at (q, v) is another one.
  int changed() const { return changed_; }         ///< The first psi_k that changed its sign, after changes().

 private:
  const Problem& problem_;
  Vector left_, psi_;  // n_s
  int changed_ = -1;
};

}  // namespace ricochet
