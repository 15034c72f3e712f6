#pragma once

#include "methods/elements/element.h"
#include "problems/problem.h"

namespace ricochet {

/// Contacts with surfaces that move by themselves, for the error estimates of step control. A body in free flight above
/// a table that shakes moves along a parabola, which one long step integrates exactly; meanwhile the gap may swing
/// below zero and back, which shows in no coordinate but the time. Gaps and slip paths of moving contacts are therefore
/// error-controlled like coordinates, by their accelerations at the stages:
///
///   J_n' w_j + v_j' (grad^2 f_c) v_j,   J_t' w_j + T(q_j, v_j) v_j                                            (1)
class MovingContacts {
 public:
  explicit MovingContacts(const Problem& problem);

  bool empty() const { return n_rows_ == 0; }
  /// (1) of an element that is solved: a row for each gap and slip path, a column per stage.
  const Matrix& accelerations(const Element& element);

 private:
  const Problem& problem_;
  Eigen::Index n_rows_ = 0;
  Vector J_n_, J_t_, bias_;
  Matrix T_, accelerations_;
};

}  // namespace ricochet
