#pragma once

#include "methods/time_stepping/common/contact_step.h"

namespace ricochet {

/// Moves a position to the nearest one without penetration, in the norm of M, by linearised steps
///
///   q <- q + M^-1 J_n tau,   0 <= tau  _|_  f_c + J_n' M^-1 J_n tau >= 0                  (1)
///
/// for the contacts that penetrate at q, or do so on the way; bilateral gaps become zero, their tau has either sign.
/// Velocities stay as they are.
class PositionProjection {
 public:
  /// @param h  of the steps that it follows; 0 for none
  PositionProjection(const Problem& problem, double h, Counters& counters);

  /// @return false when (1) failed, with a reason
  bool apply(Vector& q);
  const std::string& reason() const { return reason_; }

 private:
  const Problem& problem_;
  Counters& counters_;
  ContactStep contacts_;
  std::vector<int> active_;
  std::vector<char> is_active_;
  Matrix M_;
  BlockInverse W_;
  Vector gap_, rounding_, dq_, none_;
  std::string reason_;
};

}  // namespace ricochet
